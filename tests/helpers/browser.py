"""The headless Chromium of the browser tests."""

PATIENCE = 600  # seconds: a fuse
WINDOW = {"width": 900, "height": 560}
CHROMIUMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
# Drawn by the processor: the machines that run tests have no display and no GPU.
CHROMIUM_ARGUMENTS = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
]
