"""What was ignored or assumed when a machine was read: its notes of level "warning".

Whoever sees loads must see them. They are collected here. A run keeps them in its attribute
`warnings`. Commands, reports and the view show them. In Python each is a ModelWarning.
"""

from __future__ import annotations

import json
import os
import sys
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, NamedTuple

from linkwise.base import printable

if TYPE_CHECKING:
    from linkwise._core import Model

KEY = "warnings"
MOST_LINES = 5

_PACKAGE = os.path.dirname(os.path.abspath(__file__)) + os.sep
_quiet = ContextVar("quiet", default=False)


class ModelWarning(UserWarning):
    """Something in a model's file was ignored or assumed; loads do not hold it."""


class Ignored(NamedTuple):
    """A note of level "warning": the model's file, the element in it, and what became of it."""

    source: str
    element: str
    text: str


def warnings_of(*models: Model) -> list[Ignored]:
    """The notes of level "warning" of these models, each once."""
    found = {
        Ignored(model.source or model.name, note.element, note.text): None
        for model in models
        for note in model.notes
        if note.level == "warning"
    }
    return list(found)


def plain_warnings(found: Iterable[Ignored]) -> list[dict[str, str]]:
    """As runs and `--json` have them; the path of a model's file stays out of a run."""
    return [{"element": element, "text": text} for _, element, text in found]


def warning_attrs(found: Iterable[Ignored]) -> dict[str, str]:
    """The attribute of a run, as JSON text."""
    return {KEY: json.dumps(plain_warnings(found))}


def recorded_warnings(attrs: Mapping[Any, Any]) -> list[dict[str, str]]:
    """What `warning_attrs` wrote; nothing where there is none.

    A run may come from anywhere: what is not a warning is left out.
    """
    try:
        held = json.loads(str(attrs.get(KEY, "[]")))
    except (ValueError, RecursionError):
        return []
    return [
        {"element": str(entry["element"]), "text": str(entry["text"])}
        for entry in (held if isinstance(held, list) else [])
        if isinstance(entry, dict) and {"element", "text"} <= set(entry)
    ]


def kept_warnings(attrs: Mapping[Any, Any]) -> dict[str, Any]:
    """The attribute of a run for what is computed from it."""
    return {KEY: attrs[KEY]} if KEY in attrs else {}


def warning_lines(found: Sequence[Mapping[str, str]], most: int = MOST_LINES) -> list[str]:
    """A line for each warning, of many the first ones and how many more there are."""
    lines = [f"{entry['element']}: {entry['text']}" for entry in found[:most]]
    if len(found) > most:
        lines.append(f"and {len(found) - most} more; all are in --json and run.warnings")
    return lines


# What was said when a machine was read is not said again when it is simulated.
_told_at_reading: set[Ignored] = set()


@contextmanager
def quiet() -> Iterator[None]:
    """No ModelWarning from within: whoever enters shows the notes in another way."""
    token = _quiet.set(True)
    try:
        yield
    finally:
        _quiet.reset(token)


def tell(found: Iterable[Ignored], *, reading: bool) -> None:
    """A ModelWarning for each, at the line outside of the package that called it.

    reading: whether a machine is read now; otherwise only what was not said then.
    """
    if _quiet.get():
        return
    for ignored in found:
        if reading:
            _told_at_reading.add(ignored)
        if reading or ignored not in _told_at_reading:
            text = printable(": ".join(ignored))
            warnings.warn(text, ModelWarning, stacklevel=_levels_to_caller())


def _levels_to_caller() -> int:
    """How far above the function that calls this one the caller of the package is."""
    frame, levels = sys._getframe(1), 1
    while frame.f_code.co_filename.startswith(_PACKAGE) and frame.f_back is not None:
        frame, levels = frame.f_back, levels + 1
    return levels
