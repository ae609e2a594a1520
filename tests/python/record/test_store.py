"""The Zarr store: chunk by chunk, readable at any moment, careful with what is there already."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import linkwise as lw
from helpers.made_up_run import make_chunk
from linkwise.record import store
from linkwise.record.claim import unused_path
from linkwise.record.memory import MemoryRecord
from linkwise.record.schema import build_schema
from linkwise.record.store import RunWriter

TIMES = np.arange(25.0)


def write(path, schema, attrs, times=TIMES, per_call=4, **options):
    writer = RunWriter(path, schema, attrs, samples=len(times), **options)
    for start in range(0, len(times), per_call):
        writer.append(make_chunk(times[start : start + per_call]))
    return writer


@pytest.fixture
def seven_rows_a_chunk(monkeypatch):
    monkeypatch.setattr(store, "MAX_BLOCK_ROWS", 7)


@pytest.mark.usefixtures("seven_rows_a_chunk")
@pytest.mark.parametrize("per_call", [1, 4, 7, 25])
@pytest.mark.parametrize("flush_seconds", [0.0, 1e9])
def test_store_and_memory_agree(tmp_path, schema, attrs, per_call, flush_seconds):
    path = tmp_path / "run.zarr"
    writer = write(path, schema, attrs, per_call=per_call, flush_seconds=flush_seconds)
    writer.finish({"outcome": "converged"})
    memory = MemoryRecord(schema, attrs)
    memory.append(make_chunk(TIMES))
    run = lw.open_run(path)
    xr.testing.assert_identical(run.dataset.load(), memory.finish({"outcome": "converged"}))
    assert list(run.dataset.data_vars) == [v.name for v in schema.variables]


@pytest.mark.usefixtures("seven_rows_a_chunk")
def test_what_is_written_can_be_read_while_writing(tmp_path, schema, attrs):
    writer = write(tmp_path / "run.zarr", schema, attrs, flush_seconds=1e9)
    run = lw.open_run(tmp_path / "run.zarr")
    assert run.outcome == "running"
    assert run.time.size == 21  # whole chunks only
    np.testing.assert_array_equal(run.joint_load, make_chunk(TIMES[:21])["joint_load"])
    writer.finish({"outcome": "converged"})
    assert lw.open_run(tmp_path / "run.zarr").time.size == 25


def test_samples_are_complete_only_with_their_time(tmp_path, schema, attrs, monkeypatch):
    """Arrays that were written ahead of `time` when the process died are cut when opening."""
    writer = write(tmp_path / "run.zarr", schema, attrs, times=TIMES[:10], flush_seconds=0.0)
    writer._arrays["position"][:] = 7.0
    writer._arrays["time"][6:] = np.nan
    run = lw.open_run(tmp_path / "run.zarr")
    assert dict(run.sizes) == {"time": 6, "joint": 3, "component": 6}
    assert run.position.shape == (6, 3)


def test_run_that_stops_early_holds_its_samples(tmp_path, schema, attrs):
    writer = RunWriter(tmp_path / "run.zarr", schema, attrs, samples=1000)
    writer.append(make_chunk(TIMES))
    dataset = writer.finish({"outcome": "not_finite", "stop_time": 24.5})
    assert dataset.sizes["time"] == 25
    run = lw.open_run(tmp_path / "run.zarr")
    assert run.outcome == "not_finite"
    np.testing.assert_array_equal(run.time, TIMES)


def test_no_samples_at_all(tmp_path, schema, attrs):
    RunWriter(tmp_path / "run.zarr", schema, attrs, samples=10).finish({"outcome": "interrupted"})
    run = lw.open_run(tmp_path / "run.zarr")
    assert run.sizes["time"] == 0
    assert "no samples" in repr(run)
    with pytest.raises(lw.InputError, match="no samples"):
        run.peak_loads()


def test_large_systems_are_cut_along_joints():
    builder = lw.ModelBuilder("long")
    builder.add_link("link_0")
    for k in range(1, 20_001):
        builder.add_link(f"link_{k}", mass=1.0, inertia=np.eye(3))
        builder.add_joint(f"joint_{k}", "revolute", f"link_{k - 1}", f"link_{k}")
    schema = build_schema(builder.build())
    rows = store.block_rows(schema, 1000)
    assert 1 <= rows * schema.row_bytes <= store.SAMPLE_BLOCK_BYTES
    for variable in schema.variables:
        shape = store.chunk_shape(variable, rows)
        assert np.prod(shape) * 8 <= store.CHUNK_BYTES
        assert all(size <= whole for size, whole in zip(shape[1:], variable.shape, strict=True))


# -- a process that is killed --------------------------------------------------------------------

KILLED = """
import os, signal, sys
sys.path[:0] = [{here!r}]
from helpers.made_up_run import make_chunk, small_model
from linkwise.record import store
from linkwise.record.provenance import provenance
from linkwise.record.schema import build_schema
import numpy as np
store.MAX_BLOCK_ROWS = 7
model = small_model()
writer = store.RunWriter({path!r}, build_schema(model), provenance(model, options={{}}),
                         samples=1_000_000, flush_seconds=0.0)
die_in = {die_in!r}
if die_in:
    from zarr.storage import _local
    count = 0
    original = _local._atomic_write
    def counting(path, *args, **kwargs):
        global count
        count += 1
        if count == die_in:
            path.with_suffix(".partial").write_bytes(b"half")
            os.kill(os.getpid(), signal.SIGKILL)
        return original(path, *args, **kwargs)
    _local._atomic_write = counting
for start in range(0, 1_000_000, 5):
    writer.append(make_chunk(np.arange(start, start + 5.0)))
    print(start + 5, flush=True)
"""


def start_writing(path, die_in=0):
    code = KILLED.format(here=str(Path(__file__).parents[2]), path=str(path), die_in=die_in)
    return subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)


def assert_holds(path, at_least):
    run = lw.open_run(path)
    assert run.outcome == "killed"
    count = run.sizes["time"]
    assert count >= at_least
    expected = make_chunk(np.arange(float(count)))
    for name in run.dataset.data_vars:
        np.testing.assert_array_equal(run[name], expected[name], err_msg=name)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs POSIX signals")
def test_killed_between_chunks(tmp_path):
    process = start_writing(tmp_path / "run.zarr")
    done = 0
    while done < 60:
        done = int(process.stdout.readline())
    process.kill()
    process.wait()
    assert_holds(tmp_path / "run.zarr", at_least=60)


# Every write of a file in turn: 13 arrays a flush, `time` last, two chunks when one is filled.
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs POSIX signals")
@pytest.mark.parametrize("die_in", [1, 2, 12, 13, 14, 27, 40])
def test_killed_in_the_middle_of_a_chunk(tmp_path, die_in):
    process = start_writing(tmp_path / "run.zarr", die_in)
    lines = process.communicate(timeout=600)[0].split()
    assert process.returncode == -signal.SIGKILL
    assert_holds(tmp_path / "run.zarr", at_least=int(lines[-1]) if lines else 0)


# -- what is at the path already -----------------------------------------------------------------


def test_existing_run_is_replaced_whole(tmp_path, schema, attrs):
    path = tmp_path / "run.zarr"
    write(path, schema, attrs).finish({"outcome": "converged"})
    write(path, schema, attrs, times=TIMES[:3]).finish({"outcome": "converged"})
    assert lw.open_run(path).sizes["time"] == 3
    assert os.listdir(tmp_path) == ["run.zarr"]


def test_run_being_written_is_not_replaced(tmp_path, schema, attrs):
    path = tmp_path / "run.zarr"
    writer = write(path, schema, attrs)
    with pytest.raises(lw.InputError, match="being written by another process"):
        RunWriter(path, schema, attrs, samples=3)
    writer.finish({"outcome": "converged"})
    assert lw.open_run(path).sizes["time"] == 25
    assert os.listdir(tmp_path) == ["run.zarr"]


def make_file(path):
    path.write_text("precious")


def make_folder(path):
    path.mkdir()
    (path / "precious.txt").write_text("precious")


def make_foreign_store(path):
    xr.Dataset({"precious": ("x", [1.0])}).to_zarr(path, zarr_format=3, consolidated=False)


def make_link(path):
    (path.parent / "elsewhere").mkdir()
    path.symlink_to(path.parent / "elsewhere")


@pytest.mark.parametrize("make", [make_file, make_folder, make_foreign_store, make_link])
def test_anything_else_is_left_alone(tmp_path, schema, attrs, make):
    path = tmp_path / "run.zarr"
    make(path)
    before = sorted(str(p) for p in tmp_path.rglob("*"))
    with pytest.raises(lw.InputError, match=r"run\.zarr': exists and is not a linkwise run; "):
        RunWriter(path, schema, attrs, samples=3)
    assert sorted(str(p) for p in tmp_path.rglob("*")) == before


def test_missing_folder_is_named(tmp_path, schema, attrs):
    with pytest.raises(lw.InputError, match=r"folder '.*nowhere' does not exist"):
        RunWriter(tmp_path / "nowhere" / "run.zarr", schema, attrs, samples=3)
    assert os.listdir(tmp_path) == []


def test_unused_path_counts_on(tmp_path):
    assert unused_path(tmp_path / "run.zarr").name == "run.zarr"
    (tmp_path / "run.zarr").mkdir()
    (tmp_path / "run-2.zarr").mkdir()
    assert unused_path(tmp_path / "run.zarr").name == "run-3.zarr"


# -- opening -------------------------------------------------------------------------------------


@pytest.mark.parametrize("make", [None, make_file, make_folder, make_foreign_store])
def test_opening_what_is_no_run(tmp_path, make):
    path = tmp_path / "x.zarr"
    if make:
        make(path)
    with pytest.raises(lw.InputError, match=r"does not exist|is not a linkwise run") as caught:
        lw.open_run(path)
    assert "\n" not in str(caught.value)


def test_opening_a_damaged_run(tmp_path, schema, attrs):
    path = tmp_path / "run.zarr"
    write(path, schema, attrs).finish({"outcome": "converged"})
    (path / "time" / "zarr.json").write_text("{")
    with pytest.raises(lw.InputError, match="is damaged") as caught:
        lw.open_run(path)
    assert "\n" not in str(caught.value)


def test_format_of_the_future_is_refused(tmp_path, schema, attrs):
    path = tmp_path / "run.zarr"
    write(path, schema, {**attrs, "linkwise_run": 99}).finish({"outcome": "converged"})
    with pytest.raises(lw.InputError, match="format 99"):
        lw.open_run(path)


def test_xarray_alone_can_open_a_run(tmp_path, schema, attrs):
    write(tmp_path / "run.zarr", schema, attrs).finish({"outcome": "converged"})
    dataset = xr.open_zarr(tmp_path / "run.zarr", consolidated=False)
    assert dataset.joint_load.sel(joint="elbow", component="fx").shape == (25,)
