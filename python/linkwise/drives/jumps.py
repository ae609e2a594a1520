"""Whether a table of positions can be differentiated twice: where a derivative jumps instead.

A joint that follows a table needs its acceleration, and its load jumps where that jumps. At every
row, value, velocity and acceleration are estimated by the cubic through the rows before and by the
one through the rows after; on smooth tables the two agree to the third and second power of the
interval.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from linkwise.base import Array

LEAST_ROWS = 8
_STENCIL = 4
# Per derivative: the jump that counts where it stands out from the others, relative to the largest
# value. Above _ALWAYS it counts anyway: the rows are then too far apart, or rounded too coarsely.
_STANDING_OUT = (0.1, 0.1, 0.2)
_ALWAYS = 0.5
_OVER_OTHERS = 10.0
NAMES = ("position", "velocity", "acceleration")


class Jump(NamedTuple):
    """Which derivative (0: position) jumps, where, and by how much."""

    derivative: int
    time: float
    size: float


def _one_sided(times: Array, values: Array, at: Array, first: npt.NDArray[np.intp]) -> Array:
    """(3, n): value, first and second derivative at the times `at` of the cubics through the rows
    first ... first + 3."""
    rows = first[:, None] + np.arange(_STENCIL)
    x = times[rows] - at[:, None]
    scale = np.abs(x).max(axis=1)
    powers = (x / scale[:, None])[:, :, None] ** np.arange(_STENCIL)
    c = np.linalg.solve(powers, values[rows][:, :, None])[:, :, 0]
    return np.stack([c[:, 0], c[:, 1] / scale, 2 * c[:, 2] / scale**2])


def find_jump(times: Array, values: Array) -> Jump | None:
    """The lowest derivative that jumps, for one column of at least LEAST_ROWS rows."""
    n = times.size
    reach = float(np.ptp(values))
    if reach == 0:
        return None
    step, span = float(np.diff(times).min()), float(times[-1] - times[0])
    rounding = 1e3 * np.finfo(np.float64).eps * float(np.abs(values).max())
    between = np.arange(_STENCIL - 1, n - _STENCIL)
    at_row = np.arange(_STENCIL - 1, n - _STENCIL + 1)
    middle = (times[between] + times[between + 1]) / 2
    left = _one_sided(times, values, middle, between - _STENCIL + 1)
    right = _one_sided(times, values, middle, between + 1)
    before = _one_sided(times, values, times[at_row], at_row - _STENCIL + 1)
    after = _one_sided(times, values, times[at_row], at_row)
    tests = (
        (middle, left[0], right[0], reach),
        *((times[at_row], before[k], after[k], None) for k in (1, 2)),
    )
    for k, (where, first, second, given) in enumerate(tests):
        largest = float(np.abs(first + second).max()) / 2 if given is None else given
        floor = rounding / step**k + 1e-6 * reach / span**k
        jump = np.abs(first - second)
        top = float(jump.max())
        if top <= floor:
            continue
        others = _OVER_OTHERS * float(np.percentile(jump, 75))
        stands_out = top > _STANDING_OUT[k] * largest and top > others
        if stands_out or top > _ALWAYS * largest:
            return Jump(k, _middle_of_peak(where, jump), top)
    return None


def _middle_of_peak(where: Array, jump: Array) -> float:
    """Stencils see a jump a few rows early and late: the middle of where they do."""
    high = jump > jump.max() / 2
    first = last = int(np.argmax(jump))
    while first > 0 and high[first - 1]:
        first -= 1
    while last + 1 < jump.size and high[last + 1]:
        last += 1
    return float((where[first] + where[last]) / 2)
