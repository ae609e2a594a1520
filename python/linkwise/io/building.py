"""The last step of reading an XML file: notes, the build, and complaints of the core with lines."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping

from linkwise._core import InputError, Model, ModelBuilder
from linkwise.io.complaint import file_name, shorten
from linkwise.io.urdf_elements import UrdfElement

#: The part that a complaint of the core is about, by its first word.
_PARTS = {
    "mass": "mass",
    "inertia": "inertia",
    "axis": "axis",
    "lower": "limit",
    "effort": "limit",
    "velocity": "limit",
    "damping": "dynamics",
    "friction": "dynamics",
}


def build(
    builder: ModelBuilder,
    path: str | os.PathLike[str],
    notes: Iterable[tuple[str, str, str]],
    found: Mapping[str, UrdfElement],
    first: Mapping[str, UrdfElement],
    *,
    keep_fixed: bool,
) -> Model:
    """The model of what was read.

    found: the elements as complaints of the core name them (link 'a'); first: the first of those
    whose name is used again. Raises InputError, with the line of the element.
    """
    for note in notes:
        builder.add_note(*note)
    try:
        return builder.build(keep_fixed=keep_fixed)
    except InputError as error:
        raise _with_line(error, path, found, first) from None


def refuse_mimic_cycle(leaders: Mapping[str, str], elements: Mapping[str, UrdfElement]) -> None:
    """InputError where joints mimic each other in a ring: that holds them, and no file means it.

    leaders: of each joint that mimics, the joint that it follows; elements: where each says so.
    """
    done: set[str] = set()
    for joint in leaders:
        followed: dict[str, None] = {}  # in their order
        at = joint
        while at in leaders and at not in done and at not in followed:
            followed[at] = None
            at = leaders[at]
        if at in followed:
            names = list(followed)
            ring = [shorten(name) for name in names[names.index(at) :]]
            chain = " mimics ".join(f"'{name}'" for name in [*ring[:6], ring[0]])
            elements[at].fail(
                f"mimics itself by way of others: {chain}", "let one of them mimic none"
            )
        done |= followed.keys()


def _with_line(
    error: InputError,
    path: str | os.PathLike[str],
    elements: Mapping[str, UrdfElement],
    first: Mapping[str, UrdfElement],
) -> InputError:
    """The core's complaint, ELEMENT of FILE: PROBLEM; REMEDY, as FILE:LINE: ELEMENT: ..."""
    element, _, rest = str(error).partition(f" of {file_name(path)}")
    found = elements.get(element)
    if element.startswith("coupling '"):
        name = element.removeprefix("coupling '").removesuffix("'")
        found = elements.get(f"joint '{name}'") or elements.get(
            f"joint '{name.removesuffix('_mimic')}'"
        )
    words = rest.removeprefix(": ").split()
    if found is None:  # links 'a' and 'b'
        found = elements.get("link " + element.rpartition(" and ")[2])
    elif words and words[0] in _PARTS:
        found = _part_of(found, _PARTS[words[0]])
    if element in first:
        twice = "the name is used twice"
        rest = rest.replace(twice, f"{twice} (first on line {first[element].line})", 1)
    line = f":{found.line}" if found is not None and found.line else ""
    text = shorten(f"{element}{rest}", 2000)
    return InputError(f"{shorten(os.fspath(path), 400)}{line}: {text}")


def _part_of(element: UrdfElement, part: str) -> UrdfElement:
    """The part of a link or joint, wherever the format has it; else what comes nearest."""
    for outer in ("inertial", "axis"):
        inside = element.child(outer)
        if inside is not None and inside.child(part) is not None:
            return inside.child(part) or inside
    return element.child(part) or element.child("inertial") or element
