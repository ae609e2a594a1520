"""Reading URDF into a Model: strict checks, then yourdfpy, then the builder.

yourdfpy turns the checked document into placements, axes and inertia matrices. It never sees the
original file: it would drop or replace by defaults what it cannot read, stop at a broken colour,
and look for meshes. It gets the clean document of :mod:`linkwise.io.urdf_checks`.
"""

from __future__ import annotations

import io
import math
import os
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from lxml import etree

from linkwise._core import InputError, Model, ModelBuilder
from linkwise.io.complaint import complain, file_name, shorten
from linkwise.io.urdf_checks import CheckedUrdf, check_urdf
from linkwise.io.urdf_tree import JointOrder, check_tree, order_joints

Mimic = Literal["independent", "error"]


def read_urdf(
    path: str | os.PathLike[str],
    root: etree._Element,
    *,
    gravity: tuple[float, float, float],
    floating_base: bool = False,
    joint_order: JointOrder = "file",
    keep_fixed: bool = False,
    mimic: Mimic = "error",
) -> Model:
    """The model that the parsed URDF ``root`` describes; ``path`` is for messages.

    Conventions of the format: a missing axis is 1 0 0; a planar joint's axis is the normal of its
    plane; inertia is about the centre of mass along the axes of the inertial origin. A revolute or
    prismatic joint without <limit> is unlimited and noted. Mimic joints are kept as joints of
    their own and noted as warnings ("independent", what Pinocchio does unless asked otherwise) or
    refused ("error").
    """
    checked = check_urdf(path, root)
    root_link = check_tree(path, checked.links, checked.joints)
    if mimic == "error" and checked.mimics:
        _refuse_mimic(checked)
    robot = _parse_clean(checked)
    builder = ModelBuilder(checked.name, gravity=gravity, source=file_name(path))
    for link in robot.links:
        _add_link(builder, link, checked)
    for index in order_joints(checked.joints, root_link, joint_order):
        _add_joint(builder, robot.joints[index], checked.joints[index].line, path)
    if floating_base:
        builder.set_floating_base()
    for note in checked.notes:
        builder.add_note(*note)
    return builder.build(keep_fixed=keep_fixed)


def _refuse_mimic(checked: CheckedUrdf) -> None:
    joint, target = next(iter(checked.mimics.items()))
    line = next(j.line for j in checked.joints if j.name == joint)
    complain(
        checked.path,
        f"joint '{shorten(joint)}'",
        f"mimics joint '{shorten(target)}', and couplings are not supported",
        'let it move on its own with mimic="independent", or remove <mimic>',
        line,
    )


def _parse_clean(checked: CheckedUrdf) -> Any:
    # Imported here because it brings trimesh along, which costs most of a second.
    import yourdfpy

    document = io.BytesIO(etree.tostring(checked.robot))
    checked.robot.clear()  # of large files one copy less
    robot = yourdfpy.URDF.load(
        document,
        build_scene_graph=False,
        build_collision_scene_graph=False,
        load_meshes=False,
        load_collision_meshes=False,
        filename_handler=yourdfpy.urdf.filename_handler_null,
    ).robot
    names = [link.name for link in robot.links]
    if names != list(checked.links) or [j.name for j in robot.joints] != [
        j.name for j in checked.joints
    ]:
        raise AssertionError("yourdfpy lost links or joints of a checked document")
    return robot


def _placement(
    matrix: npt.NDArray[np.float64] | None,
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    if matrix is None:
        return np.eye(3), np.zeros(3)
    return matrix[:3, :3], matrix[:3, 3]


def _add_link(builder: ModelBuilder, link: Any, checked: CheckedUrdf) -> None:
    if link.inertial is None:
        builder.add_link(link.name)
        return
    rotation, com = _placement(link.inertial.origin)
    inertia = rotation @ link.inertial.inertia @ rotation.T
    try:
        builder.add_link(
            link.name, mass=link.inertial.mass, com=com, inertia=0.5 * (inertia + inertia.T)
        )
    except InputError as error:
        _with_line(error, checked.path, checked.links[link.name])


def _add_joint(
    builder: ModelBuilder, joint: Any, line: int | None, path: str | os.PathLike[str]
) -> None:
    rotation, translation = _placement(joint.origin)
    properties: dict[str, Any] = {}
    if joint.dynamics is not None:
        properties["damping"] = float(joint.dynamics.damping or 0.0)
        properties["friction"] = float(joint.dynamics.friction or 0.0)
    if joint.limit is not None:
        for name in ("lower", "upper", "effort", "velocity"):
            value = getattr(joint.limit, name)
            if value is not None:
                properties[name] = value
    if joint.type in ("revolute", "continuous", "prismatic", "planar"):
        properties["axis"] = tuple(joint.axis / math.hypot(*joint.axis))
    try:
        builder.add_joint(
            joint.name,
            joint.type,
            joint.parent,
            joint.child,
            translation=translation,
            rotation=rotation,
            **properties,
        )
    except InputError as error:
        _with_line(error, path, line)


def _with_line(error: InputError, path: str | os.PathLike[str], line: int | None) -> None:
    """Raise the builder's complaint again with the line of the element in front."""
    raise InputError(f"{shorten(os.fspath(path), 400)}:{line}: {error}") from None
