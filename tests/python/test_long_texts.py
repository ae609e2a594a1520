"""Texts of thousands of letters come back shortened, and names too long for files are refused."""

import pytest

import linkwise as lw
from fuzz.judge import LONGEST_LINE

LONG = "a" * 5000
MODEL = lw.scenes.chain(2)


@pytest.fixture(scope="module")
def run():
    return lw.simulate(MODEL, duration=0.01, every=0.005)


CALLS = {
    "open_run": lambda run: lw.open_run(LONG),
    "load": lambda run: lw.load(LONG),
    "packages": lambda run: lw.load("tests/data/arm.urdf", package_dirs=[LONG]),
    "scenario": lambda run: lw.load_scenario(LONG),
    "table": lambda run: lw.Table.from_csv(LONG, "x"),
    "to_csv": lambda run: run.to_csv(LONG),
    "to_csv file": lambda run: run.to_csv(f"{LONG}/x.csv", "joint_load"),
    "output": lambda run: lw.simulate(MODEL, duration=0.01, output=LONG),
    "output below": lambda run: lw.simulate(MODEL, duration=0.01, output=f"{LONG}/x.zarr"),
    "integrator": lambda run: lw.simulate(MODEL, duration=0.01, integrator=LONG),
    "method": lambda run: lw.simulate(MODEL, duration=0.01, method=LONG),
    "batch": lambda run: lw.simulate_batch(MODEL, duration=0.01, step=0.01, integrator=LONG),
    "record": lambda run: lw.simulate(MODEL, duration=0.01, record=[LONG]),
    "extremes": lambda run: lw.simulate(MODEL, duration=0.01, record=lw.Recording(extremes=LONG)),
    "drives": lambda run: lw.simulate(MODEL, duration=0.01, drives={LONG: lw.Torque(1)}),
    "wrenches": lambda run: lw.simulate(MODEL, duration=0.01, wrenches={LONG: lw.Wrench([0] * 6)}),
    "frame": lambda run: lw.loads.in_frame(run, LONG),
    "rating": lambda run: lw.loads.margins(run, {LONG: lw.loads.Rating(force=1)}),
    "rating value": lambda run: lw.loads.margins(run, {"joint_1": {"force": LONG}}),
    "cycles": lambda run: lw.loads.cycles(run, LONG, "nx"),
    "bodies": lambda run: lw.scenes.chain(10**4000),
}


@pytest.mark.parametrize("name", CALLS)
def test_one_line_of_bounded_length(name, run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(lw.InputError) as caught:
        CALLS[name](run)
    of_paths = 2 * len(LONG) if name.startswith(("o", "t")) else 0  # these are told whole
    assert len(str(caught.value)) < LONGEST_LINE + of_paths
    assert "\n" not in str(caught.value)
