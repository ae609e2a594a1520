"""The time loop seen from Python: calls into the core of bounded duration, and Ctrl-C."""

from __future__ import annotations

import contextlib
import signal
import threading
import time as clock
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from linkwise.base import Array

if TYPE_CHECKING:
    from linkwise._core import Ending, Simulation
    from linkwise.record.schema import Schema

# One call into the core computes samples for about this long: short enough for a live progress
# display and for Ctrl-C, long enough that the calls themselves cost nothing.
CALL_SECONDS = 0.2
CALL_BYTES = 32 << 20
# An interval between samples that takes long is itself cut, into this many pieces at most.
MOST_PIECES = 1024


class Progress(NamedTuple):
    """How far a simulation is, as handed to the `progress` callback."""

    time: float
    duration: float
    wall_time: float
    steps: int
    evaluations: int
    stiff: bool = False  #: noticed so far; `run.warnings` will say since when

    @property
    def speed(self) -> float:
        """Simulated seconds per second."""
        return self.time / self.wall_time if self.wall_time > 0 else 0.0

    @property
    def remaining(self) -> float:
        """Expected seconds until the end, infinite before anything is known."""
        return (self.duration - self.time) / self.speed if self.speed > 0 else float("inf")


class Recorder(Protocol):
    def append(self, chunk: Mapping[str, Any]) -> None: ...


class _Interrupt:
    """Ctrl-C while simulating: at once in a call into the core, elsewhere soon after."""

    def __init__(self) -> None:
        self.pressed = False
        self._in_core = False
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
        # The core looks for signals at every step and returns the samples until then; what Python
        # does with them is not to be cut short, unless it is asked for twice.
        if self.pressed or self._in_core:
            raise KeyboardInterrupt
        self.pressed = True

    @contextlib.contextmanager
    def call(self) -> Iterator[None]:
        self._in_core = True
        try:
            yield
        finally:
            self._in_core = False


@dataclass
class _Pace:
    """How much one call computes: several samples, or one of the pieces of a single interval.

    How times are cut into calls depends on the clock; the results do not, because the integrators
    choose their steps by themselves and everything else is read from their dense output.
    """

    most: int
    count: int = 1
    pieces: int = 1

    def adapt(self, spent: float) -> None:
        if spent < CALL_SECONDS / 2:
            if self.pieces > 1:
                self.pieces //= 2
            else:
                self.count = min(2 * self.count, self.most)
        elif spent > 2 * CALL_SECONDS:
            if self.count > 1:
                self.count //= 2
            else:
                self.pieces = min(2 * self.pieces, MOST_PIECES)

    def calls(self, times: Array) -> Iterator[tuple[Array, bool]]:
        """The times of each call, and whether they are samples or lie between two of them."""
        done, previous = 0, 0.0
        while done < times.size:
            between = np.linspace(previous, times[done], self.pieces + 1)[1:-1]
            for time in between:
                yield np.array([time]), False
            wanted = times[done : done + self.count]
            yield wanted, True
            done += wanted.size
            previous = float(wanted[-1])


def run_time_loop(
    simulation: Simulation,
    recorder: Recorder,
    schema: Schema,
    times: Array,
    progress: Callable[[Progress], object] | None = None,
    see: Callable[[Mapping[str, Array]], object] | None = None,
    seen: Collection[str] = (),
) -> Ending:
    """Advance through the sample times, handing each chunk of samples to the recorder, and to `see`
    together with the quantities `seen`."""
    quantities = tuple(dict.fromkeys((*schema.quantities, *seen)))
    pace = _Pace(most=max(1, CALL_BYTES // schema.row_bytes))
    end = float(times[-1])
    started = clock.monotonic()
    reached, recorded = 0.0, 0
    with _Interrupt() as interrupt:
        try:
            for asked, are_samples in pace.calls(times):
                before = clock.monotonic()
                with interrupt.call():
                    chunk = simulation.advance(asked, quantities if are_samples else ())
                pace.adapt(clock.monotonic() - before)
                if are_samples:
                    recorder.append(chunk)
                    if see is not None:
                        see(chunk)
                    recorded += len(chunk["time"])
                if len(chunk["time"]):
                    reached = float(chunk["time"][-1])
                if simulation.ending.outcome != "converged":
                    break
                if progress is not None:
                    wall, done = clock.monotonic() - started, simulation.statistics
                    counts = done.steps, done.evaluations
                    progress(Progress(reached, end, wall, *counts, bool(simulation.stiffness)))
                if interrupt.pressed:
                    break
        except KeyboardInterrupt:
            pass
    if recorded < times.size and simulation.ending.outcome == "converged":
        simulation.interrupt()
    return simulation.ending
