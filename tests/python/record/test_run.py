"""The Run object: access, summary, peaks, export."""

import csv
import json
import pickle
import sys

import numpy as np
import pytest
import xarray as xr

import linkwise as lw
from helpers.made_up_run import make_chunk, small_model
from linkwise import base
from linkwise.io.table import read_table
from linkwise.record.memory import MemoryRecord
from linkwise.record.provenance import provenance
from linkwise.record.schema import QUANTITIES, build_schema
from linkwise.record.store import RunWriter

TIMES = np.linspace(0, 2, 21)


@pytest.fixture
def run(schema, attrs):
    record = MemoryRecord(schema, attrs)
    record.append(make_chunk(TIMES[:8]))
    record.append(make_chunk(TIMES[8:]))
    return lw.Run(record.finish({"outcome": "converged", "method": "articulated_body"}))


def test_access_falls_through_to_the_dataset(run):
    xr.testing.assert_identical(run.joint_load, run.dataset["joint_load"])
    xr.testing.assert_identical(run["position"], run.dataset.position)
    elbow = run.joint_load.sel(joint="elbow", component="fz")
    np.testing.assert_allclose(elbow, TIMES + 1000.02)
    assert run.sizes["time"] == 21
    assert run.attrs["model"] == "arm"
    assert "position" in run
    assert "joint_load" in dir(run)
    assert run.outcome == "converged"
    assert run.completed


def test_unknown_attribute_lists_what_there_is(run):
    with pytest.raises(AttributeError, match=r"no 'torque'; it holds position, .*drive_torque"):
        run.torque  # noqa: B018


def test_repr_says_what_matters(run):
    for text in ("'arm'", "converged", "0 to 2 s", "21 samples", "3 joints", "joint_load", "rad/s"):
        assert text in repr(run)
    assert "<p>" in run._repr_html_()


def test_a_run_pickles(run):
    again = pickle.loads(pickle.dumps(run))
    xr.testing.assert_identical(again.dataset, run.dataset)


def test_provenance_is_flat_and_names_no_machine(run):
    assert all(isinstance(value, (str, int, float)) for value in run.attrs.values())
    assert json.loads(run.attrs["options"]) == {"tolerance": 1e-6}
    assert json.loads(run.attrs["versions"])["xarray"] == xr.__version__
    assert run.attrs["model_source"] == "arm.urdf"
    assert run.attrs["scenario"].startswith("[simulate]")
    assert run.attrs["model_hash"] == small_model().hash


def test_model_source_loses_its_folder():
    builder = lw.ModelBuilder("arm", source="/home/somebody/arm.urdf")
    builder.add_link("base")
    builder.add_link("upper", mass=1.0, inertia=np.eye(3))
    builder.add_joint("shoulder", "revolute", "base", "upper")
    attrs = provenance(builder.build(), options={})
    assert attrs["model_source"] == "arm.urdf"
    assert "somebody" not in json.dumps(attrs)


@pytest.mark.parametrize("block", [1, 300, 1 << 20])
def test_peak_loads(model, monkeypatch, block):
    monkeypatch.setattr(base, "BLOCK_BYTES", block)
    chunk = make_chunk(TIMES)
    load = np.zeros((21, 3, 6))
    load[5, 0, :3] = (3, 0, -4)
    load[9, 0, 3:] = (0, -5, 12)
    load[0, 2, :3] = load[20, 2, :3] = (2, 2, 1)  # the first of equal peaks
    chunk["joint_load"] = load
    record = MemoryRecord(build_schema(model, "joint_load"), provenance(model, options={}))
    record.append(chunk)
    peaks = lw.Run(record.finish({})).peak_loads()
    np.testing.assert_allclose(peaks.force, [5, 0, 3])
    np.testing.assert_allclose(peaks.moment, [13, 0, 0])
    np.testing.assert_allclose(peaks.force_time, [TIMES[5], 0, 0])
    np.testing.assert_allclose(peaks.moment_time, [TIMES[9], 0, 0])
    assert peaks.joint.values.tolist() == ["shoulder", "elbow", "wrist"]
    assert list(peaks.coords) == ["joint"]
    assert peaks.force.attrs["units"] == "N"


def test_peak_loads_need_loads(model):
    record = MemoryRecord(build_schema(model, "position"), {})
    record.append(make_chunk(TIMES))
    with pytest.raises(lw.InputError, match="no joint_load"):
        lw.Run(record.finish({})).peak_loads()


@pytest.mark.parametrize("stored", [False, True])
def test_netcdf_holds_the_same(tmp_path, run, schema, attrs, stored):
    if stored:
        writer = RunWriter(tmp_path / "run.zarr", schema, attrs, samples=21)
        writer.append(make_chunk(TIMES))
        writer.finish(run.attrs)
        run = lw.open_run(tmp_path / "run.zarr")
    assert run.to_netcdf(tmp_path / "run.nc") == tmp_path / "run.nc"
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf", decode_times=False) as again:
        xr.testing.assert_equal(again.load(), run.dataset.load())
        assert again.attrs == run.attrs
        for name, variable in run.dataset.variables.items():
            assert {**again[name].attrs} == {**variable.attrs}, name
        assert set(again.coords) == set(run.dataset.coords)


def test_export_to_a_missing_folder(tmp_path, run):
    with pytest.raises(lw.InputError, match="does not exist"):
        run.to_netcdf(tmp_path / "nowhere" / "run.nc")
    with pytest.raises(lw.InputError, match="does not exist"):
        run.to_csv(tmp_path / "nowhere" / "loads.csv", "joint_load")
    with pytest.raises(lw.InputError, match="cannot make the folder"):
        run.to_csv(tmp_path / "nowhere" / "tables")


def read(path):
    with open(path, newline="") as file:
        header, *rows = csv.reader(file)
    return header, np.array(rows, float)


def test_csv_folder_has_a_table_a_quantity(tmp_path, run):
    written = run.to_csv(tmp_path / "tables")
    assert {path.stem for path in written} == (set(QUANTITIES) - {"external_wrench"}) | {
        "drive_work"
    }
    header, rows = read(tmp_path / "tables" / "joint_load.csv")
    assert header[:2] == ["time [s]", "shoulder.fx [N]"]
    assert header[-1] == "wrist.nz [N m]"
    np.testing.assert_array_equal(rows[:, 0], TIMES)
    np.testing.assert_array_equal(rows[:, 1:], run.joint_load.values.reshape(21, 18))
    header, rows = read(tmp_path / "tables" / "energy.csv")
    assert header == ["time [s]", "kinetic_energy [J]", "potential_energy [J]"]
    np.testing.assert_array_equal(rows[:, 1], run.kinetic_energy)
    header, _ = read(tmp_path / "tables" / "statistics.csv")
    assert header[1:3] == ["steps", "evaluations"]


def test_csv_file_holds_one_quantity(tmp_path, run):
    assert run.to_csv(tmp_path / "t.csv", "drive_torque") == [tmp_path / "t.csv"]
    table = read_table(tmp_path / "t.csv")  # what a torque drive reads
    np.testing.assert_array_equal(table.times, TIMES)
    assert table.names == ("shoulder", "elbow", "wrist")
    np.testing.assert_array_equal(table.values, run.drive_torque)
    with pytest.raises(lw.InputError, match="name one with quantity="):
        run.to_csv(tmp_path / "t.csv")
    with pytest.raises(lw.InputError, match="no 'torque'"):
        run.to_csv(tmp_path / "t.csv", "torque")


def test_csv_of_mixed_units_and_awkward_names(tmp_path):
    builder = lw.ModelBuilder("odd")
    for name in ("base", "a", "b"):
        builder.add_link(name, mass=1.0, inertia=np.eye(3))
    builder.add_joint('say "hi", you', "prismatic", "base", "a")
    builder.add_joint("turn", "revolute", "a", "b")
    model = builder.build()
    record = MemoryRecord(build_schema(model, ["position"]), provenance(model, options={}))
    record.append(make_chunk(TIMES, 2))
    run = lw.Run(record.finish({}))
    run.to_csv(tmp_path / "p.csv", "position")
    header, _ = read(tmp_path / "p.csv")
    assert header == ["time [s]", 'say "hi", you [m]', "turn [rad]"]


def test_versions_are_read_once(monkeypatch):
    module = sys.modules[provenance.__module__]
    expected = module.versions()
    monkeypatch.setattr(module, "version", None)  # would fail if it were called
    assert module.versions() == expected
    module.versions()["numpy"] = "changed"
    assert module.versions() == expected
