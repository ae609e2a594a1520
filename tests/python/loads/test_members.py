"""Functions of runs take batches and sweeps: they are those of the members, put together."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import linkwise as lw
from helpers.loaded_arm import arm, profile

DRIVES = {"shoulder": lw.Motion(profile(0.8, 1.0)), "elbow": 3.0}
OPTIONS = {"step": 5e-3, "duration": 0.5, "every": 0.05, "drives": DRIVES}
Q0 = np.array([[0, 0.3, 0.25], [0, -0.2, 0.1]])

FUNCTIONS = {
    "summary": lw.loads.summary,
    "envelope": lambda run, model: lw.loads.envelope(run),
    "peak_loads": lambda run, model: lw.loads.peak_loads(run),
    "quantities": lw.loads.quantities,
    "in_frame": lambda run, model: lw.loads.in_frame(run, "world", model=model),
    "split": lambda run, model: lw.loads.split(run, "force", model),
    "split_at_peaks": lambda run, model: lw.loads.split_at_peaks(run, "motion", model),
    "energy_balance": lw.loads.energy_balance,
    "damage_equivalent": lambda run, model: lw.loads.damage_equivalent(run, repetitions=1),
}


@pytest.fixture(scope="module")
def batch():
    return lw.simulate_batch(arm(), q0=Q0, **OPTIONS)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_each_member_has_what_it_has_alone(batch, name):
    found = FUNCTIONS[name](batch, arm())
    assert found.sizes["member"] == 2
    for k, q0 in enumerate(Q0):
        run = lw.simulate(arm(), q0=q0, integrator="runge_kutta_4", **OPTIONS)
        own = FUNCTIONS[name](run, None if name != "energy_balance" else arm())
        one = found.isel(member=k).drop_vars(["outcome", "stop_time", "stop_joint", "message"])
        xr.testing.assert_allclose(one, own, rtol=1e-8, atol=1e-7)


def test_shares_of_a_batch_add_up(batch):
    """Drives, given motions and constant torques of members are told by the batch."""
    pushed = lw.simulate_batch(arm(), q0=Q0, tau=[[0, 1.0, 0.5], [0, -2.0, 0.0]], **OPTIONS)
    for made in (batch, pushed):
        total = lw.loads.split(made, "force", arm()).sum("cause")
        scale = float(np.abs(made.joint_load).max())
        np.testing.assert_allclose(total, made.joint_load, atol=1e-9 * scale)
    wrenched = lw.simulate_batch(arm(), q0=Q0, wrenches={"hand": lw.Wrench([1] * 6)}, **OPTIONS)
    with pytest.raises(lw.InputError, match="member 0: run holds no external_wrench"):
        lw.loads.split(wrenched, "force", arm())


def test_machines_of_members():
    models = [arm(), arm().with_payload("hand", mass=3.0)]
    batch = lw.simulate_batch(models, q0=Q0, **OPTIONS)
    with pytest.raises(lw.InputError, match="members are of different machines; give the 2 of"):
        lw.loads.split(batch, "force", models[0])
    with pytest.raises(lw.InputError, match="give a Model, or the 2 of the members along 'model'"):
        lw.loads.split(batch, "force", [models[0]])
    found = lw.loads.split(batch, "motion", models)
    assert found.dims[:2] == ("model", "member")
    scale = float(np.abs(batch.joint_load).max())
    np.testing.assert_allclose(found.sum("cause"), batch.joint_load, atol=1e-9 * scale)
    with pytest.raises(lw.InputError, match="members do not hold their machine; give model="):
        lw.loads.split(batch)
    peaks = lw.loads.peak_loads(batch)
    assert peaks.force.dims == ("model", "member", "joint")
    assert (peaks.force[1] > peaks.force[0]).all()


def test_members_that_end_early():
    """What is after a member's end is NaN; a member without samples has NaN for a result."""
    still = np.zeros((3, 3))
    still[1, 1] = 1e9
    batch = lw.simulate_batch(arm(), v0=still, step=0.05, duration=1.0, every=0.1)
    assert batch.outcome.values.tolist() != ["converged"] * 3
    found = lw.loads.peak_loads(batch)
    assert np.isfinite(found.force.isel(member=[0, 2])).all()
    np.testing.assert_array_equal(found.force[0], found.force[2])
    assert found.outcome.values.tolist() == batch.outcome.values.tolist()
    over_time = lw.loads.quantities(batch, arm())
    assert over_time.force.shape == (3, 11, 3)
    there = np.isfinite(batch.joint_load[1]).all(("joint", "component"))
    np.testing.assert_array_equal(np.isfinite(over_time.force[1]).all("joint"), there)


def test_a_sweep_and_its_margins():
    scenario = lw.load_scenario(HOIST)
    found = lw.sweep(scenario, {"payload.box": BOXES}, processes=1)
    assert "extreme_quantity" in found
    peaks = lw.loads.summary(found, [scenario.load_model()] * 2)
    assert peaks.peak.dims[0] == "member"
    margins = lw.loads.margins(peaks, {"arm": lw.loads.Rating(force=1e4)})
    use = margins.use.sel(quantity="force", joint="arm")
    np.testing.assert_allclose(use, peaks.peak.sel(quantity="force", joint="arm") / 1e4)
    assert float(use[1]) > float(use[0])


HOIST = Path(__file__).parents[3] / "examples/data/hoist.toml"
BOXES = [{"link": "arm_link", "mass": mass} for mass in (0.5, 50.0)]


def test_what_takes_one_run_says_so(batch):
    for use in (
        lambda run: lw.loads.cycles(run, "elbow", "fx"),
        lambda run: lw.loads.spectrum(run, "elbow", "fx"),
        lw.loads.bounds,
    ):
        with pytest.raises(lw.InputError, match=r"is a Dataset; this takes a linkwise\.Run\. One"):
            use(batch)
