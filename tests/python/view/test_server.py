"""The server stays on this machine, and the exported page holds everything."""

import re
import socket
import time

import numpy as np
import pytest

import linkwise as lw
from linkwise.view.export import frame_samples, write_html
from linkwise.view.scene import Scene
from linkwise.view.server import running
from linkwise.view.source import Looks, Options, Source, open_source, static_loads

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
        socket.create_connection(("127.0.0.1", port), timeout=10).close()
        outside = own_address()
        if outside is not None and not outside.startswith("127."):
            with pytest.raises(OSError, match="refused"):
                socket.create_connection((outside, port), timeout=10)
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


def test_ten_thousand_links_take_one_message_a_group():
    model = lw.scenes.chain(10_000)
    source = Source("chain", model, Looks([], [], []))
    with running("127.0.0.1", 0, "chain") as server:
        scene = Scene(server, source)
        for name in scene.toggles:
            scene.toggle(name, True)
        scene.style.largest = (1e5, 1.0)
        sent = []
        server._websock_server.queue_message = sent.append
        spent = []
        for picture in range(1, 6):
            q = np.full(model.nq, picture * 1e-4)
            loads = static_loads(model, q)
            sent.clear()
            before = time.process_time()
            scene.show(scene.at(q, loads))
            spent.append(time.process_time() - before)
    assert 5 < len(sent) < 25
    assert min(spent) < 0.05  # seconds of a processor: twenty pictures a second and more
    marks = scene.joint_marks.batched_positions
    assert marks == pytest.approx(lw.body_poses(model, q)[:, :3, 3], rel=1e-6, abs=1e-3)
