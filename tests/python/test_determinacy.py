"""Which loads of loops rigid bodies determine, wherever a person sees loads."""

import csv
import json

import numpy as np
import pytest
import xarray as xr
from test_loops import door, four_bar
from typer.testing import CliRunner

import linkwise as lw
from linkwise.cli.main import app
from linkwise.cli.sweep import member_records
from linkwise.simulation.determinacy import Determinacy

pytestmark = pytest.mark.filterwarnings("ignore::linkwise.ModelWarning")

#: Of every hinge along z of a planar machine: the forces in the plane, and its own free moment.
PLANAR = np.array([1, 1, 0, 0, 0, 1], dtype=bool)


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    path = tmp_path_factory.mktemp("runs") / "four_bar"
    return lw.simulate(four_bar("c"), duration=0.3, every=0.01, output=path)


def test_trees_have_no_such_variable():
    run = lw.simulate(door(1), duration=0.1)
    assert "determinate" not in run
    assert "determinate" not in lw.loads.summary(run)
    assert "force_determinate" not in run.peak_loads()


@pytest.mark.parametrize("cut", ["c", "d"])
def test_runs_tell_it_wherever_the_loop_is_cut(cut):
    run = lw.simulate(four_bar(cut), duration=0.1)
    assert run.determinate.dims == ("joint", "component")
    assert run.determinate.dtype == bool
    for name in "abcd":
        np.testing.assert_array_equal(run.determinate.sel(joint=name), PLANAR)


def test_stored_and_exported(stored, tmp_path):
    again = lw.open_run(stored.path)
    np.testing.assert_array_equal(again.determinate, np.tile(PLANAR, (4, 1)))
    again.to_netcdf(tmp_path / "run.nc")
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as exported:
        assert exported.determinate.dtype == bool
        np.testing.assert_array_equal(exported.determinate, again.determinate)
    again.to_csv(tmp_path / "tables")
    with open(tmp_path / "tables" / "joint_load.csv", newline="") as file:
        heads = next(csv.reader(file))[1:]
    assert ["(not determinate)" in head for head in heads] == (~np.tile(PLANAR, 4)).tolist()


def test_runs_of_some_joints_keep_their_rows(tmp_path):
    run = lw.simulate(
        four_bar("c", joint="spherical"), duration=0.1, joints=["b"], record=["joint_load"]
    )
    whole = lw.simulate(four_bar("c", joint="spherical"), duration=0.1)
    assert whole.determinate.values.any()
    np.testing.assert_array_equal(run.determinate, whole.determinate.sel(joint=["b"]))


def test_determinate_loads_do_not_depend_on_where_the_loop_is_cut():
    first, second = (lw.simulate(four_bar(cut), duration=0.3, tolerance=1e-10) for cut in "cd")
    for name in "abcd":
        known = first.determinate.sel(joint=name).values
        one, other = (run.joint_load.sel(joint=name).values[:, known] for run in (first, second))
        np.testing.assert_allclose(one, other, atol=1e-6 * np.abs(one).max())


def test_joints_that_are_held_too_often_share_out_their_torques():
    """A four-bar has one way to move: a second lock fights the first, in the plane, too."""
    model = four_bar("c")
    lock = {"a": lw.Locked()}
    one = lw.simulate(model, duration=0.01, drives=lock)
    np.testing.assert_array_equal(one.determinate, np.tile(PLANAR, (4, 1)))
    for second in (lw.Locked(), lw.Motion(lambda t: (0.0, 0.0, 0.0))):
        both = lw.simulate(model, duration=0.01, drives=lock | {"d": second}).determinate
        assert not both.sel(joint=["a", "d"]).values.any()
        # Hinges without a lock carry no torque, whoever fights.
        assert both.sel(joint=["b", "c"], component="nz").values.all()
        assert not both.sel(joint=["b", "c"], component=["fx", "fy"]).values.any()
    many = lw.simulate_batch(
        model, step=1e-3, duration=0.01, drives=lock | {"d": lw.Locked()}, q0=np.zeros((2, 3))
    )
    np.testing.assert_array_equal(many.determinate[1], both)


def test_members_tell_it_each():
    model = door(2)
    found = lw.simulate_batch(model, step=1e-3, duration=0.01, v0=np.array([[0.0], [1.0]]))
    assert found.determinate.dims == ("member", "joint", "component")
    assert not found.determinate.values[..., :5].any()
    assert found.determinate.values[..., 5].all()
    summary = lw.loads.summary(found, model=model)
    assert summary.determinate.dtype == bool
    assert not summary.determinate.sel(quantity="radial").values.any()
    notes = [n["text"] for n in json.loads(found.attrs["warnings"]) if n["element"] == "joint_load"]
    assert len(notes) == 1
    assert "5 self-stresses" in notes[0]


def test_the_report_puts_them_in_brackets(stored, tmp_path):
    path = tmp_path / "report.html"
    result = CliRunner().invoke(app, ["loads", str(stored.path), "--html", str(path)])
    assert result.exit_code == 0, result.output
    assert "Numbers in brackets are not determined by rigid bodies" in path.read_text()


def test_quantities_are_open_where_a_part_of_them_is(stored):
    found = lw.loads.summary(stored).determinate.all("joint")
    known = {str(name) for name in found.quantity.values[found.values]}
    assert known == {"radial", "torque", "drive_power"}
    peaks = stored.peak_loads()
    assert not peaks.force_determinate.values.any()
    np.testing.assert_array_equal(lw.loads.envelope(stored).determinate, stored.determinate)
    equivalent = lw.loads.damage_equivalent(stored)
    np.testing.assert_array_equal(equivalent.determinate, stored.determinate)
    rated = lw.loads.margins(
        lw.loads.summary(stored), {"a": lw.loads.Rating(radial=500, axial=500)}
    )
    assert bool(rated.determinate.sel(quantity="radial", joint="a"))
    assert not bool(rated.determinate.sel(quantity="axial", joint="a"))


def test_tables_put_them_in_brackets(stored, monkeypatch):
    monkeypatch.setenv("COLUMNS", "300")
    shown = CliRunner().invoke(app, ["loads", str(stored.path), "--joint", "a"]).output
    assert "in brackets: not determined by rigid bodies" in shown
    row = next(line for line in shown.splitlines() if line.strip().startswith("axial [N]"))
    assert row.split()[2].startswith("(")
    row = next(line for line in shown.splitlines() if line.strip().startswith("radial [N]"))
    assert not row.split()[2].startswith("(")
    found = json.loads(CliRunner().invoke(app, ["loads", str(stored.path), "--json"]).stdout)
    by = {(r["joint"], r["quantity"]): r for r in found["peaks"]}
    assert by["b", "radial"]["determinate"] is True
    assert by["b", "axial"]["determinate"] is False
    assert by["b", "axial"]["not_determinate"] == "fz nx ny"


def test_what_opens_in_some_poses_only_is_told():
    machine = lw.scenes.benchmark("four_bars", n=1)
    model = machine.model
    # In a line all bars can be pulled along it: forces in the plane are open there, too.
    flat = np.zeros(model.nq)
    straight = {"A0": -np.pi / 2, "A1": -np.pi / 2, "B0": np.pi / 2}
    for name, angle in straight.items():
        flat[model.joint_names.index(name)] = angle
    seen = Determinacy(model, {}, machine.q0, samples=1)
    assert "in some poses only" not in seen.notes()[0].text
    before = seen.throughout.copy()
    assert lw.loop_gaps(model, flat).max() < 1e-12
    seen.see(flat[None])
    assert (seen.throughout <= before).all()
    assert (seen.throughout != before).any()
    assert "in some poses only those of joints" in seen.notes()[0].text


def test_loads_elsewhere_and_shares_are_in_brackets(stored, monkeypatch, tmp_path):
    monkeypatch.setenv("COLUMNS", "300")
    csv_file = tmp_path / "at.csv"
    asked = ["loads", str(stored.path), "--at", "world"]
    shown = CliRunner().invoke(app, [*asked, "--csv", str(csv_file)]).output
    assert "in brackets: not determined by rigid bodies" in shown
    cells = next(line for line in shown.splitlines() if line.strip().startswith("c ")).split()
    # joint, force @ s, moment @ s, six components
    opened = [cell.startswith("(") for cell in cells]
    assert opened == [False, True, False, False, True, False, False, *~PLANAR]
    with open(csv_file, newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["quantity"] for row in rows if row["determinate"] == "False"} == {
        *("force", "moment", "fz", "nx", "ny")
    }
    one = CliRunner().invoke(app, [*asked, "--joint", "c"]).output
    rows = {line.split()[0]: line for line in one.splitlines() if line.strip()}
    assert rows["fz"].count("(") == 3  # peak, minimum, maximum; not the time
    assert "(" not in rows["fx"]
    found = json.loads(CliRunner().invoke(app, [*asked, "--json"]).stdout)
    by = {(r["joint"], r["quantity"]): r["determinate"] for r in found["loads"]}
    assert by["c", "fy"]
    assert not by["c", "nx"]
    assert not by["c", "moment"]
    split = ["loads", str(stored.path), "--split", "force"]
    shown = CliRunner().invoke(app, split).output
    row = [line for line in shown.splitlines() if "force [N]" in line][-1].split()
    assert all(cell.startswith("(") for cell in row[4:])
    found = json.loads(CliRunner().invoke(app, [*split, "--json"]).stdout)
    assert not any(share["determinate"] for share in found["split"])


def test_sweeps_rank_what_is_determined():
    """The largest force of a member is one that rigid bodies determine, where there is one."""
    many = lw.simulate_batch(door(2), step=1e-3, duration=0.01, v0=np.array([[0.0], [1.0]]))
    many = many.assign_coords(speed=("member", [0.0, 1.0]))
    many["joint_load"][0, :, 1, 0] = 1e6
    many["determinate"][0, 0] = True
    first, second = member_records(many, ["speed"])
    assert (first["force_joint"], first["largest_force_determinate"]) == ("low", True)
    assert second["largest_force_determinate"] is False
