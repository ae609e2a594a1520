"""MuJoCo's states of linkwise's: the way back from linkwise.io.mjcf_state."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

import linkwise as lw
from linkwise.base import Array
from linkwise.io.mjcf import rotation
from linkwise.io.mjcf_state import joints_of, vector_of


def wxyz_from_xyzw(quaternion: npt.ArrayLike) -> Array:
    """Quaternions (..., 4) from linkwise's order to MuJoCo's."""
    return np.roll(quaternion, 1, axis=-1)


def position_to_mujoco(model: lw.Model, mj_model: Any, q: npt.ArrayLike) -> Array:
    """MuJoCo's qpos (mj_model.nq,) of linkwise's q (nq,)."""
    source = vector_of(q, model.nq, "q")
    qpos = np.array(mj_model.qpos0, dtype=float)
    for name, kind, theirs, _ in joints_of(mj_model):
        values = source[model.q_slice(name)]
        if kind == "floating":
            qpos[theirs] = [*values[:3], *wxyz_from_xyzw(values[3:])]
        elif kind == "spherical":
            qpos[theirs] = wxyz_from_xyzw(values)
        else:
            qpos[theirs] = values + mj_model.qpos0[theirs]
    return qpos


def velocity_to_mujoco(
    model: lw.Model, mj_model: Any, qpos: npt.ArrayLike, v: npt.ArrayLike
) -> Array:
    """MuJoCo's qvel (mj_model.nv,) of linkwise's v (nv,), with the position as MuJoCo's qpos."""
    positions, source = vector_of(qpos, mj_model.nq, "qpos"), vector_of(v, model.nv, "v")
    qvel = np.zeros(mj_model.nv)
    for name, kind, where, theirs in joints_of(mj_model):
        values = source[model.v_slice(name)].copy()
        if kind == "floating":
            values[:3] = rotation(positions[where][3:]) @ values[:3]
        qvel[theirs] = values
    return qvel
