"""Poses and frames of an SDF model: what is placed against what, and on which link it sits."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass

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
    "auto",
    "joint",
    "frame",
}


class SdfElement(UrdfElement):
    """An element of an SDF, whose values are texts of its children."""

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


class Frames:
    """The frames of one model: its links, joints and frames by name, and `__model__`, `world`."""

    def __init__(self, path: str | os.PathLike[str], model: SdfElement) -> None:
        pose, reference = pose_of(model)
        if reference not in ("", WORLD):
            model.fail("its pose is relative to what is no part of it", "place it in the world")
        self._model = model
        self._places: dict[str, _Place] = {}
        self._known: dict[str, Array] = {WORLD: np.eye(4), MODEL: pose}
        self._path = path
        self.links: dict[str, SdfElement] = {}

    def add(self, name: str, element: SdfElement, default: str, attached_to: str) -> None:
        """A named element: what its pose counts from unless it says so, and what it sits on."""
        pose, reference = pose_of(element)
        self._places[name] = _Place(element, pose, reference or default, attached_to)

    def taken(self, name: str) -> bool:
        return name in self._places

    def pose(self, name: str, asker: SdfElement) -> Array:
        """The pose (4, 4) of a frame in the world as the file draws the model."""
        chain: list[str] = []
        seen: set[str] = set()
        at = name
        while at not in self._known:
            place = self._places.get(at)
            if place is None:
                known = [*self._places, MODEL]
                asker.fail(
                    f"names the frame '{shorten(at)}', which does not exist", near(at, known)
                )
            if at in seen:
                place.element.fail("its pose is relative to itself", "give it another relative_to")
            chain.append(at)
            seen.add(at)
            asker, at = place.element, place.reference
        found = self._known[at]
        for frame in reversed(chain):
            found = self._known[frame] = found @ self._places[frame].pose
        return found

    def link_of(self, name: str, asker: SdfElement, role: str) -> str:
        """The link that a frame sits on, or "world"."""
        seen: set[str] = set()
        at = name
        while at not in self.links and at != WORLD:
            if at == MODEL:
                return self._canonical()
            place = self._places.get(at)
            if place is None:
                asker.fail(f"{role} '{shorten(at)}' does not exist", near(at, self.links))
            if at in seen:
                place.element.fail("it is attached to itself", "attach it to a link")
            seen.add(at)
            asker, role, at = place.element, "attached_to", place.attached_to
        return at

    def _canonical(self) -> str:
        name = self._model.get("canonical_link")
        if name is None:
            return next(iter(self.links))
        if name not in self.links:
            problem = f"canonical_link '{shorten(name)}' does not exist"
            self._model.fail(problem, near(name, self.links))
        return name
