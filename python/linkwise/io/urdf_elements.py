"""The elements of a URDF as the strict reader takes them: children, numbers and placements.

URDF readers in general replace what they cannot read by defaults; here it is refused, with file,
line, element and remedy.
"""

from __future__ import annotations

import os
from typing import NoReturn, Self

import numpy as np
from lxml import etree

from linkwise.base import Array
from linkwise.io.complaint import complain
from linkwise.io.numbers import parse_number, parse_numbers
from linkwise.io.xml import is_foreign, local_name

#: How programs write infinity: C, Windows' C, YAML, Python's and JavaScript's.
_INFINITE = ("inf", "infinity", "1.#inf", "1.#inf00", ".inf", "math.inf", "infty", "∞")


def placement(xyz: Array | list[float], rpy: Array | list[float]) -> Array:
    """The pose (4, 4) of an <origin>: turned by roll, pitch, yaw about fixed axes, then moved."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy), np.cos(rpy)
    turned, moved = np.eye(4), np.eye(4)
    turned[:3, :3] = [
        [cp * cy, sp * (sr * cy) - cr * sy, sp * (cr * cy) + sr * sy],
        [cp * sy, sp * (sr * sy) + cr * cy, sp * (cr * sy) - sr * cy],
        [-sp, cp * sr, cp * cr],
    ]
    moved[:3, 3] = xyz
    pose: Array = np.dot(moved, turned)
    return pose


class UrdfElement:
    """One <link> or <joint>, or a part of it; ``title`` says whose part in complaints."""

    def __init__(self, path: str | os.PathLike[str], element: etree._Element, title: str) -> None:
        self._path = path
        self._element = element
        self.title = title
        self.line: int | None = element.sourceline
        self._children: dict[str, list[etree._Element]] | None = None

    def fail(self, problem: str, remedy: str) -> NoReturn:
        complain(self._path, self.title, problem, remedy, self.line)

    def children(self) -> dict[str, list[etree._Element]]:
        """By name, without those of other vocabularies."""
        if self._children is None:
            self._children = {}
            for child in self._element.iterchildren(tag=etree.Element):
                if not is_foreign(child, self._element):
                    self._children.setdefault(local_name(child), []).append(child)
        return self._children

    def child(self, tag: str) -> Self | None:
        """The only child of that name, or None."""
        found = [type(self)(self._path, c, self.title) for c in self.children().get(tag, ())]
        if len(found) > 1:
            found[1].fail(f"has two <{tag}> elements", "keep one")
        return found[0] if found else None

    def required(self, tag: str, remedy: str) -> Self:
        found = self.child(tag)
        if found is None:
            self.fail(f"<{local_name(self._element)}> has no <{tag}>", remedy)
        return found

    def get(self, attribute: str) -> str | None:
        """An attribute, or what stands for it: a child of its name, the text of a <mass>."""
        text: str | None = self._element.get(attribute)
        child = self.child(attribute) if attribute in self.children() else None
        if child is not None:
            if text is not None:
                child.fail(f"gives {attribute} twice, as attribute and as element", "keep one")
            text = child._element.get("value") or child._element.text or ""
        if text is None and attribute == "value" and (self._element.text or "").strip():
            text = self._element.text
        return text

    def number(self, attribute: str, what: str) -> float:
        return self.numbers(attribute, 1, what)[0]

    def limit(self, attribute: str, sign: int = 0) -> float | None:
        """A limit, None where it means unlimited: infinite (on the side of ``sign``), or, without a
        sign, -1, as some simulators write it."""
        text = (self.get(attribute) or "").strip().lower()
        infinite = text.lstrip("+-") in _INFINITE
        if infinite and (text[0] == "-") == (sign < 0):
            return None
        value = self.number(attribute, f"{attribute} limit")
        return None if sign == 0 and value == -1 else value

    def numbers(self, attribute: str, count: int, what: str) -> list[float]:
        """``count`` finite numbers of an attribute; complaints call them ``what``."""
        text = self.get(attribute)
        remedy = "give a finite number" if count == 1 else f"give {count} finite numbers"
        if text is None:
            problem = f"<{local_name(self._element)}> has no {attribute}"
            self.fail(problem, f'add {attribute}="..."')
        try:
            return [parse_number(text)] if count == 1 else parse_numbers(text, count)
        except ValueError as error:
            if "${" in text or "$(" in text:
                remedy = "expand the xacro expression first"
            self.fail(f"{what}: {error}", remedy)

    def origin(self) -> Array | None:
        """The pose (4, 4) that the child <origin> gives, or None."""
        origin = self.child("origin")
        if origin is None:
            return None
        if origin.get("quat_xyzw") is not None:
            origin.fail("origin quat_xyzw is not supported", "give the rotation as rpy")
        parts = [
            [0.0, 0.0, 0.0]
            if origin.get(attribute) is None
            else origin.numbers(attribute, 3, f"origin {attribute}")
            for attribute in ("xyz", "rpy")
        ]
        return placement(*parts)
