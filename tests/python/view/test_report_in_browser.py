"""The report of `linkwise loads --html` in a headless Chromium, with the network off."""

import io

import numpy as np
import pytest

import linkwise as lw
from helpers.browser import PATIENCE
from helpers.loaded_arm import arm, profile
from linkwise.plot import write_report

pytest.importorskip("plotly", reason="the report needs plotly: pip install '.[report]'")
imageio = pytest.importorskip("imageio.v3")

pytestmark = pytest.mark.browser
TITLES = [
    "Force",
    "Moment",
    "Force by cause",
    "Moment by cause",
    "Force along and across the axis",
    "Moment about and across the axis",
    "Radial force about the axis, in the joint frame",
    "Load duration",
    "Spectral density of the force",
    "Spectral density of the moment",
    "Energy",
    "What does not add up",
    "Integration step",
]


@pytest.fixture
def report(tmp_path):
    """A report of a run with every cause, against ratings that it exceeds."""
    drives = {"shoulder": lw.Motion(profile(0.8, 1.0)), "elbow": 3.0}
    run = lw.simulate(arm(), duration=1.0, every=0.01, drives=drives, q0=[0, 0.3, 0.25])
    peaks = lw.loads.summary(run)
    ratings = {"shoulder": lw.loads.Rating(radial=1), "elbow": lw.loads.Rating(force=1e4)}
    found = {"summary": peaks, "bounds": lw.loads.bounds(run)}
    found["margins"] = lw.loads.margins(peaks, ratings)
    return run, write_report(run, tmp_path / "report.html", found)


def figure(page, title):
    return page.locator(".figure").filter(has=page.get_by_text(title, exact=True))


def picture(page, title):
    shot = figure(page, title).screenshot(timeout=PATIENCE * 1000)
    return imageio.imread(io.BytesIO(shot))[..., :3].astype(int)


def test_report_draws_every_figure_without_a_network(report, page):
    run, path = report
    page.context.set_offline(True)
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(path.as_uri())
    for title in TITLES:
        figure(page, title).locator("svg.main-svg").first.wait_for()
        assert figure(page, title).count() == 1, title
    assert page.locator(".figure").count() == len(TITLES)
    assert [url for url in asked if not url.startswith(("file:", "blob:", "data:"))] == []

    peak = float(lw.loads.summary(run).peak.sel(joint="shoulder", quantity="radial"))
    over = page.locator("tr.over")
    assert over.count() == 1
    assert f"{peak:.4g}" in over.inner_text()

    force = figure(page, "Force by cause")
    for cause in ("gravity", "velocity", "drive", "motion", "passive"):
        assert force.get_by_text(cause, exact=True).count() == 1
    drawn = picture(page, "Force by cause")
    assert len(np.unique(drawn.reshape(-1, 3), axis=0)) > 20  # areas in several colours
    assert page.evaluate("document.body.scrollWidth <= window.innerWidth")


def test_chosen_joint_changes_the_figures(report, page):
    _, path = report
    page.goto(path.as_uri())
    figure(page, "Force").locator("svg.main-svg").first.wait_for()
    before, same = picture(page, "Force"), picture(page, "Energy")
    page.locator("#joint").select_option("wrist")
    figure(page, "Force").locator("svg.main-svg").first.wait_for()
    after = picture(page, "Force")
    assert before.shape == after.shape
    assert (np.abs(after - before).max(axis=2) > 50).sum() > 300
    assert np.array_equal(picture(page, "Energy"), same)
