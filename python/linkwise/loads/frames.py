"""Loads of joints, merged ones too, in other axes and about other points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Literal, NamedTuple, cast, overload

import numpy as np
import numpy.typing as npt

from linkwise import _core
from linkwise._core import Frame, InputError, as_floats
from linkwise.base import AnyArray, Array
from linkwise.io.complaint import check_one_of, near, shown
from linkwise.loads.determinate import components_of, self_stresses, touched
from linkwise.loads.extremes import what_samples_miss
from linkwise.loads.members import each_member
from linkwise.loads.samples import model_of, need_whole, rows
from linkwise.loads.welds import Weld
from linkwise.record.schema import DETERMINATE

if TYPE_CHECKING:
    import xarray as xr

    from linkwise._core import Model
    from linkwise.loads.samples import RunLike

FixedIn = Literal["child", "parent", "world"]
_AXES = {
    "child": "joint frame, fixed in the outboard body",
    "parent": "frame of the inboard body: its own joint's; at the ground the world's",
    "world": "world frame",
}


class _Loads(NamedTuple):
    """Loads (..., joint, 6) of some joints, each at and in its own frame; poses (..., joint, 4, 4)
    of these frames and of the inboard bodies' frames."""

    load: Array
    child: Array
    parent: Array


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


def _inboard(model: Model, child: Array, body: str | None) -> Array:
    """Poses (..., 4, 4) of a body's frame, by its link's name; of the world's for None."""
    if body is None:
        return np.broadcast_to(np.eye(4), (*child.shape[:-3], 4, 4))
    return child[..., model.child_link_names.index(body), :, :]


def _of_joints(model: Model, q: Array, load: Array) -> _Loads:
    """All joints of the model, those that close loops behind the others; load (..., joint, 6)."""
    child = _core.joint_poses(model, q)
    inboard = np.asarray(model.joint_parents, dtype=np.intp)
    parent = child[..., np.maximum(inboard, 0), :, :]
    parent[..., inboard < 0, :, :] = np.eye(4)
    if model.n_loops:
        links, index = _core.link_poses(model, q), model.link_names.index
        ends = [
            links[..., [index(name) for name in names], :, :]
            for names in (model.loop_child_link_names, model.loop_parent_link_names)
        ]
        child = np.concatenate([child, ends[0] @ model.loop_placements[:, 1]], axis=-3)
        parent = np.concatenate([parent, ends[1]], axis=-3)
    return _Loads(load, child, parent)


def _loaded(model: Model) -> dict[str, int]:
    """Where each joint's load is among all of them."""
    return {name: k for k, name in enumerate([*model.joint_names, *model.loop_names])}


def _of_run(run: RunLike, model: Model, names: Sequence[str]) -> _Loads:
    """The named joints of a run, merged ones too."""
    everything = slice(None)
    q = rows(run, "position", everything)
    whole = _of_joints(model, q, rows(run, "joint_load", everything))
    index = _loaded(model)
    if list(names) == list(index):
        return whole
    return _with_welds(model, q, whole, names, lambda weld: weld.load(run, whole.child, everything))


def _stressed(model: Model, q: Array, loads: Array, names: Sequence[str]) -> _Loads:
    """The named joints of loads (n, joint, 6) that balance without masses and wrenches."""
    whole = _of_joints(model, q, loads)
    return _with_welds(model, q, whole, names, lambda weld: weld.of_joints(q, loads, whole.child))


def _with_welds(
    model: Model,
    q: Array,
    whole: _Loads,
    names: Sequence[str],
    through: Callable[[Weld], Array],
) -> _Loads:
    """The named joints out of the whole machine, whose merged ones carry what is `through` them."""
    index = _loaded(model)
    merged = {name for name, _, _ in model.welds}
    found = []
    for name in names:
        if name in merged:
            weld = Weld(model, name)
            parent = _inboard(model, whole.child, model.frame_placement(weld.parent)[0])
            pose = _core.frame_pose(model, q, weld.child)
            found.append(_Loads(through(weld), pose, parent))
        else:
            k = index[name] if name in index else model.joint_index(name)
            found.append(_Loads(*(part[:, k] for part in whole)))
    return _Loads(*(np.stack(parts, axis=1) for parts in zip(*found, strict=True)))


def _of_array(
    loads: npt.ArrayLike, model: Model, q: npt.ArrayLike, names: Sequence[str]
) -> tuple[Array, _Loads]:
    """q, and the named joints of loads (..., n_joints, 6)."""
    load, state = as_floats(loads, "loads"), as_floats(q, "q")
    index = _loaded(model)
    if load.shape[-2:] != (len(index), 6) or load.ndim < 2:
        raise InputError(
            f"loads: shape {load.shape}; give (..., {len(index)}, 6), the loads of all joints"
        )
    welds = {name for name, _, _ in model.welds}
    for name in names:
        if name in welds:
            raise InputError(
                f"joint {name!r} is fixed and its links are merged, so loads in an array do not "
                "tell its own; give a run, or load the model with keep_fixed"
            )
    take = [index[name] if name in index else model.joint_index(name) for name in names]
    found = _of_joints(model, state, load)
    return state, _Loads(*(part.take(take, axis=-3 if k else -2) for k, part in enumerate(found)))


def _in_frame(
    model: Model, q: Array, found: _Loads, frame: str | Frame, point: Array | None, fixed_in: str
) -> tuple[Array, dict[str, str]]:
    """Loads (..., joint, 6) in the axes of a frame and about a point, and what these are."""
    world = _turned(found.load, found.child[..., :3, :3])
    poses = {"child": found.child, "parent": found.parent, "world": np.eye(4)}
    where = "joint point: the origin of the joint frame"
    at = None
    if isinstance(frame, str) and frame in _AXES:
        axes, shown = poses[frame], _AXES[frame]
    else:
        axes = _core.frame_pose(model, q, frame)[..., None, :, :]
        shown = f"frame of link {frame!r}" if isinstance(frame, str) else repr(frame)
        at, where = axes[..., :3, 3], "the frame's origin"
    if point is not None:
        pose = poses[fixed_in]
        at = pose[..., :3, 3] + np.einsum(
            "...ik,...k->...i",
            pose[..., :3, :3],
            np.broadcast_to(point, (found.load.shape[-2], 3)),
        )
        told = "(" + ", ".join(f"{x:g}" for x in point) + ") m" if point.ndim == 1 else ""
        where = f"{told or 'given per joint'} in the {_AXES[fixed_in]}"
    if at is not None:
        with np.errstate(over="ignore", invalid="ignore"):
            world = move_wrench(world, found.child[..., :3, 3], at)
        if not np.isfinite(world).all():
            raise InputError("point: is so far away that moments there are too large for numbers")
    moved = _turned(world, np.swapaxes(axes[..., :3, :3], -1, -2))
    return moved, {"frame": shown, "point": where}


def _checked(model: Model, frame: str | Frame, fixed_in: str) -> None:
    check_one_of("fixed_in", fixed_in, _AXES)
    if not isinstance(frame, str | Frame):
        raise InputError(f"frame: {shown(frame)} given; give the name of a link, or a Frame")
    if isinstance(frame, str) and frame not in _AXES and frame not in model.link_names:
        known = near(frame, model.link_names, "the links are")
        raise InputError(
            f"frame: {shown(frame)} is unknown; use {', '.join(_AXES)}, a Frame or a link ({known})"
        )


def _as_point(point: npt.ArrayLike | None, joints: int) -> Array | None:
    if point is None:
        return None
    given = as_floats(point, "point")
    if given.shape not in ((3,), (joints, 3)) or not np.isfinite(given).all():
        raise InputError(
            f"point: shape {given.shape}; give three finite coordinates in metres, or one row "
            f"per joint ({joints}, 3)"
        )
    return given


@overload
def in_frame(
    run: RunLike | xr.Dataset,
    frame: str | Frame = ...,
    *,
    joint: str | Sequence[str] | None = ...,
    point: npt.ArrayLike | None = ...,
    fixed_in: FixedIn = ...,
    model: Model | None = ...,
) -> xr.DataArray: ...
@overload
def in_frame(
    run: npt.ArrayLike,
    frame: str | Frame = ...,
    *,
    joint: str | Sequence[str] | None = ...,
    point: npt.ArrayLike | None = ...,
    fixed_in: FixedIn = ...,
    model: Model,
    q: npt.ArrayLike,
) -> Array: ...
def in_frame(
    run: RunLike | xr.Dataset | npt.ArrayLike,
    frame: str | Frame = "world",
    *,
    joint: str | Sequence[str] | None = None,
    point: npt.ArrayLike | None = None,
    fixed_in: FixedIn = "child",
    model: Model | None = None,
    q: npt.ArrayLike | None = None,
) -> xr.DataArray | Array:
    """Joint loads in the axes of another frame, about any point.

    A fixed joint whose links are merged has a load too, what moves everything beyond it: the
    reading of a force-torque sensor there, wherever it is on a link.

    Args:
        run: A run that holds `joint_load` and `position` of all joints, for fixed joints also
            `velocity` and `acceleration`; or an array (..., n_joints, 6) as `joint_loads` returns
            it.
        frame: Axes of the components: "child" (the joint frame), "parent", "world", the name of
            any link, or a `Frame`. Moments are taken about the joint point, in the frame of a link
            about its origin.
        joint: The joint, or several, by name; all of them by default.
        point: Where moments are taken about instead, as coordinates (3,) or (joint, 3) [m] in the
            frame `fixed_in`.
        fixed_in: The frame that the point is fixed in: "child", "parent" or "world".
        model: The machine, if the run does not hold it; an array needs it.
        q: Positions (..., nq) [rad, m] of loads in an array.

    Returns:
        DataArray (time, joint, component), without joint for a single one; `attrs` state frame,
        point, convention, and what the samples miss of the peaks. Of machines with loops the
        coordinate `determinate` (joint, component) says which of them rigid bodies determine in
        these axes, in every pose that was looked at. Of an array an array (..., joint, 6), or
        (..., 6).

    Raises:
        InputError: the frame or joint is unknown, shapes are wrong, the run lacks a quantity, or
            wrenches act on both sides of a merged joint.
    """
    if not (hasattr(run, "dataset") or hasattr(run, "data_vars")):
        if model is None or q is None:
            raise InputError("loads in an array need their machine and state; give model and q")
        names = list(_loaded(model)) if joint is None else _names(joint)
        _checked(model, frame, fixed_in)
        state, found = _of_array(run, model, q, names)
        at = _as_point(point, len(names))
        moved, _ = _in_frame(model, state, found, frame, at, fixed_in)
        return moved[..., 0, :] if isinstance(joint, str) else moved
    return _run_in_frame(cast("RunLike", run), frame, joint, point, fixed_in, model)


@each_member
def _run_in_frame(
    run: RunLike,
    frame: str | Frame,
    joint: str | Sequence[str] | None,
    point: npt.ArrayLike | None,
    fixed_in: FixedIn,
    model: Model | None,
) -> xr.DataArray:
    machine = model_of(run, model)
    need_whole(run, machine, "joint_load", "position")
    _checked(machine, frame, fixed_in)
    names = list(_loaded(machine)) if joint is None else _names(joint)
    at = _as_point(point, len(names))
    known = dict.fromkeys([*_loaded(machine), *(name for name, _, _ in machine.welds)])
    for name in names:
        if name not in known:
            hint = near(name, known, "the joints are")
            raise InputError(f"joint {shown(name)} does not exist; {hint}")
    found = _of_run(run, machine, names)
    q = rows(run, "position", slice(None))
    moved, attrs = _in_frame(machine, q, found, frame, at, fixed_in)
    own = set(names) <= set(_loaded(machine))
    attrs["samples"] = what_samples_miss(run, names if own else None)
    made = _labelled(run, names, moved, attrs)
    mask = _determinate(run, machine, names, frame, at, fixed_in)
    if mask is not None:
        made = made.assign_coords({DETERMINATE: (("joint", "component"), mask)})
    return made.isel(joint=0) if isinstance(joint, str) else made


def _determinate(
    run: RunLike,
    model: Model,
    names: Sequence[str],
    frame: str | Frame,
    point: Array | None,
    fixed_in: str,
) -> AnyArray | None:
    """Which components (joint, 6) rigid bodies determine there; None where the run does not tell.

    In its own frame the run says it. Elsewhere the self-stresses of some poses are seen from there:
    those of two components may cancel.
    """
    own = components_of(run)
    if own is None:
        return None
    index = _loaded(model)
    of_names = np.array([index.get(name, -1) for name in names])
    known: AnyArray = np.where((of_names < 0)[:, None], True, own[of_names])
    if frame == "child" and point is None and (of_names >= 0).all():
        return known
    found: AnyArray = np.ones_like(known)
    stresses = self_stresses(run, model)
    if not stresses:  # all components mix
        found[:] = own.all()
    for q, loads in stresses:
        if not len(loads):
            continue
        several = np.broadcast_to(q, (len(loads), q.size))
        seen = _stressed(model, several, loads, names)
        moved, _ = _in_frame(model, several, seen, frame, point, fixed_in)
        arms = np.linalg.norm(seen.child[..., :3, 3], axis=-1)
        found &= ~touched(moved, arms).any(axis=0)
    return found | (known.all(axis=1) & (of_names >= 0))[:, None]


def _names(joint: str | Sequence[str]) -> list[str]:
    names = [joint] if isinstance(joint, str) else list(joint)
    if not names:
        raise InputError("joint: no name is given; leave it out for all joints")
    return names


def _labelled(
    run: RunLike, names: Sequence[str], load: Array, attrs: dict[str, str]
) -> xr.DataArray:
    import xarray as xr

    given = run.dataset["joint_load"]
    return xr.DataArray(
        load,
        dims=("time", "joint", "component"),
        coords={
            "time": run.dataset["time"],
            "joint": ("joint", list(names)),
            "component": given["component"],
        },
        attrs={**given.attrs, **attrs},
        name="joint_load",
    )
