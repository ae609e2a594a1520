"""One-line complaints about bad input: file, line, element, what is wrong, what to do.

Names and numbers in a message come from untrusted files. They are shortened and stripped of control
characters, so a complaint stays one line whatever the file holds.
"""

from __future__ import annotations

import difflib
import os
from collections.abc import Collection, Iterable
from typing import NoReturn

import numpy as np

from linkwise._core import InputError
from linkwise.base import printable

_SHOWN_NAMES = 8
_SHOWN_CHARACTERS = 60


def shorten(text: object, limit: int = _SHOWN_CHARACTERS) -> str:
    """``text`` on one line, printable, at most ``limit`` characters."""
    line = printable(" ".join(str(text)[: 4 * limit].split()))
    return line if len(line) <= limit else line[: limit - 3] + "..."


def file_name(path: str | os.PathLike[str]) -> str:
    """``path`` as text; names of files may hold bytes that are not text."""
    return os.fspath(path).encode("utf-8", "replace").decode("utf-8")


def shown(value: object) -> str:
    """What was given where something else belongs, as a person would type it, not too long."""
    return shorten(repr(value))


def check_one_of(what: str, value: object, known: Collection[str]) -> None:
    """InputError where `value` is none of the known names."""
    if not (isinstance(value, str) and value in known):
        names = (" or " if len(known) == 2 else ", ").join(known)
        raise InputError(f"{what}: {shown(value)} is unknown; use {names}")


def check_flag(what: str, value: object) -> None:
    """InputError where `value` is neither True nor False: "no" would count as true."""
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{what}: {shown(value)} given; give True or False")


def near(name: object, known: Iterable[str], kind: str = "known") -> str:
    """``did you mean 'elbow'?`` for the nearest known name, otherwise a list of some of them."""
    names = list(known)
    if not names:
        return "there are none"
    if isinstance(name, str) and len(name) <= 200:
        letters = sorted(name)  # iyx is ixy rather than iyz
        matches = [known for known in names[:5000] if sorted(known) == letters][:1]
        matches = matches or difflib.get_close_matches(name, names[:5000], n=1, cutoff=0.6)
        if matches:
            return f"did you mean '{shorten(matches[0])}'?"
    listed = ", ".join(shorten(n) for n in names[:_SHOWN_NAMES])
    return f"{kind}: {listed}" + (", ..." if len(names) > _SHOWN_NAMES else "")


def complaint(
    source: str | os.PathLike[str],
    element: str,
    problem: str,
    remedy: str,
    line: int | None = None,
) -> InputError:
    """The error ``FILE:LINE: ELEMENT: PROBLEM; REMEDY``, ready to raise; the problem may hold its
    remedy itself."""
    where = shorten(os.fspath(source), 400) + (f":{line}" if line else "")
    parts = [p for p in (where, element) if p]
    return InputError(f"{': '.join(parts)}: {problem}" + (f"; {remedy}" if remedy else ""))


def complain(
    source: str | os.PathLike[str],
    element: str,
    problem: str,
    remedy: str,
    line: int | None = None,
) -> NoReturn:
    """Raise :func:`complaint`."""
    raise complaint(source, element, problem, remedy, line)


def check_path(name: str, path: object) -> None:
    """InputError where `path` is nothing that can name a file."""
    if not isinstance(path, str | os.PathLike) or not isinstance(os.fspath(path), str):
        raise InputError(f"{name}: is a {type(path).__name__}; give a path")
    if "\0" in os.fspath(path):
        raise InputError(f"{name}: the path holds a NUL character; delete it")
