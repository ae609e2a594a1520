"""What a run finds: one row per contestant and machine."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field, fields
from typing import Any

import numpy as np

#: (low, high) quartiles
Spread = tuple[float, float]


@dataclass
class Row:
    case: str  # single, robots, batch, threads, memory, simulation
    machine: str
    n_bodies: int
    engine: str
    arena: str  # C++: no Python in the timed loop; Python: calls from it
    method: str
    threads: int = 1
    loads: bool = False  # whether the joint loads are found too
    ns_per_body: float | None = None
    spread: Spread | None = None  # of ns_per_body
    ratio: float | None = None  # this row's time to that of linkwise's `auto`
    ratio_spread: Spread | None = None
    against_pinocchio: float | None = None  # Pinocchio's better convention's time to this row's
    failure: str = ""
    figures: dict[str, Any] = field(default_factory=dict)  # what only this case has
    samples: list[float] = field(default_factory=list)  # ns per body of every turn

    @property
    def measured(self) -> bool:
        return self.ns_per_body is not None

    def record(self) -> dict[str, Any]:
        return asdict(self)

    @staticmethod
    def of(record: dict[str, Any]) -> Row:
        known = {f.name for f in fields(Row)}
        return Row(**{key: value for key, value in record.items() if key in known})


def quartiles(values: Sequence[float]) -> Spread:
    low, high = np.percentile(values, [25, 75])
    return float(low), float(high)


def settle(row: Row) -> None:
    """Median and quartiles of the row's turns."""
    if row.samples:
        row.ns_per_body = float(np.median(row.samples))
        row.spread = quartiles(row.samples)


def best(rows: Iterable[Row]) -> Row | None:
    measured = [row for row in rows if row.ns_per_body is not None]
    return min(measured, key=lambda row: row.ns_per_body or 0.0, default=None)


def compare(rows: Sequence[Row], ours: Row | None) -> None:
    """Ratios of medians, with the quartiles of the ratios of the turns, which were interleaved."""
    pinocchio = best(row for row in rows if row.engine == "pinocchio")
    for row in rows:
        if row.ns_per_body is None:
            continue
        if ours is not None and ours.ns_per_body is not None:
            row.ratio = row.ns_per_body / ours.ns_per_body
            pairs = list(zip(row.samples, ours.samples, strict=False))
            if pairs:
                row.ratio_spread = quartiles([theirs / own for theirs, own in pairs])
        if pinocchio is not None and pinocchio.ns_per_body is not None:
            row.against_pinocchio = pinocchio.ns_per_body / row.ns_per_body
