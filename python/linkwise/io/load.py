"""Loading a model file: the format is told from the file's root element."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import get_args

import numpy as np
import numpy.typing as npt

from linkwise._core import InputError, Model, as_floats
from linkwise.io.complaint import check_flag, check_path, complain, shorten
from linkwise.io.mjcf_equalities import Equality
from linkwise.io.urdf import JointOrder, Mimic, read_urdf
from linkwise.io.xml import local_name, parse_xml
from linkwise.notes import tell, warnings_of

STANDARD_GRAVITY = (0.0, 0.0, -9.81)
_HINTS = {
    ".toml": "a scenario: run it with 'linkwise run' or read it with linkwise.load_scenario",
    ".xacro": "a xacro file: expand it first with 'xacro FILE.xacro > FILE.urdf'",
    ".csv": "a table: name it in a drive",
    ".zarr": "a result: open it with linkwise.open_run",
}


def load(
    path: str | os.PathLike[str],
    *,
    floating_base: bool = False,
    gravity: npt.ArrayLike | None = None,
    package_dirs: Sequence[str | os.PathLike[str]] = (),
    joint_order: JointOrder = "file",
    keep_fixed: bool = False,
    mimic: Mimic = "couple",
    equality: Equality = "exact",
) -> Model:
    """Read a URDF, MJCF or SDF file into a Model.

    path: the file, or the XML itself as a text that starts with ``<`` (what xacro returns); its
        root element, not its suffix, tells the format.
    floating_base: give the root link of a URDF six degrees of freedom instead of welding it to the
        ground (MJCF and SDF say this themselves: with a free joint, and by joining nothing to the
        world).
    gravity: m/s2 in the world frame; by default the file's own where it has one (MJCF, worlds of
        SDF), else (0, 0, -9.81).
    package_dirs: directories in which packages of ``package://`` paths may lie; only existence is
        checked, the dynamics needs no meshes.
    joint_order: "file" keeps the file's order (parents first), "pinocchio" goes depth first with
        the joints of one link by name, so that q, v and tau can be handed over as they are.
    keep_fixed: keep fixed joints that carry mass as joints with a load instead of merging
        their links.
    mimic: mimic joints of URDF and SDF are tied to the joint that they follow ("couple"), move
        "independent" of it, with a warning note, or are refused ("error").
    equality: an MJCF's connect, weld and joint constraints are spherical and fixed joints that
        close loops, and couplings ("exact"), with a warning note because MuJoCo's give way, or
        are left out with one ("ignore").

    Raises InputError, in one line that names file, line, element and remedy, for anything that
    cannot be read without guessing. What was ignored or assumed is in ``model.notes``; each note
    of level "warning" is also a ModelWarning.
    The file may come from anywhere: nothing in it can reach the network or run code.
    """
    _check_choice(path, "joint_order", joint_order, get_args(JointOrder))
    _check_choice(path, "mimic", mimic, get_args(Mimic))
    _check_choice(path, "equality", equality, get_args(Equality))
    check_flag("floating_base", floating_base)
    check_flag("keep_fixed", keep_fixed)
    check_path("model file", path)
    if isinstance(package_dirs, str | os.PathLike):
        package_dirs = (package_dirs,)
    for directory in package_dirs:
        if not os.path.isdir(directory):
            complain(
                path,
                "package_dirs",
                f"'{shorten(os.fspath(directory), 200)}' is not a directory",
                "give directories that hold the packages",
            )
    vector = None if gravity is None else _gravity(path, gravity)
    xml: str | None = None
    if isinstance(path, str) and path.lstrip("\ufeff \t\r\n").startswith("<"):
        path, xml = "XML text", path
    suffix = Path(path).suffix.lower()
    if suffix in _HINTS:
        complain(path, "model file", "is not a model", f"it looks like {_HINTS[suffix]}")
    root = parse_xml(path, xml)
    kind = local_name(root)
    if kind == "robot":
        model = read_urdf(
            path,
            root,
            gravity=vector or STANDARD_GRAVITY,
            floating_base=floating_base,
            joint_order=joint_order,
            keep_fixed=keep_fixed,
            mimic=mimic,
        )
        tell(warnings_of(model), reading=True)
        return model
    if kind == "mujoco":
        from linkwise.io.mjcf import read_mjcf
        from linkwise.io.mjcf_files import require_utf8
        from linkwise.io.mjcf_limits import check_mjcf

        if xml is None:
            require_utf8(path)
        check_mjcf(path, root)
        _check_floats(path, floating_base, "give the root body of an MJCF a <freejoint/>")
        model = read_mjcf(path, gravity=vector, keep_fixed=keep_fixed, equality=equality, xml=xml)
        tell(warnings_of(model), reading=True)
        return model
    if kind == "sdf":
        from linkwise.io.sdf import read_sdf

        _check_floats(path, floating_base, "what is not joined to the world floats in an SDF")
        model = read_sdf(path, root, gravity=vector, keep_fixed=keep_fixed, mimic=mimic)
        tell(warnings_of(model), reading=True)
        return model
    complain(
        path,
        f"element '{shorten(kind)}'",
        "is the root of neither a URDF, an MJCF nor an SDF",
        "give a file whose root element is <robot>, <mujoco> or <sdf>",
        root.sourceline,
    )


def _check_floats(path: str | os.PathLike[str], floating_base: bool, instead: str) -> None:
    if floating_base:
        problem = "the file says itself which bodies float"
        complain(path, "floating_base", problem, f"leave it out: {instead}")


def _check_choice(
    path: str | os.PathLike[str], name: str, value: str, choices: Sequence[str]
) -> None:
    if value not in choices:
        complain(path, name, f"unknown value '{shorten(value)}'", f"use {' or '.join(choices)}")


def _gravity(path: str | os.PathLike[str], gravity: npt.ArrayLike) -> tuple[float, float, float]:
    try:
        vector = as_floats(gravity, "gravity")
    except InputError:
        vector = np.empty(0)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        complain(path, "gravity", "is not a vector of 3 finite numbers", "give (0, 0, -9.81)")
    return (float(vector[0]), float(vector[1]), float(vector[2]))
