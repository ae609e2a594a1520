"""Wrenches at frames as the functions of a state take them: one row per body."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from linkwise._core import InputError, as_floats, joint_poses
from linkwise.base import Array
from linkwise.drives.drive import Wrench
from linkwise.io.complaint import shown

if TYPE_CHECKING:
    from linkwise._core import Frame, Model


def external_wrenches(
    model: Model, q: npt.ArrayLike, wrenches: Mapping[str | Frame, Wrench | npt.ArrayLike]
) -> Array:
    """Wrenches at frames of any links, for `external=` of functions such as `joint_loads`.

    Args:
        model: The machine.
        q: Positions (..., nq) [rad, m].
        wrenches: Per frame (a link's name, merged or not, or a `Frame`) force and moment (..., 6)
            [N, N m] along the world's axes, or a constant `Wrench`, which a `Frame` with axes of
            its own needs. Leading axes broadcast.

    Returns:
        (..., n_joints, 6) [N, N m]: the sum on each body, at and in its joint frame.

    Raises:
        InputError: a link is unknown or on the ground, shapes are wrong, or a number is not finite.
    """
    if not isinstance(wrenches, Mapping):
        raise InputError(f"wrenches: {shown(wrenches)} given; give a dictionary by frame")
    state = as_floats(q, "q")
    poses = joint_poses(model, state)
    bodies = {name: k for k, name in enumerate(model.child_link_names)}
    placed = [_on_body(model, poses, bodies, frame, wrench) for frame, wrench in wrenches.items()]
    lead = np.broadcast_shapes(poses.shape[:-3], *(force.shape[:-1] for _, force, _ in placed))
    total = np.zeros((*lead, model.n_joints, 6))
    for k, force, moment in placed:
        total[..., k, :3] += force
        total[..., k, 3:] += moment
    if not np.isfinite(total).all():
        raise InputError("wrenches: their sum at a joint is not finite; give smaller numbers")
    return total


def _on_body(
    model: Model, poses: Array, bodies: Mapping[str, int], frame: Any, wrench: Any
) -> tuple[int, Array, Array]:
    """The row of the body, and force and moment (..., 3) at and in its joint frame."""
    at, value = frame, wrench
    if isinstance(wrench, Wrench):
        at, value = wrench.where(frame), wrench.value
        if callable(value) or hasattr(value, "times"):
            raise InputError(f"wrenches[{str(frame)!r}]: is no constant; give six numbers")
    axes_of = wrench if isinstance(wrench, Wrench) else Wrench(np.zeros(6))
    along_world = axes_of.along_world(at)
    name = f"wrenches[{str(frame)!r}]"
    given = as_floats(value, name)
    if given.shape[-1:] != (6,) or not np.isfinite(given).all():
        raise InputError(f"{name}: shape {given.shape}; give finite numbers fx fy fz nx ny nz")
    body, axes, origin = model.frame_placement(at)
    if body is None:
        raise InputError(f"{name}: is fixed to the ground, where a wrench moves nothing")
    # Components of the wrench -> components in the joint frame.
    turn = np.swapaxes(poses[..., bodies[body], :3, :3], -1, -2) if along_world else axes
    with np.errstate(all="ignore"):  # the sum is looked at
        force = (turn @ given[..., :3, None])[..., 0]
        moment = (turn @ given[..., 3:, None])[..., 0] + np.cross(origin, force)
    return bodies[body], force, moment
