"""The server stays on this machine, and the exported page holds everything."""

import gc
import re
import socket
import sys

import numpy as np
import pytest

import linkwise as lw
from helpers.browser import PATIENCE
from linkwise.view.export import frame_samples, write_html
from linkwise.view.pose import Pose
from linkwise.view.scene import Scene
from linkwise.view.server import running
from linkwise.view.source import Appearance, Options, Source, open_source

pytest.importorskip("viser", reason="the view needs viser: pip install '.[view]'")


def own_address():
    """An address of this machine that other machines see; no packet is sent for it."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))
        except OSError:
            return None
        return probe.getsockname()[0]


def test_only_this_machine_can_connect(capsys):
    with running("127.0.0.1", 0, "arm") as server:
        port = server.get_port()
        socket.create_connection(("127.0.0.1", port), timeout=PATIENCE).close()
        outside = own_address()
        if outside is not None and not outside.startswith("127."):
            with pytest.raises(OSError, match="refused"):
                socket.create_connection((outside, port), timeout=PATIENCE)
    assert capsys.readouterr().out == ""


def test_sharing_does_nothing():
    with running("127.0.0.1", 0, "arm") as server:
        assert server.request_share_url() is None
        assert server._share_tunnel is None


def test_export_is_one_page_that_asks_for_nothing(run_path, tmp_path):
    source = open_source(run_path, Options())
    written = write_html(source, tmp_path / "arm.html")
    assert written.frames == 41
    assert written.duration == pytest.approx(2.0)
    page = written.path.read_text(encoding="utf-8")
    assert written.bytes == written.path.stat().st_size < 5 << 20
    assert "<title>srms</title>" in page
    assert not re.search(r"<(?:script|link|img)\b[^>]*\b(?:src|href)=[\"']?(?:https?:)?//", page)


def test_frames_are_even_in_time_and_bounded():
    times = np.linspace(0, 100, 100_001)
    few = frame_samples(times, 1000)
    assert few[0] == 0
    assert few[-1] == 100_000
    assert 2900 < few.size <= 3000
    assert np.ptp(np.diff(few)) <= 1
    assert frame_samples(times, 1 << 20).size == 192
    assert frame_samples(np.array([0.5]), 1000).tolist() == [0]


def work_of_a_picture(n):
    """Calls of functions and messages that a picture of a chain of n links takes."""
    model = lw.scenes.chain(n)
    source = Source("chain", model, Appearance([], [], []))
    calls, sent = [], []
    with running("127.0.0.1", 0, "chain") as server:
        scene = Scene(server, source)
        for name in scene.toggles:
            scene.toggle(name, True)
        scene.style.largest = (1e5, 1.0)
        server._websock_server.queue_message = sent.append
        q = np.full(model.nq, 1e-4)
        instant = scene.at(q, Pose(model).loads(q))
        before = sys.getprofile()
        gc.collect()  # what is left of other tests must not be cleared, and counted, within
        gc.disable()
        sys.setprofile(lambda _frame, event, _: calls.append(event))
        try:
            scene.show(instant)
        finally:
            sys.setprofile(before)
            gc.enable()
    marks = scene.joint_marks.batched_positions
    assert marks == pytest.approx(lw.joint_poses(model, q)[:, :3, 3], rel=1e-6, abs=1e-3)
    return len(calls), len(sent)


def test_ten_thousand_links_take_no_more_calls_and_messages_than_two_thousand():
    calls, messages = work_of_a_picture(10_000)
    assert (calls, messages) == work_of_a_picture(2_000)
    assert 5 < messages < 25


def test_the_first_picture_has_room_for_the_whole_run(tmp_path):
    chain = lw.scenes.chain(20, axes="parallel")
    lw.simulate(chain, duration=2, every=0.1, q0=[1.5] + [0] * 19, output=tmp_path / "fall.zarr")
    source = open_source(tmp_path / "fall.zarr", Options())
    with running("127.0.0.1", 0, "fall") as server:
        scene = Scene(server, source)
    for sample in range(source.recording.times.size):
        points = lw.joint_poses(chain, source.recording.position(sample))[:, :3, 3]
        assert (np.abs(points - scene.center) < 0.6 * scene.size).all()


def test_placeholder_links_have_no_box(tmp_path):
    def link(name, mass, inertia):
        about = (
            f"<inertia ixx='{inertia}' iyy='{inertia}' izz='{inertia}' ixy='0' ixz='0' iyz='0'/>"
        )
        return f"<link name='{name}'><inertial><mass value='{mass}'/>{about}</inertial></link>"

    joint = (
        "<joint name='j' type='revolute'><parent link='base'/><child link='arm'/>"
        "<axis xyz='0 0 1'/>"
        "<limit lower='-1' upper='1' effort='1' velocity='1'/></joint>"
    )
    links = link("base", 1e-6, 1e-6) + link("arm", 5, 0.1)
    (tmp_path / "r.urdf").write_text(f"<robot name='r'>{links}{joint}</robot>")
    source = open_source(tmp_path / "r.urdf", Options())
    with running("127.0.0.1", 0, "r") as server:
        scene = Scene(server, source)
    boxes = [layer.place for layer in scene.layers["Bodies"] if hasattr(layer.place, "links")]
    drawn = [source.model.link_names[k] for place in boxes for k in place.links]
    assert drawn == ["arm"]
