"""Wherever a joint is named, one that closes a loop is taken as those of the tree are."""

from pathlib import Path

import numpy as np
import pytest

import linkwise as lw
from linkwise.loads.limits import beyond_limits
from linkwise.view.source import Options, open_source

WATT = Path(__file__).parents[2] / "examples" / "data" / "watt.urdf"
SCENARIO = """
model = "watt.urdf"
[initial.position]
left = 0.3
[rating.lower]
radial = 100
[rating.left]
force = 1e6
[simulate]
duration = 0.2
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "watt.urdf").write_bytes(WATT.read_bytes())
    (tmp_path / "watt.toml").write_text(SCENARIO)
    return tmp_path


def simulated(model, **options):
    return lw.simulate(model, duration=0.3, every=0.05, q0=[0.3, 0, 0], **options)


@pytest.mark.parametrize("property", ["damping", "stiffness", "friction", "armature"])
def test_the_joint_that_closes_a_documented_loop_takes_properties(property):
    """Its child is a frame without mass on a fixed joint, which stays in the tree."""
    text = WATT.read_text()
    model = lw.load(text)
    assert model.loop_names == ["lower"]
    given = {"damping": "damping", "friction": "friction"}.get(property)
    if given is not None:
        plain = '<joint name="lower" type="continuous">'
        assert plain in text
        text = text.replace(plain, f'{plain}<dynamics {given}="0.1"/>')
        written = lw.load(text)
        assert written.loop_names == ["lower"]
        assert written.loop_property(property) == [0.1]
    changed = model.with_joint("lower", **{property: 0.1})
    assert changed.loop_names == ["lower"]
    assert simulated(changed).attrs["outcome"] == "converged"


def test_ratings_and_recorded_joints_of_a_scenario(folder, linkwise):
    linkwise("run", folder / "watt.toml", "-o", folder / "run")
    shown = linkwise("loads", folder / "run", "--json").json
    rated = {r["joint"]: r for r in shown["peaks"] if r.get("rating") is not None}
    run = lw.run_scenario(folder / "watt.toml")
    peak = lw.loads.summary(run).peak.sel(joint="lower", quantity="radial")
    assert rated["lower"]["quantity"] == "radial"
    assert rated["lower"]["peak"] == pytest.approx(float(peak), rel=1e-9)
    assert rated["lower"]["use"] == pytest.approx(float(peak) / 100, rel=1e-9)

    some = folder / "some.toml"
    some.write_text(SCENARIO + '[output]\njoints = ["lower", "left"]\n')
    run = lw.run_scenario(some)
    assert list(run.joint_load.joint.values) == ["left", "lower"]
    some.write_text(SCENARIO.replace("[rating.lower]", "[rating.lowre]"))
    with pytest.raises(lw.InputError, match=r"rating\.lowre: .*did you mean 'lower'"):
        lw.run_scenario(some)


@pytest.mark.parametrize("joints", [["lower"], ["lower", "left"], ["right", "upper"]])
def test_runs_of_some_joints_hold_what_whole_runs_hold(joints, tmp_path):
    model = lw.load(WATT)
    whole, some = simulated(model), simulated(model, joints=joints, output=tmp_path / "run")
    order = [*model.joint_names, *model.loop_names]
    recorded = sorted(joints, key=order.index)
    for run in (some, lw.open_run(tmp_path / "run")):
        assert list(run.joint_load.joint.values) == recorded
        for name in ("joint_load", "determinate", "extreme_joint_load", "extreme_quantity"):
            want = whole.dataset[name].sel(joint=recorded).values
            np.testing.assert_array_equal(run.dataset[name].values, want, err_msg=name)
        assert ("loop_velocity" in run.dataset) == ("lower" in joints)
        if "lower" in joints:
            np.testing.assert_array_equal(run["loop_velocity"], whole["loop_velocity"])
        tree = [name for name in recorded if name != "lower"]
        if tree:
            np.testing.assert_array_equal(run.velocity.sel(dof=tree), whole.velocity.sel(dof=tree))
        summary, all_ = lw.loads.summary(run), lw.loads.summary(whole).sel(joint=recorded)
        for name, values in summary.data_vars.items():
            np.testing.assert_allclose(values, all_[name], rtol=1e-14, err_msg=str(name))


@pytest.mark.parametrize("joints", [None, ["lower"], ["left", "lower"]])
def test_limits_without_stops_of_loop_joints(joints):
    model = lw.load(WATT).with_joint("lower", lower=-0.05, upper=0.05)
    run = simulated(model, joints=joints)
    if joints == ["lower"]:
        assert beyond_limits(run) == []  # the run holds no positions of the tree
        return
    (found,) = beyond_limits(run)
    (coordinate,) = run["loop_position"].values.T
    assert found["joint"] == "lower"
    assert found["farthest"] == coordinate[np.abs(coordinate).argmax()]


def test_a_run_is_drawn_with_its_file(folder, linkwise):
    linkwise("run", folder / "watt.toml", "-o", folder / "run")
    source = open_source(folder / "run", Options(model=folder / "watt.urdf"))
    assert source.model.loop_names == ["lower"]
