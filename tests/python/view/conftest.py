"""A short run of the Shuttle's arm, and a browser."""

import os
import shutil
import threading

import pytest

import linkwise as lw
from helpers.browser import CHROMIUM_ARGUMENTS, CHROMIUMS, PATIENCE, WINDOW

START = (0.0, -0.3, 0.5, -0.2, 0.15, 0.0)
DURATION = 2.0


@pytest.fixture(scope="session")
def arm():
    return lw.scenes.srms(payload_mass=100)


@pytest.fixture(scope="session")
def run_path(arm, tmp_path_factory):
    """A run whose loads and positions change from sample to sample."""
    path = tmp_path_factory.mktemp("run") / "arm.zarr"
    lw.simulate(
        arm,
        duration=DURATION,
        every=0.05,
        q0=START,
        drives={"shoulder_yaw": 300.0, "elbow_pitch": -200.0},
        output=path,
    )
    return path


@pytest.fixture(scope="session")
def ratings_path(tmp_path_factory):
    """Ratings of one joint, which the run exceeds."""
    path = tmp_path_factory.mktemp("ratings") / "ratings.toml"
    path.write_text("[rating.shoulder_yaw]\nforce = 1\n")
    return path


@pytest.fixture
def serve():
    """Starts the view of a source in a thread; returns its address."""
    pytest.importorskip("viser", reason="the view needs viser: pip install '.[view]'")
    from linkwise.view.live import show

    stop, threads = threading.Event(), []

    def start(source):
        ready, addresses = threading.Event(), []

        def started(address):
            addresses.append(address)
            ready.set()

        thread = threading.Thread(
            target=show,
            args=(source,),
            kwargs={
                "host": "127.0.0.1",
                "port": 0,
                "open_browser": False,
                "started": started,
                "stop": stop,
            },
        )
        thread.start()
        threads.append(thread)
        assert ready.wait(PATIENCE), "the view did not start"
        return addresses[0]

    yield start
    stop.set()
    for thread in threads:
        thread.join(PATIENCE)
        assert not thread.is_alive()


@pytest.fixture(scope="session")
def chromium():
    """A headless Chromium. Without one tests are skipped, and say so; where the environment sets
    LINKWISE_NEEDS_CHROMIUM they fail instead.
    """
    missing = pytest.fail if os.environ.get("LINKWISE_NEEDS_CHROMIUM") else pytest.skip
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        missing("browser tests need playwright: pip install '.[test]'")
    executable = next(filter(None, map(shutil.which, CHROMIUMS)), None)
    if executable is None:
        missing("browser tests need Chromium, which is not here: apt-get install chromium")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=executable, args=CHROMIUM_ARGUMENTS)
        yield browser
        browser.close()


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
