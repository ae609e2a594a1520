"""The table of cases. A further one is a file with `run` and a line here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from benchmarks.cases import batch, memory, robots, simulation, single, threads
from benchmarks.rows import Row
from benchmarks.sessions import Workers


@dataclass(frozen=True)
class Case:
    name: str
    title: str
    run: Callable[[Workers], list[Row]]


CASES = (
    Case("single", "One evaluation of a chain", single.run),
    Case("robots", "One evaluation of a robot", robots.run),
    Case("batch", "Many states of a 7-joint arm", batch.run),
    Case("threads", "Several threads", threads.run),
    Case("memory", "Very long chains: time and memory", memory.run),
    Case("simulation", "Whole simulations: time and error", simulation.run),
)
BY_NAME = {case.name: case for case in CASES}
