"""MuJoCo's state vectors in linkwise's coordinates.

What differs: MuJoCo writes quaternions w, x, y, z and linkwise x, y, z, w; MuJoCo's hinge and
slide positions are ``ref`` in the pose drawn in the file, linkwise's are zero there; the linear
velocity of a MuJoCo free joint is along the world axes, linkwise's along the body's.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from linkwise._core import InputError, as_floats
from linkwise.base import Array
from linkwise.io.complaint import near, shorten
from linkwise.io.mjcf import KINDS, Names, compile_mjcf, keyframe_names, rotation
from linkwise.io.mjcf_limits import check_mjcf
from linkwise.io.xml import local_name, parse_xml

if TYPE_CHECKING:
    from linkwise._core import Model


def xyzw_from_wxyz(quaternion: npt.ArrayLike) -> Array:
    """Quaternions (..., 4) from MuJoCo's order to linkwise's."""
    return np.roll(as_floats(quaternion, "quaternion"), -1, axis=-1)


def position_from_mujoco(model: Model, mj_model: Any, qpos: npt.ArrayLike) -> Array:
    """linkwise's q (nq,) of MuJoCo's qpos (mj_model.nq,)."""
    source = vector_of(qpos, mj_model.nq, "qpos")
    q = np.array(model.neutral_configuration(), dtype=float)
    for name, kind, theirs, _ in joints_of(mj_model):
        ours = model.q_slice(name)
        values = source[theirs]
        if kind == "floating":
            q[ours] = [*values[:3], *xyzw_from_wxyz(values[3:])]
        elif kind == "spherical":
            q[ours] = xyzw_from_wxyz(values)
        else:
            q[ours] = values - mj_model.qpos0[theirs]
    return q


def velocity_from_mujoco(
    model: Model, mj_model: Any, qpos: npt.ArrayLike, qvel: npt.ArrayLike
) -> Array:
    """linkwise's v (nv,) of MuJoCo's qvel (mj_model.nv,) at qpos."""
    positions, source = vector_of(qpos, mj_model.nq, "qpos"), vector_of(qvel, mj_model.nv, "qvel")
    v = np.zeros(model.nv)
    for name, kind, where, theirs in joints_of(mj_model):
        values = source[theirs].copy()
        if kind == "floating":
            values[:3] = rotation(positions[where][3:]).T @ values[:3]
        v[model.v_slice(name)] = values
    return v


def acceleration_from_mujoco(
    model: Model,
    mj_model: Any,
    qpos: npt.ArrayLike,
    qvel: npt.ArrayLike,
    qacc: npt.ArrayLike,
) -> Array:
    """linkwise's dv/dt (nv,) of MuJoCo's qacc (mj_model.nv,) at qpos, qvel.

    The body's axes turn under a free joint's linear velocity: d(R'v)/dt = R'a - w x R'v.
    """
    a = velocity_from_mujoco(model, mj_model, qpos, qacc)
    v = velocity_from_mujoco(model, mj_model, qpos, qvel)
    for name, kind, *_ in joints_of(mj_model):
        if kind == "floating":
            first = model.v_slice(name).start
            linear, angular = v[first : first + 3], v[first + 3 : first + 6]
            a[first : first + 3] -= np.cross(angular, linear)
    return a


def read_keyframe(
    model: Model, path: str | os.PathLike[str], key: str | int
) -> tuple[Array, Array]:
    """q (nq,) and v (nv,) of a <key> of the MJCF file from which ``model`` was loaded.

    key: its name, or its number from 0. Raises InputError where the file has no such keyframe, or
    one that moves mocap bodies, which are fixed here. Its time, activations and controls are
    ignored, for so are the actuators.
    """
    root = parse_xml(path)
    if local_name(root) != "mujoco":
        raise InputError("only an MJCF file has keyframes; remove it")
    check_mjcf(path, root)
    mj_model = compile_mjcf(path)
    names = keyframe_names(mj_model)
    if str(key) not in names:
        remedy = near(str(key), names, "the keyframes are")
        raise InputError(f"the file has no keyframe '{shorten(key)}'; {remedy}")
    index = names.index(str(key))
    drawn = mj_model.body_mocapid >= 0
    moved = mj_model.key_mpos[index].reshape(-1, 3) - mj_model.body_pos[drawn]
    if moved.any() or (mj_model.key_mquat[index].reshape(-1, 4) - mj_model.body_quat[drawn]).any():
        raise InputError(
            f"keyframe '{shorten(key)}' moves mocap bodies, which are fixed here; draw them there"
        )
    qpos = np.array(mj_model.key_qpos[index])
    for _, kind, where, _ in joints_of(mj_model):  # written with a few digits
        if kind in ("floating", "spherical"):
            qpos[where][-4:] /= np.linalg.norm(qpos[where][-4:])
    q = position_from_mujoco(model, mj_model, qpos)
    return q, velocity_from_mujoco(model, mj_model, qpos, mj_model.key_qvel[index])


def joints_of(mj_model: Any) -> Iterator[tuple[str, str, slice, slice]]:
    """Name, type, part of qpos and part of qvel of each joint."""
    for joint, name in enumerate(Names(mj_model).joint):
        kind = int(mj_model.jnt_type[joint])
        q, v = int(mj_model.jnt_qposadr[joint]), int(mj_model.jnt_dofadr[joint])
        nq, nv = (7, 4, 1, 1)[kind], (6, 3, 1, 1)[kind]
        yield name, KINDS[kind], slice(q, q + nq), slice(v, v + nv)


def vector_of(values: npt.ArrayLike, size: int, name: str) -> Array:
    array = as_floats(values, name)
    if array.shape != (size,):
        raise InputError(f"{name}: expected shape ({size},), given shape {array.shape}")
    return array
