"""The view in a headless Chromium: draws the machine where it is, plays, scrubs and toggles.

The page's errors fail every test. Everything waits for what it needs, never for a time: without a
GPU a frame can take a second, and on a busy machine many.
"""

import io
import re
import time

import numpy as np
import pytest

import linkwise as lw
from helpers.browser import PATIENCE, WINDOW
from linkwise.view.export import write_html
from linkwise.view.scene import Scene
from linkwise.view.server import running
from linkwise.view.source import Appearance, Options, Source, open_source

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


# As many pictures drawn as half a second takes where nothing holds them up.
NEW_PICTURES = """() => new Promise(done => {
  let left = 30;
  const next = () => left-- ? requestAnimationFrame(next) : done();
  next();
})"""


def still(page):
    """A picture that has stopped changing: the first one fades in."""
    before = wait_for(page, lambda image: drawn(image) > 300, "drawn")
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        page.evaluate(NEW_PICTURES)
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
    seen = lw.joint_poses(source.model, q)[:, :3, 3] - eye
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


def to_end(page):
    page.get_by_role("slider").first.press("End")
    wait_for_time(page, lambda now: now == 2)


def told_force(page, force):
    page.get_by_text(f": {force:.4g} N,").wait_for()


def force_at_end(run_path, joint, without=None):
    """Size of a joint's force [N] at the end of the run, or of what other causes make of it."""
    shares = lw.loads.split(lw.open_run(run_path)).isel(time=-1).sel(joint=joint)
    shares = shares if without is None else shares.drop_sel(cause=without)
    return float(np.linalg.norm(shares.sum("cause").values[:3]))


def check_toggles_and_choices(page, run_path):
    """At the end of a run with ratings: colours, causes, layers and the joint chosen."""
    whole = still(page)
    toggle(page, "Colour by rating")
    page.get_by_text("of the rating: 100 %").wait_for()
    wait_for(page, lambda image: changed(image, whole) > 20, "in other colours")
    toggle(page, "Colour by rating")
    wait_for(page, lambda image: changed(image, whole) < 20, "in the old colours")

    toggle(page, "drive")
    wait_for(page, lambda image: changed(image, whole) > 100, "without what the drives cause")
    told_force(page, force_at_end(run_path, "shoulder_yaw", without="drive"))
    toggle(page, "drive")
    wait_for(page, lambda image: changed(image, whole) < 20, "with all causes")

    toggle(page, "Forces")
    toggle(page, "Moments")
    wait_for(page, lambda image: drawn(image) < drawn(whole) - 100, "without arrows")
    toggle(page, "Bodies")
    toggle(page, "Joints")
    wait_for(page, lambda image: drawn(image) < 30, "empty")
    for name in ("Forces", "Moments", "Bodies", "Joints"):
        toggle(page, name)
    wait_for(page, lambda image: changed(image, whole) < 20, "back")

    assert page.locator(".uplot").count() == 2
    page.get_by_role("combobox", name="Joint").click()
    page.get_by_role("option", name="elbow_pitch").click()
    told_force(page, force_at_end(run_path, "elbow_pitch"))


def test_run_is_drawn_plays_scrubs_and_toggles(serve, run_path, ratings_path, page):
    source = open_source(run_path, Options(ratings=ratings_path))
    open_page(page, serve(source))
    start = still(page)
    assert readout(page) == 0
    assert_machine_is_drawn(start, source, 0)

    page.get_by_role("button", name="Play").click()
    wait_for_time(page, lambda now: now > 0.3)
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Play").wait_for()
    stopped = readout(page)
    moved = still(page)
    assert changed(moved, start) > 100
    assert readout(page) == stopped  # paused

    to_end(page)
    wait_for(page, lambda image: changed(image, start) > 400, "at the end")
    assert_machine_is_drawn(still(page), source, 40)
    check_toggles_and_choices(page, run_path)
    page.get_by_role("slider").first.press("Home")
    wait_for_time(page, lambda now: now == 0)
    wait_for(page, lambda image: changed(image, start) < 50, "back at the start")


def test_model_is_posed_with_sliders(serve, page):
    model = lw.scenes.chain(3)
    open_page(page, serve(Source("chain", model, Appearance([], [], []))))
    before = still(page)
    page.get_by_role("slider").first.press("End")
    wait_for(page, lambda image: changed(image, before) > 200, "moved")
    page.get_by_role("button", name="Zero").click()
    wait_for(page, lambda image: changed(image, before) < 50, "back at zero")


def rod_machine():
    """Two bars on the ground, whose ends a rod joins."""
    builder = lw.ModelBuilder("rod")
    builder.add_link("ground")
    for name, x in (("left", 0.0), ("right", 1.5)):
        builder.add_link(name, mass=1, com=[0, 0, 0.5], inertia=np.diag([0.1, 0.1, 0.001]))
        turn = {"axis": [0, 1, 0], "translation": [x, 0, 0]}
        builder.add_joint(f"turn_{name}", "revolute", "ground", name, **turn)
    ends = {"point": [0, 0, 1], "child_point": [0, 0, 1]}
    builder.add_rod("tie", "left", "right", length=1.5, **ends)
    return builder.build()


def test_a_looped_machine_is_posed_closed(serve, page):
    open_page(page, serve(Source("rod", rod_machine(), Appearance([], [], []))))
    before = still(page)
    page.get_by_text("held by turn_left").wait_for()
    first, second = page.get_by_role("slider").all()[:2]
    for _ in range(25):
        first.press("ArrowRight")
    wait_for(page, lambda image: changed(image, before) > 200, "moved")
    angle = float(first.get_attribute("aria-valuenow"))
    assert angle > 0.1
    end = time.monotonic() + PATIENCE
    while abs(float(second.get_attribute("aria-valuenow")) - angle) > 0.01:  # a parallelogram
        assert time.monotonic() < end, "the other bar does not follow"
        time.sleep(0.1)


MADE = """frame => {
  const {player, place} = linkwise, made = {};
  const plain = updates => Object.fromEntries(
    Object.entries(updates).map(([name, values]) => [name, Array.from(values)]));
  for (const layer of player.data.layers) {
    made[layer.name] = plain(place[layer.kind](player.moment(frame), layer, player.style));
  }
  return made;
}"""


def assert_same_instances(page, source, sample):
    """The page places and colours everything where `placement` does, with one exception: rounding
    to four bytes may turn a colour by one step."""
    recording = source.recording
    with running("127.0.0.1", 0, "placed") as server:
        scene = Scene(server, source)
        scene.style.largest = recording.largest
        moment = scene.at(recording.position(sample), recording.load(sample))
        layers = [layer for layers in scene.layers.values() for layer in layers]
        expected = {layer.handle.name: layer.place(moment) for layer in layers}
    frame = page.evaluate("t => linkwise.player.data.times.indexOf(t)", recording.times[sample])
    found = page.evaluate(MADE, frame)
    assert {"/forces/0", "/moments/0", "/joints/0"} <= set(found) == set(expected)
    for name, updates in expected.items():
        assert set(found[name]) == set(updates)
        for prop, values in updates.items():
            got = np.array(found[name][prop], dtype=float)
            within = 1.0 if prop == "batched_colors" else 2e-5 * max(1.0, np.abs(values).max())
            np.testing.assert_allclose(got, np.ravel(values), atol=within, err_msg=f"{name}.{prop}")


def test_exported_page_plays_and_toggles_without_a_network(run_path, ratings_path, tmp_path, page):
    source = open_source(run_path, Options(ratings=ratings_path))
    written = write_html(source, tmp_path / "arm.html")
    assert written.frames == 41
    assert written.bytes < 2 << 20
    page.context.set_offline(True)
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    open_page(page, written.path.as_uri())
    first = wait_for(page, lambda image: drawn(image) > 300, "drawn")
    wait_for(page, lambda image: changed(image, first) > 100, "moving")
    assert page.title() == "srms"
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Play").wait_for()
    still(page)
    stopped = readout(page)
    still(page)
    assert readout(page) == stopped  # paused

    for sample in (0, 27, 40):
        assert_same_instances(page, source, sample)
    to_end(page)
    check_toggles_and_choices(page, run_path)
    assert [url for url in asked if not url.startswith(("file:", "blob:", "data:"))] == []


def test_exported_loop_joints_and_rods_are_those_of_the_view(tmp_path, page):
    """Every place, rods included, is as `placement` says; a loop joint can be chosen as others."""
    path = tmp_path / "rod.zarr"
    lw.simulate(rod_machine(), duration=1, every=0.05, q0=[0.4, 0.4], output=path)
    source = open_source(path, Options())
    assert source.recording.load(0).shape == (3, 6)
    written = write_html(source, tmp_path / "rod.html")
    open_page(page, written.path.as_uri())
    page.get_by_role("button", name="Pause").click()
    page.get_by_text("3 joints, 1 of which close loops").wait_for()
    for sample in (0, 7):
        assert_same_instances(page, source, sample)
    assert page.get_by_role("checkbox", name="Rods").count() == 1
    page.get_by_role("combobox", name="Joint").click()
    page.get_by_role("option", name="tie").click()
    page.get_by_role("slider").first.press("Home")
    told_force(page, np.linalg.norm(lw.open_run(path).joint_load[0, -1, :3]))


def test_exported_model_is_a_still(tmp_path, page):
    written = write_html(
        Source("chain", lw.scenes.chain(3), Appearance([], [], [])), tmp_path / "c.html"
    )
    page.context.set_offline(True)
    open_page(page, written.path.as_uri())
    page.get_by_text("held still: ").wait_for()
    still(page)
    toggle(page, "Bodies")
    toggle(page, "Joints")
    wait_for(page, lambda image: drawn(image) < 30, "empty")
    toggle(page, "Forces")
    wait_for(page, lambda image: drawn(image) > 100, "with arrows")


MESSAGES = """() => {
  const {player} = linkwise, post = player.post;
  let sent = 0;
  player.post = batch => { sent += batch.messages.length; post.call(player, batch); };
  player.draw(performance.now(), true);
  player.post = post;
  return sent;
}"""


def messages_of_a_picture(page, path):
    """What one picture of an exported page sends to what draws it, while the page plays."""
    open_page(page, path.as_uri())
    wait_for(page, lambda image: drawn(image) > 30, "drawn")
    start = readout(page)
    wait_for_time(page, lambda now: now != start)
    return page.evaluate(MESSAGES)


def test_ten_thousand_links_play_and_take_no_more_messages_than_six(run_path, tmp_path, page):
    model = lw.scenes.chain(10_000)
    lw.simulate(model, duration=0.3, every=0.02, tolerance=1e-4, output=tmp_path / "chain.zarr")
    source = open_source(tmp_path / "chain.zarr", Options())
    few = write_html(open_source(run_path, Options()), tmp_path / "few.html").path
    allowed = messages_of_a_picture(page, few)
    many = write_html(source, tmp_path / "many.html").path
    assert 5 < messages_of_a_picture(page, many) <= allowed
    assert_same_instances(page, source, 15)


def test_exported_flexible_links_bend_as_those_of_the_view(tmp_path, page):
    """Pieces follow the bent link, round and box-shaped ones, and the legend has the moment."""
    path = tmp_path / "crane.zarr"
    builder = lw.ModelBuilder("crane")
    for name, mass in (("tower", 0), ("jib", 60.0), ("rope", 4.0), ("load", 50.0)):
        builder.add_link(name, mass=mass, inertia=np.eye(3) * bool(mass))
    builder.add_joint("slew", "revolute", "tower", "jib", axis=(0, 0, 1), translation=(0, 0, 2))
    builder.add_joint("hook", "revolute", "jib", "rope", axis=(0, 1, 0), translation=(3, 0, 0))
    builder.add_joint("shackle", "fixed", "rope", "load", translation=(0, 0, -1))
    steel = {"E": 210e9, "G": 80e9, "damping": 0.05, "interior_modes": 0, "stretches": False}
    builder.make_flexible("jib", section=lw.Section.box(0.08, 0.1, 0.004), **steel)
    builder.make_flexible("rope", section=lw.Section.round(0.03), **steel)
    lw.simulate(
        builder.build(),
        duration=0.4,
        every=0.02,
        drives={"slew": lw.Torque(500)},
        output=path,
    )
    source = open_source(path, Options())
    written = write_html(source, tmp_path / "crane.html")
    open_page(page, written.path.as_uri())
    page.get_by_role("button", name="Pause").click()
    for sample in (0, 7, 20):
        assert_same_instances(page, source, sample)
    assert page.get_by_role("checkbox", name="Flexible links").count() == 1
    page.get_by_text("by the curvature of the bent shape").wait_for()
    assert page.get_by_text(re.compile(r"^bending moment \d.* N m$")).count() == 1
