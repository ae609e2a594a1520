"""What stands in a URDF beside what is read: leftovers of macros, extensions, slips.

URDF readers in general skip what they do not know, and with it dampers, masses and whole joints.
Here everything is met. What would carry dynamics is refused or a warning, each with its line; what
is known to have no part in the dynamics is counted.
"""

from __future__ import annotations

import os
import re
from collections import Counter
from typing import NoReturn

from lxml import etree

from linkwise.io.complaint import complain, near, shorten
from linkwise.io.xml import is_foreign, is_xacro, local_name

#: By element, the attributes that are read. All other elements are no concern of the dynamics.
ATTRIBUTES = {
    "joint": ("name", "type"),
    "link": ("name",),
    "inertial": (),
    "origin": ("xyz", "rpy", "quat_xyzw"),
    "axis": ("xyz",),
    "limit": ("lower", "upper", "effort", "velocity"),
    "dynamics": ("damping", "friction"),
    "mass": ("value",),
    "inertia": ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
    "parent": ("link",),
    "child": ("link",),
    "mimic": ("joint", "multiplier", "offset"),
}
_CHILDREN = {
    "robot": ("link", "joint"),
    "link": ("inertial", "visual", "collision"),
    "joint": ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic"),
    "inertial": ("origin", "mass", "inertia"),
}
#: Where each element that carries dynamics belongs.
_PLACES = {
    "link": "robot",
    "joint": "robot",
    "inertial": "link",
    "mass": "inertial",
    "inertia": "inertial",
    "axis": "joint",
    "limit": "joint",
    "dynamics": "joint",
    "mimic": "joint",
    "parent": "joint",
    "child": "joint",
    "damping": "dynamics",
    "friction": "dynamics",
    "lower": "limit",
    "upper": "limit",
    "effort": "limit",
    "velocity": "limit",
}
#: Elements and attributes of other tools that have no part in the dynamics.
_HARMLESS = {
    "robot": "gazebo transmission sensor ros2_control group_state plugin author license "
    "version actuator camera link_name disable_collisions end_effector virtual_joint group "
    "passive_joint lidar motor_group property",
    "link": "contact material self_collision_checking audio verbose sensor name",
    "joint": "safety_controller calibration hardwareInterface safety material sensor visual",
    "limit": "acceleration deceleration jerk soft_lower soft_upper soft_lower_limit "
    "soft_upper_limit k_position k_velocity",
    "link attributes": "type concave id drake_ignore",
    "joint attributes": "id",
}
#: They hold elements of these names that mean something else.
_WITH_THEIR_OWN = ("transmission", "sensor", "ros2_control", "plugin", "camera", "lidar")
_MACROS = ("insert_block", "include", "macro")
#: What Gazebo adds to links and joints by its own elements.
_OF_GAZEBO = "joint springStiffness springReference dampingFactor inertial mass stiffness damping"
_SWITCHES = ("turnGravityOff", "kinematic")
#: Of other programs, with a prefix or without: they carry dynamics, and what stands for them here.
_FORCES_AND_LOOPS = {
    "linear_bushing_rpy": "[bearing.JOINT] or a joint with springs and dampers",
    "linear_spring_damper": "[spring.NAME]",
    "revolute_spring": "[joint.JOINT] stiffness",
    "prismatic_spring": "[joint.JOINT] stiffness",
    "force_element": "[spring.NAME] or [joint.JOINT]",
    "ball_constraint": "[loop.NAME] with a spherical joint",
    "loop_joint": "[loop.NAME]",
    "loop": "[loop.NAME]",
    "constraint": "[loop.NAME]",
    "screw_thread_pitch": "a helical joint of linkwise.ModelBuilder",
    "damping": "<dynamics>",
    "friction": "<dynamics>",
    "stiffness": "[joint.JOINT] stiffness",
    "spring": "[spring.NAME] or [joint.JOINT] stiffness",
    "gear_ratio": "[joint.JOINT] gear_ratio with motor_inertia",
    "rotor_inertia": "[joint.JOINT] motor_inertia with gear_ratio",
    "armature": "[joint.JOINT] armature",
}


class Vocabulary:
    """Walks a document once and keeps the notes: level, element, text."""

    def __init__(self, path: str | os.PathLike[str], root: etree._Element) -> None:
        self._path, self._root = path, root
        self._first: dict[tuple[str, str], tuple[str, int | None]] = {}
        self._counts: Counter[tuple[str, str]] = Counter()
        self._harmless: Counter[str] = Counter()
        for element in root.iter(etree.Element):
            if is_xacro(element) or (
                local_name(element) in _MACROS[:1] and not is_foreign(element, root)
            ):
                self._refuse_macro(element)
        for child in root.iterchildren(etree.Element):
            self._of_robot(child)

    def notes(self) -> list[tuple[str, str, str]]:
        found = []
        for (name, text), count in self._counts.items():
            element, line = self._first[name, text]
            more = f", and {count - 1} more like it" if count > 1 else ""
            where = f" (line {line}{more})" if line else ""
            found.append(("warning", element, f"{text}{where}"))
        for tag, count in sorted(self._harmless.items()):
            text = f"{count} ignored: not part of the rigid-body dynamics"
            found.append(("info", tag, text))
        return found

    # -- what is refused ------------------------------------------------------------------------

    def _refuse_macro(self, element: etree._Element) -> NoReturn:
        complain(
            self._path,
            f"element '{_shown(element)}'",
            "this is a xacro file, not yet a URDF",
            "expand it first: xacro FILE.xacro > FILE.urdf",
            element.sourceline,
        )

    def _refuse(self, element: etree._Element, problem: str, remedy: str) -> NoReturn:
        complain(self._path, f"element '{_shown(element)}'", problem, remedy, element.sourceline)

    def _refuse_extension(self, element: etree._Element) -> NoReturn:
        name = element.get("name")
        called = f" '{shorten(name)}'" if name else ""
        kind = element.get("type")
        self._refuse(
            element,
            f"<{_shown(element)}>{called}{f' of type {shorten(kind)}' if kind else ''} is an "
            "extension of another program and is not read, but the machine needs it",
            "write it with the elements of URDF, or build the machine with linkwise.ModelBuilder",
        )

    # -- the walk -------------------------------------------------------------------------------

    def _of_robot(self, element: etree._Element) -> None:
        tag = local_name(element)
        if is_foreign(element, self._root):
            if tag in _PLACES:
                self._refuse_extension(element)
            self._of_another_program("robot", element, f"<{shorten(tag)}>")
        elif tag in ("link", "joint"):
            self._inside(element, f"{tag} '{shorten(element.get('name', ''))}'")
        elif tag in ("material", "transmission"):  # urdf_transmissions reads the latter
            pass
        elif tag in _MACROS:
            self._refuse_macro(element)
        elif tag in _PLACES or tag == "origin":
            self._misplaced(element)
        else:
            if tag == "gazebo":
                self._of_gazebo(element)
            elif tag not in _WITH_THEIR_OWN:
                self._refuse_pieces_in(element)
            if tag not in _HARMLESS["robot"].split():
                self._unknown("robot", element)
                return
            self._harmless[f"<{shorten(tag)}>"] += 1

    def _refuse_pieces_in(self, element: etree._Element) -> None:
        """Links and joints with their properties, in an element where nobody looks for them."""
        for inner in element.iter(etree.Element):
            if local_name(inner) in ("inertial", "dynamics", "parent"):
                self._refuse(
                    element,
                    f"is unknown, and it holds <{_shown(inner)}>, which is not looked for there",
                    "put links and joints directly into <robot> (expand macros first)",
                )

    def _of_gazebo(self, element: etree._Element) -> None:
        whom = shorten(element.get("reference") or "gazebo")
        for inner in element.iter(etree.Element):
            tag = local_name(inner)
            switched_on = (inner.text or "").strip().lower() not in ("false", "0", "")
            if tag == "gravity":
                acts = not switched_on
            elif tag in _SWITCHES:
                acts = switched_on
            else:
                acts = tag in _OF_GAZEBO.split()
            if acts:
                self._warn(whom, inner, f"<{_shown(inner)}> of <gazebo> is not read")

    def _inside(self, element: etree._Element, title: str) -> None:
        """A <link>, <joint> or <inertial>, whose children are elements that are read."""
        kind = local_name(element)
        self._attributes(element, title)
        for child in element.iterchildren(etree.Element):
            tag = local_name(child)
            if is_foreign(child, self._root):
                if tag in _PLACES and tag not in _FORCES_AND_LOOPS:
                    self._refuse_extension(child)
                self._of_another_program(title, child, f"<{shorten(tag)}> of a {kind}")
            elif tag in _MACROS:
                self._refuse_macro(child)
            elif tag in ("visual", "collision") and kind == "link":
                continue
            elif tag in _CHILDREN[kind]:
                (self._inside if tag == "inertial" else self._leaf)(child, title)
            elif tag in _PLACES:
                self._misplaced(child)
            elif tag in _HARMLESS.get(kind, "").split():
                self._harmless[f"<{shorten(tag)}> of a {kind}"] += 1
            else:
                self._unknown(title, child, _CHILDREN[kind])

    def _unknown(self, title: str, element: etree._Element, known: tuple[str, ...] = ()) -> None:
        """A warning, with what stands for the element here, or the nearest known name."""
        tag = local_name(element)
        text = f"unknown element <{_shown(element)}> is not read"
        hint = near(tag, known) if known else ""
        if tag in _FORCES_AND_LOOPS:
            hint = f"it acts on the machine: write {_FORCES_AND_LOOPS[tag]} instead"
        elif not hint.startswith("did"):
            hint = ""
        self._warn(title, element, f"{text}; {hint}" if hint else text)

    def _of_another_program(self, title: str, element: etree._Element, counted: str) -> None:
        """An element with a prefix: a warning where it acts on the machine, else it is counted."""
        if local_name(element) in _FORCES_AND_LOOPS:
            self._unknown(title, element)
        else:
            self._harmless[counted] += 1

    def _misplaced(self, element: etree._Element) -> None:
        place = _PLACES.get(local_name(element), "joint> or <inertial")
        self._refuse(
            element,
            f"stands in <{_shown(element.getparent())}>, where it is not looked for",
            f"move it into the <{place}> that it belongs to",
        )

    def _leaf(self, element: etree._Element, title: str) -> None:
        """An element that is all attributes; children that are named so stand for them."""
        tag = local_name(element)
        self._attributes(element, title)
        for child in element.iterchildren(etree.Element):
            name = local_name(child)
            if is_foreign(child, self._root):
                self._of_another_program(title, child, f"<{shorten(name)}> of a {tag}")
            elif name in _MACROS:
                self._refuse_macro(child)
            elif name in ATTRIBUTES[tag]:
                text = f"<{tag}> gives {name} as an element, which other readers skip; it is read"
                self._warn(title, child, text)
            elif tag == "limit" and name in _HARMLESS["limit"].split():
                self._harmless[f"<{shorten(name)}> of a limit"] += 1
            else:
                text = f"unknown element <{_shown(child)}> in <{tag}> is not read"
                self._warn(title, child, text)
        texts = [element.text, *(child.tail for child in element)]
        said = " ".join(filter(None, (shorten(text or "") for text in texts)))
        if said and tag == "mass" and element.get("value") is None:
            text = "<mass> gives value as text, which other readers skip; it is read"
            self._warn(title, element, text)
        elif said:
            name = ATTRIBUTES[tag][0]
            self._refuse(
                element,
                f"holds the text '{shorten(said)}', which is not read",
                f'write it as an attribute: <{tag} {name}="..."/>',
            )

    def _attributes(self, element: etree._Element, title: str) -> None:
        tag = local_name(element)
        known = ATTRIBUTES[tag]
        harmless = _HARMLESS.get(f"{tag} attributes", "").split()
        harmless += _HARMLESS["limit"].split() if tag == "limit" else []
        for name, value in element.attrib.items():
            name = str(name)
            if name in ("name", "type", "link", "joint") and re.search(r"\$[{(]", str(value)):
                self._refuse(
                    element,
                    f"{name} holds the expression '{shorten(value)}'",
                    "expand the xacro expression first",
                )
            if name in known or name.startswith("{") or ":" in name or name in harmless:
                continue
            hint = near(name, known) if known else ""
            text = f"unknown attribute '{shorten(name)}' of <{tag}> is not read"
            self._warn(title, element, f"{text}; {hint}" if hint.startswith("did") else text)

    def _warn(self, title: str, element: etree._Element, text: str) -> None:
        name = title.partition(" ")[2].strip("'") if title.startswith(("link '", "joint '")) else ""
        key = (local_name(element), text)
        self._first.setdefault(key, (name or title, element.sourceline))
        self._counts[key] += 1


def _shown(element: etree._Element) -> str:
    """The element's name with its prefix, as the file writes it."""
    name = str(element.tag).rpartition("}")[2]
    return shorten(f"{element.prefix}:{name}" if element.prefix else name)
