"""Poses and frames of an SDF: what is placed against what, and on which link it sits.

Models may stand in models. What one names is looked up in it, and `inner::name` is inside the model
`inner` of it. Here every name is written from the outermost model, and so are those of the result.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Self

import numpy as np

from linkwise.base import Array
from linkwise.io.complaint import near, shorten
from linkwise.io.urdf_elements import UrdfElement, placement
from linkwise.io.xml import local_name

WORLD, MODEL = "world", "__model__"


#: What SDF writes as attributes; everything else is the text of an element.
_ATTRIBUTES = {
    "name",
    "type",
    "relative_to",
    "expressed_in",
    "degrees",
    "rotation_format",
    "attached_to",
    "canonical_link",
    "placement_frame",
    "auto",
    "joint",
    "frame",
}


class SdfElement(UrdfElement):
    """An element of an SDF, whose values are texts of its children."""

    #: What stands before the names that it uses: "outer::inner::".
    scope = ""

    def child(self, tag: str) -> Self | None:
        found = super().child(tag)
        if found is not None:
            found.scope = self.scope
        return found

    def full(self, name: str) -> str:
        """A name that the element uses, from the outermost model."""
        return name if name == WORLD else self.scope + name

    def get(self, attribute: str) -> str | None:
        """An attribute, the text of a child of that name, or under "value" the element's own."""
        if attribute in _ATTRIBUTES:
            found: str | None = self._element.get(attribute)
            return found
        if attribute != "value":
            child = self.child(attribute)
            return None if child is None else child._element.text or ""
        own: str | None = self._element.text
        return own if own and own.strip() else None

    def numbers(self, attribute: str, count: int, what: str) -> list[float]:
        if self.get(attribute) is None:
            tag = local_name(self._element)
            if attribute == "value":
                self.fail(f"<{tag}> is empty", f"write <{tag}>...</{tag}>")
            self.fail(f"<{tag}> has no <{attribute}>", f"add <{attribute}>...</{attribute}>")
        return super().numbers(attribute, count, what)


def pose_of(element: SdfElement) -> tuple[Array, str]:
    """The pose (4, 4) of the child <pose>, and the frame that it names as its reference or ""."""
    pose = element.child("pose")
    if pose is None:
        return np.eye(4), ""
    reference = pose.get("relative_to") or ""
    reference = reference and pose.full(reference)
    if pose.get("frame"):
        pose.fail("<pose frame> is of SDF 1.5 and was never defined", "write relative_to")
    if pose.get("value") is None:
        return np.eye(4), reference
    kind = pose.get("rotation_format") or "euler_rpy"
    if kind == "quat_xyzw":
        x, y, z, *quaternion = pose.numbers("value", 7, "pose")
        return _from_quaternion(pose, [x, y, z], quaternion), reference
    if kind != "euler_rpy":
        pose.fail(f"unknown rotation_format '{shorten(kind)}'", "use euler_rpy or quat_xyzw")
    numbers = pose.numbers("value", 6, "pose")
    degrees = (pose.get("degrees") or "false").strip().lower() in ("true", "1")
    angles = [math.radians(a) if degrees else a for a in numbers[3:]]
    return placement(numbers[:3], angles), reference


def _from_quaternion(pose: SdfElement, point: list[float], quaternion: list[float]) -> Array:
    length = math.hypot(*quaternion)
    if abs(length - 1) > 1e-3:
        pose.fail(f"its quaternion has length {length:.4g}", "give a unit quaternion x y z w")
    x, y, z, w = (part / length for part in quaternion)
    found = np.eye(4)
    found[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    found[:3, 3] = point
    return found


def quaternion_of(rotation: Array) -> list[float]:
    """x, y, z, w of a rotation matrix, from its largest component."""
    m = rotation
    squares = [
        1 + m[0, 0] - m[1, 1] - m[2, 2],
        1 - m[0, 0] + m[1, 1] - m[2, 2],
        1 - m[0, 0] - m[1, 1] + m[2, 2],
        1 + m[0, 0] + m[1, 1] + m[2, 2],
    ]
    sums = {(0, 1): m[1, 0] + m[0, 1], (0, 2): m[2, 0] + m[0, 2], (1, 2): m[2, 1] + m[1, 2]}
    turns = {(0, 3): m[2, 1] - m[1, 2], (1, 3): m[0, 2] - m[2, 0], (2, 3): m[1, 0] - m[0, 1]}
    products = {**sums, **turns}
    k = int(np.argmax(squares))
    row = [squares[k] if i == k else products[min(i, k), max(i, k)] for i in range(4)]
    length = math.hypot(*row)
    return [float(part) / length for part in row]


@dataclass
class _Place:
    element: SdfElement
    pose: Array
    reference: str
    attached_to: str
    #: Of a model: the frame in it that its pose places, if that is not its own.
    placed: str = ""


class Frames:
    """Links, joints, frames and models by name. The frame of a model in which `scope` names things
    is `scope__model__`."""

    def __init__(self) -> None:
        self._places: dict[str, _Place] = {}
        self._known: dict[str, Array] = {WORLD: np.eye(4)}
        self._models: dict[str, tuple[SdfElement, str]] = {}
        self._first: dict[str, str] = {}
        self.links: dict[str, SdfElement] = {}

    def add(self, name: str, element: SdfElement, default: str, attached_to: str) -> None:
        """A named element: what its pose counts from unless it says so, and what it sits on."""
        pose, reference = pose_of(element)
        self._places[name] = _Place(element, pose, reference or default, attached_to)

    def add_link(self, name: str, element: SdfElement) -> None:
        self.links[name] = element
        self._first.setdefault(element.scope, name)
        self.add(name, element, element.full(MODEL), name)

    def add_model(self, element: SdfElement, inside: str, outside: str, *, static: bool) -> None:
        """A model whose names are those that begin with `inside`, in the frame `outside`."""
        frame = inside + MODEL
        self.add(frame, element, outside, WORLD if static else frame)
        placed = element.get("placement_frame")
        if placed:
            self._places[frame].placed = inside + placed
        self._models[frame] = element, inside
        if inside:  # by its name from outside, too
            self._places[inside.removesuffix("::")] = _Place(element, np.eye(4), frame, frame)

    def taken(self, name: str) -> bool:
        return name in self._places

    def pose(self, name: str, asker: SdfElement) -> Array:
        """The pose (4, 4) of a frame in the world as the file draws the model."""
        chain = self._chain(name, asker, self._known)
        found = self._known[self._places[chain[-1]].reference] if chain else self._known[name]
        for frame in reversed(chain):
            found = self._known[frame] = found @ self._own(frame)
        return found

    def _chain(self, name: str, asker: SdfElement, ends: Collection[str]) -> list[str]:
        """The frame and those that it is placed against, up to one of `ends`, which is left out."""
        chain: dict[str, None] = {}
        at = name
        while at not in ends:
            place = self._places.get(at)
            if place is None:
                asker.fail(
                    f"names the frame '{shorten(at)}', which does not exist", near(at, self._places)
                )
            if at in chain:
                place.element.fail("its pose is relative to itself", "give it another relative_to")
            chain[at] = None
            asker, at = place.element, place.reference
        return list(chain)

    def _own(self, frame: str) -> Array:
        """The pose (4, 4) of a frame in the one that it is placed against."""
        place = self._places[frame]
        if not place.placed:
            return place.pose
        chain = self._chain(place.placed, place.element, (frame, WORLD))
        if chain and self._places[chain[-1]].reference == WORLD:
            place.element.fail("its placement_frame is placed in the world", "name another frame")
        inside = np.eye(4)
        for each in reversed(chain):
            inside = inside @ self._own(each)
        return place.pose @ np.linalg.inv(inside)

    def link_of(self, name: str, asker: SdfElement, role: str) -> str:
        """The link that a frame sits on, or "world"."""
        seen: set[str] = set()
        at = name
        while at not in self.links and at != WORLD:
            place = self._places.get(at)
            if place is None:
                asker.fail(f"{role} '{shorten(at)}' does not exist", near(at, self.links))
            if at in seen:
                place.element.fail("it is attached to itself", "attach it to a link")
            seen.add(at)
            asker, role, at = place.element, "attached_to", place.attached_to
            if at in seen and at in self._models:
                at = self._canonical(at)
        return at

    def _canonical(self, frame: str) -> str:
        """The link of a model that carries its frame, or the model in it whose link does."""
        model, scope = self._models[frame]
        name = model.get("canonical_link")
        if name:
            if scope + name not in self.links:
                problem = f"canonical_link '{shorten(name)}' does not exist"
                model.fail(problem, near(scope + name, self.links))
            return scope + name
        if scope in self._first:
            return self._first[scope]
        for nested in self._models:
            if nested.startswith(scope) and nested != frame:
                return nested
        model.fail("has no links", "give a model of links and joints")
