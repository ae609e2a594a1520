"""What every room uses: arrays, a wrench's components, blocks of runs, values as JSON has them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
AnyArray = npt.NDArray[Any]

# A wrench is a force and a moment; these are its components in the order of every array.
COMPONENTS = ("fx", "fy", "fz", "nx", "ny", "nz")
HALVES = (("force", "N", COMPONENTS[:3]), ("moment", "N m", COMPONENTS[3:]))

# What bearings and gears carry, in the order in which the core keeps the extremes.
DERIVED = ("force", "axial", "radial", "moment", "tilting_moment", "torque", "drive_power")

# What is held of a run at once, in bytes: the run itself may be larger than memory.
BLOCK_BYTES = 64 << 20


def lengths(vectors: AnyArray) -> Array:
    """Euclidean lengths along the last axis, also where the squares of huge components overflow."""
    with np.errstate(over="ignore"):
        found = np.asarray(np.linalg.norm(vectors, axis=-1))
    huge = np.isinf(found)
    if huge.any():
        largest = np.abs(vectors[huge]).max(axis=-1)
        with np.errstate(invalid="ignore", over="ignore"):
            scaled = largest * np.linalg.norm(vectors[huge] / largest[:, None], axis=-1)
        found[huge] = np.where(np.isinf(largest), largest, scaled)
    return found


def rows_per_block(row_bytes: int) -> int:
    """How many rows of this size are held at once, at least one."""
    return max(1, BLOCK_BYTES // max(1, row_bytes))


def blocks(count: int, row_bytes: int) -> Iterator[slice]:
    """Slices of `count` rows, in order, each of which fits into memory."""
    rows = rows_per_block(row_bytes)
    for start in range(0, count, rows):
        yield slice(start, min(start + rows, count))


def printable(text: object) -> str:
    """`text` as a terminal may show it: on one line, what controls it written as an escape.

    Names, paths and notes come from files and from runs of others. An escape sequence among them
    would move the cursor, change the title or paint over what was said before.
    """
    shown = (c if c.isprintable() else " " if c.isspace() else _escape(c) for c in str(text))
    return "".join(shown)


def _escape(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")


def json_value(value: Any) -> Any:
    """`value` in types that JSON has; infinities and NaN, which it lacks, become null."""
    if hasattr(value, "tolist"):  # NumPy arrays and scalars
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): json_value(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [json_value(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    return str(value)
