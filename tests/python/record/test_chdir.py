"""Relative paths mean the folder of the call, whatever the process changes it to meanwhile."""

import os

import numpy as np
import pytest

import linkwise as lw


@pytest.fixture
def folders(tmp_path, monkeypatch):
    for name in ("here", "there"):
        (tmp_path / name).mkdir()
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path


def test_a_run_goes_where_it_was_meant_to(folders):
    def drive(t, q, v):
        os.chdir(folders / "there")
        return 0.0

    run = lw.simulate(
        lw.scenes.chain(3), duration=1, output="run.zarr", drives={"joint_1": drive}, q0=[1, 0, 0]
    )
    assert os.getcwd() == str(folders / "there")
    assert os.listdir(folders / "there") == []
    assert run.path == folders / "here" / "run.zarr"
    again = lw.open_run(folders / "here" / "run.zarr")
    assert again.outcome == "converged"
    np.testing.assert_array_equal(again.position, run.position)
    assert again.sizes["time"] == 1001


def test_an_opened_run_stays_readable(folders):
    lw.simulate(lw.scenes.chain(2), duration=0.1, output="run.zarr")
    run = lw.open_run("run.zarr")
    os.chdir(folders / "there")
    assert run.joint_load.shape == (1001, 2, 6)
    assert run.load_model().n_joints == 2
    os.mkdir("out")
    assert lw.Run(run.dataset, "out").path == folders / "there" / "out"


def test_a_scenario_finds_its_files(folders):
    (folders / "here" / "t.csv").write_text("t,joint_1\n0,1\n1,1\n")
    (folders / "here" / "s.toml").write_text(
        '[model.chain]\nn_bodies = 2\n[drive.joint_1]\nkind = "torque"\ntable = "t.csv"\n'
        '[simulate]\nduration = 0.1\n[output]\npath = "run.zarr"\n'
    )
    scenario = lw.load_scenario("s.toml")
    os.chdir(folders / "there")
    run = lw.run_scenario(scenario)
    assert run.path == folders / "here" / "run.zarr"
    assert os.listdir(folders / "there") == []
