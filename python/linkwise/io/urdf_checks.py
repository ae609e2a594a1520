"""Strict checks of a URDF before anything is taken from it.

The checks read the XML themselves, because they must name line, element and remedy, and because
URDF readers replace what they cannot read by defaults. What passes is copied, element by element,
into a clean document that holds only what the rigid-body dynamics needs.
"""

from __future__ import annotations

import math
import os
from collections import Counter
from dataclasses import dataclass, field
from typing import NoReturn

import numpy as np
from lxml import etree

from linkwise.io.complaint import complain, shorten
from linkwise.io.numbers import parse_number, parse_numbers
from linkwise.io.urdf_tree import Edge
from linkwise.io.xml import is_foreign, local_name

JOINT_TYPES = ("fixed", "revolute", "continuous", "prismatic", "planar", "floating")
_LIMITED = ("revolute", "prismatic")
_WITH_AXIS = ("revolute", "continuous", "prismatic", "planar")
_INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_LINK_CHILDREN = {"inertial", "visual", "collision"}
_JOINT_CHILDREN = {"origin", "parent", "child", "axis", "limit", "dynamics", "mimic"}


@dataclass
class CheckedUrdf:
    """A URDF that passed: the clean document, its links and joints, and what was left out."""

    path: str | os.PathLike[str]
    name: str
    robot: etree._Element
    links: dict[str, int | None] = field(default_factory=dict)
    joints: list[Edge] = field(default_factory=list)
    mimics: dict[str, str] = field(default_factory=dict)
    notes: list[tuple[str, str, str]] = field(default_factory=list)


def check_urdf(path: str | os.PathLike[str], root: etree._Element) -> CheckedUrdf:
    """Check everything but the shape of the tree. Raises InputError at the first defect."""
    return _Checker(path, root).run()


class _Checker:
    def __init__(self, path: str | os.PathLike[str], root: etree._Element) -> None:
        self.path = path
        self.root = root
        name = root.get("name") or os.path.splitext(os.path.basename(os.fspath(path)))[0]
        self.out = CheckedUrdf(path, name, etree.Element("robot", name="robot"))
        self.ignored: Counter[str] = Counter()
        self.joint_lines: dict[str, int | None] = {}
        self.welded: set[str | None] = set()
        self.children_of: etree._Element | None = None
        self.children: dict[str, list[etree._Element]] = {}

    def run(self) -> CheckedUrdf:
        links, joints = [], []
        for element in self.root.iterchildren(tag=etree.Element):
            tag = local_name(element)
            if is_foreign(element, self.root):
                self._refuse_xacro(element)
                self.ignored[f"<{shorten(tag)}>"] += 1
            elif tag == "link":
                links.append(element)
            elif tag == "joint":
                joints.append(element)
            elif tag != "material":
                self.ignored[f"<{shorten(tag)}>"] += 1
        if not links:
            self._fail(
                self.root,
                "robot",
                "has no links",
                "give a complete URDF (if it comes from xacro, expand it with its arguments first)",
            )
        self.welded = {
            child.get("link")
            for joint in joints
            if joint.get("type") == "fixed"
            for child in joint.iterchildren(tag=etree.Element)
            if local_name(child) == "child"
        }
        for element in links:
            self._link(element)
        for element in joints:
            self._joint(element)
        self._note_mimics()
        for tag, count in sorted(self.ignored.items()):
            self.out.notes.append(
                ("info", tag, f"{count} ignored: not part of the rigid-body dynamics")
            )
        return self.out

    # -- links ------------------------------------------------------------------------------

    def _link(self, element: etree._Element) -> None:
        name = self._name(element, "link", self.out.links)
        self.out.links[name] = element.sourceline
        clean = etree.SubElement(self.out.robot, "link", name=name)
        for child in element.iterchildren(tag=etree.Element):
            if local_name(child) not in _LINK_CHILDREN:
                self.ignored[f"<{shorten(local_name(child))}> of a link"] += 1
        inertial = self._child(element, "inertial", f"link '{shorten(name)}'")
        if inertial is not None:
            self._inertial(inertial, name, etree.SubElement(clean, "inertial"))

    def _inertial(self, element: etree._Element, name: str, clean: etree._Element) -> None:
        title = f"link '{shorten(name)}'"
        self._origin(element, title, clean)
        mass = self._child(element, "mass", title)
        if mass is None:
            self._fail(element, title, "<inertial> has no <mass>", 'add <mass value="..."/> in kg')
        value = self._number(mass, "value", title, "mass")
        if value < 0:
            self._fail(mass, title, f"mass is negative ({value:g})", "give a mass >= 0 in kg")
        etree.SubElement(clean, "mass", value=mass.get("value", ""))
        inertia = self._child(element, "inertia", title)
        if inertia is None:
            self._fail(
                element,
                title,
                "<inertial> has no <inertia>",
                'add <inertia ixx="..." ixy="..." ixz="..." iyy="..." iyz="..." izz="..."/>',
            )
        moments = [
            self._number(inertia, attribute, title, f"inertia {attribute}")
            for attribute in _INERTIA
        ]
        self._principal_moments(inertia, name, value, moments)
        etree.SubElement(clean, "inertia", {a: inertia.get(a, "") for a in _INERTIA})

    def _principal_moments(
        self, element: etree._Element, name: str, mass: float, moments: list[float]
    ) -> None:
        """Refuse a principal moment that is negative beyond the rounding of printed numbers.

        CAD programs print noise such as 1e-20 kg m2, which is measured against a millimetre's
        radius of gyration. A link that is welded to its parent is left to the builder, which
        judges the sum: robots in use carry antennas with inertias that no body can have.
        """
        xx, xy, xz, yy, yz, zz = moments
        smallest, _, largest = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if smallest < -1e-6 * max(-smallest, largest, mass * 1e-6) and name not in self.welded:
            self._fail(
                element,
                f"link '{shorten(name)}'",
                f"inertia has a negative principal moment ({smallest:.4g} kg m2)",
                "give a positive semidefinite inertia about the centre of mass",
            )

    # -- joints -----------------------------------------------------------------------------

    def _joint(self, element: etree._Element) -> None:
        name = self._name(element, "joint", self.joint_lines)
        self.joint_lines[name] = element.sourceline
        title = f"joint '{shorten(name)}'"
        kind = element.get("type")
        if kind not in JOINT_TYPES:
            problem = "has no type" if kind is None else f"unknown type '{shorten(kind)}'"
            self._fail(element, title, problem, f"use one of {', '.join(JOINT_TYPES)}")
        ends = {}
        for role in ("parent", "child"):
            end = self._child(element, role, title)
            link = None if end is None else end.get("link")
            if not link:
                self._fail(element, title, f"has no {role} link", f'add <{role} link="..."/>')
            ends[role] = link
        self.out.joints.append(Edge(name, ends["parent"], ends["child"], element.sourceline))
        clean = etree.SubElement(self.out.robot, "joint", name=name, type=kind)
        for role, link in ends.items():
            etree.SubElement(clean, role, link=link)
        for child in element.iterchildren(tag=etree.Element):
            if local_name(child) not in _JOINT_CHILDREN:
                self.ignored[f"<{shorten(local_name(child))}> of a joint"] += 1
        self._origin(element, title, clean)
        if kind in _WITH_AXIS:
            self._axis(element, name, clean)
        if kind in ("revolute", "continuous", "prismatic"):
            self._limit(element, name, kind, clean)
        if kind != "fixed":
            self._dynamics(element, name, kind, clean)
            self._mimic(element, name)

    def _axis(self, element: etree._Element, name: str, clean: etree._Element) -> None:
        title = f"joint '{shorten(name)}'"
        axis = self._child(element, "axis", title)
        if axis is None:
            return  # the format's default, 1 0 0, is also yourdfpy's
        xyz = self._numbers(axis, "xyz", 3, title, "axis")
        length = math.hypot(*xyz)
        if length == 0:
            self._fail(axis, title, "axis has zero length", "give a nonzero axis")
        if abs(length - 1) > 1e-3:
            text = f"axis has length {length:.4g}; only its direction is used"
            self.out.notes.append(("warning", name, text))
        etree.SubElement(clean, "axis", xyz=axis.get("xyz", ""))

    def _limit(self, element: etree._Element, name: str, kind: str, clean: etree._Element) -> None:
        title = f"joint '{shorten(name)}'"
        limit = self._child(element, "limit", title)
        if limit is None:
            if kind in _LIMITED:
                note = f"has no <limit>, which a {kind} joint should have; unlimited"
                self.out.notes.append(("warning", name, note))
            return
        out = etree.SubElement(clean, "limit")
        for attribute in ("effort", "velocity"):
            if limit.get(attribute) is not None:
                value = self._number(limit, attribute, title, f"{attribute} limit")
                if value < 0:
                    problem = f"{attribute} limit is negative ({value:g})"
                    self._fail(limit, title, problem, "give a value >= 0")
                out.set(attribute, limit.get(attribute, ""))
        if kind not in _LIMITED:
            return
        missing = [a for a in ("lower", "upper") if limit.get(a) is None]
        if len(missing) == 2:
            # The format's default would be a range from 0 to 0, which nobody means.
            self.out.notes.append(("warning", name, "<limit> has no bounds; unlimited"))
            return
        if missing:
            note = f"<limit> has no {missing[0]} bound; 0 is taken, as the format says"
            self.out.notes.append(("warning", name, note))
        bounds = []
        for attribute in ("lower", "upper"):
            text = limit.get(attribute)
            bounds.append(
                0.0 if text is None else self._number(limit, attribute, title, f"{attribute} limit")
            )
            out.set(attribute, text or "0")
        if bounds[0] > bounds[1]:
            self._fail(
                limit,
                title,
                f"lower limit {bounds[0]:g} is above the upper limit {bounds[1]:g}",
                "swap them",
            )

    def _dynamics(
        self, element: etree._Element, name: str, kind: str, clean: etree._Element
    ) -> None:
        title = f"joint '{shorten(name)}'"
        dynamics = self._child(element, "dynamics", title)
        if dynamics is None:
            return
        out = etree.SubElement(clean, "dynamics")
        for attribute in ("damping", "friction"):
            if dynamics.get(attribute) is None:
                continue
            value = self._number(dynamics, attribute, title, attribute)
            if value < 0:
                self._fail(
                    dynamics, title, f"{attribute} is negative ({value:g})", "give a value >= 0"
                )
            if value > 0 and kind in ("planar", "floating"):
                # One number for both lengths and angles has no meaning the format would define.
                note = f"{attribute} of a {kind} joint is ignored"
                self.out.notes.append(("warning", name, note))
                continue
            out.set(attribute, dynamics.get(attribute, ""))

    def _mimic(self, element: etree._Element, name: str) -> None:
        title = f"joint '{shorten(name)}'"
        mimic = self._child(element, "mimic", title)
        if mimic is None:
            return
        for attribute in ("multiplier", "offset"):
            if mimic.get(attribute) is not None:
                self._number(mimic, attribute, title, f"mimic {attribute}")
        target = mimic.get("joint")
        if not target:
            self._fail(mimic, title, "<mimic> names no joint", 'add joint="..." or remove it')
        self.out.mimics[name] = target

    def _note_mimics(self) -> None:
        # A target that does not exist is no error: the coupling is not used either way.
        for joint, target in self.out.mimics.items():
            missing = "" if target in self.joint_lines else ", which does not exist"
            text = (
                f"mimics joint '{shorten(target)}'{missing}: "
                "the coupling is ignored, it moves independently"
            )
            self.out.notes.append(("warning", joint, text))

    # -- shared -----------------------------------------------------------------------------

    def _fail(self, element: etree._Element, title: str, problem: str, remedy: str) -> NoReturn:
        complain(self.path, title, problem, remedy, element.sourceline)

    def _refuse_xacro(self, element: etree._Element) -> None:
        if "xacro" in str(element.tag).rpartition(local_name(element))[0]:
            self._fail(
                element,
                f"element 'xacro:{shorten(local_name(element))}'",
                "this is a xacro file, not yet a URDF",
                "expand it first: xacro FILE.xacro > FILE.urdf",
            )

    def _name(self, element: etree._Element, kind: str, taken: dict[str, int | None]) -> str:
        name: str = element.get("name", "")
        if not name:
            self._fail(element, kind, "has no name", 'add name="..."')
        if name in taken:
            first = f" (first on line {taken[name]})" if taken[name] else ""
            self._fail(
                element,
                f"{kind} '{shorten(name)}'",
                f"the name is used twice{first}",
                f"give every {kind} its own name",
            )
        return name

    def _child(self, element: etree._Element, tag: str, title: str) -> etree._Element | None:
        if self.children_of is not element:  # one pass serves all children of an element
            self.children_of, self.children = element, {}
            for child in element.iterchildren(tag=etree.Element):
                if not is_foreign(child, self.root):
                    self.children.setdefault(local_name(child), []).append(child)
        found = self.children.get(tag, ())
        if len(found) > 1:
            self._fail(found[1], title, f"has two <{tag}> elements", "keep one")
        return found[0] if found else None

    def _number(self, element: etree._Element, attribute: str, title: str, what: str) -> float:
        return self._numbers(element, attribute, 1, title, what)[0]

    def _numbers(
        self, element: etree._Element, attribute: str, count: int, title: str, what: str
    ) -> list[float]:
        text = element.get(attribute)
        remedy = "give a finite number" if count == 1 else f"give {count} finite numbers"
        if text is None:
            problem = f"<{local_name(element)}> has no {attribute}"
            self._fail(element, title, problem, f'add {attribute}="..."')
        try:
            return [parse_number(text)] if count == 1 else parse_numbers(text, count)
        except ValueError as error:
            if "${" in text or "$(" in text:
                remedy = "expand the xacro expression first"
            self._fail(element, title, f"{what}: {error}", remedy)

    def _origin(self, element: etree._Element, title: str, clean: etree._Element) -> None:
        origin = self._child(element, "origin", title)
        if origin is None:
            return
        if origin.get("quat_xyzw") is not None:
            problem = "origin quat_xyzw is not supported"
            self._fail(origin, title, problem, "give the rotation as rpy")
        out = etree.SubElement(clean, "origin")
        for attribute in ("xyz", "rpy"):
            if origin.get(attribute) is not None:
                self._numbers(origin, attribute, 3, title, f"origin {attribute}")
                out.set(attribute, origin.get(attribute, ""))
