"""Whether rigid bodies determine joint loads, and what is made of them.

A self-stress is a set of joint loads that cancel inside the loops of a machine. Any multiple of it
may be added to the loads of a run, so what a self-stress touches is open: one choice of many. A run
holds that as `determinate` (joint, component); what is made of several components is open as soon
as one of them is. In other axes, or about other points, a self-stress has other components, which
are looked at there.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from linkwise import _core
from linkwise._core import InputError
from linkwise.base import COMPONENTS, HALVES, AnyArray, Array
from linkwise.loads.extremes import states_at_peaks
from linkwise.loads.samples import drive_kinds, joint_names, rows, select
from linkwise.record.schema import DETERMINATE

if TYPE_CHECKING:
    from linkwise._core import Indeterminacy, Model
    from linkwise.loads.samples import RunLike

ABOUT_DETERMINATE = {"long_name": "whether rigid bodies determine it throughout the run"}
#: Directions that loop joints hold. The search for undetermined loads is dense: about a second
#: for so many.
MOST_ROWS = 1000
#: Up to here a look takes a millisecond or less.
FEW_ROWS = 100
#: Poses of a run that are looked at: spread over the samples, and at peaks.
POSES = 8
PEAKS = 8
# Components of a unit vector that are less are rounding.
_ALONG = 1e-9
# Of the largest component of a self-stress: what is less is rounding.
_TOUCHED = 1e-8
#: Which half of a load a quantity is of, and which part of it, seen along the joint's axis.
_PARTS = {
    "force": (0, ""),
    "axial": (0, "along"),
    "radial": (0, "across"),
    "moment": (1, ""),
    "tilting_moment": (1, "across"),
    "torque": (1, "along"),
}


def loop_rows(model: Model) -> int:
    """Directions that what closes loops holds."""
    return sum(6 - freedom for freedom in model.loop_nv) + len(model.coupling_names)


class Held:
    """A machine some of whose joints are locked or moved as given, and so hold a direction more."""

    def __init__(self, model: Model, joints: Iterable[str]) -> None:
        names = list(joints)
        self._model = model.prescribe(names) if names else model

    def indeterminacy(self, q: Array) -> Indeterminacy:
        """Raises InputError where the position q (nq,) [rad, m] leaves loops open."""
        return _core.indeterminacy(self._model, q)


def given_joints(run: RunLike) -> list[str]:
    """The joints that were locked, or whose motion was given."""
    kinds = drive_kinds(run) or {}
    return [joint for joint, kind in kinds.items() if kind in ("locked", "motion")]


def components_of(run: RunLike) -> AnyArray | None:
    """(joint, 6) of the recorded joints; None where the run does not tell: all are determinate,
    or nobody looked."""
    if DETERMINATE not in run.dataset:
        return None
    known: AnyArray = run.dataset[DETERMINATE].transpose("joint", "component").values
    return known.astype(np.bool_)


def halves_of(run: RunLike) -> AnyArray | None:
    """(half, joint) of the lengths of force and moment; None as in `components_of`."""
    known = components_of(run)
    if known is None:
        return None
    both: AnyArray = np.all(known.reshape(-1, len(HALVES), 3), axis=2)
    return both.T


def quantities_of(
    run: RunLike, model: Model, directions: Array, names: Sequence[str]
) -> AnyArray | None:
    """(quantity, joint) of the quantities of these names, for axes (joint, 3) of recorded joints.

    Along and across an axis that is none of the joint frame's own self-stresses are looked at,
    where the run has what that needs. None as in `components_of`.
    """
    components = components_of(run)
    if components is None:
        return None
    is_open = ~components.reshape(-1, 2, 3)
    unknown = np.isnan(directions)
    along = (np.abs(directions) > _ALONG) | unknown
    across = (np.abs(directions) < 1 - _ALONG) | unknown
    parts = {"": np.ones_like(along), "along": along, "across": across}
    skew = (along & across & ~unknown).any(axis=1) & is_open.any(axis=(1, 2))
    stresses = self_stresses(run, model) if skew.any() else []
    recorded = select(run, model).joints
    known = np.ones((len(names), len(is_open)), dtype=np.bool_)
    for k, name in enumerate(names):
        if name not in _PARTS:  # the power of a drive is that of its torque, which is given
            continue
        half, part = _PARTS[name]
        known[k] = ~(is_open[:, half] & parts[part]).any(axis=1)
        if part and stresses:
            seen = [
                _parts_seen(loads[:, recorded], directions, part)[:, half] for _, loads in stresses
            ]
            known[k] |= skew & ~np.any(seen, axis=0)
    return known


def _parts_seen(loads: Array, directions: Array, part: str) -> AnyArray:
    """(joint, half): whether self-stresses (n, joint, 6) have a part along or across an axis."""
    halves = loads.reshape(*loads.shape[:-1], 2, 3)
    along = np.einsum("njhi,ji->njh", halves, directions)
    seen = along[..., None] if part == "along" else halves - along[..., None] * directions[:, None]
    size = np.abs(halves).max(axis=(1, 3), keepdims=True)[..., 0]
    found: AnyArray = np.abs(seen).max(axis=-1) > _TOUCHED * size
    touched_once: AnyArray = np.any(found, axis=0)
    return touched_once


def signal_of(
    run: RunLike, model: Model | None, joint: int, quantity: str, direction: Array
) -> bool | None:
    """Of one quantity or component of one of the recorded joints, whose axis is `direction` (3,);
    components need no model. None as in `components_of`."""
    known = components_of(run)
    if known is None:
        return None
    if quantity in COMPONENTS or model is None:
        return bool(known[joint, COMPONENTS.index(quantity)])
    directions = np.full((len(known), 3), np.nan)
    directions[joint] = direction
    found = quantities_of(run, model, directions, [quantity])
    assert found is not None
    return bool(found[0, joint])


def self_stresses(run: RunLike, model: Model) -> list[tuple[Array, Array]]:
    """Poses (nq,) of a run, and loads (n, joint, 6) of self-stresses that nothing decides there.

    The poses are spread over its samples, and where loads are largest, as those that `determinate`
    is of.

    None where loops are open, or the run does not hold all positions.
    """
    size = loop_rows(model)
    held = run.dataset.get("position")
    if not 0 < size <= MOST_ROWS or held is None or held.shape[1] != model.nq:
        return []
    few, count = size <= FEW_ROWS, run.dataset.sizes["time"]
    spread = np.linspace(0, count - 1, min(count, POSES + 1 if few else 3))
    poses = rows(run, "position", sorted({round(k) for k in spread}))
    peaks = states_at_peaks(run, model) if few else None
    if peaks is not None:
        q = peaks.q.reshape(-1, model.nq)
        q = np.unique(q[np.isfinite(q).all(axis=1)], axis=0)
        chosen = sorted({round(k) for k in np.linspace(0, len(q) - 1, min(len(q), PEAKS))})
        poses = np.concatenate([poses, q[chosen]])
    machine = Held(model, given_joints(run))
    found = []
    for q in poses:
        with contextlib.suppress(InputError):  # of a run that went astray: its loops are open
            found.append((q, np.asarray(machine.indeterminacy(q).undecided)))
    return found


def touched(loads: Array, arms: Array) -> AnyArray:
    """Which components (..., joint, 6) of loads of self-stresses are more than rounding; arms
    (..., joint): lengths [m] by which forces enter the moments."""
    size = np.abs(loads)
    force = size[..., :3].max(axis=(-1, -2), keepdims=True, initial=0.0)
    moment = size[..., 3:].max(axis=(-1, -2), keepdims=True, initial=0.0)
    moment = np.maximum(moment, force * arms[..., None])
    scale = np.concatenate(
        [np.broadcast_to(x, (*loads.shape[:-1], 3)) for x in (force, moment)], axis=-1
    )
    found: AnyArray = size > _TOUCHED * scale
    return found


def joint_rows(run: RunLike, names: Sequence[str]) -> AnyArray | None:
    """(joint, 6) of these of the recorded joints; None as in `components_of`."""
    known = components_of(run)
    if known is None:
        return None
    recorded = joint_names(run)
    return known[[recorded.index(name) for name in names]]
