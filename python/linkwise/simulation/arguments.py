"""Checking what `simulate` is given: one line with the argument, its value and the remedy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from linkwise._core import InputError, Model, as_floats
from linkwise.io.complaint import shown

_DEFAULT_SAMPLES = 1000
_MAX_SAMPLES = 100_000_000
#: Of steps whose length is given; a billion of them take minutes.
_MOST_STEPS = 1e12
_LONGEST = 1e12

T = TypeVar("T")


def options_object(
    argument: str,
    kind: type[T],
    given: T | Mapping[str, Any] | None,
    keywords: dict[str, Any] | None = None,
) -> T:
    """The dataclass `kind` from one itself, or from its fields by name; InputError where a name is
    unknown. Of keywords those that are fields of it are taken out and go before."""
    known = [field.name for field in fields(kind)]  # type: ignore[arg-type]
    if given is not None and not isinstance(given, kind | Mapping):
        raise InputError(f"{argument}: {shown(given)} given; give a linkwise.{kind.__name__}")
    if isinstance(given, Mapping):
        for name in given:
            if name not in known:
                raise InputError(
                    f"{argument}: unknown option {shown(name)}; known: {', '.join(known)}"
                )
        given = kind(**given)
    taken = {name: keywords.pop(name) for name in known if keywords and name in keywords}
    return replace(given or kind(), **taken)  # type: ignore[type-var]


def check_called(model: object, progress: object) -> None:
    """InputError where these are no model and no function."""
    check_model(model)
    if progress is not None and not callable(progress):
        raise InputError(f"progress: {shown(progress)} given; give a function")


def check_model(model: object) -> None:
    """InputError where `model` is something else, such as the path of a file."""
    if not isinstance(model, Model):
        raise InputError(
            f"model: is a {type(model).__name__}; give a linkwise.Model, as linkwise.load returns"
        )


def check_mapping(name: str, given: object) -> None:
    if given is not None and not isinstance(given, Mapping):
        raise InputError(f"{name}: {shown(given)} given; give a dictionary by name")


def number(name: str, value: Any) -> float:
    """A finite number above zero, or an InputError that says which argument is wrong."""
    array = as_floats(value, name)
    if array.ndim:
        raise InputError(f"{name} has shape {array.shape}; give one number")
    number = float(array)
    if not np.isfinite(number) or number <= 0:
        raise InputError(f"{name}: {number:g} given; give a finite number above 0")
    return number


def optional_count(name: str, value: Any) -> int | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
        raise InputError(f"{name}: {shown(value)} given; give a whole number of at least 1")
    if value >= 2**31:
        raise InputError(f"{name}: {shown(value)} given; give a whole number below 2^31")
    return int(value)


def state_vector(
    name: str, values: Any, size: int, default: npt.ArrayLike
) -> npt.NDArray[np.float64]:
    """Initial q or v as a vector of `size` finite numbers."""
    array = np.array(as_floats(default if values is None else values, name))
    if array.shape != (size,):
        raise InputError(f"{name}: expected shape ({size},), given shape {array.shape}")
    if not np.all(np.isfinite(array)):
        bad = int(np.flatnonzero(~np.isfinite(array))[0])
        raise InputError(f"{name}: expected {size} finite numbers, {name}[{bad}] is {array[bad]}")
    return array


def sample_times(
    duration: float | None = None,
    every: float | None = None,
    times: npt.ArrayLike | None = None,
) -> npt.NDArray[np.float64]:
    """The times to record: `times` themselves, or 0, `every`, ... and the end."""
    if times is not None:
        return _given_times(times, duration, every)
    if duration is None:
        raise InputError("duration: missing; give the seconds to simulate")
    end = number("duration", duration)
    _check_end("duration", end)
    if end / _DEFAULT_SAMPLES < np.finfo(np.float64).tiny:
        raise InputError(f"duration: {end:g} s is too short for a double; give a longer one")
    spacing = end / _DEFAULT_SAMPLES if every is None else number("every", every)
    count = end / spacing
    if count > _MAX_SAMPLES:
        raise InputError(f"every: {spacing:g} s makes {count:.3g} samples; give a longer interval")
    # A whole number of intervals, up to rounding, ends exactly at the duration; otherwise what
    # is left over becomes a shorter interval of its own.
    whole = round(count)
    if whole >= 1 and abs(count - whole) <= 1e-9 * count:
        return np.linspace(0.0, end, whole + 1)
    return np.append(spacing * np.arange(int(count) + 1), end)


def _check_end(name: str, end: float) -> None:
    if end > _LONGEST:
        raise InputError(
            f"{name}: {end:g} s given; give at most {_LONGEST:g} s, after which a double has no "
            "room for steps of a tenth of a millisecond"
        )


def check_steps(end: float, options: Mapping[str, Any]) -> None:
    """InputError where steps of a given length would take for ever until `end` [s]."""
    for name in ("step", "max_step"):
        length = options.get(name)
        if length is not None and length > 0 and end > _MOST_STEPS * length:
            raise InputError(
                f"{name}: {length:g} s makes more than {_MOST_STEPS:g} steps until {end:g} s; give "
                "a longer one"
            )


def _given_times(
    times: npt.ArrayLike, duration: float | None, every: float | None
) -> npt.NDArray[np.float64]:
    if every is not None:
        raise InputError("every and times: give one of them")
    listed = np.array(as_floats(times, "times"))
    if listed.ndim != 1 or listed.size == 0:
        raise InputError(f"times: expected shape (n,) with n > 0, given shape {listed.shape}")
    if not np.all(np.isfinite(listed)) or listed[0] < 0 or np.any(np.diff(listed) <= 0):
        raise InputError("times: expected finite, increasing times from 0 on, in seconds")
    _check_end("times", float(listed[-1]))
    if duration is not None and listed[-1] > number("duration", duration):
        raise InputError(f"times: the last, {listed[-1]:g} s, is after duration = {duration:g} s")
    return listed
