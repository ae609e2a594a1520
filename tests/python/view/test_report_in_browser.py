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


INSIDE = [
    "Axial force along jib, at",
    "Shear along jib, at",
    "Torsion along jib, at",
    "Bending along jib, at",
    "Fibre stress along jib, at",
    "Deflection of jib's end",
    "Strain energy of jib",
]


def test_flexible_links_have_their_diagrams(tmp_path, page):
    builder = lw.ModelBuilder("crane")
    for name, mass in (("tower", 0), ("jib", 60.0), ("load", 50.0)):
        builder.add_link(name, mass=mass, inertia=np.eye(3) * bool(mass))
    builder.add_joint("slew", "revolute", "tower", "jib", axis=(0, 0, 1))
    builder.add_joint("hook", "revolute", "jib", "load", axis=(0, 1, 0), translation=(3, 0, 0))
    steel = {"E": 210e9, "G": 80e9, "damping": 0.05, "interior_modes": 0, "stretches": False}
    builder.make_flexible("jib", section=lw.Section.box(0.08, 0.1, 0.004), **steel)
    run = lw.simulate(builder.build(), duration=0.4, every=0.02, drives={"slew": lw.Torque(500)})
    path = write_report(run, tmp_path / "report.html", {"summary": lw.loads.summary(run)})
    page.goto(path.as_uri())
    place = page.locator("#link-figures")
    for title in INSIDE:
        one = place.locator(".figure").filter(has=page.get_by_text(title))
        one.locator("svg.main-svg").first.wait_for()
        assert one.count() == 1, title
    assert place.locator(".figure").count() == len(INSIDE)
    peak = lw.loads.section_summary(run, "jib", 21).peak.sel(quantity="ny")
    row = page.locator("tr").filter(has_text="jib: bending about y ny [N m]")
    assert f"{float(peak):.4g}" in row.inner_text()
    page.screenshot(path=tmp_path / "report.png", full_page=True, timeout=PATIENCE * 1000)
