"""Loads by cause: the shares add up to rounding, and each is what it says."""

import numpy as np
import pytest

import linkwise as lw
from helpers.loaded_arm import arm
from helpers.machines import G, rod_chain
from helpers.random_trees import random_configuration


@pytest.mark.parametrize("by", ["force", "motion"])
def test_shares_add_up(swing, by):
    shares = lw.loads.split(swing, by)
    total = shares.sum("cause").transpose(*swing.joint_load.dims).values
    scale = np.abs(swing.joint_load.values).max()
    np.testing.assert_allclose(total, swing.joint_load.values, atol=1e-13 * scale)
    expected = {
        "force": ["gravity", "velocity", "drive", "motion", "passive", "external"],
        "motion": ["gravity", "velocity", "acceleration", "external"],
    }
    assert shares.cause.values.tolist() == expected[by]
    assert all(np.abs(shares.sel(cause=name)).max() > 1e-3 for name in expected[by])


@pytest.mark.parametrize("solver", ["thomas", "conjugate_gradient"])
def test_shares_add_up_whatever_solved(solver, rng):
    model = lw.scenes.chain(8, joint="spherical")
    run = lw.simulate(
        model,
        q0=random_configuration(model, rng),
        duration=0.3,
        every=0.1,
        method="constraint_force",
        solver=solver,
        tolerance=1e-7,
    )
    total = lw.loads.split(run).sum("cause").transpose(*run.joint_load.dims).values
    scale = np.abs(run.joint_load.values).max()
    np.testing.assert_allclose(total, run.joint_load.values, atol=1e-6 * scale)


def test_a_locked_cantilever_carries_its_weight_by_gravity_alone():
    model = rod_chain(4)
    locked = dict.fromkeys(model.joint_names, lw.Locked())
    run = lw.simulate(model, duration=0.1, every=0.05, drives=locked)
    for by in ("force", "motion"):
        shares = lw.loads.split(run, by).isel(time=-1)
        k = 4 - np.arange(4)
        np.testing.assert_allclose(shares.sel(cause="gravity", component="fy"), k * G, atol=1e-12)
        np.testing.assert_allclose(
            shares.sel(cause="gravity", component="nz"), k**2 * G / 2, atol=1e-12
        )
        others = shares.drop_sel(cause="gravity")
        np.testing.assert_allclose(others, 0, atol=1e-12)


def test_gravity_is_a_factor():
    model = arm()
    q, v, tau = np.array([0.3, -0.2, 0.1]), np.array([1.0, -2.0, 0.5]), np.ones(3)
    weightless = arm(gravity=(0, 0, 0))
    for gravity, other in ((1.0, model), (0.0, weightless)):
        a = lw.forward_dynamics(model, q, v, tau, gravity=gravity)
        np.testing.assert_allclose(a, lw.forward_dynamics(other, q, v, tau), rtol=1e-14)
        loads = lw.inverse_dynamics_loads(model, q, v, a, gravity=gravity)
        np.testing.assert_allclose(loads, lw.inverse_dynamics_loads(other, q, v, a), rtol=1e-13)


@pytest.mark.parametrize("method", ["articulated_body", "composite_rigid_body", "constraint_force"])
def test_hybrid_dynamics(method, rng):
    """Given accelerations of some joints and torques of the others, against inverse dynamics."""
    model = arm()
    free = model.prescribe(["shoulder", "wrist"])
    q, v, a = rng.normal(size=(3, 5, 3))
    tau = lw.inverse_dynamics(model, q, v, a)
    found = lw.forward_dynamics(free, q, v, tau, prescribed=a, method=method, full=True)
    np.testing.assert_allclose(found.acceleration, a, rtol=1e-9)
    loads = lw.inverse_dynamics_loads(model, q, v, a)
    np.testing.assert_allclose(found.joint_load, loads, atol=1e-9 * np.abs(loads).max())


def test_given_accelerations_need_given_joints():
    with pytest.raises(lw.InputError, match=r"use model.prescribe"):
        lw.forward_dynamics(arm(), np.zeros(3), None, prescribed=np.zeros(3))
    with pytest.raises(lw.InputError, match="elbw"):
        arm().prescribe(["elbw"])


@pytest.mark.parametrize(
    ("quantities", "missing"),
    [
        (["position"], "joint_load"),
        (["joint_load", "position", "velocity"], "drive_torque"),
        (["joint_load", "position", "velocity", "drive_torque"], "external_wrench"),
    ],
)
def test_a_run_that_lacks_something_says_what(quantities, missing):
    wrenches = {"hand": lw.Wrench([1, 0, 0, 0, 0, 0])}
    run = lw.simulate(arm(), duration=0.1, every=0.05, quantities=quantities, wrenches=wrenches)
    with pytest.raises(lw.InputError, match=f'record the quantity "{missing}"'):
        lw.loads.split(run)


def test_a_split_needs_all_joints():
    run = lw.simulate(arm(), duration=0.1, every=0.05, joints=["elbow"])
    with pytest.raises(lw.InputError, match="1 of 3 joints"):
        lw.loads.split(run)
