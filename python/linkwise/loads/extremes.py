"""The extremes that a run holds of what happened between its samples."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np

from linkwise._core import InputError
from linkwise.base import DERIVED, AnyArray, Array
from linkwise.loads.samples import rows

if TYPE_CHECKING:
    from linkwise.loads.samples import RunLike

_PREFIX = "extreme_"


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


def extremes_of(run: RunLike, name: str) -> Extremes | None:
    """Extremes of a recorded variable, or of the derived quantities (quantity, joint) by the name
    "quantity"; None where the run holds none: it is of an older linkwise, or was simulated without,
    or its process was killed before the first were written."""
    if _PREFIX + name not in run.dataset:
        return None
    values = _rows(run, name, len(fields(Extremes)))
    return None if np.isnan(values).all() else Extremes(*values)


def _rows(run: RunLike, name: str, count: int) -> Array:
    """The `count` rows of one variable; InputError where the run has others or none."""
    held = run.dataset.get(_PREFIX + name)
    if held is None or held.shape[:1] != (count,):
        shown = f"run {str(run.path)!r}" if run.path is not None else "run"
        raise InputError(
            f"{shown}: {_PREFIX}{name} is missing or has another shape than it was written with; "
            "its files are damaged, simulate again"
        )
    return rows(run, _PREFIX + name, slice(None))


def load_at_extremes(run: RunLike) -> Array:
    """The whole load (quantity, joint, component) when each quantity was largest in magnitude."""
    wrench = _rows(run, "wrench", 2)
    found = extremes_of(run, "quantity")
    assert found is not None
    load: Array = np.where(found.is_minimum[..., None], wrench[0], wrench[1])
    return load


def quantity_rows(names: list[str]) -> list[int]:
    """Where derived quantities stand among those of `extremes_of(run, "quantity")`."""
    return [DERIVED.index(name) for name in names]
