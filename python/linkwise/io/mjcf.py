"""Reading MJCF into a Model: MuJoCo's own compiler reads the file, its bodies and joints are taken.

Every body keeps the axes of its MJCF body frame; its link frame lies at the anchor of its last
joint (MuJoCo's ``pos`` of a joint), because a joint load is given at the joint point. Several
joints on one body become a stack through links without mass. A hinge or slide counts from the
pose drawn in the file; a free joint's position is the body's pose in the world, as in MuJoCo, and
it starts where the file draws it (``model.initial_configuration()``).
:mod:`linkwise.io.mjcf_state` converts qpos and qvel.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import numpy as np

from linkwise._core import InputError, Model, ModelBuilder
from linkwise.base import Array
from linkwise.io.complaint import complain, file_name, shorten
from linkwise.io.mjcf_equalities import Equalities, Equality
from linkwise.io.mjcf_transmissions import Transmissions, without_warnings
from linkwise.io.unit_hints import FAR, unit_hints

KINDS = ("floating", "spherical", "prismatic", "revolute")
"""Joint types in the order of MuJoCo's mjtJoint: free, ball, slide, hinge."""


def read_mjcf(
    path: str | os.PathLike[str],
    *,
    gravity: tuple[float, float, float] | None = None,
    keep_fixed: bool = False,
    equality: Equality = "exact",
    xml: str | None = None,
) -> Model:
    """The model that an MJCF file describes.

    gravity: m/s2; None takes the file's. equality: whether connect, weld and joint constraints
    are loop joints and couplings ("exact") or left out ("ignore"). xml: the text, where it is no
    file.

    Raises InputError with MuJoCo's own words for what its compiler refuses, and when the optional
    package is missing. Contacts, tendons, other equality constraints, forces of actuators and what
    else is not taken over are warnings in ``model.notes``.
    """
    mj_model = compile_mjcf(path, xml)
    names = Names(mj_model)
    if gravity is None:
        gravity = tuple(mj_model.opt.gravity) if _enabled(mj_model, "GRAVITY") else (0, 0, 0)
    stem = os.path.splitext(os.path.basename(file_name(path)))[0]
    builder = ModelBuilder(stem, gravity=gravity, source=file_name(path))
    try:
        added = Transmissions(mj_model)
        notes = [*_ignored(mj_model), *added.notes(), *_joint_notes(mj_model, names)]
        notes += _unit_notes(mj_model, names)
        with np.errstate(all="ignore"):  # the builder refuses what is no number, with its name
            _add_bodies(builder, mj_model, names, added)
            if equality == "exact":
                closing = Equalities(mj_model, rotation, names.joint)
                _add_loops(builder, mj_model, names, closing)
                notes += closing.notes()
            elif mj_model.neq:
                count = mj_model.neq
                text = f'{count} equality constraints ignored, as equality="ignore" asks: loops '
                text += "stay open"
                notes.append(("warning", "equality", text))
        for level, element, text in notes:
            builder.add_note(level, element, text)
        return builder.build(keep_fixed=keep_fixed)
    except InputError as error:
        text = str(error).replace(f" of {file_name(path)}", "", 1)
        raise InputError(f"{shorten(os.fspath(path), 400)}: {text}") from None


#: What MuJoCo says where its own messages fail, as with `%s` for a type. It keeps a lock then, so
#: that the next reading would wait for ever.
_BROKE = "Caught an unknown exception!"
_broken_by: list[str] = []


def compile_mjcf(path: str | os.PathLike[str], xml: str | None = None) -> Any:
    """The mujoco.MjModel of a file, or of a text that ``path`` only names.

    Raises InputError as :func:`read_mjcf`.
    """
    try:
        import mujoco
    except ImportError:
        complain(
            path, "model file", "MJCF needs the package mujoco", "pip install 'linkwise[mjcf]'"
        )
    if file_name(path) != os.fspath(path):
        problem = "its name is not UTF-8, which MuJoCo cannot open"
        complain(path, "model file", problem, "rename it")
    if _broken_by:
        problem = f"MuJoCo cannot read any more: its reader broke on {_broken_by[0]}"
        complain(path, "model file", problem, "correct that file, and start a new process")
    try:
        with without_warnings():
            if xml is None:
                mj_model = mujoco.MjModel.from_xml_path(os.fspath(path))
            else:
                mj_model = mujoco.MjModel.from_xml_string(xml)
    except (ValueError, RuntimeError, MemoryError, mujoco.FatalError) as error:
        if str(error) == _BROKE:
            _broken_by.append(shorten(os.fspath(path), 400))
        complain(
            path,
            "model file",
            f"MuJoCo refuses it: {shorten(error, 300)}",
            "correct the element that it names",
        )
    names = Names(mj_model)
    for field in ("body_pos", "body_quat", "body_mass", "body_ipos", "body_iquat", "body_inertia"):
        wrong = np.flatnonzero(~np.isfinite(getattr(mj_model, field)).reshape(mj_model.nbody, -1))
        if wrong.size:
            body = int(wrong[0]) // max(1, getattr(mj_model, field)[0].size)
            element = f"body '{shorten(names.body[body])}'"
            problem = f"{field.removeprefix('body_')} is not finite"
            complain(path, element, problem, "give finite numbers")
    return mj_model


class Names:
    """Names of bodies and joints; elements without one are numbered."""

    def __init__(self, mj_model: Any) -> None:
        self.body = _named([mj_model.body(i).name for i in range(mj_model.nbody)], "body")
        self.joint = _named([mj_model.joint(i).name for i in range(mj_model.njnt)], "joint")


def keyframe_names(mj_model: Any) -> list[str]:
    """Names of the keyframes; those without one are called by their number, from 0."""
    return [mj_model.key(i).name or str(i) for i in range(mj_model.nkey)]


def _named(given: list[str], kind: str) -> list[str]:
    taken = {name for name in given if name}
    result = []
    for index, name in enumerate(given):
        candidate = name or f"{kind}{index}"
        while not name and candidate in taken:
            candidate += "_"
        taken.add(candidate)
        result.append(candidate)
    return result


def rotation(quaternion: Array) -> Array:
    """Rotation matrix of a unit quaternion w, x, y, z."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def joints_of(mj_model: Any, body: int) -> range:
    """Indices of a body's joints."""
    first = int(mj_model.body_jntadr[body])
    return range(first, first + int(mj_model.body_jntnum[body]))


def _anchor(mj_model: Any, body: int) -> Array:
    """Origin of a body's link frame in its MJCF body frame."""
    joints = joints_of(mj_model, body)
    return np.array(mj_model.jnt_pos[joints[-1]]) if joints else np.zeros(3)


def _add_bodies(builder: ModelBuilder, mj_model: Any, names: Names, added: Transmissions) -> None:
    builder.add_link(names.body[0])
    for body in range(1, mj_model.nbody):
        turned = rotation(mj_model.body_iquat[body])
        builder.add_link(
            names.body[body],
            mass=float(mj_model.body_mass[body]),
            com=mj_model.body_ipos[body] - _anchor(mj_model, body),
            inertia=(turned * mj_model.body_inertia[body]) @ turned.T,
        )
        parent = int(mj_model.body_parentid[body])
        placed = {
            "rotation": rotation(mj_model.body_quat[body]),
            "translation": mj_model.body_pos[body] - _anchor(mj_model, parent),
        }
        inboard = names.body[parent]
        joints = joints_of(mj_model, body)
        if joints and KINDS[mj_model.jnt_type[joints[0]]] == "floating":
            placed = {"rotation": np.eye(3), "translation": np.zeros(3)}
        if not joints:
            weld = f"{names.body[body]}_weld"
            while weld in names.joint:
                weld += "_"
            builder.add_joint(weld, "fixed", inboard, names.body[body], **placed)
        before = np.zeros(3)
        for joint in joints:
            anchor = np.array(mj_model.jnt_pos[joint])
            child = names.body[body]
            if joint != joints[-1]:
                child = f"{child}/{names.joint[joint]}"
                builder.add_link(child)
            placed["translation"] = placed["translation"] + placed["rotation"] @ (anchor - before)
            builder.add_joint(
                names.joint[joint],
                KINDS[mj_model.jnt_type[joint]],
                inboard,
                child,
                **placed,
                **_properties(mj_model, joint, added),
            )
            inboard, before = child, anchor
            placed = {"rotation": np.eye(3), "translation": np.zeros(3)}


def _unit_notes(mj_model: Any, names: Names) -> list[tuple[str, str, str]]:
    """Hints at units of masses that the file gives; what has a geom of its size is no slip."""
    bodies = range(1, mj_model.nbody)
    joints, inertials = [], {}
    for body in bodies:
        floats = any(KINDS[mj_model.jnt_type[j]] == "floating" for j in joints_of(mj_model, body))
        length = 0.0 if floats else float(np.linalg.norm(mj_model.body_pos[body]))
        parent = int(mj_model.body_parentid[body])
        joints.append((names.body[parent], names.body[body], length))
        first = int(mj_model.body_geomadr[body])
        geoms = slice(first, first + int(mj_model.body_geomnum[body]))
        size = np.linalg.norm(mj_model.geom_pos[geoms], axis=1) + mj_model.geom_rbound[geoms]
        mass, com = float(mj_model.body_mass[body]), mj_model.body_ipos[body]
        moments = mj_model.body_inertia[body]
        if np.sum(moments) / 2 > mass * (FAR * np.max(size, initial=0.0)) ** 2:
            inertials[names.body[body]] = mass, com, np.diag(moments)
    return [("warning", name, text) for name, text in unit_hints(joints, inertials)]


def _add_loops(builder: ModelBuilder, mj_model: Any, names: Names, closing: Equalities) -> None:
    for closure in closing.closures:
        parent, child = closure.bodies
        builder.add_loop(
            closure.name,
            closure.type,
            names.body[parent],
            names.body[child],
            translation=closure.translation - _anchor(mj_model, parent),
            rotation=closure.rotation,
            child_translation=closure.child_translation - _anchor(mj_model, child),
            child_rotation=closure.child_rotation,
        )
    for name, factors, offset in closing.couplings:
        builder.add_coupling(name, factors, offset=offset)


def _enabled(mj_model: Any, flag: str) -> bool:
    import mujoco

    return not mj_model.opt.disableflags & getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag}")


def _dofs(mj_model: Any, joint: int) -> slice:
    first = int(mj_model.jnt_dofadr[joint])
    return slice(first, first + (6, 3, 1, 1)[mj_model.jnt_type[joint]])


def _properties(mj_model: Any, joint: int, added: Transmissions) -> dict[str, Any]:
    """Passive forces, rotor inertia and range of one joint, as keywords of add_joint."""
    dofs = _dofs(mj_model, joint)
    result: dict[str, Any] = {
        "armature": _one_or_all(mj_model.dof_armature[dofs] + added.armature[dofs])
    }
    if KINDS[mj_model.jnt_type[joint]] == "floating":
        first = int(mj_model.jnt_qposadr[joint])
        drawn = mj_model.qpos0[first : first + 7]
        result["initial"] = [*drawn[:3], *drawn[4:], drawn[3]]
    if _enabled(mj_model, "DAMPER"):
        result["damping"] = _one_or_all(mj_model.dof_damping[dofs] + added.damping[dofs])
    if _enabled(mj_model, "FRICTIONLOSS"):
        result["friction"] = _one_or_all(mj_model.dof_frictionloss[dofs] + added.friction[dofs])
    if KINDS[mj_model.jnt_type[joint]] in ("floating", "spherical"):
        return result
    result["axis"] = np.array(mj_model.jnt_axis[joint])
    address = mj_model.jnt_qposadr[joint]
    zero = float(mj_model.qpos0[address])
    if _enabled(mj_model, "SPRING"):
        stiffness, rest = float(mj_model.jnt_stiffness[joint]), float(mj_model.qpos_spring[address])
        result["stiffness"], rest = added.spring(dofs.start, stiffness, rest)
        if result["stiffness"]:
            result["rest_position"] = rest - zero
    if mj_model.jnt_limited[joint]:
        lower, upper = mj_model.jnt_range[joint] - zero
        result |= {"lower": float(lower), "upper": float(upper)}
    if mj_model.jnt_actfrclimited[joint]:
        result["effort"] = float(np.abs(mj_model.jnt_actfrcrange[joint]).max())
    return result


def _one_or_all(values: Array) -> float | list[float]:
    return float(values[0]) if (values == values[0]).all() else [float(v) for v in values]


def _ignored(mj_model: Any) -> Iterator[tuple[str, str, str]]:
    """Warnings about what the file has and the model has not."""
    colliding = np.count_nonzero(
        np.logical_or(mj_model.geom_contype > 0, mj_model.geom_conaffinity > 0)
    )
    counts = {
        "contact": (colliding + mj_model.npair, "geoms that can touch: contacts are ignored"),
        "tendon": (
            mj_model.ntendon,
            "tendons: only what is fixed to one joint counts",
        ),
        "actuator": (mj_model.nu, "actuators: no force of theirs acts, drive the joints instead"),
        "flex": (mj_model.nflex, "flexible objects ignored"),
        "plugin": (mj_model.nplugin, "plugins ignored"),
        "mocap": (mj_model.nmocap, "mocap bodies are fixed where the file draws them"),
        "gravcomp": (
            np.count_nonzero(mj_model.body_gravcomp),
            "bodies with gravity compensation: it is ignored",
        ),
    }
    for element, (count, text) in counts.items():
        if count:
            yield "warning", element, f"{count} {text}"
    if mj_model.opt.density or mj_model.opt.viscosity:
        yield "warning", "option", "density and viscosity ignored: no fluid forces act"
    if mj_model.jnt_limited.any():
        count = np.count_nonzero(mj_model.jnt_limited)
        yield "info", "range", f"{count} joint ranges kept as numbers: they do not stop the motion"
    if mj_model.nsensor:
        yield "info", "sensor", f"{mj_model.nsensor} ignored"
    if mj_model.nkey:
        names = ", ".join(f"'{shorten(name)}'" for name in keyframe_names(mj_model)[:8])
        yield "info", "keyframe", f"{names}: a scenario starts there with [initial] keyframe"


def _joint_notes(mj_model: Any, names: Names) -> Iterator[tuple[str, str, str]]:
    for joint, name in enumerate(names.joint):
        if KINDS[mj_model.jnt_type[joint]] == "floating":
            first = int(mj_model.jnt_qposadr[joint])
            drawn = mj_model.qpos0[first : first + 7]
            if drawn[:3].any() or drawn[4:].any():
                text = (
                    "starts where the file draws it: at {:g} {:g} {:g}, "
                    "turned by the quaternion (w x y z) {:g} {:g} {:g} {:g}"
                )
                yield "info", name, text.format(*drawn)
        several = KINDS[mj_model.jnt_type[joint]] in ("floating", "spherical")
        if several and mj_model.jnt_stiffness[joint]:
            yield "warning", name, "its spring is ignored: springs need a hinge or slide joint"
        if several and mj_model.jnt_limited[joint]:
            yield "warning", name, "its cone limit is ignored"
        if (
            mj_model.jnt_stiffnesspoly[joint].any()
            or mj_model.dof_dampingpoly[_dofs(mj_model, joint)].any()
        ):
            yield "warning", name, "only the linear part of its spring and damper is used"
        if not several and (zero := mj_model.qpos0[mj_model.jnt_qposadr[joint]]):
            yield "info", name, f"its position counts from the file's ref, {zero:g}"
