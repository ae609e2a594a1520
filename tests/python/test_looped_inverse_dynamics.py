"""Torques of driven joints that make a motion of a machine with closed loops."""

import numpy as np
import pytest

import linkwise as lw
from helpers.looped_machines import accelerations, chain, closed_rates, rows
from helpers.random_trees import random_configuration

#: Loops on a chain of nine links, and joints that determine its motion: as many as it can move.
CHAINS = [
    ([("spherical", "base", "link8")], 6),
    ([("fixed", "link1", "link8")], 3),
    ([("revolute", "base", "link6"), ("spherical", "link2", "link8")], 1),
]


def driven_chain(case, seed, **properties):
    loops, free = CHAINS[case]
    rng = np.random.default_rng(seed)
    while True:
        machine = chain(rng, loops, **properties)
        K = rows(machine, machine.q)
        if machine.tree.nv - np.linalg.matrix_rank(K) == free:
            break
    # Independent ones: pivots of the projection on motions that keep the loops closed.
    motions = np.linalg.svd(K)[2][len(K) :]
    P, driven = motions.T @ motions, []
    for _ in range(free):
        k = int(np.argmax(np.diag(P)))
        driven.append(k)
        P = P - np.outer(P[:, k], P[k]) / P[k, k]
    return machine, [f"joint{k}" for k in sorted(driven)], sorted(driven), rng


def a_motion(machine, rng):
    v = closed_rates(machine, rng)
    a, _ = accelerations(machine, v, rng.normal(size=machine.tree.nv) * 5, bias=True)
    return v, a


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("case", range(len(CHAINS)))
def test_torques_and_loads_balance_the_dense_system(case, seed):
    """K_p^T f = (H a + h)_p at the joints without drives gives f, and f the torques."""
    machine, names, driven, rng = driven_chain(case, seed)
    v, a = a_motion(machine, rng)
    tau = lw.inverse_dynamics(machine.model, machine.q, v, a, driven=names)
    whole = lw.inverse_dynamics(machine.tree, machine.q, v, a)
    K = rows(machine, machine.q)
    passive = np.setdiff1d(np.arange(machine.tree.nv), driven)
    f = np.linalg.lstsq(K[:, passive].T, whole[passive], rcond=1e-11)[0]
    want = np.zeros(machine.tree.nv)
    want[driven] = (whole - K.T @ f)[driven]
    scale = np.abs(whole).max()
    np.testing.assert_allclose(tau, want, rtol=0, atol=1e-6 * np.abs(want).max() + 1e-7 * scale)
    assert (tau[passive] == 0).all()


@pytest.mark.parametrize("case", range(len(CHAINS)))
def test_the_torques_make_the_motion(case):
    """Forward and back, with everything that may act: the loads are those of the same torques."""
    machine, names, _, rng = driven_chain(case, 7, damping=0.3, stiffness=2.0, armature=0.1)
    model, q = machine.model, machine.q
    v = closed_rates(machine, rng)
    acting = {"external": rng.normal(size=(model.n_joints, 6)), "passive": True}
    tau = np.zeros(model.nv)
    tau[[model.v_slice(name).start for name in names]] = rng.normal(size=len(names))
    a = lw.forward_dynamics(model, q, v, tau, **acting)
    got = lw.inverse_dynamics(model, q, v, a, driven=names, **acting)
    np.testing.assert_allclose(got, tau, rtol=0, atol=1e-9)
    loads = lw.inverse_dynamics_loads(model, q, v, a, driven=names, **acting)
    want = lw.joint_loads(model, q, v, tau, **acting)
    np.testing.assert_allclose(loads, want, rtol=0, atol=1e-9 * np.abs(want).max())
    both = lw.inverse_dynamics(model, [q, q], [v, v], [a, a], driven=names, **acting)
    np.testing.assert_array_equal(both, [got, got])


def test_power_of_the_drives_is_the_change_of_energy():
    """No force of a loop works: drives give what kinetic and potential energy take up."""
    machine, names, _, rng = driven_chain(2, 3)
    v, a = a_motion(machine, rng)
    tau = lw.inverse_dynamics(machine.model, machine.q, v, a, driven=names)
    weight = lw.inverse_dynamics(machine.tree, machine.q, None, None)
    moved = lw.inverse_dynamics(machine.tree, machine.q, v, a, gravity=0.0)
    assert tau @ v == pytest.approx((weight + moved) @ v, rel=1e-6)


def test_a_stewart_platform_needs_its_legs_alone():
    """Forces of six legs without mass hold the platform: J^T f = its weight."""
    machine = lw.scenes.benchmark("stewart")
    model, q = machine.model, machine.q0
    legs = [
        name
        for name, kind in zip(model.joint_names, model.joint_types, strict=True)
        if kind == "prismatic"
    ]
    found = lw.indeterminacy(model, q)
    assert len(legs) == found.mobility == 6
    tau = lw.inverse_dynamics(model, q, None, None, driven=legs)
    np.testing.assert_allclose(lw.forward_dynamics(model, q, None, tau), 0, atol=1e-9)


def test_given_motions_in_a_simulation_have_these_torques():
    """A motor table on the crank of a slider-crank: the run's torques are inverse dynamics."""
    machine = lw.scenes.benchmark("slider_crank")
    model = machine.model.with_payload(machine.model.link_names[-1], mass=3.0)
    crank = model.joint_names[0]
    start = machine.q0[model.q_slice(crank)][0]
    motion = lw.Motion(lambda t: (start + 2 * t + t * t, 2 + 2 * t, 2.0))
    v0 = lw.assemble(model, machine.q0, None).v.copy()
    v0[model.v_slice(crank)] = 2.0
    run = lw.simulate(
        model,
        duration=0.3,
        every=0.05,
        q0=machine.q0,
        v0=v0,
        drives={crank: motion},
        tolerance=1e-11,
    )
    q, v, a, torque = (
        run.dataset[name].transpose("time", ...).values
        for name in ("position", "velocity", "acceleration", "drive_torque")
    )
    tau = lw.inverse_dynamics(model, q, v, a, driven=[crank])
    assert np.abs(torque).max() > 0.1
    np.testing.assert_allclose(tau, torque, rtol=0, atol=1e-8 * np.abs(torque).max())


def test_what_cannot_be_is_said_in_one_line():
    machine, names, _, rng = driven_chain(2, 5)
    model, q = machine.model, machine.q
    v, a = a_motion(machine, rng)
    with pytest.raises(lw.InputError, match=r"depend on which joints drive it; give driven=\["):
        lw.inverse_dynamics(model, q, v, a)
    with pytest.raises(lw.InputError, match=r"accelerations open the loops; the nearest .* move j"):
        lw.inverse_dynamics(model, q, v, a + 0.1, driven=names)
    with pytest.raises(lw.InputError, match="cannot move by itself here"):
        lw.inverse_dynamics(model, q, v, a, driven=model.joint_names)
    with pytest.raises(lw.InputError, match="'loop0' closes a loop, and its torque is"):
        lw.inverse_dynamics(model, q, v, a, driven=["loop0"])
    with pytest.raises(lw.InputError, match="given twice"):
        lw.inverse_dynamics(model, q, v, a, driven=names * 2)
    with pytest.raises(lw.InputError, match="joint 'x' does not exist"):
        lw.inverse_dynamics(model, q, v, a, driven=["x"])
    with pytest.raises(lw.InputError, match=r"is prescribed; give the model before prescribe"):
        lw.inverse_dynamics(model.prescribe(names), q, v, a, driven=names)
    wide, few, _, rng = driven_chain(0, 5)
    v, a = a_motion(wide, rng)
    free = lw.forward_dynamics(wide.model, wide.q, v, None)
    with pytest.raises(lw.InputError, match=r"state 1: driven: these joints do not make this moti"):
        lw.inverse_dynamics(wide.model, wide.q, v, [free, a], driven=few[:-1])


def test_drives_of_a_tree_may_be_chosen_too(rng):
    """A tree that some joints move while the others swing freely."""
    tree = chain(rng, []).model
    q, v = random_configuration(tree, rng, ()), rng.normal(size=tree.nv)
    tau = np.zeros(tree.nv)
    tau[[1, 4]] = 3.0, -2.0
    a = lw.forward_dynamics(tree, q, v, tau)
    got = lw.inverse_dynamics(tree, q, v, a, driven=["joint1", "joint4"])
    np.testing.assert_allclose(got, tau, rtol=0, atol=1e-10)
    np.testing.assert_allclose(got, lw.inverse_dynamics(tree, q, v, a), rtol=0, atol=1e-9)
