"""Joint loads split by cause: the shares add up to the load."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from linkwise import _core
from linkwise._core import InputError, NumericsError
from linkwise.base import HALVES, AnyArray, Array, lengths
from linkwise.io.complaint import check_one_of
from linkwise.loads.determinate import ABOUT_DETERMINATE, components_of, halves_of
from linkwise.loads.extremes import (
    MISSED,
    load_at_extremes,
    quantity_rows,
    states_at_peaks,
    what_samples_miss,
)
from linkwise.loads.members import each_member
from linkwise.loads.motion_causes import DrivenMotion
from linkwise.loads.peaks import peak_loads
from linkwise.loads.samples import (
    drive_kinds,
    external,
    given_motions,
    joint_names,
    loop_torque,
    model_of,
    need_whole,
    rows,
)
from linkwise.notes import recorded_warnings
from linkwise.record.schema import DETERMINATE

if TYPE_CHECKING:
    import xarray as xr

    from linkwise._core import Model
    from linkwise.loads.samples import RunLike

By = Literal["force", "motion"]

CAUSES: dict[str, dict[str, str]] = {
    "force": {
        "gravity": "gravity acting alone on the mechanism at rest",
        "velocity": "centrifugal, Coriolis and gyroscopic terms of the joints' rates alone",
        "drive": "the drive torques alone",
        "motion": "the accelerations of the joints whose motion is given, alone",
        "passive": "damping, friction, springs and stops of the joints alone",
        "external": "the external wrenches alone",
        "misfit": "what bearings do not fit by, and preloads, alone",
    },
    "motion": {
        "gravity": "what holds the mechanism at rest against gravity",
        "velocity": "what the joints' rates need: centrifugal, Coriolis, gyroscopic",
        "acceleration": "what the joints' accelerations need",
        "passive": "what balances damping, friction, springs and stops, in machines with loops",
        "external": "what balances the external wrenches",
        "misfit": "what bearings do not fit by, and preloads, alone",
    },
}


#: Part of the largest share that the sum may miss in machines with loops.
_LOST = 1e-6
_MISFITS = {"offset", "turn", "preload"}
_PASSIVE = ("damping", "friction", "stiffness", "limit_stiffness")


def _yields(model: Model) -> AnyArray:
    """Degrees of freedom (nv,) of the tree with passive forces."""
    found: AnyArray = np.any([model.dof_property(name) != 0 for name in _PASSIVE], axis=0)
    return found


def _loops_yield(model: Model) -> bool:
    return any(np.any(model.loop_property(name)) for name in _PASSIVE)


class Split:
    """Evaluates the shares of any block of samples of one run.

    At a given position the equations of motion are linear in gravity, the velocity terms, drives,
    external wrenches and passive forces, and what is factored of them depends on the position
    alone: by force, one factorisation serves all causes. By motion nothing is to be solved in a
    tree, and where loops close, the torques of the driven joints are.
    """

    def __init__(
        self, run: RunLike, by: By, model: Model | None, driven: Sequence[str] | None = None
    ) -> None:
        check_one_of("by", by, CAUSES)
        self.run, self.by = run, by
        machine = model_of(run, model)
        self.closed = bool(machine.n_loops or machine.coupling_names)
        if driven is not None and not (by == "motion" and self.closed):
            raise InputError(
                "driven: is for loads by motion of machines with closed loops; leave it out"
            )
        wanted = ["joint_load", "position", "velocity"]
        wanted += ["drive_torque"] if by == "force" else ["acceleration"]
        self.given = given_motions(run)
        if by == "force" and self.given:
            wanted.append("acceleration")
        need_whole(run, machine, *wanted)
        self.model = machine
        moved = by == "motion" and self.closed
        self._driven = DrivenMotion(run, machine, driven) if moved else None
        held = by == "force" and self.given
        self.free = machine.prescribe(list(self.given)) if held else machine
        self.imposed = np.zeros(machine.nv, dtype=bool)
        self.loop_imposed = np.zeros(sum(machine.loop_nv), dtype=bool)
        rates = {
            name: v for name, (_, v) in zip(machine.loop_names, machine.loop_slices, strict=True)
        }
        for joint in self.given:
            if joint in rates:
                self.loop_imposed[rates[joint]] = True
            else:
                self.imposed[machine.v_slice(joint)] = True
        self.names = [name for name in CAUSES[by] if self._happens(name)]

    def _happens(self, cause: str) -> bool:
        """Can this cause load the machine at all?"""
        if cause == "gravity":
            return any(self.model.gravity)
        if cause in ("velocity", "acceleration"):
            return not self.imposed.all() or "motion" in self.given.values()
        if cause == "drive":
            kinds = drive_kinds(self.run)
            return kinds is None or not set(kinds.values()) <= {"free", "locked", "motion"}
        if cause == "passive" and self.by == "motion":
            return self.closed and bool(_yields(self.model).any() or _loops_yield(self.model))
        if cause == "passive":
            free = ~self.imposed
            if _loops_yield(self.model):
                return True
            return bool(_yields(self.model)[free].any())
        if cause == "misfit":
            given = self.model.bearings.values() if self.closed else ()
            return any(_MISFITS & bearing.keys() for bearing in given)
        if cause == "external":
            return "external_wrench" in self.run.dataset
        return "motion" in self.given.values()

    def shares(self, where: slice | Sequence[int]) -> Array:
        """(time, cause, joint, 6) of these samples; NaN where loops close and the state tells too
        little: in singular positions, and of springs in loop joints that turned more than once."""
        if not self.closed:
            return self._at(where)
        shares, load = self._at(where), rows(self.run, "joint_load", where)
        missed = np.abs(shares.sum(axis=1) - load).max(axis=(1, 2), initial=0.0)
        largest = np.abs(shares).max(axis=(1, 2, 3), initial=0.0)
        shares[~(missed <= _LOST * largest)] = np.nan
        return shares

    def _at(self, where: slice | Sequence[int]) -> Array:
        q = rows(self.run, "position", where)
        v = rows(self.run, "velocity", where)
        a = None
        if self.by == "motion" or "motion" in self.names:
            a = rows(self.run, "acceleration", where)
        torque = rows(self.run, "drive_torque", where) if self.by == "force" else None
        loops = loop_torque(self.run, where)
        return self._of(q, v, a, torque, external(self.run, self.model, where), loops)

    def shares_at_peaks(self, when: Array) -> Array:
        """(half, joint, cause, 6) of each joint at when (half, joint) its force and its moment were
        largest; NaN where that moment cannot be made again.

        The run holds the state. Wrenches from outside are interpolated between samples, and count
        only if the shares add up to the load that the run holds of that moment.
        """
        shares = np.full((*when.shape, len(self.names), 6), np.nan)
        states = states_at_peaks(self.run, self.model)
        if states is None:
            return shares
        there = ~np.isnan(states.q).any(axis=-1)
        half, joint = np.nonzero(there)
        q, v, a, torque = (part[there] for part in states)
        evaluated = self._of(q, v, a, torque, self._external_at(when[there]))
        own = evaluated[np.arange(joint.size), :, joint]
        known = load_at_extremes(self.run)[quantity_rows([HALVES[h][0] for h in half]), joint]
        off, size = (
            lengths(load.reshape(-1, 2, 3))[np.arange(joint.size), half]
            for load in (own.sum(axis=1) - known, known)
        )
        own[off > MISSED * size] = np.nan
        shares[there] = own
        return shares

    def _external_at(self, when: Array) -> Array | None:
        """The wrenches from outside, (time, body, 6), interpolated between samples."""
        times = self.run.dataset["time"].values
        after = np.searchsorted(times, when).clip(max=times.size - 1)
        before = np.maximum(after - 1, 0)
        every = external(self.run, self.model, slice(None))
        if every is None:
            return None
        span = np.where(after > before, times[after] - times[before], 1.0)
        share = ((when - times[before]) / span).clip(0, 1)[:, None, None]
        between: Array = (1 - share) * every[before] + share * every[after]
        return between

    def _of(
        self,
        q: Array,
        v: Array,
        a: Array | None,
        torque: Array | None,
        outside: Array | None,
        loops: Array | None = None,
    ) -> Array:
        if self.by == "force":
            assert torque is not None
            driven = np.where(self.imposed, 0.0, torque)
            held = a if "motion" in self.names else None
            of_loops = None if held is None else self._of_loops(q, v, held)
            if loops is not None:
                loops = np.where(self.loop_imposed, 0.0, loops)
            return self._by_force(q, [v, driven, outside, held, loops, of_loops])
        if self._driven is not None:
            assert a is not None
            return self._driven.shares(self.names, q, v, a, outside)
        shares = np.empty((len(q), len(self.names), self.model.n_joints, 6))
        for k, cause in enumerate(self.names):
            shares[:, k] = _core.inverse_dynamics_loads(
                self.model,
                q,
                v if cause == "velocity" else None,
                a if cause == "acceleration" else None,
                external=outside if cause == "external" else None,
                gravity=1.0 if cause == "gravity" else 0.0,
            )
        return shares

    def _of_loops(self, q: Array, v: Array, a: Array) -> Array | None:
        """Accelerations of the joints that close loops."""
        return _core.loop_accelerations(self.model, q, v, a) if self.loop_imposed.any() else None

    def _by_force(self, q: Array, acting: Sequence[Array | None]) -> Array:
        """Of closed loops NaN at each state that is in a singular position."""
        v, driven, outside, held, loops, of_loops = acting
        try:
            return _core.joint_loads_by_cause(
                self.free,
                self.names,
                q,
                v,
                driven,
                external=outside,
                prescribed=held,
                loop_tau=loops,
                loop_prescribed=of_loops,
            )
        except NumericsError:
            if not self.closed:
                raise
            if len(q) == 1:
                size = self.model.n_joints + self.model.n_loops
                return np.full((1, len(self.names), size, 6), np.nan)
        each = [slice(k, k + 1) for k in range(len(q))]
        return np.concatenate(
            [self._by_force(q[k], [x if x is None else x[k] for x in acting]) for k in each]
        )


@each_member
def split(
    run: RunLike,
    by: By = "force",
    model: Model | None = None,
    *,
    driven: Sequence[str] | None = None,
) -> xr.DataArray:
    """Joint loads by cause; the shares add up to the joint load to rounding.

    Args:
        run: Holds `joint_load`, `position`, `velocity` and `drive_torque` of all joints, and
            `external_wrench` where there are wrenches; by motion `acceleration` instead of
            `drive_torque`.
        by: "force": what each acting force alone would load the joints with while the mechanism
            moves freely under it (joints whose motion is given stay held). "motion": what the
            position, the rates and the accelerations of this very motion each need. Where loops
            close that depends on the joints whose drives make it: the rates are then those
            that go on while the driven joints keep theirs.
        model: The machine, if the run does not hold it.
        driven: By motion, where loops close: names of the joints that make the motion; those with
            drives in the run unless given.

    Returns:
        DataArray (time, cause, joint, component), frame and signs as `joint_load`. Causes that the
        run cannot have are left out. Loads that rigid bodies do not determine (coordinate
        `determinate` (joint, component), attribute `undetermined`) are split by the rule that chose
        them. NaN where closed loops are in a
        singular position. At the samples: the attribute `samples` says what these miss,
        and `split_at_peaks` is what the peaks are made of.
    """
    import xarray as xr

    made = Split(run, by, model, driven)
    given = run.dataset["joint_load"]
    about = {f"cause {name}": CAUSES[by][name] for name in made.names}
    return xr.DataArray(
        made.shares(slice(None)),
        dims=("time", "cause", "joint", "component"),
        coords={
            "time": run.dataset["time"],
            "cause": made.names,
            "joint": ("joint", joint_names(run)),
            "component": given["component"],
            **_mark(("joint", "component"), components_of(run)),
        },
        attrs={
            **given.attrs,
            "long_name": f"joint load by {by}",
            **about,
            "samples": what_samples_miss(run),
            **_undetermined(run),
        },
        name="joint_load",
    )


@each_member
def split_at_peaks(
    run: RunLike,
    by: By = "force",
    model: Model | None = None,
    *,
    driven: Sequence[str] | None = None,
) -> xr.Dataset:
    """What each cause adds to the largest force and the largest moment of every joint.

    Args:
        run, by, model, driven: As for `split`.

    Returns:
        Dataset over (quantity, joint): `share` (cause, quantity, joint), its part along the load at
        `time` [s], whose size `total` the shares add up to; `peak`, that of `peak_loads`, which
        `total` is too, to 1 % where wrenches act from outside, which are interpolated;
        of machines with loops `determinate`, as in `summary`;
        `at_peak`: 1 where the load is taken at the peak, 0 where it is that of the sample beside it
        with the larger load. That is so where the run does not hold the machine's state at the
        peak: of machines with more than 50 joints, without extremes, or where wrenches from outside
        change too fast for the samples.
    """
    import xarray as xr

    made = Split(run, by, model, driven)
    peaks = peak_loads(run)
    times = run.dataset["time"].values
    names, shape = joint_names(run), (len(HALVES), len(joint_names(run)))
    when = np.stack([peaks[f"{name}_time"].values for name, _, _ in HALVES])
    own = np.where(np.isin(when, times)[..., None, None], np.nan, made.shares_at_peaks(when))
    at_peak = np.isin(when, times) | ~np.isnan(own).any(axis=(2, 3))
    total, share = np.zeros(shape), np.zeros((len(made.names), *shape))
    samples = _Last(made)
    for half, j in np.ndindex(shape):
        shares = own[half, j]
        if np.isnan(shares).any():
            k = _larger_beside(run, times, float(when[half, j]), half, j)
            when[half, j], shares = times[k], samples.at(k)[:, j]
        parts, size = along_total(shares[None, :, 3 * half : 3 * half + 3])
        total[half, j], share[:, half, j] = size[0], parts[0]
    dims = ("quantity", "joint")
    of = {"units": "of the quantity: N, N m"}
    about = {
        "time": {"long_name": "when", "units": "s"},
        "total": {"long_name": "size of the load then, the sum of the shares", **of},
        "peak": {"long_name": "largest load", **of},
        "at_peak": {"long_name": "1: at the peak, 0: at the sample beside it", "units": "1"},
    }
    peak = np.stack([peaks[name].values for name, _, _ in HALVES])
    arrays = {"time": when, "total": total, "peak": peak, "at_peak": at_peak.astype(float)}
    data: dict[str, Any] = {name: (dims, arrays[name], about[name]) for name in arrays}
    data["share"] = (("cause", *dims), share, {"long_name": "part along the load", **of})
    data |= _mark(dims, halves_of(run))
    return xr.Dataset(
        data,
        coords={
            "cause": made.names,
            "quantity": [name for name, _, _ in HALVES],
            "joint": ("joint", names),
        },
        attrs={f"cause {name}": CAUSES[by][name] for name in made.names} | _undetermined(run),
    )


def _mark(dims: tuple[str, str], known: AnyArray | None) -> dict[str, Any]:
    """The variable that says what rigid bodies determine, where the run tells."""
    return {} if known is None else {DETERMINATE: (dims, known, dict(ABOUT_DETERMINATE))}


def _undetermined(run: RunLike) -> dict[str, str]:
    """What the run says of loads that rigid bodies do not determine: the same holds of shares."""
    said = [w["text"] for w in recorded_warnings(run.dataset.attrs) if w["element"] == "joint_load"]
    return {"undetermined": "; ".join(said)} if said else {}


class _Last:
    """The shares of the sample asked for last: joints often have their peak together."""

    def __init__(self, split: Split) -> None:
        self._split, self._sample, self._shares = split, -1, np.zeros(0)

    def at(self, sample: int) -> Array:
        if sample != self._sample:
            self._sample, self._shares = sample, self._split.shares(slice(sample, sample + 1))[0]
        return self._shares


def _larger_beside(run: RunLike, times: Array, time: float, half: int, joint: int) -> int:
    """The sample beside a time at which a joint's force or moment is larger."""
    after = int(np.searchsorted(times, time).clip(max=times.size - 1))
    first = max(after - 1, 0) if times[after] != time else after
    load = rows(run, "joint_load", slice(first, after + 1))[:, joint, 3 * half : 3 * half + 3]
    return first + int(np.argmax(lengths(load)))


def along_total(shares: Array) -> tuple[Array, Array]:
    """Shares (time, cause, 3) along their sum (time, cause), and the size of the sum (time,)."""
    total = shares.sum(axis=1)
    size = lengths(total)
    direction = total / np.where(size > 0, size, 1.0)[:, None]
    return np.einsum("tci,ti->tc", shares, direction), size
