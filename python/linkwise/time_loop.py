"""The time loop seen from Python: calls into the core of bounded duration, and Ctrl-C."""

from __future__ import annotations

import contextlib
import signal
import threading
import time as clock
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from linkwise._core import Simulation
    from linkwise.record.schema import Schema

# One call into the core computes samples for about this long: short enough for a live progress
# display and for Ctrl-C, long enough that the calls themselves cost nothing.
CALL_SECONDS = 0.2
CALL_BYTES = 32 << 20
COUNTERS = ("steps", "evaluations", "iterations")


class Progress(NamedTuple):
    """How far a simulation is, as handed to the `progress` callback."""

    time: float
    duration: float
    wall_time: float
    steps: int
    evaluations: int

    @property
    def speed(self) -> float:
        """Simulated seconds per second."""
        return self.time / self.wall_time if self.wall_time > 0 else 0.0

    @property
    def remaining(self) -> float:
        """Expected seconds until the end, infinite before anything is known."""
        return (self.duration - self.time) / self.speed if self.speed > 0 else float("inf")


class Ending(NamedTuple):
    """How a time loop ended."""

    outcome: str
    time: float
    joint: str
    message: str
    counters: Mapping[str, int]


class Recorder(Protocol):
    def append(self, chunk: Mapping[str, Any]) -> None: ...


class _Interrupt:
    """Ctrl-C while simulating: the current call ends, then the run; pressed again, at once."""

    def __init__(self) -> None:
        self.pressed = False
        self._call_started = float("inf")
        self._previous: Any = None

    def __enter__(self) -> _Interrupt:
        # Only the main thread may set handlers, and a caller's own handler stays in charge.
        in_main = threading.current_thread() is threading.main_thread()
        if in_main and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            self._previous = signal.signal(signal.SIGINT, self._handle)
        return self

    def __exit__(self, *_: object) -> None:
        if self._previous is not None:
            signal.signal(signal.SIGINT, self._previous)

    def _handle(self, *_: object) -> None:
        # A call that takes long already may take much longer: give up its samples.
        long_call = clock.monotonic() - self._call_started > 5 * CALL_SECONDS
        if self.pressed or long_call:
            raise KeyboardInterrupt
        self.pressed = True

    @contextlib.contextmanager
    def call(self) -> Iterator[None]:
        self._call_started = clock.monotonic()
        try:
            yield
        finally:
            self._call_started = float("inf")


def _next_count(count: int, spent: float, most: int) -> int:
    """Samples for the next call, from how long the last one took."""
    if spent < CALL_SECONDS / 2:
        return min(2 * count, most)
    return max(1, count // 2) if spent > 2 * CALL_SECONDS else count


def run_time_loop(
    simulation: Simulation,
    recorder: Recorder,
    schema: Schema,
    times: npt.NDArray[np.float64],
    progress: Callable[[Progress], object] | None = None,
) -> Ending:
    """Advance through the sample times, handing each chunk to the recorder.

    How the times are cut into calls depends on the clock; the results do not, because the
    integrator's steps are its own and samples come from its dense output.
    """
    wanted = set(schema.quantities)
    most = max(1, CALL_BYTES // schema.row_bytes)
    end = float(times[-1])
    started = clock.monotonic()
    counters = dict.fromkeys(COUNTERS, 0)
    done, count, reached = 0, 1, 0.0
    with _Interrupt() as interrupt:
        try:
            while done < times.size and not interrupt.pressed:
                before = clock.monotonic()
                with interrupt.call():
                    chunk = simulation.advance(times[done : done + count], wanted)
                count = _next_count(count, clock.monotonic() - before, most)
                recorder.append(chunk)
                rows = len(chunk["time"])
                done += rows
                if rows:
                    reached = float(chunk["time"][-1])
                    counters = {name: int(np.ravel(chunk[name])[-1]) for name in COUNTERS}
                if chunk["outcome"] != "converged":
                    return Ending(
                        str(chunk["outcome"]),
                        float(chunk["stop_time"]),
                        str(chunk["stop_joint"] or ""),
                        str(chunk["message"] or ""),
                        counters,
                    )
                if progress is not None:
                    wall = clock.monotonic() - started
                    steps, evaluations = counters["steps"], counters["evaluations"]
                    progress(Progress(reached, end, wall, steps, evaluations))
        except KeyboardInterrupt:
            pass
    if done < times.size:
        return Ending("interrupted", reached, "", f"interrupted at t = {reached:g} s", counters)
    return Ending("converged", reached, "", "", counters)
