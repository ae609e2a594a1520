"""Error bounds of joint loads: of the linear algebra, of the integration, of the sampling.

Algebraic: the recorded accelerations a leave a residual r = tau - ID(q, v, a) in the equations of
motion. One step of refinement, a' = a + H^-1 r with the factorisation of the recursion, gives the
loads that a should have had; their distance from the recorded ones is the error of the solver at
the recorded states, be it rounding or an iteration that stopped early. That the solver led there by
right accelerations is what it proved at every step (solve/checked_solver.hpp); where it did not,
the error is not known, however small it looks at the samples.

Integration: the same run at a tighter tolerance. Its own error is smaller by about the ratio of the
tolerances, so that the distance of the two runs is the error of the first.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from linkwise import _core
from linkwise._core import InputError
from linkwise.base import AnyArray, Array, lengths
from linkwise.loads.determinate import loop_rows, quantities_of
from linkwise.loads.engineering import derive, derived_rows, joint_directions
from linkwise.loads.extremes import extremes_of, quantity_rows
from linkwise.loads.peaks import summary
from linkwise.loads.samples import (
    blocks,
    external,
    given_motions,
    joint_names,
    loop_torque,
    model_of,
    need_whole,
    rows,
    select,
)

if TYPE_CHECKING:
    import xarray as xr

    from linkwise._core import Model
    from linkwise.loads.samples import RunLike

# How many times tighter `--certify` simulates again.
TIGHTER = 100.0
# The distance of two runs understates the error where both err alike: what is stated is twice it.
SAFETY = 2.0
# A step is given a tenth of a run's tolerance.
STEPS_SHARE = 0.1
# Rounding of the wrench recursion, relative to the largest load of the sample.
_ROUNDING = 64 * np.finfo(np.float64).eps


def refined_loads(run: RunLike, model: Model, where: slice) -> Array:
    """Joint loads (time, joint, 6) after one step of refinement of the recorded accelerations."""
    q, v = rows(run, "position", where), rows(run, "velocity", where)
    a = rows(run, "acceleration", where)
    outside = external(run, model, where)
    given = list(given_motions(run))
    free = model.prescribe(given) if given else model
    if model.n_loops or model.coupling_names:
        held = (a, _core.loop_accelerations(model, q, v, a)) if given else (None, None)
        return _solved_again(
            free,
            (q, v, *held),
            (rows(run, "drive_torque", where), loop_torque(run, where)),
            outside,
        )
    torque = rows(run, "drive_torque", where) + _core.passive_torque(model, q, v)
    residual = torque - _core.inverse_dynamics(model, q, v, a, external=outside)
    loads = _core.inverse_dynamics_loads(model, q, v, a, external=outside)
    for joint in given:
        residual[:, model.v_slice(joint)] = 0.0
    step = _core.forward_dynamics(free, q, None, residual, gravity=0.0, full=True)
    return np.asarray(loads + step.joint_load)


def _solved_again(
    free: Model,
    motion: tuple[Array, Array, Array | None, Array | None],
    torques: tuple[Array, Array | None],
    outside: Array | None,
) -> Array:
    """Loads of closed loops, of the recorded states: nothing iterates in their elimination."""
    q, v, a, of_loops = motion
    tau, loop_tau = torques
    solved = _core.forward_dynamics(
        free,
        q,
        v,
        tau,
        external=outside,
        passive=True,
        full=True,
        prescribed=a,
        loop_tau=loop_tau,
        loop_prescribed=of_loops,
    )
    if solved.report.outcome != "converged":  # in a singular position: not known
        return np.full(solved.joint_load.shape, np.nan)
    return np.asarray(solved.joint_load)


def _algebraic(run: RunLike, model: Model, names: list[str]) -> Array:
    """Largest algebraic error over time (quantity, joint)."""
    directions = joint_directions(model)
    worst = np.zeros((len(names), len(directions)))
    for where in blocks(run, 8 * 40 * len(directions)):
        recorded = rows(run, "joint_load", where)
        refined = refined_loads(run, model, where)
        first, second = derive(recorded, directions), derive(refined, directions)
        scale = {
            "force": lengths(recorded[..., :3]).max(axis=1),
            "moment": lengths(recorded[..., 3:]).max(axis=1),
        }
        for k, name in enumerate(names):
            if name not in first:  # power: the drives' torques are given
                continue
            of = "force" if name in ("force", "axial", "radial") else "moment"
            floor = _ROUNDING * scale[of][:, None]
            worst[k] = np.maximum(
                worst[k], (np.abs(first[name] - second[name]) + floor).max(axis=0)
            )
    return worst


def _undetermined(run: RunLike, model: Model, names: list[str]) -> AnyArray:
    """Which quantities (quantity, joint) rigid bodies do not determine, or may not."""
    directions = joint_directions(model)
    if not loop_rows(model):
        return np.zeros((len(names), len(directions)), dtype=np.bool_)
    known = quantities_of(run, model, directions, names)
    return np.ones((len(names), len(directions)), dtype=np.bool_) if known is None else ~known


def _step_tolerance(run: RunLike) -> float:
    options = json.loads(run.dataset.attrs.get("options", "{}"))
    return float(options.get("step_tolerance", np.nan))


def _check_tighter(run: RunLike, tighter: RunLike) -> None:
    same = np.array_equal(run.dataset["time"].values, tighter.dataset["time"].values)
    if not same or joint_names(run) != joint_names(tighter):
        raise InputError(
            "the tighter run has other samples or joints; simulate it with the same ones"
        )
    for key in ("model", "model_joints", "drives", "wrenches"):
        if run.dataset.attrs.get(key) != tighter.dataset.attrs.get(key):
            raise InputError(f"the tighter run has another {key}; simulate the same machine alike")
    loose, tight = _step_tolerance(run), _step_tolerance(tighter)
    if not tight <= loose / 10:
        raise InputError(
            f"the tighter run has step_tolerance {tight:g}, the run {loose:g}; "
            f"simulate it with {loose / TIGHTER:g}"
        )


class _BetweenSamples:
    """The extremes of two runs between their samples, each with the largest distance (quantity,
    joint) that the runs have had at samples until the next one after it."""

    def __init__(self, run: RunLike, tighter: RunLike, names: list[str]) -> None:
        which, times = quantity_rows(names), run.dataset["time"].values
        both = extremes_of(run, "quantity"), extremes_of(tighter, "quantity")
        self.peak = np.zeros((len(names), len(joint_names(run))))
        # Values, distances to the other run's extreme, what the tighter run may have missed.
        self._found: list[tuple[Array, Array, Array]] = []
        self._after: list[AnyArray] = []
        if both[0] is None or both[1] is None:
            return
        self.peak = np.nan_to_num(np.abs(both[0].largest[0][which]))
        for one, other in (both, both[::-1]):
            assert one is not None
            assert other is not None
            tight = both[1]
            for value, when, twin, missed in (
                (one.minimum, one.minimum_time, other.minimum, tight.minimum - tight.minimum_reach),
                (one.maximum, one.maximum_time, other.maximum, tight.maximum_reach - tight.maximum),
            ):
                self._found.append((value[which], np.abs(value - twin)[which], missed[which]))
                self._after.append(np.searchsorted(times, when[which]).clip(max=times.size - 1))

    def add(self, k: int, where: slice, running: Array) -> None:
        """The distances of quantity k until each sample (time, joint) of one block."""
        for (_, apart, _), after in zip(self._found, self._after, strict=True):
            joints = np.flatnonzero((after[k] >= where.start) & (after[k] < where.stop))
            until = running[after[k, joints] - where.start, joints]
            apart[k, joints] = np.fmax(apart[k, joints], until)

    def reach(self) -> Array:
        """No true extreme is higher."""
        reach = np.zeros_like(self.peak)
        for value, apart, missed in self._found:
            reach = np.fmax(reach, np.abs(value) + SAFETY * apart + missed)
        return reach


def _integration(run: RunLike, tighter: RunLike, model: Model, names: list[str]) -> Array:
    """Error bound (quantity, joint) of the peaks.

    At every time the truth is taken to be within SAFETY times the largest distance that the two
    runs have had until then (at one time alone they may be close by chance), of which the distance
    of their extremes between samples is one. So no true peak, whenever it comes, is higher than the
    largest of all the values with this added. And no run vouches for less than its own tolerance:
    where a method's stability makes the steps, a tighter one moves both runs little.
    """
    found = select(run, model)
    directions = joint_directions(model)[found.joints]
    between = _BetweenSamples(run, tighter, names)
    peak = between.peak.copy()
    reach, largest = np.zeros_like(peak), np.zeros_like(peak)
    for where in blocks(run, 8 * 40 * found.joints.size):
        first = derived_rows(run, found, directions, where)
        second = derived_rows(tighter, found, directions, where)
        for k, name in enumerate(names):
            distance = np.abs(first[name] - second[name])
            running = np.maximum.accumulate(np.vstack([largest[k], distance]), axis=0)[1:]
            largest[k] = running[-1]
            between.add(k, where, running)
            size = np.abs(first[name])
            peak[k] = np.fmax(peak[k], size.max(axis=0))
            reach[k] = np.fmax(reach[k], (size + SAFETY * running).max(axis=0))
    own = _step_tolerance(tighter) / STEPS_SHARE
    return np.fmax(reach, between.reach()) - peak + own * peak


def bounds(run: RunLike, tighter: RunLike | None = None, model: Model | None = None) -> xr.Dataset:
    """How far each peak of `summary` may be from the truth.

    Args:
        run: Holds `joint_load`, `position`, `velocity`, `acceleration`, `drive_torque` of all
            joints, and `external_wrench` where there are wrenches.
        tighter: The same simulation at a tolerance at least ten times tighter, with the same
            samples; without it the error of the integration is not known.
        model: The machine, if the run does not hold it.

    Returns:
        Dataset over (quantity, joint), in the quantities' units: `algebraic`, `integration` and
        `plus_minus`, their sum; the last two are NaN without `tighter`, `algebraic` where the run
        has an iterative solver whose errors are not bounded (`run.warnings` says so), or closed
        loops that pass a singular position, or rigid bodies do not determine the load. Errors of
        the model, of its data and of peaks that were not found (`sampling` of `summary`) are not
        in it.
    """
    import xarray as xr

    machine = model_of(run, model)
    wanted = ("joint_load", "position", "velocity", "acceleration", "drive_torque")
    need_whole(run, machine, *wanted)
    peaks = summary(run, machine)
    names = [str(name) for name in peaks["quantity"].values]
    absent = np.isnan(peaks["peak"].values)
    unknown = absent | _undetermined(run, machine, names)
    unknown |= np.full_like(absent, run.dataset.attrs.get("solver_error") == "not bounded")
    algebraic = np.where(unknown, np.nan, _algebraic(run, machine, names))
    integration = np.full_like(algebraic, np.nan)
    if tighter is not None:
        _check_tighter(run, tighter)
        integration = _integration(run, tighter, machine, names)
        integration[absent] = np.nan
    data = {
        "algebraic": (algebraic, "error of the linear algebra, by one step of refinement"),
        "integration": (
            integration,
            f"error of the integration, from {SAFETY:g} times the distance to the tighter run",
        ),
        "plus_minus": (
            algebraic + integration,
            "algebraic and integration error of the peak; not known without a tighter run",
        ),
    }
    units = "of the quantity, see quantity_units"
    return xr.Dataset(
        {
            name: (("quantity", "joint"), values, {"long_name": text, "units": units})
            for name, (values, text) in data.items()
        },
        coords={name: peaks[name] for name in ("quantity", "quantity_units", "joint")},
    )
