"""Reading URDF into a Model.

The document is read once, strictly: what is not there or is no number is refused here, with its
line. Whether the machine makes sense (masses, axes, limits, the tree of the joints) is judged by
the core alone, whose complaint gets the line of the element it is about.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from lxml import etree

from linkwise._core import Model, ModelBuilder
from linkwise.base import Array
from linkwise.io.building import build, refuse_mimic_cycle
from linkwise.io.complaint import complain, file_name, shorten
from linkwise.io.unit_hints import unit_hints
from linkwise.io.urdf_elements import UrdfElement
from linkwise.io.urdf_transmissions import Transmissions
from linkwise.io.urdf_vocabulary import ATTRIBUTES, Vocabulary
from linkwise.io.xml import is_foreign, local_name

Mimic = Literal["couple", "independent", "error"]
JointOrder = Literal["file", "pinocchio"]

#: What to do about a mimic joint where they are refused, and about one whose leader is not there.
MIMIC_REMEDY = (
    'couple them with mimic="couple", let it move on its own with mimic="independent", or remove '
    "<mimic>"
)
MISSING_LEADER = 'name a joint, or let it move on its own with mimic="independent"'
JOINT_TYPES = ("fixed", "revolute", "continuous", "prismatic", "planar", "floating")
_LIMITED = ("revolute", "prismatic")
_LIMITS = ("lower", "upper", "effort", "velocity")
_WITH_AXIS = ("revolute", "continuous", "prismatic", "planar")
_INERTIA = ATTRIBUTES["inertia"]


def read_urdf(
    path: str | os.PathLike[str],
    root: etree._Element,
    *,
    gravity: tuple[float, float, float],
    floating_base: bool = False,
    joint_order: JointOrder = "file",
    keep_fixed: bool = False,
    mimic: Mimic = "couple",
) -> Model:
    """The model that the parsed URDF ``root`` describes; ``path`` is for messages.

    Conventions of the format: a missing axis is 1 0 0; a planar joint's axis is the normal of its
    plane; inertia is about the centre of mass along the axes of the inertial origin. A revolute or
    prismatic joint without <limit> is unlimited and noted. Mimic joints are coupled ("couple"),
    kept as joints of their own and noted as warnings ("independent", what Pinocchio does unless
    asked otherwise) or refused ("error").
    """
    reader = _Reader(path, root, mimic)
    name = root.get("name") or os.path.splitext(os.path.basename(os.fspath(path)))[0]
    builder = ModelBuilder(name, gravity=gravity, source=file_name(path))
    for link in reader.links:
        reader.add_link(builder, link)
    joints = [reader.joint(element) for element in reader.joints]
    reader.add_rotors(joints, root)
    for joint in depth_first(joints) if joint_order == "pinocchio" else joints:
        builder.add_joint(joint.name, joint.type, joint.parent, joint.child, **joint.properties)
    reader.add_couplings(builder)
    reader.note_units(joints)
    if floating_base:
        builder.set_floating_base()
    reader.note_what_is_left_out()
    return build(builder, path, reader.notes, reader.found, reader.first, keep_fixed=keep_fixed)


@dataclass
class UrdfJoint:
    """What ModelBuilder.add_joint takes."""

    name: str
    type: str
    parent: str
    child: str
    properties: dict[str, Any]


def depth_first(joints: list[UrdfJoint]) -> list[UrdfJoint]:
    """Depth first from the root, the joints of one link by name.

    So do urdfdom and with it Pinocchio, and q and v can be handed over. Joints that no path from
    the root reaches come last: the core refuses them.
    """
    outboard: dict[str, list[UrdfJoint]] = {}
    for joint in joints:
        outboard.setdefault(joint.parent, []).append(joint)
    for siblings in outboard.values():
        # std::map compares bytes; reversed because the stack is taken from its end.
        siblings.sort(key=lambda joint: joint.name.encode(), reverse=True)
    children = {joint.child for joint in joints}
    stack = [j for link, found in outboard.items() if link not in children for j in found]
    ordered = []
    while stack:
        joint = stack.pop()
        ordered.append(joint)
        stack += outboard.pop(joint.child, [])
    taken = {id(joint) for joint in ordered}
    return ordered + [joint for joint in joints if id(joint) not in taken]


class _Reader:
    """The links and joints of one file, where they stand in it, and the notes about them."""

    def __init__(self, path: str | os.PathLike[str], root: etree._Element, mimic: Mimic) -> None:
        self.path = path
        self.notes: list[tuple[str, str, str]] = []
        self.links: list[UrdfElement] = []
        self.joints: list[UrdfElement] = []
        self._mimic = mimic
        self._mimics: dict[str, tuple[str, float, float]] = {}  # of whom, multiplier, offset
        self._inertials: dict[str, tuple[float, Array, Array]] = {}
        self.found: dict[str, UrdfElement] = {}
        self.first: dict[str, UrdfElement] = {}  # of those whose name is used again
        self._vocabulary = Vocabulary(path, root)
        for element in root.iterchildren(tag=etree.Element):
            tag = local_name(element)
            if tag in ("link", "joint") and not is_foreign(element, root):
                found = self.links if tag == "link" else self.joints
                found.append(self._named(element, tag))
        if not self.links:
            remedy = "give a complete URDF (if it comes from xacro, expand it first)"
            complain(path, "robot", "has no links", remedy, root.sourceline)

    def _named(self, element: etree._Element, kind: str) -> UrdfElement:
        name = element.get("name", "")
        found = UrdfElement(self.path, element, f"{kind} '{shorten(name)}'" if name else kind)
        if not name:
            found.fail("has no name", 'add name="..."')
        key = f"{kind} '{name}'"
        if key in self.found:
            self.first.setdefault(key, self.found[key])
        self.found[key] = found
        return found

    def add_link(self, builder: ModelBuilder, link: UrdfElement) -> None:
        name = str(link.get("name"))
        inertial = link.child("inertial")
        if inertial is None:
            builder.add_link(name)
            return
        pose = inertial.origin()
        if pose is None:
            pose = np.eye(4)
        mass = inertial.required("mass", 'add <mass value="..."/> in kg').number("value", "mass")
        attributes = " ".join(f'{a}="..."' for a in _INERTIA)
        moments = inertial.required("inertia", f"add <inertia {attributes}/>")
        xx, xy, xz, yy, yz, zz = (moments.number(a, f"inertia {a}") for a in _INERTIA)
        rotation = pose[:3, :3]
        inertia = rotation @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ rotation.T
        inertia = 0.5 * inertia + 0.5 * inertia.T
        builder.add_link(name, mass=mass, com=pose[:3, 3], inertia=inertia)
        self._inertials[name] = (mass, pose[:3, 3], inertia)

    def joint(self, element: UrdfElement) -> UrdfJoint:
        name, kind = str(element.get("name")), element.get("type")
        if kind not in JOINT_TYPES:
            problem = "has no type" if kind is None else f"unknown type '{shorten(kind)}'"
            remedy = f"use one of {', '.join(JOINT_TYPES)}"
            if kind and kind.lower() in JOINT_TYPES:
                remedy = f"did you mean '{kind.lower()}'?"
            element.fail(problem, remedy)
        ends = {}
        for role in ("parent", "child"):
            end = element.child(role)
            link = None if end is None else end.get("link")
            if not link:
                element.fail(f"has no {role} link", f'add <{role} link="..."/>')
            ends[role] = link
        properties: dict[str, Any] = {}
        pose = element.origin()
        if pose is not None:
            properties.update(rotation=pose[:3, :3], translation=pose[:3, 3])
        if kind in _WITH_AXIS:
            properties["axis"] = self._axis(element, name)
        limit = self._limit(element, name, kind)
        if kind != "fixed":
            properties.update(self._dynamics(element, name, kind))
            self._read_mimic(element, name)
        properties.update(limit)
        return UrdfJoint(name, kind, ends["parent"], ends["child"], properties)

    def _axis(self, element: UrdfElement, name: str) -> list[float]:
        axis = element.child("axis")
        if axis is None:
            return [1.0, 0.0, 0.0]
        xyz = axis.numbers("xyz", 3, "axis")
        length = math.hypot(*xyz)
        if length == 0:
            return xyz  # for the core to refuse
        if abs(length - 1) > 1e-3:
            self._note(name, f"axis has length {length:.4g}; only its direction is used")
        return [x / length for x in xyz]

    def _limit(self, element: UrdfElement, name: str, kind: str) -> dict[str, float]:
        if kind not in ("revolute", "continuous", "prismatic"):
            return {}
        limit = element.child("limit")
        if limit is None:
            if kind in _LIMITED:
                self._note(name, f"has no <limit>, which a {kind} joint should have; unlimited")
            return {}
        given = [a for a in _LIMITS if limit.get(a) is not None]
        found: dict[str, float] = {}
        for a in ("effort", "velocity"):
            if a in given and (value := limit.limit(a)) is not None:
                found[a] = value
            elif a in given:
                self._note(name, f"{a} limit '{shorten(limit.get(a))}' is read as unlimited")
        if kind not in _LIMITED:
            return found
        missing = [a for a in ("lower", "upper") if a not in given]
        if len(missing) == 2:
            # The format's default would be a range from 0 to 0, which nobody means.
            self._note(name, "<limit> has no bounds; unlimited")
            return found
        if missing:
            self._note(name, f"<limit> has no {missing[0]} bound; 0 is taken, as the format says")
        for a, sign in (("lower", -1), ("upper", 1)):
            value = limit.limit(a, sign) if a in given else 0.0
            if value is not None:
                found[a] = value
            else:
                self._note(name, f"{a} limit '{shorten(limit.get(a))}' is read as unlimited")
        return found

    def _dynamics(self, element: UrdfElement, name: str, kind: str) -> dict[str, float]:
        dynamics = element.child("dynamics")
        given = {}
        for attribute in ("damping", "friction"):
            if dynamics is None or dynamics.get(attribute) is None:
                continue
            value = dynamics.number(attribute, attribute)
            if value > 0 and kind in ("planar", "floating"):
                # One number for both lengths and angles has no meaning the format would define.
                self._note(name, f"{attribute} of a {kind} joint is ignored")
                continue
            given[attribute] = value
        return given

    def _read_mimic(self, element: UrdfElement, name: str) -> None:
        mimic = element.child("mimic")
        if mimic is None:
            return
        multiplier, offset = (
            default
            if mimic.get(attribute) is None
            else mimic.number(attribute, f"mimic {attribute}")
            for attribute, default in (("multiplier", 1.0), ("offset", 0.0))
        )
        target = mimic.get("joint")
        if not target:
            mimic.fail("<mimic> names no joint", 'add joint="..." or remove it')
        if self._mimic == "error":
            element.fail(f"mimics joint '{shorten(target)}'", MIMIC_REMEDY)
        if self._mimic == "couple" and target == name:
            element.fail("mimics itself", "name another joint")
        if self._mimic == "couple" and f"joint '{target}'" not in self.found:
            element.fail(f"mimics joint '{shorten(target)}', which does not exist", MISSING_LEADER)
        self._mimics[name] = (target, multiplier, offset)

    def add_couplings(self, builder: ModelBuilder) -> None:
        """joint = multiplier times the other + offset, where mimic joints are coupled."""
        if self._mimic != "couple":
            return
        leaders = {joint: target for joint, (target, *_) in self._mimics.items()}
        refuse_mimic_cycle(leaders, {joint: self.found[f"joint '{joint}'"] for joint in leaders})
        for joint, (target, multiplier, offset) in self._mimics.items():
            builder.add_coupling(f"{joint}_mimic", {joint: 1, target: -multiplier}, offset=offset)

    def add_rotors(self, joints: list[UrdfJoint], root: etree._Element) -> None:
        """Gives joints the rotors of their transmissions, and notes them."""
        rotors = Transmissions(self.path, root, {joint.name: joint.type for joint in joints})
        for joint in joints:
            if joint.name in rotors.armature:
                joint.properties["armature"] = rotors.armature[joint.name]
        self.notes += rotors.notes()

    def note_units(self, joints: list[UrdfJoint]) -> None:
        """Warn of inertias and centres of mass that no body of the machine's size can have."""
        lengths = (
            (j.parent, j.child, math.hypot(*j.properties.get("translation", np.zeros(3))))
            for j in joints
        )
        for name, text in unit_hints(lengths, self._inertials):
            self._note(name, text)

    def note_what_is_left_out(self) -> None:
        # A target that does not exist is no error: the coupling is not used either way.
        for joint, (target, *_) in self._mimics.items() if self._mimic == "independent" else ():
            missing = "" if f"joint '{target}'" in self.found else ", which does not exist"
            self._note(
                joint,
                f"mimics joint '{shorten(target)}'{missing}: "
                "the coupling is ignored, it moves independently",
            )
        self.notes += self._vocabulary.notes()

    def _note(self, element: str, text: str) -> None:
        self.notes.append(("warning", element, text))
