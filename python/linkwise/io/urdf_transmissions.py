"""Rotors in the <transmission> elements of a URDF: the armature that they give to their joints.

ROS writes the reduction of a gear, as <mechanicalReduction>, and some files a <motorInertia> beside
it; Drake writes <drake:gear_ratio> and <drake:rotor_inertia>. Where one actuator drives one joint,
both together are its armature. What is left out is noted.
"""

from __future__ import annotations

import os
from collections.abc import Mapping

from lxml import etree

from linkwise._core import InputError
from linkwise.io.complaint import shorten
from linkwise.io.urdf_elements import UrdfElement
from linkwise.io.xml import local_name

_INERTIA = ("motorinertia", "rotorinertia")
_RATIO = ("gearratio", "mechanicalreduction")  # the first that is there
_DRIVEN = ("revolute", "continuous", "prismatic")


class Transmissions:
    """What the transmissions of a document give to its joints.

    joints: types by name. armature: by joint, [kg m2], or [kg] of a sliding one.
    """

    def __init__(
        self, path: str | os.PathLike[str], root: etree._Element, joints: Mapping[str, str]
    ) -> None:
        self._path, self._joints = path, joints
        self.armature: dict[str, float] = {}
        self._notes: list[tuple[str, str, str]] = []
        self._without = 0
        self._reductions: dict[str, float] = {}
        for element in root.iter(etree.Element):
            if local_name(element) == "transmission":
                self._read(element)

    def notes(self) -> list[tuple[str, str, str]]:
        """Level, element, text."""
        found = list(self._notes)
        if self._without:
            text = f"{self._without} without a motor's inertia: nothing of them acts"
            found.append(("info", "<transmission>", text))
        if self._reductions:
            joint, largest = max(self._reductions.items(), key=lambda item: abs(item[1]))
            more = f" (and {len(self._reductions) - 1} more)" if len(self._reductions) > 1 else ""
            text = (
                f"reduction {largest:g} of joint '{shorten(joint)}'{more} has no motor's inertia "
                "beside it: rotors are left out; set them with with_joint(NAME, motor_inertia=..., "
                "gear_ratio=...), or [joint.NAME] in a scenario"
            )
            found.append(("warning", "<transmission>", text))
        return found

    def _read(self, element: etree._Element) -> None:
        name = element.get("name", "")
        title = f"transmission '{shorten(name)}'" if name else "transmission"
        children = list(element.iterchildren(etree.Element))
        joints = {str(c.get("name")): None for c in children if local_name(c) == "joint"}
        actuators = [c for c in children if local_name(c) == "actuator"]
        shared = [inner for c in children if c not in actuators for inner in c.iter(etree.Element)]
        found = []
        for own in [list(a.iter(etree.Element)) for a in actuators] or [[]]:
            inertia = self._inertia(title, [*own, *(shared if len(actuators) < 2 else [])])
            if inertia:
                found.append((inertia, *self._ratio(title, own, shared)))
        if not found:
            self._without += 1
            self._note_reduction(title, element, joints)
            return
        rotors = " and ".join(f"{inertia:g} kg m2" for inertia, _, _ in found)
        lost = ""
        if len(joints) != 1:
            lost = f"drives {len(joints)} joints"
        elif (kind := self._joints.get(joint := next(iter(joints)))) not in _DRIVEN:
            what = f"which is {kind}" if kind else "which does not exist"
            lost = f"drives joint '{shorten(joint)}', {what}"
        if lost:
            text = f"{lost}: its motor inertia of {rotors} is not read (line {element.sourceline})"
            self._notes.append(("warning", title, text))
            return
        for inertia, ratio, said in found:
            armature = ratio * ratio * inertia
            self.armature[joint] = self.armature.get(joint, 0.0) + armature
            level = "warning" if said else "info"
            text = (
                f"armature {armature:g} from {title}: motor inertia {inertia:g} kg m2, "
                f"gear ratio {ratio:g}{said}"
            )
            self._notes.append((level, joint, text))

    def _numbers(
        self, title: str, elements: list[etree._Element], names: tuple[str, ...]
    ) -> list[tuple[str, float]]:
        """Tags and numbers of the elements that are called so, in the order of the names."""
        found = []
        for name in names:
            for element in elements:
                if local_name(element).replace("_", "").lower() == name:
                    tag = local_name(element)
                    number = UrdfElement(self._path, element, title).number("value", tag)
                    found.append((tag, number))
        return found

    def _inertia(self, title: str, elements: list[etree._Element]) -> float:
        given = {number for _, number in self._numbers(title, elements, _INERTIA)}
        element = next(
            (e for e in elements if local_name(e).replace("_", "").lower() in _INERTIA), None
        )
        if element is None:
            return 0.0
        complain = UrdfElement(self._path, element, title).fail
        if len(given) > 1:
            complain(f"gives a motor's inertia twice, {' and '.join(map(str, given))}", "keep one")
        (inertia,) = given
        if inertia < 0:
            complain(f"motor inertia is negative ({inertia:g})", "give a value >= 0 in kg m2")
        return inertia

    def _ratio(
        self, title: str, own: list[etree._Element], shared: list[etree._Element]
    ) -> tuple[float, str]:
        """The gear's ratio, and what is to be said of it."""
        given = self._numbers(title, own, _RATIO) or self._numbers(title, shared, _RATIO)
        if not given:
            return 1.0, "; no gear ratio is given, 1 is taken"
        tag, ratio = given[0]
        for other, number in given[1:]:
            if abs(number) != abs(ratio):
                return ratio, f" of {tag}; {other} {number:g} beside it is not used"
        return ratio, ""

    def _note_reduction(self, title: str, element: etree._Element, joints: dict[str, None]) -> None:
        try:
            given = self._numbers(title, list(element.iter(etree.Element)), _RATIO)
        except InputError:
            return  # no number, and nothing that would need it
        for _, ratio in given:
            if abs(ratio) != 1:
                self._reductions.setdefault(next(iter(joints), title), ratio)
