"""Names of joints that a browser would change keep their figures in the report."""

import json
from html.parser import HTMLParser

import numpy as np
import pytest

import linkwise as lw
from linkwise.loads import summary
from linkwise.plot import write_report

NAMES = ["  two  spaces ", "a'b\"c", "<b>&amp;", "plain"]


class Reader(HTMLParser):
    """The values of the options, and the figures that they choose from."""

    def __init__(self):
        super().__init__()
        self.values, self.figures, self.inside = [], None, False

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        if tag == "option":
            self.values.append(found["value"])
        self.inside = tag == "script" and found.get("id") == "figures"

    def handle_data(self, data):
        if self.inside:
            self.figures = json.loads(data)
            self.inside = False


def test_every_option_has_its_figures(tmp_path):
    pytest.importorskip("plotly")
    pytest.importorskip("rainflow")
    builder = lw.ModelBuilder("m")
    builder.add_link("ground")
    for k, name in enumerate(NAMES):
        before = f"link_{k - 1}" if k else "ground"
        builder.add_link(f"link_{k}", mass=1.0, com=(0, 0, -0.1), inertia=np.eye(3))
        builder.add_joint(name, "revolute", before, f"link_{k}", axis=(1, 0, 0))
    run = lw.simulate(builder.build(), duration=0.1, every=0.01, q0=[1, 0, 0, 0])
    write_report(run, tmp_path / "r.html", {"summary": summary(run)})
    reader = Reader()
    reader.feed((tmp_path / "r.html").read_text(encoding="utf-8"))
    assert reader.values == NAMES
    assert list(reader.figures["joints"]) == NAMES


def test_loop_joints_have_figures_and_rows(tmp_path):
    """Where causes are not to be had the other figures are."""
    pytest.importorskip("plotly")
    machine = lw.scenes.benchmark("slider_crank")
    run = lw.simulate(machine.model, duration=0.05, q0=machine.q0, v0=machine.v0)
    path = tmp_path / "report.html"
    write_report(run, path, {"summary": summary(run)})
    reader = Reader()
    reader.feed(path.read_text(encoding="utf-8"))
    assert reader.values == ["crank_pin", "knee", "guide", "wrist"]
    titles = json.dumps([figure["layout"] for figure in reader.figures["joints"]["wrist"]])
    assert "Force along and across the axis" in titles
    assert "rigid bodies do not determine the loads of joints" in path.read_text(encoding="utf-8")
