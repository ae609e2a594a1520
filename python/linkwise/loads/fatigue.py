"""Load cycles and what they damage, load durations, spectra.

All of it is of the samples, with the largest and the smallest value between them where cycles are
counted. The attribute `samples` of every result says what the samples miss.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from linkwise._core import InputError, as_floats
from linkwise.base import COMPONENTS, AnyArray, Array
from linkwise.io.complaint import check_one_of, shown
from linkwise.loads.determinate import joint_rows, signal_of
from linkwise.loads.engineering import QUANTITIES, derive, drive_power, has_power, joint_directions
from linkwise.loads.extremes import extremes_of, quantity_rows, what_samples_miss
from linkwise.loads.members import each_member
from linkwise.loads.samples import (
    joint_names,
    joint_position,
    model_of,
    need,
    rows,
    select,
    trapezoid_weights,
)
from linkwise.record.schema import DETERMINATE

if TYPE_CHECKING:
    import xarray as xr

    from linkwise._core import Model
    from linkwise.loads.samples import RunLike

# Slopes of Woehler lines: welded steel, steel, cast iron and composites.
EXPONENTS = (3.0, 5.0, 10.0)
_MOST_BINS = 1_000_000


def signal(
    run: RunLike, joint: str, quantity: str, model: Model | None = None
) -> tuple[Array, str]:
    """One quantity or component of one joint over time, and its unit."""
    need(run, "joint_load")
    k = joint_position(run, joint)
    load = rows(run, "joint_load", slice(None))
    check_one_of("quantity", quantity, (*COMPONENTS, *QUANTITIES))
    if quantity in COMPONENTS:
        c = COMPONENTS.index(quantity)
        return load[:, k, c], "N" if c < 3 else "N m"
    machine = model_of(run, model)
    found = select(run, machine)
    if quantity == "drive_power":
        if not has_power(run):
            raise InputError("run holds no drive power; record velocity and drive_torque")
        values = drive_power(run, found, slice(None))[:, k]
    else:
        direction = joint_directions(machine)[found.joints][k : k + 1]
        values = derive(load[:, k : k + 1], direction)[quantity][:, 0]
    if np.isnan(values).any():
        raise InputError(
            f"joint {joint!r} has no single axis, so no {QUANTITIES[quantity].long_name}; "
            "use force, moment or a component"
        )
    return values, QUANTITIES[quantity].units


def _mark(run: RunLike, joint: str, quantity: str, model: Model | None) -> dict[str, AnyArray]:
    """The coordinate that says whether rigid bodies determine a signal, where the run tells."""
    k = joint_position(run, joint)
    machine = model_of(run, model) if quantity not in COMPONENTS else None
    direction = np.full(3, np.nan)
    if machine is not None:
        direction = joint_directions(machine)[select(run, machine).joints][k]
    known = signal_of(run, machine, k, quantity, direction)
    return {} if known is None else {DETERMINATE: np.array(known)}


def _turning(run: RunLike, values: Array, joint: int, quantity: str) -> Array:
    """A signal (time,) with the extremes that it has between the samples put in where they were."""
    component = quantity in COMPONENTS
    between = extremes_of(run, "joint_load" if component else "quantity")
    if between is None:
        return values
    at = (joint, COMPONENTS.index(quantity)) if component else (quantity_rows([quantity])[0], joint)
    found = [
        (float(when[at]), float(value[at]))
        for value, when, beyond in (
            (between.minimum, between.minimum_time, between.minimum[at] < values.min()),
            (between.maximum, between.maximum_time, between.maximum[at] > values.max()),
        )
        if beyond
    ]
    times, extremes = np.array(sorted(found)).reshape(-1, 2).T
    return np.insert(values, np.searchsorted(run.dataset["time"].values, times), extremes)


def _is_list(value: object) -> bool:
    """An array without axes is an Iterable that cannot be walked."""
    return isinstance(value, Iterable) and not (isinstance(value, np.ndarray) and value.ndim == 0)


def _rainflow() -> object:
    try:
        import rainflow
    except ModuleNotFoundError:
        raise InputError(
            "counting load cycles needs the package rainflow; pip install 'linkwise[report]'"
        ) from None
    return rainflow


def _count(values: Array) -> Array:
    """Rainflow cycles of a signal: rows of (range, mean, count), count 1 or 0.5 [astm1985]."""
    with np.errstate(over="ignore"):  # of a run that went astray
        counted = [cycle[:3] for cycle in _rainflow().extract_cycles(values)]  # type: ignore[attr-defined]
    return np.array(counted, dtype=np.float64).reshape(-1, 3)


def cycles(run: RunLike, joint: str, quantity: str, model: Model | None = None) -> xr.Dataset:
    """Rainflow cycles of one quantity or component of one joint.

    Returns:
        Dataset over `cycle`: `range`, `mean` and `count` (1, or 0.5 for half cycles). The largest
        and the smallest value between the samples are counted where the run holds its extremes;
        lesser turns that the samples miss are not. Of machines with loops the coordinate
        `determinate` says whether rigid bodies determine the quantity.
    """
    import xarray as xr

    values, units = signal(run, joint, quantity, model)
    counted = _count(_turning(run, values, joint_position(run, joint), quantity))
    about = {"range": ("range of the cycle", units), "mean": ("mean of the cycle", units)}
    about["count"] = ("whole or half cycle", "1")
    data = {
        name: ("cycle", counted[:, k], {"long_name": text, "units": unit})
        for k, (name, (text, unit)) in enumerate(about.items())
    }
    about_run = {"method": "ASTM E1049", "samples": what_samples_miss(run, [joint])}
    coords = _mark(run, joint, quantity, model)
    about_run |= {"joint": joint, "quantity": quantity}
    return xr.Dataset(data, coords=coords, attrs=about_run)


def equivalent(ranges: Array, counts: Array, exponent: float, repetitions: float) -> float:
    """Range that, `repetitions` times, damages as much as all cycles: (sum n S^m / N)^(1/m).

    InputError where it is beyond all numbers, as for exponents far below 1.
    """
    if ranges.size == 0:
        return 0.0
    largest = float(ranges.max())
    if largest == 0:
        return 0.0
    scaled = float(np.sum(counts * (ranges / largest) ** exponent))
    try:
        found = largest * (scaled / repetitions) ** (1 / exponent)
    except OverflowError:
        found = np.inf
    if not np.isfinite(found):
        raise InputError(
            f"exponents: with {exponent:g} the equivalent range is too large for a number; Woehler "
            "lines have slopes of 3 to 15"
        )
    return float(found)


def ranges_of(values: Array, slopes: Array, count: float) -> Array:
    """Damage-equivalent ranges (exponent,) of one signal (time,)."""
    counted = _count(values)
    found = [equivalent(counted[:, 0], counted[:, 2], float(m), count) for m in slopes]
    return np.array(found)


def checked_exponents(exponents: Sequence[float]) -> Array:
    """Slopes of Woehler lines, or InputError."""
    slopes = as_floats(exponents, "exponents")
    if slopes.ndim != 1 or not slopes.size or not (np.isfinite(slopes) & (slopes > 0)).all():
        raise InputError("exponents: give positive numbers, such as 3, 5 and 10")
    return slopes


def checked_repetitions(times: Array, repetitions: float | None) -> float:
    """How many equal cycles, one per second unless given, or InputError."""
    if times.size < 2:
        raise InputError("run holds one sample, and cycles need two; record more, with every=")
    span = float(times[-1] - times[0])
    given = as_floats(span if repetitions is None else repetitions, "repetitions")
    if given.ndim or not (np.isfinite(given) and given > 0):
        raise InputError("repetitions: give a positive number")
    return float(given)


@each_member
def damage_equivalent(
    run: RunLike,
    exponents: Sequence[float] = EXPONENTS,
    repetitions: float | None = None,
    joints: Sequence[str] | None = None,
) -> xr.DataArray:
    """Damage-equivalent ranges of every load component.

    Args:
        run: Holds `joint_load`.
        exponents: Slopes m of the Woehler lines, N ~ S^-m.
        repetitions: Number N of equal cycles; one per second of the run by default (1 Hz).
        joints: All by default.

    Returns:
        DataArray (exponent, joint, component), peak to peak, N and N m. Cycles are those of
        `cycles`. Of machines with loops the coordinate `determinate` (joint, component) says which
        of them rigid bodies determine.
    """
    import xarray as xr

    need(run, "joint_load")
    slopes = checked_exponents(exponents)
    count = checked_repetitions(run.dataset["time"].values, repetitions)
    if joints is not None and (isinstance(joints, str) or not _is_list(joints)):
        raise InputError(f"joints: {shown(joints)} given; give a list of names")
    names = joint_names(run) if joints is None else list(joints)
    where = [joint_position(run, name) for name in names]
    load = rows(run, "joint_load", slice(None))[:, where]
    found = np.zeros((slopes.size, len(names), len(COMPONENTS)))
    for j in range(len(names)):
        for c, component in enumerate(COMPONENTS):
            values = _turning(run, load[:, j, c], where[j], component)
            found[:, j, c] = ranges_of(values, slopes, count)
    given = run.dataset["joint_load"]
    mask = joint_rows(run, names)
    known = {} if mask is None else {DETERMINATE: (("joint", "component"), mask)}
    return xr.DataArray(
        found,
        dims=("exponent", "joint", "component"),
        coords={
            "exponent": slopes.tolist(),
            "joint": names,
            "component": given["component"],
            **known,
        },
        attrs={
            **given.attrs,
            "long_name": f"damage-equivalent load range for {count:g} cycles",
            "method": "rainflow (ASTM E1049) and linear damage (Palmgren, Miner)",
            "samples": what_samples_miss(run, names),
        },
        name="damage_equivalent",
    )


def load_duration(
    run: RunLike, joint: str, quantity: str, bins: int = 40, model: Model | None = None
) -> xr.DataArray:
    """How long a quantity stays in each class of its range: (level) [s], classes of equal width.

    Of machines with loops with the coordinate `determinate`, as `cycles`.
    """
    import xarray as xr

    values, units = signal(run, joint, quantity, model)
    whole = isinstance(bins, int | np.integer) and not isinstance(bins, bool)
    if not whole or not 1 <= bins <= _MOST_BINS:
        raise InputError(f"bins: is {shown(bins)}; give a number of classes from 1 to {_MOST_BINS}")
    weights = trapezoid_weights(run.dataset["time"].values.astype(np.float64))
    low, high = float(values.min()), float(values.max())
    if high - low <= 1e-9 * max(abs(low), abs(high)):  # a constant: classes about it
        reach = 1e-3 * abs(low) or 1.0
        low, high = low - reach, high + reach
    time, edges = np.histogram(values, bins=bins, range=(low, high), weights=weights)
    level = {"long_name": f"centre of the class of {quantity}", "units": units}
    return xr.DataArray(
        time,
        dims="level",
        coords={
            "level": ("level", (edges[1:] + edges[:-1]) / 2, level),
            **_mark(run, joint, quantity, model),
        },
        attrs={
            "long_name": "time in the class",
            "units": "s",
            "class_width": edges[1] - edges[0],
            "samples": what_samples_miss(run, [joint]),
        },
        name="load_duration",
    )


def spectrum(run: RunLike, joint: str, quantity: str, model: Model | None = None) -> xr.DataArray:
    """One-sided power spectral density of a quantity about its mean: (frequency) [units^2/Hz].

    Periodogram with a Hann window; samples at unequal times are interpolated linearly first. Of
    machines with loops with the coordinate `determinate`, as `cycles`.
    """
    import xarray as xr
    from scipy.signal import periodogram

    values, units = signal(run, joint, quantity, model)
    times = run.dataset["time"].values.astype(np.float64)
    if times.size < 8:
        raise InputError(f"run holds {times.size} samples; a spectrum needs at least 8")
    even = np.linspace(times[0], times[-1], times.size)
    interval = float(even[1] - even[0])
    if not np.allclose(times, even, rtol=0, atol=1e-6 * interval):
        values = np.interp(even, times, values)
    frequency, density = periodogram(values, fs=1 / interval, window="hann", detrend="constant")
    return xr.DataArray(
        density,
        dims="frequency",
        coords={
            "frequency": ("frequency", frequency, {"units": "Hz", "long_name": "frequency"}),
            **_mark(run, joint, quantity, model),
        },
        attrs={
            "long_name": f"spectral density of {quantity}",
            "units": f"({units})^2/Hz",
            "samples": what_samples_miss(run, [joint]),
        },
        name="spectrum",
    )
