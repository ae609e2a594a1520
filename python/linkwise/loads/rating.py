"""What bearings and gears may carry, against what they do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise._core import InputError
from linkwise.base import Array
from linkwise.io.complaint import near, shown
from linkwise.loads.engineering import QUANTITIES

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Rating:
    """The largest magnitudes that a joint may carry, SI; None: not rated."""

    force: float | None = None
    axial: float | None = None
    radial: float | None = None
    moment: float | None = None
    tilting_moment: float | None = None
    torque: float | None = None
    drive_power: float | None = None

    def __post_init__(self) -> None:
        check_rating(self)


def check_rating(rating: Any) -> None:
    """Refuses what is no positive number among the fields of a rating, joint's or section's."""
    for field in fields(rating):
        value = getattr(rating, field.name)
        if value is None:
            continue
        if isinstance(value, bool) or not isinstance(value, int | float | np.number):
            raise InputError(f"rating {field.name}: {shown(value)} is not a number; give one in SI")
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"rating {field.name}: is {value:g}; give a positive number in SI")


def rating_table(
    ratings: Mapping[str, Rating], joints: Sequence[str], quantities: Sequence[str]
) -> Array:
    """Ratings (quantity, joint), NaN where nothing is rated; InputError for others."""
    table = np.full((len(quantities), len(joints)), np.nan)
    where = {joint: j for j, joint in enumerate(joints)}
    for joint, rating in ratings.items():
        if joint not in where:
            raise InputError(
                f"rating for joint {shown(joint)}: run holds no such joint; "
                f"{near(joint, joints, 'the joints are')}"
            )
        if not isinstance(rating, Rating):
            raise InputError(
                f"rating for joint {shown(joint)}: is {shown(rating)}; give a Rating, such as "
                "lw.loads.Rating(torque=40)"
            )
        for field in fields(rating):
            value = getattr(rating, field.name)
            if value is None:
                continue
            if field.name not in quantities:
                raise InputError(
                    f"rating for joint {joint!r}: the run gives no {field.name}; record velocity "
                    "and drive_torque"
                )
            table[list(quantities).index(field.name), where[joint]] = value
    return table


def margins(
    summary: xr.Dataset, ratings: Mapping[str, Rating], plus_minus: xr.DataArray | None = None
) -> xr.Dataset:
    """How far the peaks stay below the ratings.

    Args:
        summary: Of `linkwise.loads.summary`, of a batch or a sweep too.
        ratings: By joint name.
        plus_minus: Error bounds (quantity, joint) of the peaks. They count against the margin, and
            so does what peaks may have missed (`sampling` of the summary).

    Returns:
        Dataset over (quantity, joint): `rating`, `use` (peak with its bound over the rating) and
        `margin` (rating over that peak, less 1; negative: overloaded), and `determinate` where the
        summary has it: what is not says nothing. NaN where nothing is rated.
    """
    import xarray as xr

    joints = [str(name) for name in summary["joint"].values]
    names = [str(name) for name in summary["quantity"].values]
    table = rating_table(ratings, joints, names)
    peaks = summary["peak"].transpose(..., "quantity", "joint")
    nowhere = np.isnan(peaks.values).reshape(-1, *table.shape).all(axis=0)
    for k, j in np.argwhere(np.isfinite(table) & nowhere):
        raise InputError(
            f"rating for joint {joints[j]!r}: it has no single axis, so no "
            f"{QUANTITIES[names[k]].long_name}; rate force or moment"
        )
    peak = np.abs(peaks.values)
    if plus_minus is not None:
        peak = peak + plus_minus.values + summary["sampling"].values
    with np.errstate(divide="ignore"):
        margin = table / peak - 1
    dims = peaks.dims
    data = {
        "rating": (dims[-2:], table, {"long_name": "rating", "units": "of the quantity"}),
        "use": (dims, peak / table, {"long_name": "peak over rating", "units": "1"}),
        "margin": (dims, margin, {"long_name": "rating over peak, less 1", "units": "1"}),
    }
    if "determinate" in summary:
        known = summary["determinate"].transpose(..., "quantity", "joint")
        data["determinate"] = (dims, known.values, dict(known.attrs))
    return xr.Dataset(data, coords={"quantity": names, "joint": ("joint", joints)})
