"""The extremes that a run holds of what happened between its samples."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from linkwise._core import InputError
from linkwise.base import COMPONENTS, DERIVED, HALVES, AnyArray, Array, lengths
from linkwise.loads.samples import blocks, joint_names, rows

if TYPE_CHECKING:
    from linkwise._core import Model
    from linkwise.loads.samples import RunLike

_PREFIX = "extreme_"

# The share of a peak that samples may miss before it is said.
MISSED = 0.01
# Peaks below this share of the machine's largest are noise.
_NOISE = 1e-6


@dataclass(frozen=True)
class Extremes:
    """Of one variable: extremes, when they were, and bounds on what was not found; NaN where there
    is nothing of the kind."""

    minimum: Array
    minimum_time: Array
    minimum_reach: Array
    maximum: Array
    maximum_time: Array
    maximum_reach: Array

    @property
    def is_minimum(self) -> AnyArray:
        """Where the minimum is the value of largest magnitude."""
        return np.abs(self.minimum) > np.abs(self.maximum)

    @property
    def largest(self) -> tuple[Array, Array]:
        """The value of largest magnitude, and when."""
        low = self.is_minimum
        return (
            np.where(low, self.minimum, self.maximum),
            np.where(low, self.minimum_time, self.maximum_time),
        )

    @property
    def reach(self) -> Array:
        """A bound on the magnitude."""
        return np.maximum(np.abs(self.minimum_reach), np.abs(self.maximum_reach))


class State(NamedTuple):
    """Positions, velocities, accelerations and drive torques of the machine, (..., n) each."""

    q: Array
    v: Array
    a: Array
    torque: Array


def extremes_of(run: RunLike, name: str) -> Extremes | None:
    """Extremes of a recorded variable, or of the derived quantities (quantity, joint) by the name
    "quantity"; None where the run holds none: it was simulated without, or its process was killed
    before the first were written."""
    if _PREFIX + name not in run.dataset:
        return None
    values = _rows(run, name, len(fields(Extremes)))
    return None if np.isnan(values).all() else Extremes(*values)


def _rows(run: RunLike, name: str, count: int) -> Array:
    """The `count` rows of one variable; InputError where the run has others or none."""
    held = run.dataset.get(_PREFIX + name)
    if held is None or held.shape[:1] != (count,):
        raise _damaged(run, name)
    return rows(run, _PREFIX + name, slice(None))


def _damaged(run: RunLike, name: str) -> InputError:
    shown = f"run {str(run.path)!r}" if run.path is not None else "run"
    return InputError(
        f"{shown}: {_PREFIX}{name} is missing or has another shape than it was written with; "
        "its files are damaged, simulate again"
    )


def load_at_extremes(run: RunLike) -> Array:
    """The whole load (quantity, joint, component) when each quantity was largest in magnitude."""
    wrench = _rows(run, "wrench", 2)
    found = extremes_of(run, "quantity")
    assert found is not None
    load: Array = np.where(found.is_minimum[..., None], wrench[0], wrench[1])
    return load


def component_extremes(run: RunLike, joint: int) -> dict[str, tuple[Array, Array]]:
    """Times and values of the smallest and largest of each load component of a joint; none where
    the run holds no extremes."""
    between = extremes_of(run, "joint_load")
    if between is None:
        return dict.fromkeys(COMPONENTS, (np.zeros(0), np.zeros(0)))
    times = np.stack([between.minimum_time[joint], between.maximum_time[joint]])
    values = np.stack([between.minimum[joint], between.maximum[joint]])
    return {name: (times[:, c], values[:, c]) for c, name in enumerate(COMPONENTS)}


def loads_at_peaks(run: RunLike, joint: int) -> tuple[Array, Array]:
    """Times (n,) in order and whole loads (n, 6) of a joint when its force and its moment were
    largest; none where the run holds no extremes."""
    between = extremes_of(run, "quantity")
    if between is None:
        return np.zeros(0), np.zeros((0, len(COMPONENTS)))
    which = quantity_rows([name for name, _, _ in HALVES])
    times, first = np.unique(between.maximum_time[which, joint], return_index=True)
    found = ~np.isnan(times)
    return times[found], load_at_extremes(run)[which, joint][first[found]]


def states_at_peaks(run: RunLike, model: Model) -> State | None:
    """The machine when force and moment of each joint were largest, parts of (half, joint, ...);
    None where the run does not hold it: of machines with many joints, of a part of the joints,
    without extremes. NaN where nothing was found."""
    if f"{_PREFIX}state" not in run.dataset:
        return None
    held = _rows(run, "state", len(HALVES))
    parts = np.cumsum([model.nq, model.nv, model.nv, model.nv])
    if held.shape[1:] != (model.n_joints + model.n_loops, parts[-1]):
        raise _damaged(run, "state")
    return State(*np.split(held, parts[:-1], axis=-1))


def quantity_rows(names: list[str]) -> list[int]:
    """Where derived quantities stand among those of `extremes_of(run, "quantity")`."""
    return [DERIVED.index(name) for name in names]


class MissedPeak(NamedTuple):
    """A peak of a joint's force or moment that lies between the samples, and their largest."""

    joint: str
    quantity: str
    units: str
    peak: float
    time: float
    sampled: float

    def __str__(self) -> str:
        return (
            f"{self.quantity} of joint {self.joint!r} peaks between the samples, at "
            f"{self.peak:.4g} {self.units} and {self.time:.4g} s; the samples show at most "
            f"{self.sampled:.4g} {self.units}"
        )


def missed_peaks(run: RunLike, joints: Collection[str] | None = None) -> list[MissedPeak]:
    """The peaks of these joints, all by default, of which the samples miss more than `MISSED`.

    The one that they miss most of comes first. None where the run holds no extremes: what its
    samples miss is not known.
    """
    between = extremes_of(run, "quantity")
    if between is None:
        return []
    names = joint_names(run)
    sampled = np.zeros((len(HALVES), len(names)))
    for where in blocks(run, 48 * len(names)):
        load = rows(run, "joint_load", where).reshape(-1, len(names), 2, 3)
        sampled = np.maximum(sampled, lengths(load).max(axis=0).T)
    which = quantity_rows([name for name, _, _ in HALVES])
    peak, time = between.maximum[which], between.maximum_time[which]
    found = [
        MissedPeak(names[j], name, units, peak[k, j], time[k, j], sampled[k, j])
        for k, (name, units, _) in enumerate(HALVES)
        for j in np.flatnonzero(
            (sampled[k] < (1 - MISSED) * peak[k]) & (peak[k] > _NOISE * peak[k].max(initial=0.0))
        )
        if joints is None or names[j] in joints
    ]
    return sorted(found, key=lambda one: one.sampled / one.peak)


def what_samples_miss(run: RunLike, joints: Collection[str] | None = None) -> str:
    """What whoever is given samples must know of them."""
    if extremes_of(run, "quantity") is None:
        return "the run holds no extremes, so what its samples miss is not known"
    found = missed_peaks(run, joints)
    if not found:
        return f"the samples show every peak of force and moment to {MISSED:.0%}"
    more = f"; {len(found) - 1} more peaks are missed" if len(found) > 1 else ""
    return f"{found[0]}{more}"
