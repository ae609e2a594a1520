"""What a motion of any tree conserves: energy when nothing drives it, momentum when it floats.

A tolerance bounds the error of one step; over the hundreds of steps of 10 s the errors add up. So
the runs are made at a tenth of TOLERANCE, and the drift must stay below 10 TOLERANCE.
"""

import numpy as np
from hypothesis import given, settings

import linkwise as lw
from helpers.motion import simulate
from helpers.random_trees import JOINT_TYPES, random_configuration, trees

TOLERANCE = 1e-6
# A free screw in gravity turns ever faster, hundreds of turns in 10 s: no motion to measure drift.
SWINGING = tuple(kind for kind in JOINT_TYPES if kind != "helical")


def start(tree, model):
    rng = tree.rng()
    return random_configuration(model, rng), 0.5 * rng.standard_normal(model.nv)


def energy_unit(model, q, v):
    """Energy that states off by one unit of the error weights 1 + |y| would have too much [J]."""
    force = np.abs(lw.inverse_dynamics(model, q, 0 * v, 0 * v))
    momentum = np.abs(np.einsum("kij,kj->ki", lw.mass_matrix(model, q), v))
    reach = 1 + np.abs(q).max(axis=-1, keepdims=True)
    return (force * reach + momentum * (1 + np.abs(v))).sum(axis=-1).max()


@settings(max_examples=20)
@given(trees(max_joints=4, types=SWINGING))
def test_undriven_undamped_trees_keep_their_energy(tree):
    model = tree.build()
    q0, v0 = start(tree, model)
    _, q, v = simulate(model, 10.0, q0=q0, v0=v0, every=0.1, tolerance=TOLERANCE / 10)
    energy = lw.kinetic_energy(model, q, v) + lw.potential_energy(model, q)
    drift = np.abs(energy - energy[0]).max()
    assert drift < 10 * TOLERANCE * energy_unit(model, q, v)


@settings(max_examples=20)
@given(trees(max_joints=5, floating_base=True, gravity=(0, 0, 0)))
def test_floating_trees_keep_their_momentum(tree):
    """Dashpots in all inner joints: what joints do to each other, the whole does not feel."""
    model = tree.build()
    q0, v0 = start(tree, model)
    dashpots = {name: lw.Torque(lambda t, q, v: -0.1 * v) for name in model.joint_names[1:]}
    run = {"q0": q0, "v0": v0, "every": 0.1, "tolerance": TOLERANCE / 10, "drives": dashpots}
    _, q, v = simulate(model, 3.0, **run)
    momentum = lw.momentum(model, q, v)
    # Scale: the momentum that the kinetic energy could hold, at the farthest body's distance.
    size = np.sqrt(2 * model.total_mass * lw.kinetic_energy(model, q, v).max())
    reach = 1 + np.abs(lw.body_poses(model, q)[..., :3, 3]).max()
    drift = np.abs(momentum - momentum[0]).max(axis=0)
    assert drift[:3].max() < 10 * TOLERANCE * size
    assert drift[3:].max() < 10 * TOLERANCE * size * reach
