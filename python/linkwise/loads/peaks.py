"""Peaks with their time and simultaneous wrench, envelopes, mean, RMS and duty."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.base import HALVES, Array, lengths
from linkwise.loads.determinate import (
    ABOUT_DETERMINATE,
    components_of,
    halves_of,
    quantities_of,
)
from linkwise.loads.engineering import (
    QUANTITIES,
    derived_rows,
    has_power,
    joint_directions,
)
from linkwise.loads.extremes import Extremes, extremes_of, load_at_extremes, quantity_rows
from linkwise.loads.members import each_member
from linkwise.loads.samples import (
    blocks,
    joint_names,
    model_of,
    need,
    rows,
    select,
    trapezoid_weights,
)
from linkwise.notes import kept_warnings
from linkwise.record.schema import DETERMINATE

if TYPE_CHECKING:
    import xarray as xr

    from linkwise._core import Model
    from linkwise.loads.samples import RunLike

# A load counts as on duty above this share of its peak.
DUTY_LEVEL = 0.1


class _Statistics:
    """What one pass over the samples collects, (quantity, joint) each."""

    def __init__(self, quantities: int, joints: int) -> None:
        shape = (quantities, joints)
        self.largest = np.full(shape, -1.0)
        self.peak, self.peak_time = np.full(shape, np.nan), np.full(shape, np.nan)
        self.minimum, self.maximum = np.full(shape, np.inf), np.full(shape, -np.inf)
        self.total, self.squares = np.zeros(shape), np.zeros(shape)
        self.sampled, self.sampling = np.zeros(shape), np.zeros(shape)
        self.wrench = np.full((*shape, 6), np.nan)
        self.reach: Array | None = None

    def begin(self, found: Extremes, wrench: Array, which: list[int]) -> None:
        """From the extremes between the samples, of all derived quantities."""
        self.peak, self.peak_time = (values[which] for values in found.largest)
        self.largest = np.where(np.isnan(self.peak), -1.0, np.abs(self.peak))
        self.minimum = np.where(np.isnan(self.peak), np.inf, found.minimum[which])
        self.maximum = np.where(np.isnan(self.peak), -np.inf, found.maximum[which])
        self.wrench, self.reach = wrench[which], found.reach[which]

    def missed(self) -> Array:
        """How much higher than found a peak may be."""
        if self.reach is None:
            return self.sampling
        more: Array = np.maximum(self.reach - self.largest, 0.0)
        return more

    def unseen(self) -> Array:
        """The share of the peak that no sample shows."""
        if self.reach is None:
            return np.full_like(self.peak, np.nan)
        share: Array = 1 - self.sampled / np.where(self.largest > 0, self.largest, np.inf)
        return np.where(self.largest > 0, share, 0.0)

    def add(
        self, values: Array, load: Array, times: Array, weights: Array, first: int, count: int
    ) -> None:
        """Samples first ... first + count - 1 of values (quantity, time, joint); the others are
        their neighbours."""
        inner = values[:, first : first + count]
        self.minimum = np.minimum(self.minimum, inner.min(axis=1))
        self.maximum = np.maximum(self.maximum, inner.max(axis=1))
        with np.errstate(over="ignore", invalid="ignore"):  # of a run that went astray
            self.total += np.einsum("t,qtj->qj", weights, inner)
            self.squares += np.einsum("t,qtj->qj", weights, inner**2)
        size = np.abs(inner)
        at = np.argmax(np.where(np.isnan(size), -1.0, size), axis=1)
        best = np.take_along_axis(size, at[:, None], axis=1)[:, 0]
        self.sampled = np.fmax(self.sampled, best)
        better = best > self.largest  # False for NaN
        quantity, joint = np.nonzero(better)
        k = at[better]
        self.largest[better] = best[better]
        self.peak[better] = inner[quantity, k, joint]
        self.peak_time[better] = times[first + k]
        self.wrench[better] = load[first + k, joint]
        here = first + k
        last = values.shape[1] - 1
        inside = (here > 0) & (here < last)
        before, after = np.maximum(here - 1, 0), np.minimum(here + 1, last)
        bend = values[quantity, before, joint] + values[quantity, after, joint]
        bend -= 2 * values[quantity, here, joint]
        self.sampling[better] = np.where(inside, np.abs(bend) / 8, 0.0)


def _with_neighbours(where: slice, count: int) -> slice:
    return slice(max(0, where.start - 1), min(count, where.stop + 1))


@each_member
def summary(run: RunLike, model: Model | None = None) -> xr.Dataset:
    """Per quantity and joint the peak, when, and the whole wrench at that moment.

    Args:
        run: Holds `joint_load`; with `velocity` and `drive_torque` also drive power.
        model: The machine, if the run does not hold it.

    Returns:
        Dataset over (quantity, joint): `peak` (the value of largest magnitude, with its sign),
        `peak_time`, `wrench` (component) at that time, `minimum`, `maximum`, `mean`, `rms` (over
        time, by the trapezoidal rule), `duty` (share of the time above a tenth of the peak) and
        `sampling` (how much higher a peak may be that was not found). NaN where a joint has no
        single axis. Peaks, minima and maxima are those of the whole motion, between the samples
        too, where the run holds its extremes (`Recording.extremes`); `sampling` is then what
        their search left open. Else they are those of the samples, and `sampling` is an eighth of
        the second difference, which knows smooth peaks alone. The attribute `extremes` says
        "along the steps" or "of the samples". Of machines with loops `determinate` as well, and
        `wrench_determinate` (joint, component): where false, the numbers are one choice of many.
    """
    import xarray as xr

    need(run, "joint_load")
    machine = model_of(run, model)
    found = select(run, machine)
    directions = joint_directions(machine)[found.joints]
    names = [name for name in QUANTITIES if name != "drive_power" or has_power(run)]
    times = run.dataset["time"].values.astype(np.float64)
    weights = trapezoid_weights(times)
    row_bytes = 8 * (6 + 3 * len(names)) * max(1, found.joints.size)
    collected = _Statistics(len(names), found.joints.size)
    between = extremes_of(run, "quantity")
    if between is not None:
        collected.begin(between, load_at_extremes(run), quantity_rows(names))
    for where in blocks(run, row_bytes):
        wide = _with_neighbours(where, times.size)
        values = derived_rows(run, found, directions, wide)
        stacked = np.stack([values[name] for name in names])
        load = rows(run, "joint_load", wide)
        inner = where.start - wide.start, where.stop - where.start
        collected.add(stacked, load, times[wide], weights[where], *inner)
    duty = np.zeros_like(collected.peak)
    for where in blocks(run, row_bytes):
        values = derived_rows(run, found, directions, where)
        stacked = np.abs(np.stack([values[name] for name in names]))
        above = stacked > DUTY_LEVEL * collected.largest[:, None]
        duty += np.einsum("t,qtj->qj", weights[where], above)
    span = weights.sum()
    absent = np.isnan(collected.peak)
    over = {
        "peak": (collected.peak, "value of largest magnitude"),
        "minimum": (np.where(absent, np.nan, collected.minimum), "smallest value"),
        "maximum": (np.where(absent, np.nan, collected.maximum), "largest value"),
        "mean": (collected.total / span, "mean over time, of the samples"),
        "rms": (np.sqrt(collected.squares / span), "root mean square over time, of the samples"),
        "sampling": (
            np.where(absent, np.nan, collected.missed()),
            "what a peak that was not found may add",
        ),
    }
    dims = ("quantity", "joint")
    by_quantity = {"units": "of the quantity, see quantity_units"}
    data: dict[str, Any] = {
        name: (dims, array, {"long_name": text, **by_quantity})
        for name, (array, text) in over.items()
    }
    attrs = {"long_name": "time of the peak", "units": "s"}
    data["peak_time"] = (dims, collected.peak_time, attrs)
    about_duty = f"share of the samples' time above {DUTY_LEVEL:g} of the peak's magnitude"
    duty = np.where(absent, np.nan, np.minimum(duty / span, 1.0))
    data["duty"] = (dims, duty, {"long_name": about_duty, "units": "1"})
    about_missed = "share of the peak that no sample shows"
    unseen = np.where(absent, np.nan, collected.unseen())
    data["missed"] = (dims, unseen, {"long_name": about_missed, "units": "1"})
    known = quantities_of(run, machine, directions, names)
    if known is not None:
        data["determinate"] = (dims, known, dict(ABOUT_DETERMINATE))
        about = dict(ABOUT_DETERMINATE)
        data["wrench_determinate"] = (("joint", "component"), components_of(run), about)
    given = run.dataset["joint_load"]
    data["wrench"] = ((*dims, "component"), collected.wrench, dict(given.attrs))
    return xr.Dataset(
        data,
        coords={
            "quantity": names,
            "quantity_units": ("quantity", [QUANTITIES[name].units for name in names]),
            "joint": ("joint", joint_names(run)),
            "component": given["component"],
        },
        attrs={**kept_warnings(run.dataset.attrs), **_how(between)},
    )


def _how(between: Extremes | None) -> dict[str, str]:
    return {"extremes": "of the samples" if between is None else "along the steps"}


@each_member
def envelope(run: RunLike) -> xr.Dataset:
    """Smallest and largest value of every load component and when: (joint, component).

    Returns:
        Dataset: `minimum`, `minimum_time`, `maximum`, `maximum_time`; frame as `joint_load`; of
        machines with loops `determinate` as well.
        Between the samples too, as in `summary`.
    """
    import xarray as xr

    need(run, "joint_load")
    given = run.dataset["joint_load"]
    times = run.dataset["time"].values
    shape = (given.sizes["joint"], given.sizes["component"])
    found = {"minimum": np.full(shape, np.inf), "maximum": np.full(shape, -np.inf)}
    when = {name: np.zeros(shape) for name in found}
    between = extremes_of(run, "joint_load")
    if between is not None:
        found = {"minimum": between.minimum, "maximum": between.maximum}
        when = {"minimum": between.minimum_time, "maximum": between.maximum_time}
    for where in blocks(run, 48 * shape[0]):
        load = rows(run, "joint_load", where)
        for name, sign in (("minimum", -1.0), ("maximum", 1.0)):
            at = np.argmax(sign * load, axis=0)
            value = np.take_along_axis(load, at[None], axis=0)[0]
            better = sign * value > sign * found[name]
            found[name][better] = value[better]
            when[name][better] = times[where][at[better]]
    dims = ("joint", "component")
    data = {name: (dims, values, dict(given.attrs)) for name, values in found.items()}
    for name, values in when.items():
        data[f"{name}_time"] = (dims, values, {"long_name": f"time of the {name}", "units": "s"})
    known = components_of(run)
    if known is not None:
        data[DETERMINATE] = (dims, known, dict(ABOUT_DETERMINATE))
    coords = {"joint": ("joint", joint_names(run)), "component": given["component"]}
    return xr.Dataset(data, coords=coords, attrs=_how(between))


@each_member
def peak_loads(run: RunLike) -> xr.Dataset:
    """Largest force and moment that each joint carries, and when.

    Returns:
        Dataset over `joint`: `force` [N] and `moment` [N m] (magnitudes of the joint load's two
        halves, the moment about the joint point) with `force_time` and `moment_time` [s]. Of
        machines with loops `force_determinate` and `moment_determinate` as well. Between the
        samples too, as in `summary`.

    Raises:
        InputError: the run holds no joint loads or no samples.
    """
    import xarray as xr

    names, times = joint_names(run), run.dataset["time"].values
    largest = np.full((2, len(names)), -1.0)
    when = np.zeros((2, len(names)))
    between = extremes_of(run, "quantity")
    if between is not None:
        which = quantity_rows(["force", "moment"])
        largest, when = between.maximum[which], between.maximum_time[which]
    for where in blocks(run, 48 * len(names)):
        load = rows(run, "joint_load", where).reshape(-1, len(names), 2, 3)
        size = lengths(load)
        at = np.argmax(size, axis=0)
        peak = np.take_along_axis(size, at[None], axis=0)[0].T
        better = peak > largest
        largest[better] = peak[better]
        when[better] = times[where.start + at.T][better]
    data: dict[str, Any] = {}
    known = halves_of(run)
    for k, (name, units, _) in enumerate(HALVES):
        attrs = {"long_name": f"largest joint {name}", "units": units}
        data[name] = ("joint", largest[k], attrs)
        at_attrs = {"long_name": f"time of the largest joint {name}", "units": "s"}
        data[f"{name}_time"] = ("joint", when[k], at_attrs)
        if known is not None:
            data[f"{name}_{DETERMINATE}"] = ("joint", known[k], dict(ABOUT_DETERMINATE))
    joints = {"joint": ("joint", run.dataset["joint"].values)}
    attrs = {**kept_warnings(run.dataset.attrs), **_how(between)}
    return xr.Dataset(data, coords=joints, attrs=attrs)
