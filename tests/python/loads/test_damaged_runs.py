"""Runs whose files are damaged, that hold no numbers, or too few samples: one line that says so."""

import numpy as np
import pytest
import zarr

import linkwise as lw
from linkwise.record.checked_store import WritingStore
from linkwise.view.source import Options, open_source


@pytest.fixture
def path(tmp_path):
    model = lw.scenes.chain(3)
    lw.simulate(model, duration=0.3, every=0.1, q0=[0.3] * 3, output=tmp_path / "run.zarr")
    return tmp_path / "run.zarr"


def complain(call, *parts):
    with pytest.raises(lw.InputError) as caught:
        call()
    text = str(caught.value)
    assert "\n" not in text
    for part in parts:
        assert part in text, text


def each_reader(path):
    yield lambda: lw.loads.summary(lw.open_run(path))
    yield lambda: lw.loads.quantities(lw.open_run(path))
    yield lambda: lw.open_run(path).peak_loads()
    yield lambda: lw.loads.damage_equivalent(lw.open_run(path))
    yield lambda: open_source(path, Options())


def test_chunks_that_are_cut_off(path):
    for chunk in filter(lambda file: file.is_file(), (path / "joint_load" / "c").rglob("*")):
        chunk.write_bytes(chunk.read_bytes()[:20])
    for read in each_reader(path):
        complain(read, "run.zarr", "joint_load", "damaged", "simulate again")


def test_loads_that_are_no_numbers(path):
    held = zarr.open_group(WritingStore(path), mode="r+")["joint_load"]
    values = held[:]
    values[2, 1, 4] = np.nan
    held[:] = values
    for read in each_reader(path):
        complain(read, "run.zarr", "joint_2", "0.2 s", "simulate again")


def test_one_sample_has_peaks_but_no_cycles(tmp_path):
    run = lw.simulate(lw.scenes.chain(3), times=[0.0], output=tmp_path / "one.zarr")
    assert float(lw.loads.summary(run).peak.sel(joint="joint_1", quantity="force")) > 0
    complain(lambda: lw.loads.damage_equivalent(run), "one sample", "every=")
