"""Loads of closed loops by what their motion needs of the joints that drive it."""

import numpy as np
import pytest
from test_loop_drives import four_bar, simulate_both

import linkwise as lw

PLANAR = [0, 1, 5]
SWING = lw.Motion(lambda t: (0.3 * np.sin(2 * t), 0.6 * np.cos(2 * t), -1.2 * np.sin(2 * t)))
DRIVES = {
    "torque": {"a": 4.0},
    "pd where the loop is cut": {"c": lw.PD(kp=30.0, kd=0.5, target=0.4)},
    "motion where the loop is cut": {"c": SWING},
    "locked": {"d": lw.Locked()},
}


@pytest.mark.parametrize("kind", DRIVES)
def test_shares_add_up_and_are_the_same_wherever_the_loop_is_cut(kind):
    properties = {"a": {"damping": 0.4}, "c": {"armature": 0.3, "damping": 0.2}}
    runs = simulate_both(DRIVES[kind], properties=properties)
    shares = [lw.loads.split(run, "motion") for run in runs]
    for run, share in zip(runs, shares, strict=True):
        total = share.sum("cause", skipna=False).values
        np.testing.assert_allclose(total, run.joint_load.values, atol=1e-7 * np.abs(total).max())
    names = ["gravity", "velocity", "acceleration", "passive"]
    for name in "abcd":
        one, other = (x.sel(joint=name, cause=names).values[..., PLANAR] for x in shares)
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-5 * (1 + np.abs(one).max()))
    if kind != "locked":
        assert np.abs(shares[0].values).max(axis=(0, 2, 3)).min() > 0.01  # every cause counts
    peaks = lw.loads.split_at_peaks(runs[0], "motion")
    np.testing.assert_allclose(peaks.share.sum("cause"), peaks.total, rtol=1e-8)


@pytest.mark.parametrize("cut", "cd")
def test_a_crank_at_constant_speed_accelerates_nothing(cut):
    """What belongs to the crank's acceleration is zero, though all other joints speed up."""
    turn = lw.Motion(lambda t: (3 * t, 3.0, 0.0))
    run = lw.simulate(four_bar(cut), duration=0.4, every=0.05, drives={"a": turn}, tolerance=1e-10)
    shares = lw.loads.split(run, "motion")
    scale = np.abs(shares.values).max()
    assert np.abs(shares.sel(cause="acceleration").values).max() < 1e-9 * scale
    assert np.abs(shares.sel(cause="velocity").values).max() > 0.1 * scale
    assert np.abs(run.acceleration.values).max() > 1


def test_gravity_is_what_the_driven_joint_holds_at_rest():
    run = simulate_both({"a": 4.0})[0]
    model, q = run.load_model(), run.position.values
    share = lw.loads.split(run, "motion").sel(cause="gravity").values
    for k in range(len(q)):
        tau = lw.inverse_dynamics(model, q[k], None, None, driven=["a"])
        held = lw.joint_loads(model, q[k], None, tau)
        np.testing.assert_allclose(share[k], held, rtol=0, atol=1e-9 * np.abs(held).max())


def test_gears_split_too():
    """Two wheels of one gear: the driven one carries what both need, by the ratio."""
    builder = lw.ModelBuilder("gear", gravity=(0, 0, 0))
    builder.add_link("frame", mass=0)
    for name, inertia in (("small", 0.1), ("large", 0.8)):
        builder.add_link(name, mass=1, inertia=np.diag([1, 1, inertia]))
        builder.add_joint(name, "revolute", "frame", name, axis=(0, 0, 1), damping=0.05)
    builder.add_coupling("gear", {"small": 1, "large": -2})
    run = lw.simulate(builder.build(), duration=0.5, every=0.1, drives={"small": 0.7})
    shares = lw.loads.split(run, "motion")
    assert shares.cause.values.tolist() == ["velocity", "acceleration", "passive"]
    speeding = run.acceleration.values[:, run.load_model().joint_index("small")]
    of_small = shares.sel(joint="small", cause="acceleration", component="nz").values
    np.testing.assert_allclose(of_small, 0.1 * speeding, rtol=1e-9)
    total = shares.sum("cause").values
    np.testing.assert_allclose(total, run.joint_load.values, atol=1e-9)


def test_a_drive_that_is_not_named_is_told():
    run = simulate_both({"a": 4.0, "c": 1.0})[0]
    with pytest.raises(lw.InputError, match="joint 'c' has a drive in this run"):
        lw.loads.split(run, "motion", driven=["a"])
    with pytest.raises(lw.InputError, match="cannot move by itself here"):
        lw.loads.split(run, "motion")


def test_dead_points_have_no_shares():
    """A slider that drives its crank says nothing where both are in line."""
    builder = lw.ModelBuilder("slider-crank", gravity=(0, -9.81, 0))
    builder.add_link("base", mass=0)
    for name, length in (("crank", 0.2), ("rod", 0.5)):
        builder.add_link(name, mass=1, com=(length / 2, 0, 0), inertia=np.diag([0.01, 0.02, 0.02]))
    builder.add_link("slider", mass=1, inertia=0.1 * np.eye(3))
    builder.add_joint("crank", "revolute", "base", "crank", axis=(0, 0, 1))
    builder.add_joint("rod", "revolute", "crank", "rod", translation=(0.2, 0, 0), axis=(0, 0, 1))
    builder.add_joint("slider", "prismatic", "base", "slider", axis=(1, 0, 0))
    builder.add_loop("pin", "revolute", "rod", "slider", translation=(0.5, 0, 0), axis=(0, 0, 1))
    model = builder.build()
    q0 = model.neutral_configuration()
    q0[model.q_slice("slider")] = 0.7
    v0 = np.zeros(3)
    v0[model.v_slice("crank")], v0[model.v_slice("rod")] = 2.0, -2.0 * 0.7 / 0.5
    run = lw.simulate(model, duration=0.4, every=0.1, q0=q0, v0=v0)
    shares = lw.loads.split(run, "motion", driven=["slider"])
    assert np.isnan(shares.values[0]).all()
    assert np.isfinite(shares.values[1:]).all()
    whole = lw.loads.split(run, "motion", driven=["crank"])
    assert np.isfinite(whole.values).all()
