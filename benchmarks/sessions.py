"""The workers of a run, kept from machine to machine; what failed is started anew."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.engines.table import ENGINES, Engine
from benchmarks.process import (
    Worker,
    WorkerError,
    compiled_worker,
    memory_limit,
    python_worker,
)
from benchmarks.timing import timed

CPP, PYTHON = "C++", "Python"


@dataclass(frozen=True)
class Effort:
    """How long a run may take."""

    quick: bool
    rounds: int
    turn: float  # seconds of each contestant a round
    slowest: float  # seconds that one call may take
    build: float  # seconds that preparing an engine may take
    fewest_rounds: int
    patience: float  # seconds that all turns of one contestant may take


QUICK = Effort(True, rounds=5, turn=0.01, slowest=1, build=5, fewest_rounds=2, patience=0.5)
FULL = Effort(False, rounds=15, turn=0.05, slowest=30, build=60, fewest_rounds=3, patience=20)


@dataclass
class Workers:
    memory: int  # bytes that a worker may take
    program: Path | None  # the compiled worker
    effort: Effort
    say: Callable[[str], object]
    compiled: frozenset[str] = frozenset()  # engines that the program was compiled with
    engines: tuple[Engine, ...] = ENGINES
    _workers: dict[tuple[str, str, bool], Worker] = field(default_factory=dict)
    _sizes: dict[tuple[str, str], dict[int, int]] = field(default_factory=dict)
    _failed: dict[tuple[str, str], int] = field(default_factory=dict)

    def arenas(self, engine: Engine) -> list[str]:
        if not engine.installed:
            return []
        return [PYTHON, CPP] if engine.name in self.compiled else [PYTHON]

    def worker(self, engine: Engine, arena: str, *, threads: bool = False) -> Worker:
        key = engine.name, arena, threads
        if key not in self._workers or not self._workers[key].alive:
            if arena == CPP:
                assert self.program is not None
                made = compiled_worker(self.program, engine.name, memory=self.memory)
            else:
                made = python_worker(engine.name, memory=self.memory, threads=threads)
            self._workers[key] = made
        return self._workers[key]

    def forecast(self, engine: Engine, arena: str, n: int) -> float:
        """Bytes for n bodies, by the power law through the last two sizes that took any."""
        sizes = self._sizes.get((engine.name, arena), {})
        known = sorted((count, bytes_) for count, bytes_ in sizes.items() if bytes_ > 0)
        if len(known) < 2 or n <= known[-1][0]:
            return 0.0
        (n0, m0), (n1, m1) = known[-2:]
        if m1 <= m0:
            return float(m1)
        power = np.log(m1 / m0) / np.log(n1 / n0)
        return float(m1 * (n / n1) ** min(float(power), 3.0))

    def begin_family(self) -> None:
        """Machines of another kind follow: sizes that failed say nothing about them."""
        self._sizes.clear()
        self._failed.clear()

    def close(self) -> None:
        for worker in self._workers.values():
            worker.close()
        self._workers.clear()

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@dataclass
class Session:
    """One engine in one arena with one machine; built again when its worker had to be ended."""

    workers: Workers
    engine: Engine
    arena: str
    folder: Path
    threads: bool = False
    build_seconds: float = 0.0
    _before: int = 0
    _built: Worker | None = None

    def build(self) -> dict[str, Any]:
        worker = self.workers.worker(self.engine, self.arena, threads=self.threads)
        worker.ask("clear", timeout=self.workers.effort.build)
        self._before = int(worker.ask("memory", timeout=5)["resident"])
        # Half of what is free now: those built before keep theirs, and all together never take all.
        worker.allow(memory_limit())
        build = partial(worker.ask, "build", str(self.folder), timeout=self.workers.effort.build)
        answer, taken = timed(build)
        self.build_seconds = taken.seconds
        self._built = worker
        return answer

    def held(self) -> int:
        """Bytes that the machine has added to its worker, the states for the timing left out."""
        use = self.ask("memory", timeout=5)
        return int(use["resident"]) - self._before - int(use.get("states", 0))

    def ask(self, *lines: str, timeout: float) -> dict[str, Any]:
        if self._built is None or not self._built.alive:
            self.build()
        assert self._built is not None
        return self._built.ask(*lines, timeout=timeout)

    def clear(self) -> None:
        """Forgets the machine, so that the next one finds the memory free."""
        if self._built is not None and self._built.alive:
            with contextlib.suppress(WorkerError):
                self._built.ask("clear", timeout=self.workers.effort.build)

    def weigh(self, n: int) -> None:
        """Remembers the memory that n bodies took."""
        peak = int(self.ask("memory", timeout=5)["peak"]) - self._before
        self.workers._sizes.setdefault((self.engine.name, self.arena), {})[n] = peak

    def failed(self, n: int) -> None:
        self.workers._failed.setdefault((self.engine.name, self.arena), n)

    def too_big(self, n: int) -> str:
        """Why n bodies are not even tried, or nothing."""
        lost = self.workers._failed.get((self.engine.name, self.arena), n)
        if lost < n:
            return f"not tried: {lost:,} are too many already"
        needed, allowed = self.workers.forecast(self.engine, self.arena, n), self.workers.memory
        if needed <= allowed:
            return ""
        return (
            f"would need {needed / 2**30:.0f} GiB of memory, by its smaller sizes; "
            f"{allowed / 2**30:.0f} GiB allowed"
        )
