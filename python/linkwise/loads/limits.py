"""Joints that left their position limits in a run: without stops, limits exert no force."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.base import Array
from linkwise.loads.extremes import extremes_of
from linkwise.loads.samples import blocks, dof_rows

if TYPE_CHECKING:
    from linkwise._core import Model
    from linkwise.loads.samples import RunLike


def _limited(run: RunLike, model: Model) -> list[tuple[str, int, float, float]]:
    """Joint, column, lower and upper limit of joints with a finite limit and no stop."""
    names = run.dataset["joint"].values.tolist() if "joint" in run.dataset else model.joint_names
    sizes = dict(zip(model.joint_names, model.joint_nq, strict=True))
    free = model.limit_stiffness == 0
    low, high = model.lower_limit, model.upper_limit
    loops = dict(zip(model.loop_names, model.loop_slices, strict=True))
    found, first = [], 0
    for name in names:
        if name not in sizes:  # it closes a loop, and has no part in q
            continue
        dofs = range(model.nv)[model.v_slice(name)]
        if len(dofs) == sizes[name]:  # quaternions have no limits
            found += [
                (name, first + k, float(low[dof]), float(high[dof]))
                for k, dof in enumerate(dofs)
                if free[dof] and np.isfinite([low[dof], high[dof]]).any()
            ]
        first += sizes[name]
    # Nothing is known of joints that the run does not name.
    if first != run.dataset["position"].shape[1]:
        return []
    if "loop_position" not in run.dataset:
        return found
    free = model.loop_property("limit_stiffness") == 0
    low, high = model.loop_property("lower"), model.loop_property("upper")
    recorded = set(names) if "joint" in run.dataset else set(loops)
    for name, (q, v) in loops.items():
        if name not in recorded:
            continue
        dofs = range(v.start, v.stop)
        if len(dofs) == q.stop - q.start:
            found += [
                (name, first + k, float(low[dof]), float(high[dof]))
                for k, dof in enumerate(dofs)
                if free[dof] and np.isfinite([low[dof], high[dof]]).any()
            ]
        first += q.stop - q.start
    return found


def beyond_limits(run: RunLike) -> list[dict[str, Any]]:
    """Per joint beyond a limit: since when [s], to a sample, and its farthest position there, to
    the extremes between samples where the run holds them."""
    limited = _limited(run, run.load_model()) if "position" in run.dataset else []
    if not limited:
        return []
    columns = [column for _, column, _, _ in limited]
    lower, upper = np.array([row[2:] for row in limited]).T
    since, farthest = np.full((2, len(limited)), np.nan)
    worst = np.zeros(len(limited))
    between = extremes_of(run, "position")
    if between is not None:
        # Positions of joints that close loops have no extremes between samples.
        loops = max(columns) + 1 - between.minimum.size
        padding = ((0, 0), (0, max(loops, 0)))
        of_all = [
            np.pad(np.stack(pair), padding, constant_values=np.nan)
            for pair in (
                (between.minimum, between.maximum),
                (between.minimum_time, between.maximum_time),
            )
        ]
        q, when = of_all[0][:, columns], of_all[1][:, columns]
        past = np.maximum(lower - q, q - upper)
        worst_end = np.argmax(past, axis=0), np.arange(len(limited))
        beyond = past[worst_end] > 0
        since[beyond] = when[worst_end][beyond]
        farthest[beyond], worst[beyond] = q[worst_end][beyond], past[worst_end][beyond]
    times: Array = run.dataset["time"].values
    for where in blocks(run, 8 * run.dataset["position"].shape[1]):
        q = dof_rows(run, "position", where)[:, columns]
        past = np.maximum(lower - q, q - upper)
        first_time = times[where][(past > 0).argmax(axis=0)]
        out = (past > 0).any(axis=0)
        since = np.where(out, np.fmin(since, first_time), since)
        at = past.argmax(axis=0), np.arange(len(limited))
        farther = past[at] > worst
        farthest[farther], worst[farther] = q[at][farther], past[at][farther]
    return [
        {
            "joint": limited[k][0],
            "lower": float(lower[k]),
            "upper": float(upper[k]),
            "since": float(since[k]),
            "farthest": float(farthest[k]),
        }
        for k in np.flatnonzero(worst > 0)
    ]
