"""The clock of all studies."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

Result = TypeVar("Result")


@dataclass(frozen=True)
class Taken:
    seconds: float  # of the wall clock
    cpu: float  # of the processor: all threads of this process together


def timed(call: Callable[[], Result]) -> tuple[Result, Taken]:
    """What a call returns, and what it took."""
    started, busy = time.perf_counter(), time.process_time()
    result = call()
    cpu = time.process_time() - busy
    return result, Taken(time.perf_counter() - started, cpu)


def least_cpu(call: Callable[[], object], turns: int = 5) -> float:
    """Seconds of the processor in the best turn: a busy machine hardly matters."""
    return min(timed(call)[1].cpu for _ in range(turns))
