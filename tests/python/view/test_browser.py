"""The view in a headless Chromium: draws the machine where it is, plays, scrubs and toggles.

The page's errors fail every test. Everything waits for what it needs, never for a time: without a
GPU a frame can take a second, and on a busy machine many.
"""

import io
import time

import numpy as np
import pytest

import linkwise as lw
from helpers.browser import PATIENCE, WINDOW
from linkwise.view.export import write_html
from linkwise.view.scene import Scene
from linkwise.view.server import running
from linkwise.view.source import Looks, Options, Source, open_source

pytest.importorskip("viser", reason="the view needs viser: pip install '.[view]'")
imageio = pytest.importorskip("imageio.v3")

pytestmark = pytest.mark.browser
SCENE = {"x": 0, "y": 190, "width": 490, "height": 300}  # beside the panel, below messages
MACHINE_TONE = 0.74  # of white: the grid is lighter, what belongs to the machine darker


def open_page(page, address):
    """At full resolution: viser lowers it where frames take long, which would move every edge."""
    page.goto(f"{address}?fixedDpr=1")


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


def changed(image, before):
    """Pixels that are not as they were."""
    return int((np.abs(image - before) > 0.1).sum())


def joint_pixels(source, q):
    """Where the page draws the joint points: columns and rows in the scene's picture."""
    with running("127.0.0.1", 0, "camera") as server:
        Scene(server, source)
        camera = server.initial_camera
        eye, target, angle = (np.asarray(x) for x in (camera.position, camera.look_at, camera.fov))
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    seen = lw.body_poses(source.model, q)[:, :3, 3] - eye
    across, up, depth = (seen @ axis for axis in (right, np.cross(right, forward), forward))
    scale = WINDOW["height"] / 2 / np.tan(angle / 2)
    columns = WINDOW["width"] / 2 + scale * across / depth - SCENE["x"]
    rows = WINDOW["height"] / 2 - scale * up / depth - SCENE["y"]
    return columns, rows


def assert_machine_is_drawn(image, source, sample):
    """Joint marks and rods are at the joint points and between them, and not off to the side."""
    columns, rows = joint_pixels(source, source.recording.position(sample))
    points = np.column_stack([columns, rows])
    middles = (points[1:] + points[:-1]) / 2
    height, width = image.shape
    checked = 0
    for column, row in np.concatenate([points, middles]):
        if 4 <= column < width - 4 and 4 <= row < height - 4:
            around = image[int(row) - 4 : int(row) + 5, int(column) - 4 : int(column) + 5]
            assert around.min() < MACHINE_TONE, (column, row)
            checked += 1
    assert checked >= 6
    assert drawn(image) < 0.25 * image.size


def test_run_is_drawn_plays_and_scrubs(serve, run_path, page):
    source = open_source(run_path, Options())
    open_page(page, serve(source))
    start = still(page)
    assert readout(page) == 0
    assert_machine_is_drawn(start, source, 0)

    page.get_by_role("button", name="Play").click()
    wait_for_time(page, lambda now: now > 0.3)
    wait_for(page, lambda image: changed(image, start) > 200, "moved")
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Play").wait_for()
    stopped = readout(page)
    still(page)
    assert readout(page) == stopped  # paused

    page.get_by_role("slider").first.press("End")
    wait_for_time(page, lambda now: now == 2)
    wait_for(page, lambda image: changed(image, start) > 400, "at the end")
    assert_machine_is_drawn(still(page), source, 40)
    page.get_by_role("slider").first.press("Home")
    wait_for_time(page, lambda now: now == 0)
    wait_for(page, lambda image: changed(image, start) < 50, "back at the start")


def test_layers_and_causes_toggle(serve, run_path, page, tmp_path):
    (tmp_path / "r.toml").write_text("[rating.shoulder_yaw]\nforce = 1\n")
    open_page(page, serve(open_source(run_path, Options(ratings=tmp_path / "r.toml"))))
    page.get_by_text("t = 0 s").wait_for()
    page.get_by_role("slider").first.press("End")
    wait_for_time(page, lambda now: now == 2)
    whole = still(page)
    toggle(page, "Colour by rating")
    page.get_by_text("of the rating: 100 %").wait_for()
    wait_for(page, lambda image: changed(image, whole) > 20, "in other colours")
    toggle(page, "Colour by rating")
    wait_for(page, lambda image: changed(image, whole) < 20, "in the old colours")
    toggle(page, "drive")
    wait_for(page, lambda image: changed(image, whole) > 100, "without what the drives cause")
    shares = lw.loads.split(lw.open_run(run_path)).isel(time=-1, joint=0)
    force = np.linalg.norm(shares.drop_sel(cause="drive").sum("cause").values[:3])
    page.get_by_text(f"{force:.4g} N,").wait_for()
    toggle(page, "drive")
    wait_for(page, lambda image: changed(image, whole) < 20, "with all causes")

    toggle(page, "Forces")
    toggle(page, "Moments")
    bare = wait_for(page, lambda image: drawn(image) < drawn(whole) - 100, "without arrows")
    toggle(page, "Bodies")
    toggle(page, "Joints")
    wait_for(page, lambda image: drawn(image) < 30, "empty")
    toggle(page, "Bodies")
    toggle(page, "Joints")
    wait_for(page, lambda image: abs(drawn(image) - drawn(bare)) < 50, "back")


def test_load_of_the_chosen_joint_is_plotted(serve, run_path, page):
    open_page(page, serve(open_source(run_path, Options())))
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
    open_page(page, serve(Source("chain", model, Looks([], [], []))))
    before = still(page)
    page.get_by_role("slider").first.press("End")
    wait_for(page, lambda image: changed(image, before) > 200, "moved")
    page.get_by_role("button", name="Zero").click()
    wait_for(page, lambda image: changed(image, before) < 50, "back at zero")


def test_exported_page_plays_without_a_network(run_path, tmp_path, page):
    written = write_html(open_source(run_path, Options()), tmp_path / "arm.html")
    page.context.set_offline(True)
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    open_page(page, written.path.as_uri())
    first = wait_for(page, lambda image: drawn(image) > 300, "drawn")
    wait_for(page, lambda image: changed(image, first) > 100, "moving")
    assert page.get_by_text("srms", exact=True).count() == 1

    run = lw.open_run(run_path)
    before = readout(page)
    wait_for_time(page, lambda now: now != before)
    page.get_by_role("button").last.wait_for()
    page.locator("button:has(svg)").nth(-2).click()  # pause: the other one is the scene tree
    page.get_by_role("textbox").first.fill("1")
    page.get_by_role("textbox").first.press("Enter")
    wait_for_time(page, lambda now: now == 1)
    page.locator("#linkwise-joint").select_option("elbow_pitch")
    force = np.linalg.norm(run.joint_load.sel(joint="elbow_pitch", time=1).values[:3])
    page.get_by_text(f"t = 1.000 s: {force:.4g}").wait_for()
    inked = (
        "c => new Uint8Array(c.getContext('2d').getImageData(0, 0, c.width, c.height).data.buffer)"
    )
    for k in range(2):
        ink = (
            page.locator("#linkwise canvas")
            .nth(k)
            .evaluate(f"c => ({inked})(c).filter(x => x).length")
        )
        assert ink > 1000
    assert [url for url in asked if not url.startswith(("file:", "blob:", "data:"))] == []


def test_long_chain_is_drawn(serve, page):
    model = lw.scenes.chain(2000, axes="parallel")  # more take minutes without a GPU
    open_page(page, serve(Source("chain", model, Looks([], [], []))))
    before = wait_for(page, lambda image: drawn(image) > 30, "drawn")
    page.get_by_role("slider").first.press("End")
    wait_for(page, lambda image: changed(image, before) > 30, "moved")
