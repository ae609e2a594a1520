"""Reading SDF, the format of Gazebo, into a Model.

One model of links and joints is read, strictly as the URDF reader does. A link that is the child of
several joints closes loops. Its link frame here lies at the joint that it hangs on, because a joint
load is given at the joint point; a link that hangs on nothing keeps its own and floats.

Facts of the format, versions 1.5 and later (sdformat.org): a joint's pose counts from its child, an
axis from the joint, and at zero the machine is as drawn; what is not joined to the world is free.
"""

from __future__ import annotations

import math
import os
from collections import Counter, deque
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from lxml import etree

from linkwise._core import Model, ModelBuilder
from linkwise.base import Array
from linkwise.io.building import build, refuse_mimic_cycle
from linkwise.io.complaint import complain, file_name, shorten
from linkwise.io.sdf_frames import MODEL, WORLD, Frames, SdfElement, pose_of, quaternion_of
from linkwise.io.unit_hints import Inertial, unit_hints
from linkwise.io.urdf import MIMIC_REMEDY, MISSING_LEADER, Mimic
from linkwise.io.xml import is_foreign, local_name

#: Joint types of the format, with their names here and how many axes they have.
JOINT_TYPES = {
    "fixed": ("fixed", 0),
    "revolute": ("revolute", 1),
    "continuous": ("continuous", 1),
    "prismatic": ("prismatic", 1),
    "screw": ("helical", 1),
    "universal": ("universal", 2),
    "revolute2": ("universal", 2),
    "ball": ("spherical", 0),
}
_UNLIMITED = 1e16
_OLDEST = (1, 5)
#: By element, what is read of it, and what has no part in the dynamics.
_READ = {
    "model": "link joint frame pose static",
    "link": "pose inertial gravity kinematic velocity_decay",
    "frame": "pose",
    "joint": "parent child pose axis axis2 screw_thread_pitch thread_pitch gearbox_ratio "
    "gearbox_reference_body",
    "inertial": "pose mass inertia",
    "inertia": "ixx ixy ixz iyy iyz izz",
    "axis": "xyz limit dynamics mimic use_parent_model_frame",
    "axis2": "xyz limit dynamics mimic use_parent_model_frame",
    "limit": "lower upper effort velocity",
    "dynamics": "damping friction spring_reference spring_stiffness",
    "mimic": "multiplier offset reference",
}
_HARMLESS = {
    "model": "plugin self_collide allow_auto_disable enable_wind gripper",
    "link": "visual collision sensor light projector audio_sink audio_source enable_wind "
    "self_collide must_be_base_link battery particle_emitter plugin",
    "joint": "physics sensor",
    "limit": "stiffness dissipation",
    "inertial": "density",
}


def read_sdf(
    path: str | os.PathLike[str],
    root: etree._Element,
    *,
    gravity: tuple[float, float, float] | None = None,
    keep_fixed: bool = False,
    mimic: Mimic = "couple",
) -> Model:
    """The model that the parsed SDF ``root`` describes; ``path`` is for messages.

    gravity: m/s2; None takes the file's, or (0, 0, -9.81). keep_fixed, mimic: as in ``load``.
    Raises InputError, in one line with file, line, element and remedy.
    """
    reader = _Reader(path, root, mimic)
    chosen = gravity or reader.gravity or (0.0, 0.0, -9.81)
    builder = ModelBuilder(reader.name, gravity=chosen, source=file_name(path))
    reader.fill(builder)
    return build(builder, path, reader.notes(), reader.found, {}, keep_fixed=keep_fixed)


@dataclass
class SdfJoint:
    """A joint of the file, with its frame's pose (4, 4) as drawn."""

    name: str
    type: str
    parent: str
    child: str
    pose: Array
    properties: dict[str, Any]


class _Reader:
    def __init__(self, path: str | os.PathLike[str], root: etree._Element, mimic: Mimic) -> None:
        self._path, self._mimic = path, mimic
        self.found: dict[str, SdfElement] = {}
        self._notes: list[tuple[str, str, str]] = []
        self._harmless: Counter[str] = Counter()
        self.gravity: tuple[float, float, float] | None = None
        self._frames = Frames()
        self._joints: list[SdfElement] = []
        self._couplings: list[tuple[str, dict[str, float], float]] = []
        self._inertials: dict[str, Inertial] = {}
        self._leaders: dict[str, str] = {}
        self._follower: dict[str, SdfElement] = {}
        self._check_version(root)
        top = self._read_top(root)
        self.name = top.get("name") or os.path.splitext(os.path.basename(file_name(path)))[0]
        if not self._frames.links:
            still = local_name(top) == "model" and self._is_static(top)
            problem = "is static, so nothing in it moves" if still else "has no links that move"
            remedy = "remove <static>" if still else "give a model of links and joints"
            title = f"{local_name(top)} '{shorten(self.name)}'"
            complain(path, title, problem, remedy, top.sourceline)

    # -- what the file holds --------------------------------------------------------------------

    def _check_version(self, root: etree._Element) -> None:
        text = root.get("version", "")
        parts = text.strip().split(".")
        known = len(parts) == 2 and all(p.isascii() and p.isdigit() and len(p) < 4 for p in parts)
        version = tuple(int(part) for part in parts) if known else (0, 0)
        if version < _OLDEST or version[0] > 1:
            complain(
                self._path,
                "sdf",
                f"version '{shorten(text)}' is not read",
                "convert it to 1.5 or later (gz sdf -p FILE)",
                root.sourceline,
            )

    def _read_top(self, root: etree._Element) -> etree._Element:
        """Reads the one model of the file, or what stands in its world. Of a world with one model
        that moves, that one is the machine, and its names are as it writes them."""
        worlds = [c for c in root.iterchildren(tag=etree.Element) if local_name(c) == "world"]
        inside = list((worlds[0] if worlds else root).iterchildren(tag=etree.Element))
        models = [c for c in inside if local_name(c) == "model"]
        if len(worlds) > 1 or not models or (len(models) > 1 and not worlds):
            count = f"{len(worlds)} worlds" if len(worlds) > 1 else f"{len(models)} models"
            remedy = "give a file with one <model>, or a <world> of several"
            complain(self._path, "sdf", f"holds {count}", remedy, root.sourceline)
        moving = [model for model in models if not self._is_static(model)]
        tied = [c for c in inside if worlds and local_name(c) in ("joint", "frame")]
        alone = len(moving) == 1 and not tied
        for child in inside if worlds else ():
            tag = local_name(child)
            if tag == "gravity":
                given = SdfElement(self._path, child, "world").numbers("value", 3, "gravity")
                self.gravity = (given[0], given[1], given[2])
            elif tag == "include":
                self._refuse_include(child)
        for model in models:
            named = not (alone and model is moving[0]) and len(models) + len(tied) > 1
            self._read_model(model, WORLD, "", named=named)
        for child in tied:
            self._add_named(child, local_name(child), "", WORLD)
        return models[0] if len(models) == 1 else moving[0] if alone else worlds[0]

    def _refuse_include(self, element: etree._Element) -> NoReturn:
        problem, remedy = "includes are not fetched", "write them out (gz sdf -p FILE)"
        complain(self._path, "element 'include'", problem, remedy, element.sourceline)

    def _is_static(self, model: etree._Element) -> bool:
        return self._switched_on(SdfElement(self._path, model, "model"), "static")

    def _read_model(
        self,
        element: etree._Element,
        outside: str,
        scope: str,
        *,
        named: bool = True,
        static: bool = False,
    ) -> None:
        """A model in the frame `outside`, where `scope` stands before names; named: so does its own
        name inside it. Links of a static one are parts of the world."""
        name = element.get("name", "")
        model = self._element(element, f"model '{shorten(name)}'", scope)
        static = static or self._is_static(element)
        if named and not name:
            model.fail("has no name", 'add name="..."')
        if named and self._frames.taken(scope + name):
            model.fail("the name is used twice", "rename one of them")
        inside = f"{scope}{name}::" if named else scope
        self._frames.add_model(model, inside, outside, static=static)
        if static:
            self._notes.append(
                ("info", scope + name, "is static: its links are parts of the world")
            )
        for child in element.iterchildren(tag=etree.Element):
            tag = local_name(child)
            if is_foreign(child, element):
                continue
            if tag == "include":
                self._refuse_include(child)
            if tag == "model":
                self._read_model(child, inside + MODEL, inside, static=static)
            if tag in ("link", "joint", "frame"):
                self._add_named(child, tag, inside, inside + MODEL, static=static)

    def _element(self, element: etree._Element, title: str, scope: str = "") -> SdfElement:
        """The element, whose children of unknown names are noted."""
        tag = local_name(element)
        read, harmless = _READ[tag].split(), _HARMLESS.get(tag, "").split()
        for child in element.iterchildren(tag=etree.Element):
            name = local_name(child)
            if is_foreign(child, element) or name in harmless:
                self._harmless[f"<{shorten(name)}> of a {tag}"] += 1
            elif name not in read and name not in ("include", "model"):
                text = f"unknown element <{shorten(name)}> in <{tag}> is not read"
                self._warn(title, f"{text} (line {child.sourceline})")
            elif name in _READ and name not in ("link", "joint", "frame"):
                self._element(child, title)
        found = SdfElement(self._path, element, title)
        found.scope = scope
        return found

    def _add_named(
        self, element: etree._Element, tag: str, scope: str, model: str, *, static: bool = False
    ) -> None:
        """A link, joint or frame of the model whose frame is `model`."""
        name = element.get("name", "")
        title = f"{tag} '{shorten(scope + name)}'" if name else tag
        found = self._element(element, title, scope)
        if not name:
            found.fail("has no name", 'add name="..."')
        if name in (WORLD, MODEL) or (name.startswith("__") and name.endswith("__")):
            found.fail("has a name that the format reserves", "rename it")
        name = scope + name
        if self._frames.taken(name):
            found.fail("the name is used twice", "rename one of them")
        self.found[f"{tag} '{name}'"] = found
        if tag == "link" and not static:
            self._frames.add_link(name, found)
        elif tag == "link":
            self._frames.add(name, found, model, WORLD)
        elif tag == "frame":
            attached_to = found.get("attached_to")
            on = found.full(attached_to) if attached_to else model
            self._frames.add(name, found, on, on)
        else:
            child = self._end(found, "child")
            self._frames.add(name, found, child, child)
            if not static:
                self._joints.append(found)

    def _end(self, joint: SdfElement, role: str) -> str:
        end = joint.child(role)
        text = None if end is None else end.get("value")
        if text is None:
            joint.fail(f"has no {role}", f"add <{role}>LINK</{role}>")
        return joint.full(text.strip())

    @staticmethod
    def _switched_on(element: SdfElement, name: str, default: bool = False) -> bool:
        text = element.get(name)
        return default if text is None else text.strip().lower() in ("true", "1")

    # -- the model ------------------------------------------------------------------------------

    def fill(self, builder: ModelBuilder) -> None:
        """Links and joints; each link hangs on the first joint that reaches it from the root."""
        gearboxes = [e for e in self._joints if e.get("type") == "gearbox"]
        joints = [self._joint(e) for e in self._joints if e.get("type") != "gearbox"]
        self._couplings += [self._gearbox(element, joints) for element in gearboxes]
        hangs_on, roots = self._tree(joints)
        frames = {WORLD: np.eye(4)}
        for name, link in self._frames.links.items():
            own = self._frames.pose(name, link)
            frames[name] = hangs_on[name].pose if name in hangs_on else own
            self._add_link(builder, name, link, np.linalg.inv(frames[name]) @ own)
        builder.add_link(WORLD)
        names = {joint.name for joint in joints}
        for name in roots:
            free = f"{name}_free"
            while free in names:
                free += "_"
            names.add(free)
            pose = frames[name]
            start = [*pose[:3, 3], *quaternion_of(pose[:3, :3])]
            builder.add_joint(free, "floating", WORLD, name, initial=start)
            text = f"link '{shorten(name)}' is not joined to the world: it floats"
            self._notes.append(("info", free, text))
        reach = []
        for joint in joints:
            at = np.linalg.inv(frames[joint.parent]) @ joint.pose
            reach.append((joint.parent, joint.child, math.hypot(*at[:3, 3])))
            placed = {"rotation": at[:3, :3], "translation": at[:3, 3], **joint.properties}
            if hangs_on.get(joint.child) is joint:
                builder.add_joint(joint.name, joint.type, joint.parent, joint.child, **placed)
                continue
            there = np.linalg.inv(frames[joint.child]) @ joint.pose
            builder.add_loop(
                joint.name,
                joint.type,
                joint.parent,
                joint.child,
                child_rotation=there[:3, :3],
                child_translation=there[:3, 3],
                **placed,
            )
        for body, text in unit_hints((r for r in reach if r[0] != WORLD), self._inertials):
            self._warn(body, text)
        refuse_mimic_cycle(self._leaders, self._follower)
        for coupling, factors, offset in self._couplings:
            builder.add_coupling(coupling, factors, offset=offset)

    def _couple(self, name: str, axis: SdfElement, mimic: SdfElement) -> None:
        """follower = multiplier (leader - reference) + offset, as the format says."""
        leader = mimic.full(mimic.get("joint") or "")
        if leader == name:
            axis.fail("mimics itself", "name another joint")
        if f"joint '{leader}'" not in self.found:
            axis.fail(f"mimics joint '{shorten(leader)}', which does not exist", MISSING_LEADER)
        multiplier, offset, reference = (
            default if mimic.get(key) is None else mimic.number(key, f"mimic {key}")
            for key, default in (("multiplier", 1.0), ("offset", 0.0), ("reference", 0.0))
        )
        self._leaders[name], self._follower[name] = leader, axis
        factors = {name: 1.0, leader: -multiplier}
        self._couplings.append((f"{name}_mimic", factors, offset - multiplier * reference))

    def _gearbox(
        self, element: SdfElement, joints: list[SdfJoint]
    ) -> tuple[str, dict[str, float], float]:
        """theta_2 = -ratio theta_1, the angles of child and parent against the reference body."""
        name = element.full(str(element.get("name")))
        if element.get("gearbox_reference_body") is None:
            remedy = "name the link in which both of its shafts turn"
            element.fail("has no <gearbox_reference_body>", remedy)
        ratio = element.number("gearbox_ratio", "gearbox_ratio")
        reference = element.full(str(element.get("gearbox_reference_body")).strip())
        housing = self._frames.link_of(reference, element, "gearbox_reference_body")
        pose = self._frames.pose(name, element)
        factors: dict[str, float] = {}
        for role, tag, factor in (("parent", "axis", ratio), ("child", "axis2", 1.0)):
            shaft = self._frames.link_of(self._end(element, role), element, role)
            direction = pose[:3, :3] @ self._axis(element, element.child(tag), pose)
            found, sign = _turning(joints, housing, shaft, direction)
            if found is None:
                element.fail(
                    f"no revolute joint about its {tag} joins '{shorten(housing)}' and "
                    f"'{shorten(shaft)}'",
                    f"add the joint in which its {role} turns, or correct the axis",
                )
            factors[found.name] = factors.get(found.name, 0.0) + sign * factor
        return name, factors, 0.0

    def _tree(self, joints: list[SdfJoint]) -> tuple[dict[str, SdfJoint], list[str]]:
        """By link the joint that it hangs on, breadth first, and the links that hang on none."""
        outboard: dict[str, list[SdfJoint]] = {}
        for joint in joints:
            outboard.setdefault(joint.parent, []).append(joint)
        children = {joint.child for joint in joints}
        links = list(self._frames.links)
        hangs_on: dict[str, SdfJoint] = {}
        roots: list[str] = []
        starts = [WORLD, *(n for n in links if n not in children), *links]
        for start in starts:
            if start in hangs_on or start in roots:
                continue
            if start != WORLD:
                roots.append(start)
            waiting = deque([start])
            while waiting:
                for joint in outboard.get(waiting.popleft(), ()):
                    if joint.child not in hangs_on and joint.child not in (*roots, WORLD):
                        hangs_on[joint.child] = joint
                        waiting.append(joint.child)
        return hangs_on, roots

    def _add_link(self, builder: ModelBuilder, name: str, link: SdfElement, own: Array) -> None:
        """own: pose of the file's link frame in the model's."""
        for switch, default in (("gravity", True), ("kinematic", False)):
            if self._switched_on(link, switch, default) != default:
                self._warn(name, f"<{switch}> is not read: the link falls and moves as the others")
        if link.child("velocity_decay") is not None:
            self._warn(name, "<velocity_decay> is not read: no such drag acts")
        inertial = link.child("inertial")
        if inertial is None:
            self._warn(name, "has no <inertial>; 1 kg and 1 kg m2 are taken, as the format says")
            builder.add_link(name, mass=1.0, com=own[:3, 3], inertia=np.eye(3))
            return
        if inertial.get("auto") is not None:
            inertial.fail("<inertial auto> asks for computed inertia", "write mass and inertia")
        pose, reference = pose_of(inertial)
        if reference:
            inertial.fail("its pose names a frame, which the format does not allow", "leave it out")
        mass = inertial.number("mass", "mass")
        moments = inertial.required("inertia", "add <inertia> with ixx, iyy, izz in kg m2")
        xx, yy, zz = (moments.number(key, f"inertia {key}") for key in ("ixx", "iyy", "izz"))
        xy, xz, yz = (
            0.0 if moments.get(key) is None else moments.number(key, f"inertia {key}")
            for key in ("ixy", "ixz", "iyz")
        )
        placed = own @ pose
        turned = placed[:3, :3]
        inertia = turned @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turned.T
        inertia = 0.5 * inertia + 0.5 * inertia.T
        builder.add_link(name, mass=mass, com=placed[:3, 3], inertia=inertia)
        self._inertials[name] = mass, placed[:3, 3], inertia

    def _joint(self, element: SdfElement) -> SdfJoint:
        name, kind = element.full(str(element.get("name"))), element.get("type")
        if kind not in JOINT_TYPES:
            problem = "has no type" if kind is None else f"type '{shorten(kind)}' is not read"
            element.fail(problem, f"use one of {', '.join(JOINT_TYPES)}, gearbox")
        here, n_axes = JOINT_TYPES[kind]
        ends = [
            self._frames.link_of(self._end(element, role), element, role)
            for role in ("parent", "child")
        ]
        pose = self._frames.pose(name, element)
        properties: dict[str, Any] = {}
        if kind == "screw":
            properties["pitch"] = self._pitch(element)
        given = [element.child(tag) for tag in ("axis", "axis2")[:n_axes]]
        axes = [self._axis(element, axis, pose) for axis in given]
        if n_axes == 2:
            properties["axes"] = axes
        elif axes:
            properties["axis"] = axes[0]
        each = [self._properties(name, kind, axis) for axis in given]
        for key, values in each[0].items() if each else ():
            every = [values, *(other[key] for other in each[1:])]
            properties[key] = every if len(every) > 1 else values
        return SdfJoint(name, here, ends[0], ends[1], pose, properties)

    def _pitch(self, element: SdfElement) -> float:
        """m/rad of a screw."""
        if element.get("screw_thread_pitch") is None:
            element.fail(
                "has no <screw_thread_pitch>; <thread_pitch> means different things to different "
                "programs"
                if element.get("thread_pitch") is not None
                else "has no <screw_thread_pitch>",
                "give <screw_thread_pitch> in m per turn, positive for a right-hand thread",
            )
        return element.number("screw_thread_pitch", "screw_thread_pitch") / (2 * math.pi)

    def _axis(self, element: SdfElement, axis: SdfElement | None, pose: Array) -> list[float]:
        """The axis in the joint's frame, of length 1."""
        if axis is None:
            element.fail("has no <axis>", "add <axis> with <xyz> (and <axis2> if it has two)")
        xyz = axis.child("xyz")
        if xyz is None:
            return [0.0, 0.0, 1.0]
        direction = np.array(xyz.numbers("value", 3, "axis"))
        expressed = xyz.get("expressed_in") or ""
        if not expressed and self._switched_on(axis, "use_parent_model_frame"):
            expressed = MODEL
        if expressed:
            turned = self._frames.pose(xyz.full(expressed), xyz)[:3, :3]
            direction = pose[:3, :3].T @ turned @ direction
        length = math.hypot(*direction)
        return [float(x) / length for x in direction] if length > 0 else [0.0, 0.0, 0.0]

    def _properties(self, name: str, kind: str, axis: SdfElement | None) -> dict[str, float]:
        found = dict.fromkeys(
            ("damping", "friction", "stiffness", "rest_position", "lower", "upper"), 0.0
        )
        found |= {"lower": -math.inf, "upper": math.inf, "effort": math.inf, "velocity": math.inf}
        if axis is None:
            return found
        mimic = axis.child("mimic")
        if mimic is not None:
            target = shorten(mimic.get("joint") or "")
            if self._mimic == "error":
                axis.fail(f"mimics joint '{target}'", MIMIC_REMEDY)
            if self._mimic == "couple":
                self._couple(name, axis, mimic)
            else:
                self._warn(name, f"mimics joint '{target}': the coupling is ignored")
        dynamics, limit = axis.child("dynamics"), axis.child("limit")
        for key, element in (
            ("damping", "damping"),
            ("friction", "friction"),
            ("stiffness", "spring_stiffness"),
            ("rest_position", "spring_reference"),
        ):
            if dynamics is not None and dynamics.get(element) is not None:
                found[key] = dynamics.number(element, element)
        if limit is None:
            return found
        if kind in ("screw", "continuous"):
            if limit.get("lower") is not None or limit.get("upper") is not None:
                self._warn(name, f"the range of a {kind} joint is not read")
        else:
            for key, sign in (("lower", -1), ("upper", 1)):
                value = None if limit.get(key) is None else limit.limit(key, sign)
                if value is not None and abs(value) < _UNLIMITED:
                    found[key] = value
        for key in ("effort", "velocity"):
            value = None if limit.get(key) is None else limit.limit(key)
            if value is not None and value >= 0:
                found[key] = value
        return found

    # -- notes and complaints -------------------------------------------------------------------

    def _warn(self, element: str, text: str) -> None:
        name = element.partition(" ")[2].strip("'") if " '" in element else element
        self._notes.append(("warning", name, text))

    def notes(self) -> list[tuple[str, str, str]]:
        counted = [
            ("info", tag, f"{count} ignored: not part of the rigid-body dynamics")
            for tag, count in sorted(self._harmless.items())
        ]
        return [*self._notes, *counted]


def _turning(
    joints: list[SdfJoint], housing: str, shaft: str, direction: Array
) -> tuple[SdfJoint | None, float]:
    """The hinge between two links about a direction of the world, and the sign of its angle when
    the shaft turns about that direction."""
    for joint in joints:
        ends = (joint.parent, joint.child)
        if joint.type in ("revolute", "continuous") and ends in (
            (housing, shaft),
            (shaft, housing),
        ):
            along = float(joint.pose[:3, :3] @ joint.properties["axis"] @ direction)
            if abs(along) > 1 - 1e-6:
                return joint, math.copysign(1.0, along) * (1.0 if joint.child == shaft else -1.0)
    return None, 0.0
