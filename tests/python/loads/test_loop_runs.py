"""Loads of joints that close loops, from a run to peaks, tables, figures and the view."""

import numpy as np
import pytest

import linkwise as lw
from linkwise.loads.engineering import joint_directions
from linkwise.loads.limits import beyond_limits
from linkwise.view.source import Options, open_source


@pytest.fixture(scope="module")
def run():
    start = lw.scenes.benchmark("four_bars")
    return lw.simulate(start.model, duration=0.5, q0=start.q0, v0=start.v0, every=0.01)


NAMES = ["A0", "B0", "A1", "B1", "A2", "C1", "C2"]


def test_they_stand_behind_those_of_the_tree(run):
    assert run.joint_load["joint"].values.tolist() == NAMES
    assert run.joint_load.sizes["joint"] == 7


def test_they_are_what_joint_loads_says(run):
    model, k = run.load_model(), 20
    loads = lw.joint_loads(model, run.position[k].values, run.velocity[k].values)
    np.testing.assert_allclose(run.joint_load[k].values, loads, atol=1e-6)


def test_axes_of_loop_joints_are_known(run):
    model = run.load_model()
    np.testing.assert_array_equal(joint_directions(model), np.tile([0.0, 0, 1], (7, 1)))


def test_peaks_of_loop_joints_are_those_of_the_samples(run):
    peaks = run.peak_loads().sel(joint="C2")
    force = np.linalg.norm(run.joint_load.sel(joint="C2").values[:, :3], axis=-1)
    assert float(peaks["force"]) == pytest.approx(force.max(), rel=1e-12)


def test_engineering_quantities(run):
    found = lw.loads.quantities(run)
    load = run.joint_load.sel(joint="C1").values
    np.testing.assert_allclose(found["axial"].sel(joint="C1"), load[:, 2], atol=1e-12)
    across = np.hypot(load[:, 0], load[:, 1])
    np.testing.assert_allclose(found["radial"].sel(joint="C1"), across, rtol=1e-12)
    assert not found["drive_power"].sel(joint=["C1", "C2"]).any()


def test_summaries_cycles_and_spectra(run):
    found = lw.loads.summary(run)
    assert found["joint"].values.tolist() == NAMES
    assert lw.loads.envelope(run)["joint"].values.tolist() == NAMES
    largest = np.linalg.norm(run.joint_load.sel(joint="C1").values[:, :3], axis=-1).max()
    assert lw.loads.cycles(run, "C1", "radial").sizes["cycle"] > 0
    assert float(run.peak_loads()["force"].sel(joint="C1")) == pytest.approx(largest)


def test_limits_are_those_of_the_tree(run):
    assert beyond_limits(run) == []


def test_in_the_worlds_axes_the_pins_push_along_the_machine(run):
    """At C1 the bar's end: its frame turns as the bar does. Another way: the forces on bar 0 are
    its mass times its acceleration."""
    model, k = run.load_model(), 10
    world = lw.loads.in_frame(run, "world")
    assert world["joint"].values.tolist() == NAMES
    q, v, a = (run[name][k].values for name in ("position", "velocity", "acceleration"))
    moved = lw.frame_acceleration(model, q, v, a, lw.Frame("bar_0", (0.5, 0, 0)))
    force = sum(world.sel(joint=joint).values[k, :3] for joint in ("B0", "C1"))
    # B0 and C1 act on bar 0 as the child of both; B1 acts on bar 1 alone.
    np.testing.assert_allclose(force, moved[:3] + np.array([0, 9.81, 0]), atol=1e-6)
    one = lw.loads.in_frame(run, "world", joint="C1")
    np.testing.assert_array_equal(one.values, world.sel(joint="C1").values)


def test_tables(run, tmp_path):
    for path in run.to_csv(tmp_path):
        assert path.exists()
    table = next(tmp_path.glob("*joint_load*.csv")).read_text().splitlines()
    assert any("C2" in line for line in table[:5])


def test_a_stored_run_is_read_and_viewed(run, tmp_path):
    start = lw.scenes.benchmark("four_bars")
    place = tmp_path / "run.zarr"
    lw.simulate(start.model, duration=0.05, q0=start.q0, v0=start.v0, every=0.01, output=place)
    stored = lw.open_run(place)
    assert stored.load_model().loop_names == ["C1", "C2"]
    source = open_source(place, Options())
    assert source.recording is not None
    assert source.recording.load(3).shape == (7, 6)
    np.testing.assert_array_equal(source.recording.load(3), stored.joint_load.values[3])


def test_loads_by_motion_ask_what_drives_the_machine(run):
    with pytest.raises(lw.InputError, match="depends on which joints drive it, and none does"):
        lw.loads.split(run, by="motion")
    with pytest.raises(lw.InputError, match="cannot move by itself here once the driven joints"):
        lw.loads.split(run, by="motion", driven=["A0", "A1"])
    with pytest.raises(lw.InputError, match=r"driven: is for loads by motion of machines with"):
        lw.loads.split(run, driven=["A0"])


def said_of_loads(run):
    return [entry["text"] for entry in run.warnings if entry["element"] == "joint_load"]


def test_loads_that_rigid_bodies_leave_open_are_told(run):
    text, *what_decides = said_of_loads(run)
    assert what_decides
    assert all("hold each other" in told for told in what_decides)
    for joint in NAMES:
        assert f"'{joint}' (fz, nx, ny)" in text
    assert "6 self-stresses" in text


def test_loads_that_are_all_determined_go_without_a_word():
    start = lw.scenes.benchmark("stewart")
    run = lw.simulate(
        start.model, duration=0.01, q0=start.q0, v0=start.v0, every=0.01, drives=start.drives
    )
    assert said_of_loads(run) == []
