"""Joint loads in other axes and about other points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt

from linkwise import _core
from linkwise._core import InputError, as_floats
from linkwise.base import Array
from linkwise.loads.samples import joint_names, model_of, need_whole, rows

if TYPE_CHECKING:
    import xarray as xr

    from linkwise._core import Model
    from linkwise.loads.samples import RunLike

Frame = Literal["child", "parent", "world"]
_AXES = {
    "child": "joint frame, fixed in the outboard body",
    "parent": "frame of the inboard body: its own joint's; at the ground the world's",
    "world": "world frame",
}


def _frames(model: Model, q: Array) -> tuple[Array, Array]:
    """Poses (time, joint, 4, 4) of the joints' frames and of their inboard bodies' frames."""
    child = _core.joint_poses(model, q)
    inboard = np.asarray(model.joint_parents)
    parent = child[:, np.maximum(inboard, 0)]
    parent[:, inboard < 0] = np.eye(4)
    return child, parent


def _turned(load: Array, rotation: Array) -> Array:
    """Loads (..., 6) whose axes are turned: rotation (..., 3, 3) @ each half."""
    halves = load.reshape((*load.shape[:-1], 2, 3))
    turned: Array = np.einsum("...ik,...hk->...hi", rotation, halves)
    return turned.reshape(load.shape)


def move_wrench(load: Array, origin: Array, point: Array) -> Array:
    """The wrench (..., 6) at `origin`, about `point`; all in the same axes."""
    moved = load.copy()
    moved[..., 3:] += np.cross(origin - point, load[..., :3])
    return moved


def in_frame(
    run: RunLike,
    frame: Frame = "world",
    *,
    point: npt.ArrayLike | None = None,
    fixed_in: Frame = "child",
    model: Model | None = None,
) -> xr.DataArray:
    """Joint loads in the axes of another frame, about any point of either body.

    Args:
        run: Holds `joint_load` and `position` of all joints.
        frame: Axes of the components: "child" (the joint frame), "parent" or "world".
        point: Where moments are taken about, as coordinates (3,) or (joint, 3) [m] in the frame
            `fixed_in`; the joint point by default.
        fixed_in: The frame that the point is fixed in.
        model: The machine, if the run does not hold it.

    Returns:
        DataArray (time, joint, component); `attrs` state frame, point and convention.
    """
    for name in (frame, fixed_in):
        if name not in _AXES:
            raise InputError(f"frame: {name!r} is unknown; use {', '.join(_AXES)}")
    machine = model_of(run, model)
    need_whole(run, machine, "joint_load", "position")
    q = rows(run, "position", slice(None))
    load = rows(run, "joint_load", slice(None))
    child, parent = _frames(machine, q)
    where = "joint point: the origin of the joint frame"
    world = _turned(load, child[..., :3, :3])
    if point is not None:
        given = as_floats(point, "point")
        if given.shape not in ((3,), (machine.n_joints, 3)) or not np.isfinite(given).all():
            raise InputError(
                f"point: shape {given.shape}; give three finite coordinates in metres, or one row "
                f"per joint ({machine.n_joints}, 3)"
            )
        pose = {"child": child, "parent": parent}.get(fixed_in, np.eye(4))
        at = pose[..., :3, 3] + np.einsum(
            "...ik,...k->...i", pose[..., :3, :3], np.broadcast_to(given, (machine.n_joints, 3))
        )
        world = move_wrench(world, child[..., :3, 3], at)
        shown = (
            "given per joint"
            if given.ndim == 2
            else "(" + ", ".join(f"{x:g}" for x in given) + ") m"
        )
        where = f"{shown} in the {_AXES[fixed_in]}"
    if frame == "child":
        load = _turned(world, np.swapaxes(child[..., :3, :3], -1, -2))
    elif frame == "parent":
        load = _turned(world, np.swapaxes(parent[..., :3, :3], -1, -2))
    else:
        load = world
    return _labelled(run, load, {"frame": _AXES[frame], "point": where})


def _labelled(run: RunLike, load: Array, attrs: dict[str, str]) -> xr.DataArray:
    import xarray as xr

    given = run.dataset["joint_load"]
    return xr.DataArray(
        load,
        dims=("time", "joint", "component"),
        coords={
            "time": run.dataset["time"],
            "joint": ("joint", joint_names(run)),
            "component": given["component"],
        },
        attrs={**given.attrs, **attrs},
        name="joint_load",
    )
