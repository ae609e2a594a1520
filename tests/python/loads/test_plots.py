"""Figures from Python: they hold the run's numbers."""

import numpy as np
import pytest

import linkwise as lw
from helpers.machines import pendulum, stopped_arm

pytest.importorskip("matplotlib", reason="plots need matplotlib: pip install '.[plot]'")


def curves(axis):
    return {line.get_label(): line.get_xydata().T for line in axis.get_lines()}


def test_loads_of_a_joint(swing):
    force, moment = swing.plot.loads("elbow").axes
    for axis, names in ((force, ("fx", "fy", "fz")), (moment, ("nx", "ny", "nz"))):
        drawn = curves(axis)
        for name in names:
            load = swing.joint_load.sel(joint="elbow", component=name)
            np.testing.assert_array_equal(drawn[name], [swing.time, load])
    assert force.get_ylabel() == "force [N]"
    assert moment.get_ylabel() == "moment [N m]"


@pytest.mark.parametrize("by", ["force", "motion"])
def test_split_stacks_up_to_the_total(swing, by):
    shares = lw.loads.split(swing, by).sel(joint="elbow")
    figure = swing.plot.split("elbow", by)
    for axis, half in zip(figure.axes, (slice(0, 3), slice(3, 6)), strict=True):
        size = np.linalg.norm(swing.joint_load.sel(joint="elbow").values[:, half], axis=1)
        np.testing.assert_allclose(curves(axis)["total"][1], size, rtol=1e-12)
        areas = [area.get_label() for area in axis.collections[: shares.sizes["cause"]]]
        assert areas == shares.cause.values.tolist()
        # What is stacked above zero less what is stacked below is the size.
        tops = [np.abs(area.get_paths()[0].vertices[:, 1]).max() for area in axis.collections]
        assert max(tops) >= size.max() * (1 - 1e-12)


def test_energy(swing):
    balance = lw.loads.energy_balance(swing)
    above, below = (curves(axis) for axis in swing.plot.energy().axes)
    assert len(above) == 5
    for name in ("kinetic_energy", "drive_work", "dissipated"):
        drawn = above[balance[name].attrs["long_name"]]
        np.testing.assert_array_equal(drawn, [balance.time, balance[name]])
    np.testing.assert_array_equal(below["energy that does not add up"][1], balance.residual)


def test_figures_are_files(swing, tmp_path):
    for name, figure in (("a.png", swing.plot.loads("wrist")), ("b.svg", swing.plot.energy())):
        figure.savefig(tmp_path / name)
        assert (tmp_path / name).stat().st_size > 5000


@pytest.mark.parametrize(
    ("draw", "quantity"),
    [
        (lambda run: run.plot.loads("pivot"), "joint_load"),
        (lambda run: run.plot.split("pivot"), "joint_load"),
        (lambda run: run.plot.energy(), "joint_load"),
    ],
)
def test_a_run_that_lacks_the_quantity_says_so(draw, quantity):
    run = lw.simulate(pendulum(), duration=0.1, every=0.05, record=["position"])
    with pytest.raises(lw.InputError, match=f'record the quantity "{quantity}"'):
        draw(run)


def test_unknown_joints_are_named(swing):
    with pytest.raises(lw.InputError, match="did you mean 'elbow'"):
        swing.plot.loads("elbw")


def test_a_blow_between_the_samples_is_in_the_figures():
    run = lw.simulate(stopped_arm(1e7), duration=1.0, every=0.05)
    found = lw.loads.envelope(run).sel(joint="elbow")
    for axis, names in zip(
        run.plot.loads("elbow").axes, (("fx", "fy", "fz"), ("nx", "ny", "nz")), strict=True
    ):
        dots = [line.get_xydata() for line in axis.get_lines() if line.get_marker() == "o"]
        for drawn, name in zip(dots, names, strict=True):
            one = found.sel(component=name)
            expected = [[one.minimum_time, one.minimum], [one.maximum_time, one.maximum]]
            np.testing.assert_array_equal(drawn, np.array(expected, dtype=float))
    assert "peaks between the samples" in run.plot.split("elbow").axes[0].get_title()


def test_what_is_one_choice_of_many_is_dashed():
    machine = lw.scenes.benchmark("four_bars", n=1)
    run = lw.simulate(machine.model, duration=0.1, q0=machine.q0, v0=machine.v0)
    force, moment = run.plot.loads("A0").axes
    styles = {line.get_label(): line.get_linestyle() for line in force.get_lines()}
    assert (styles["fx"], styles["fy"], styles["(fz)"]) == ("-", "-", "--")
    styles = {line.get_label(): line.get_linestyle() for line in moment.get_lines()}
    assert (styles["(nx)"], styles["(ny)"], styles["nz"]) == ("--", "--", "-")


def test_figures_of_loads_that_are_open():
    """A planar linkage: fx, fy and nz are determinate, so the sizes and their shares are not."""
    from linkwise.plot.report_figures import joint_figures

    machine = lw.scenes.benchmark("four_bars", n=1)
    run = lw.simulate(machine.model, duration=0.2, every=0.01, q0=machine.q0, v0=machine.v0)
    for axis in run.plot.split("A0").axes:
        (total,) = axis.get_lines()
        assert total.get_label() == "(total)"
        assert total.get_linestyle() == "--"
        labels = [area.get_label() for area in axis.collections if area.get_label()[0] != "_"]
        assert labels
        assert all(label[0] == "(" for label in labels)
    made = {f["layout"]["title"]["text"]: f for f in joint_figures(run, ["A0"], 1, None)["A0"]}
    note = "; dotted and in brackets: one choice of many"
    for title in ("Force by cause", "Moment by cause"):
        *areas, total = made[title + note]["data"]
        assert total["name"] == "(total)"
        assert total["line"]["dash"] == "dot"
        assert all(area["name"][0] == "(" for area in areas)
    names = {
        title: [line["name"] for line in figure["data"]]
        for title, figure in made.items()
        if "along" in title or "about and" in title or "Spectral" in title
    }
    assert names["Force along and across the axis" + note] == ["(axial)", "radial"]
    assert names["Moment about and across the axis" + note] == ["torque", "(tilting moment)"]
    assert names["Spectral density of the force" + note] == ["fx", "fy", "(fz)"]
    assert "Radial force about the axis, in the joint frame" in made
    assert "Load duration (one choice of many)" in made
