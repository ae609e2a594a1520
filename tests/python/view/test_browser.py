"""The view in a headless Chromium: draws, plays, scrubs and toggles, without errors."""

import io
import time

import numpy as np
import pytest

import linkwise as lw
from linkwise.view.export import write_html
from linkwise.view.source import Looks, Options, Source, open_source

pytest.importorskip("viser", reason="the view needs viser: pip install '.[view]'")
imageio = pytest.importorskip("imageio.v3")

pytestmark = pytest.mark.browser
PATIENCE = 180  # seconds; without a GPU a frame can take one
WINDOW = {"width": 900, "height": 560}
SCENE = {"x": 0, "y": 190, "width": 510, "height": 300}  # beside the panel, below messages
MACHINE_TONE = 0.80  # of white: the grid is lighter, what belongs to the machine darker


@pytest.fixture
def page(chromium):
    """A page whose errors fail the test."""
    context = chromium.new_context(viewport=WINDOW)
    page = context.new_page()
    page.set_default_timeout(PATIENCE * 1000)
    wrong = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("requestfailed", lambda request: wrong.append(request.url))
    page.on(
        "console", lambda message: wrong.append(message.text) if message.type == "error" else None
    )
    yield page
    context.close()
    assert wrong == []


def picture(page):
    """The scene as grey values in 0..1."""
    pixels = imageio.imread(io.BytesIO(page.screenshot(clip=SCENE, timeout=PATIENCE * 1000)))
    return pixels[..., :3].mean(axis=-1) / 255


def drawn(image):
    """Pixels of the machine."""
    return int((image < MACHINE_TONE).sum())


def wait_for(page, holds, what):
    """Take pictures until one satisfies `holds`; return it."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        image = picture(page)
        if holds(image):
            return image
        time.sleep(0.3)
    raise AssertionError(f"after {PATIENCE} s: not {what}; {drawn(image)} pixels drawn")


def still(page):
    """A picture that has stopped changing: the first one fades in."""
    before = wait_for(page, lambda image: drawn(image) > 300, "drawn")
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        time.sleep(0.5)
        image = picture(page)
        if np.abs(image - before).max() < 0.02:
            return image
        before = image
    raise AssertionError("the picture never rests")


def readout(page):
    """The time told with the joint's load [s]."""
    text = page.get_by_text("t = ").first.inner_text()
    return float(text.split()[2])


def wait_for_time(page, holds):
    end = time.monotonic() + PATIENCE
    while not holds(readout(page)):
        assert time.monotonic() < end, f"the time stays at {readout(page)}"
        time.sleep(0.1)


def toggle(page, name):
    page.get_by_role("checkbox", name=name, exact=True).click()


def test_run_plays_scrubs_and_toggles(serve, run_path, page):
    page.goto(serve(open_source(run_path, Options())))
    start = still(page)
    assert readout(page) == 0

    page.get_by_role("button", name="Play").click()
    wait_for_time(page, lambda now: now > 0.3)
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Play").wait_for()
    stopped = readout(page)
    wait_for(page, lambda image: (np.abs(image - start) > 0.1).sum() > 200, "moved")
    assert readout(page) == stopped  # paused

    page.get_by_role("slider").first.press("End")
    wait_for_time(page, lambda now: now == 2)
    page.get_by_role("slider").first.press("Home")
    wait_for_time(page, lambda now: now == 0)
    wait_for(page, lambda image: (np.abs(image - start) > 0.1).sum() < 50, "back at the start")

    page.get_by_role("slider").first.press("End")
    wait_for_time(page, lambda now: now == 2)
    whole = drawn(still(page))
    toggle(page, "Forces")
    toggle(page, "Moments")
    bare = wait_for(page, lambda image: drawn(image) < whole - 100, "without arrows")
    toggle(page, "Bodies")
    toggle(page, "Joints")
    wait_for(page, lambda image: drawn(image) < 30, "empty")
    toggle(page, "Bodies")
    toggle(page, "Joints")
    wait_for(page, lambda image: abs(drawn(image) - drawn(bare)) < 50, "back")


def test_load_of_the_chosen_joint_is_plotted(serve, run_path, page):
    page.goto(serve(open_source(run_path, Options())))
    page.get_by_text("t = 0 s").wait_for()
    assert page.locator(".uplot").count() == 2
    page.get_by_role("slider").first.press("End")
    wait_for_time(page, lambda now: now == 2)
    loads = lw.open_run(run_path).joint_load.isel(time=-1)
    for joint in ("wrist_roll", "elbow_pitch"):
        page.get_by_role("combobox", name="Joint").click()
        page.get_by_role("option", name=joint).click()
        force = np.linalg.norm(loads.sel(joint=joint).values[:3])
        page.get_by_text(f"{force:.4g} N,").wait_for()


def test_model_is_posed_with_sliders(serve, page):
    model = lw.scenes.chain(3)
    page.goto(serve(Source("chain", model, Looks([], [], []))))
    before = still(page)
    page.get_by_role("slider").nth(1).press("End")  # the first is the arrows' size
    wait_for(page, lambda image: (np.abs(image - before) > 0.1).sum() > 200, "moved")
    page.get_by_role("button", name="Zero").click()
    wait_for(page, lambda image: (np.abs(image - before) > 0.1).sum() < 50, "back at zero")


def test_exported_page_plays_without_a_network(run_path, tmp_path, page):
    written = write_html(open_source(run_path, Options()), tmp_path / "arm.html")
    page.context.set_offline(True)
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(written.path.as_uri())
    first = wait_for(page, lambda image: drawn(image) > 300, "drawn")
    wait_for(page, lambda image: (np.abs(image - first) > 0.1).sum() > 100, "moving")
    assert page.get_by_text("srms", exact=True).count() == 1
    assert [url for url in asked if not url.startswith(("file:", "blob:", "data:"))] == []


def test_long_chain_is_drawn(serve, page):
    model = lw.scenes.chain(2000, axes="parallel")  # more take minutes without a GPU
    page.goto(serve(Source("chain", model, Looks([], [], []))))
    before = wait_for(page, lambda image: drawn(image) > 30, "drawn")
    page.get_by_role("slider").nth(1).press("End")
    wait_for(page, lambda image: (np.abs(image - before) > 0.1).sum() > 30, "moved")
