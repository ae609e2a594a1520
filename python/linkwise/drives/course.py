"""When functions of the caller's change their course: declared, or found by a look before the run.

Between two evaluations an integrator sees nothing. Of tables it knows the rows; of a function it
knows what the caller declares, or what `SAMPLES` values over the whole run show.
"""

from __future__ import annotations

import copy
import functools
import types
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from linkwise._core import InputError, as_floats
from linkwise.base import Array

SAMPLES = 2048
_REPEATS = 8


class Span(NamedTuple):
    """A simulation as one joint's drive sees it before: from 0 to `end` [s], its state at 0."""

    end: float
    q: Array = np.empty(0)
    v: Array = np.empty(0)


def as_breakpoints(times: npt.ArrayLike | None, what: str) -> Array | None:
    """(n,) declared times, increasing; None where none are declared."""
    if times is None:
        return None
    try:
        array = as_floats(times, "breakpoints")
    except InputError:
        array = np.full((1, 1), np.nan)
    if array.ndim != 1 or not np.isfinite(array).all():
        raise InputError(f"{what} breakpoints: give a sequence of finite times in seconds")
    array = np.unique(array)
    array.setflags(write=False)
    return array


def course(
    function: Callable[..., Any],
    breakpoints: npt.ArrayLike | None,
    span: Span | None,
    state: Callable[[Span, float], Sequence[Any]] = lambda span, change: (),
    part: Callable[[Any], Any] = lambda value: value,
) -> dict[str, Any]:
    """Keyword arguments of the core that say when a function changes its course.

    Args:
        function: Is called as ``function(t, *state(span, change))``.
        breakpoints: As the caller declares them: the function is not called.
        state: What the function takes beside the time, moved by `change` from that at the start.
        part: What of the returned value acts.

    Raises:
        InputError: the function returns something else when it is asked again.
    """
    declared = as_breakpoints(breakpoints, "function")
    if declared is not None:
        return {"breakpoints": declared} if declared.size else {}
    if span is None:
        return {}
    private = _copy(function)
    asked = function if private is None else private

    def value(time: float, change: float = 0.0) -> Array:
        found = np.atleast_1d(np.asarray(part(asked(time, *state(span, change))), np.float64))
        if found.ndim != 1 or not np.isfinite(found).all():
            raise ValueError
        return found

    def values(times: Any, changes: Any) -> list[Array]:
        rows: list[Array] = []
        for time, change in zip(times.tolist(), changes.tolist(), strict=True):
            try:
                rows.append(value(time, change))
            except Exception:  # it comes again when the run gets there
                break
        return rows

    again = np.linspace(0.0, span.end, _REPEATS)
    changes = 1e-3 * (1 + np.arange(_REPEATS))
    first = [] if private is not None else values(again, changes)
    times = np.linspace(0.0, span.end, SAMPLES + 1)
    rows = values(times, np.zeros(times.size))
    if len(first) == _REPEATS:
        last = values(again[::-1], changes[::-1])[::-1]
        if len(last) < _REPEATS or not all(map(np.array_equal, first, last)):
            raise InputError(
                "the function returns other values when it is asked again for the same time and "
                "state: it keeps something between calls. Give breakpoints=, the times at which "
                "it changes, or () for none; it is then not asked before the run"
            )
    if len(rows) < 2 or len({row.shape for row in rows}) != 1:
        return {}
    return {"samples": (times[: len(rows)], np.stack(rows))}


def _copy(function: Callable[..., Any]) -> Callable[..., Any] | None:
    """A copy of an object or its method, so that what it remembers is not changed by the look; None
    of plain functions, whose variables no copy has of its own."""
    if isinstance(function, types.FunctionType | types.BuiltinFunctionType | functools.partial):
        return None
    try:
        copied: Callable[..., Any] = copy.deepcopy(function)
    except Exception:
        return None
    return copied


def note_on_function(end: float) -> str:
    return (
        f"is a function without breakpoints=; it was looked at every {end / SAMPLES:.3g} s, and "
        "changes that last less may be missed"
    )


def notes_on_span(times: Array, end: float) -> list[str]:
    """Whether a table that is held beyond its ends covers a simulation until `end` [s]."""
    first, last = float(times[0]), float(times[-1])
    held = []
    if first > 0:
        held.append("its first row holds before")
    if last < end * (1 - 1e-12):
        held.append("its last row holds after")
    if not held:
        return []
    covered = f"the table covers {first:g} to {last:g} s, the simulation 0 to {end:g} s"
    return [f"{covered}: {', '.join(held)}"]


def notes_on_turn(times: Array, values: Array) -> list[str]:
    when = find_turn(times, values)
    return [] if when is None else [f"the target {wrapped_at(when)}"]


def wrapped_at(time: float) -> str:
    return f"jumps by one turn at t = {time:.6g} s: unwrap the angle, as numpy.unwrap does"


def find_turn(times: Array, values: Array) -> float | None:
    """The time after the first step that is one turn and otherwise like its neighbours."""
    steps = np.diff(values)
    turns = np.sign(steps) * 2 * np.pi
    rest = np.abs(steps - turns)
    before, after = np.abs(np.roll(steps, 1)), np.abs(np.roll(steps, -1))
    before[0], after[-1] = after[0], before[-1]
    around = np.maximum(before, after)
    wrapped = np.flatnonzero((rest <= 2 * around + 1e-6) & (np.abs(steps) > 4 * around))
    return float(times[wrapped[0] + 1]) if wrapped.size else None
