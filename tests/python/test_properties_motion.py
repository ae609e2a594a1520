"""What a motion of any tree conserves: energy when nothing drives it, momentum when it floats."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings

import linkwise as lw
from helpers.motion import simulate
from helpers.random_trees import random_configuration, trees

TOLERANCE = 1e-6
# N m/rad. A screw falls ever faster, up to 120 turns of a hundred steps in 10 s, and each adds to
# the drift: one free screw in 500 drifts further. On a spring it swings, as hinges do.
SCREW_SPRING = 1.0


def with_screws_on_springs(tree):
    return replace(
        tree,
        joints=tuple(
            replace(joint, options=joint.options | {"stiffness": SCREW_SPRING})
            if joint.type == "helical"
            else joint
            for joint in tree.joints
        ),
    )


def start(tree, model):
    rng = tree.rng()
    return random_configuration(model, rng), 0.5 * rng.standard_normal(model.nv)


def energy_unit(model, q, v):
    """Energy that states off by one unit of the error weights 1 + |y| would have too much [J]."""
    force = np.abs(lw.inverse_dynamics(model, q, 0 * v, 0 * v))
    momentum = np.abs(np.einsum("kij,kj->ki", lw.mass_matrix(model, q), v))
    reach = 1 + np.abs(q).max(axis=-1, keepdims=True)
    return (force * reach + momentum * (1 + np.abs(v))).sum(axis=-1).max()


@settings(max_examples=100)
@given(trees(max_joints=4))
def test_undriven_undamped_trees_keep_their_energy(tree):
    model = with_screws_on_springs(tree).build()
    q0, v0 = start(tree, model)
    _, q, v = simulate(model, 10.0, q0=q0, v0=v0, every=0.1, tolerance=TOLERANCE)
    energy = lw.kinetic_energy(model, q, v) + lw.potential_energy(model, q)
    drift = np.abs(energy - energy[0]).max()
    assert drift < 10 * TOLERANCE * energy_unit(model, q, v)


@settings(max_examples=20)
@given(trees(max_joints=5, floating_base=True, gravity=(0, 0, 0)))
def test_floating_trees_keep_their_momentum(tree):
    """Dashpots in all inner joints: forces between bodies do not change the momentum of the
    whole."""
    model = tree.build()
    q0, v0 = start(tree, model)
    dashpots = {name: lw.Torque(lambda t, q, v: -0.1 * v) for name in model.joint_names[1:]}
    run = {"q0": q0, "v0": v0, "every": 0.1, "tolerance": TOLERANCE, "drives": dashpots}
    _, q, v = simulate(model, 3.0, **run)
    momentum = lw.momentum(model, q, v)
    # Scale: the momentum that the kinetic energy could hold, at the farthest body's distance.
    size = np.sqrt(2 * model.total_mass * lw.kinetic_energy(model, q, v).max())
    reach = 1 + np.abs(lw.joint_poses(model, q)[..., :3, 3]).max()
    drift = np.abs(momentum - momentum[0]).max(axis=0)
    assert drift[:3].max() < 10 * TOLERANCE * size
    assert drift[3:].max() < 10 * TOLERANCE * size * reach
