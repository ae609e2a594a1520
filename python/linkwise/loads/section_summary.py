"""Peaks and envelopes along elastic links, load cycles inside them, and what they may carry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise._core import InputError
from linkwise.base import COMPONENTS, Array
from linkwise.io.complaint import near, shown
from linkwise.loads.fatigue import EXPONENTS, checked_exponents, checked_repetitions, ranges_of
from linkwise.loads.members import each_member
from linkwise.loads.rating import check_rating
from linkwise.loads.sections import Sections, extreme_stress, fibres, stress_at

if TYPE_CHECKING:
    import xarray as xr

    from linkwise._core import Model
    from linkwise.loads.samples import RunLike

STRESS = "stress"
_UNITS = {name: "N" if name[0] == "f" else "N m" for name in COMPONENTS} | {STRESS: "Pa"}
LONG_NAMES = {
    "fx": "axial force",
    "fy": "shear along y",
    "fz": "shear along z",
    "nx": "torsion",
    "ny": "bending about y",
    "nz": "bending about z",
    STRESS: "fibre stress",
}


@each_member
def section_summary(run: RunLike, link: str, n: int = 11, model: Model | None = None) -> xr.Dataset:
    """The largest loads inside an elastic link, where and when, and the envelope along it.

    Args:
        run, link, n, model: As for `section_loads`.

    Returns:
        Dataset over `quantity`, the components fx ... nz and `stress`, where the outer sizes of the
        section are known: `peak` (the value of largest magnitude at all sections, with its sign),
        `peak_time` [s], `peak_x` [m] from the link's start, and `peak_error`, the discretisation
        error there (NaN for fy and fz). Over (section, quantity): `minimum`, `minimum_time`,
        `maximum`, `maximum_time`. The coordinate `quantity_units` has the units. Of the samples.

    Raises:
        InputError: as `section_loads`.
    """
    import xarray as xr

    of = Sections(run, link, n, model)
    names = [*COMPONENTS, *([STRESS] if fibres(of.section) is not None else [])]
    shape = (of.n, len(names))
    low, high = np.full(shape, np.inf), np.full(shape, -np.inf)
    low_time, high_time = np.full(shape, np.nan), np.full(shape, np.nan)
    off_low, off_high = np.full(shape, np.nan), np.full(shape, np.nan)
    for block, load, error in of.blocks():
        smallest, largest = _both(load, of.section, len(names) > 6)
        if len(names) > 6:
            error = np.concatenate([error, _stress_error(error, of.section)[..., None]], axis=-1)
        for values, best, when, off, sign in (
            (smallest, low, low_time, off_low, -1.0),
            (largest, high, high_time, off_high, 1.0),
        ):
            at = np.argmax(sign * values, axis=0)
            value = np.take_along_axis(values, at[None], axis=0)[0]
            better = sign * value > sign * best
            best[better] = value[better]
            when[better] = of.times[block][at[better]]
            off[better] = np.take_along_axis(error, at[None], axis=0)[0][better]
    rising = high >= -low
    size = np.where(rising, high, -low)
    where = np.argmax(size, axis=0)
    every = np.arange(len(names))
    up = rising[where, every]
    peak = {
        "peak": np.where(up, high[where, every], low[where, every]),
        "peak_time": np.where(up, high_time[where, every], low_time[where, every]),
        "peak_x": of.x[where],
        "peak_error": np.where(up, off_high[where, every], off_low[where, every]),
    }
    data: dict[str, Any] = {name: ("quantity", values) for name, values in peak.items()}
    along = {"minimum": low, "minimum_time": low_time, "maximum": high, "maximum_time": high_time}
    data |= {name: (("section", "quantity"), values) for name, values in along.items()}
    found = xr.Dataset(
        data,
        coords={
            **of.coords(),
            "quantity": names,
            "quantity_units": ("quantity", [_UNITS[name] for name in names]),
        },
        attrs={"link": link, "sign": "inboard part on outboard part", "extremes": "of the samples"},
    )
    for name in found.data_vars:
        unit = "s" if str(name).endswith("time") else "m" if name == "peak_x" else "of the quantity"
        found[name].attrs["units"] = unit
    return found


def _both(load: Array, section: dict[str, Any], stressed: bool) -> tuple[Array, Array]:
    """Smallest and largest value (time, section, quantity) at each sample: of stress there are
    two."""
    if not stressed:
        return load, load
    low, high = extreme_stress(load, section)
    return tuple(np.concatenate([load, s[..., None]], axis=-1) for s in (low, high))  # type: ignore[return-value]


def _stress_error(error: Array, section: dict[str, Any]) -> Array:
    """What errors of the loads make of the stress, at most."""
    off = error.copy()
    off[..., 0] *= -1  # it is counted as tension
    return extreme_stress(off, section)[1]


@each_member
def section_damage(
    run: RunLike,
    link: str,
    n: int = 11,
    exponents: Sequence[float] = EXPONENTS,
    repetitions: float | None = None,
    model: Model | None = None,
) -> xr.DataArray:
    """Damage-equivalent ranges of the loads inside an elastic link.

    Args:
        run, link, n, model: As for `section_loads`.
        exponents: Slopes m of the Woehler lines, N ~ S^-m.
        repetitions: Number N of equal cycles; one per second of the run by default (1 Hz).

    Returns:
        DataArray (exponent, section, quantity), peak to peak, N, N m and Pa. That of `stress`,
        where the outer sizes of the section are known, is of the fibre with the largest one: cycles
        are counted at each of four corners, or of 24 points around a circle. Of the samples.

    Raises:
        InputError: as `section_loads`, or an exponent or the number is not positive.
    """
    import xarray as xr

    of = Sections(run, link, n, model)
    slopes = checked_exponents(exponents)
    count = checked_repetitions(of.times, repetitions)
    outside = fibres(of.section)
    names = [*COMPONENTS, *([STRESS] if outside is not None else [])]
    load = np.empty((of.times.size, of.n, 6))
    for block, here, _ in of.blocks():
        load[block] = here
    found = np.zeros((slopes.size, of.n, len(names)))
    for s in range(of.n):
        for c in range(6):
            found[:, s, c] = ranges_of(load[:, s, c], slopes, count)
        if outside is not None:
            stress = stress_at(load[:, s], of.section, *outside)
            each = [ranges_of(stress[:, p], slopes, count) for p in range(stress.shape[1])]
            found[:, s, 6] = np.max(each, axis=0)
    return xr.DataArray(
        found,
        dims=("exponent", "section", "quantity"),
        coords={
            "exponent": slopes.tolist(),
            **of.coords(),
            "quantity": names,
            "quantity_units": ("quantity", [_UNITS[name] for name in names]),
        },
        attrs={
            "link": link,
            "long_name": f"damage-equivalent range for {count:g} cycles",
            "method": "rainflow (ASTM E1049) and linear damage (Palmgren, Miner)",
        },
        name="damage_equivalent",
    )


@dataclass(frozen=True)
class SectionRating:
    """The largest magnitudes that sections of an elastic link may carry, SI; None: not rated.

    stress [Pa] of the fibres; fx, fy, fz [N], nx, ny, nz [N m], as components of section loads.
    """

    stress: float | None = None
    fx: float | None = None
    fy: float | None = None
    fz: float | None = None
    nx: float | None = None
    ny: float | None = None
    nz: float | None = None

    def __post_init__(self) -> None:
        check_rating(self)


def section_margins(summary: xr.Dataset, rating: SectionRating) -> xr.Dataset:
    """How far the peaks inside an elastic link stay below what its sections may carry.

    Args:
        summary: Of `section_summary`.
        rating: What every section may carry.

    Returns:
        Dataset over `quantity`, those that are rated: `rating`, `use` (the peak with its
        discretisation error over the rating), `margin` (rating over that peak, less 1; negative:
        overloaded), `peak_x` [m] and `peak_time` [s].

    Raises:
        InputError: stress is rated and the outer sizes of the section are not known.
    """
    import xarray as xr

    known = [str(name) for name in summary["quantity"].values]
    given = {field.name: getattr(rating, field.name) for field in fields(rating)}
    rated = {name: float(value) for name, value in given.items() if value is not None}
    for name in rated:
        if name not in known:
            raise InputError(
                f"rating {name}: the section of link {shown(summary.attrs['link'])} has no outer "
                f"sizes; give Section(width=, height=) or rate {near(name, known)}"
            )
    names = [name for name in known if name in rated]
    here = summary.sel(quantity=names).transpose(..., "quantity")
    limits = np.array([rated[name] for name in names])
    peak = np.abs(here["peak"].values) + np.nan_to_num(here["peak_error"].values)
    with np.errstate(divide="ignore"):
        margin = limits / peak - 1
    dims = here["peak"].dims
    data: Mapping[str, Any] = {
        "rating": ("quantity", limits, {"long_name": "rating", "units": "of the quantity"}),
        "use": (dims, peak / limits, {"long_name": "peak over rating", "units": "1"}),
        "margin": (dims, margin, {"long_name": "rating over peak, less 1", "units": "1"}),
        "peak_x": (dims, here["peak_x"].values, {"units": "m"}),
        "peak_time": (dims, here["peak_time"].values, {"units": "s"}),
    }
    return xr.Dataset(data, coords={"quantity": names}, attrs={"link": summary.attrs["link"]})
