"""Floating bases as each engine describes them: the layouts of q and v, and accelerations back.

Engines whose velocities are those of the base's frame in world axes measure dv/dt of exactly these
components, so with R the base's rotation and (v, w) its velocity in its own axes
    d(R v)/dt = R (dv/dt + w x v),   d(R w)/dt = R dw/dt.
"""

from __future__ import annotations

import numpy as np

from benchmarks.machine import Array, States


def rotations(quaternions: Array) -> Array:
    """(n, 3, 3) from quaternions (x, y, z, w)."""
    x, y, z, w = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _turn(R: Array, vectors: Array) -> Array:
    turned: Array = np.einsum("nij,nj->ni", R, vectors)
    return turned


def to_mujoco(states: States) -> States:
    """Quaternion (w, x, y, z); linear velocity in world axes, angular in the base's."""
    q, v = states.q.copy(), states.v.copy()
    q[:, 3:7] = np.roll(states.q[:, 3:7], 1, axis=1)
    v[:, :3] = _turn(rotations(states.q[:, 3:7]), states.v[:, :3])
    return States(q, v, states.tau)


def from_mujoco(states: States, accelerations: Array) -> Array:
    """``states`` in our own coordinates."""
    R = rotations(states.q[:, 3:7])
    out = accelerations.copy()
    out[:, :3] = _turn(R.transpose(0, 2, 1), accelerations[:, :3])
    out[:, :3] -= np.cross(states.v[:, 3:6], states.v[:, :3])
    return out


def to_drake(states: States) -> States:
    """Quaternion (w, x, y, z), then position; angular velocity, then linear, both in world axes."""
    R = rotations(states.q[:, 3:7])
    q, v = states.q.copy(), states.v.copy()
    q[:, :4] = np.roll(states.q[:, 3:7], 1, axis=1)
    q[:, 4:7] = states.q[:, :3]
    v[:, :3] = _turn(R, states.v[:, 3:6])
    v[:, 3:6] = _turn(R, states.v[:, :3])
    return States(q, v, states.tau)


def from_drake(states: States, accelerations: Array) -> Array:
    back = rotations(states.q[:, 3:7]).transpose(0, 2, 1)
    out = accelerations.copy()
    out[:, :3] = _turn(back, accelerations[:, 3:6])
    out[:, :3] -= np.cross(states.v[:, 3:6], states.v[:, :3])
    out[:, 3:6] = _turn(back, accelerations[:, :3])
    return out


def to_dart(states: States) -> States:
    """Rotation vector, then position; velocities as Drake's."""
    from scipy.spatial.transform import Rotation

    q = states.q[:, 1:].copy()
    q[:, :3] = Rotation.from_quat(states.q[:, 3:7]).as_rotvec()
    q[:, 3:6] = states.q[:, :3]
    return States(q, to_drake(states).v, states.tau)


from_dart = from_drake
