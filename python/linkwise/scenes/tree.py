"""Trees of equal rods."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise._core import ModelBuilder
from linkwise.scenes.chain import (
    EARTH,
    check_bodies,
    check_count,
    check_floating,
    check_rod,
    joint_axes,
    rod_inertia,
)

if TYPE_CHECKING:
    from linkwise._core import Model


def tree(
    n_bodies: int = 15,
    *,
    branching: int = 2,
    joint: str = "revolute",
    axes: str | Sequence[Sequence[float]] = "alternating",
    length: float = 1.0,
    mass: float = 1.0,
    radius: float = 0.05,
    damping: float = 0.0,
    gravity: Sequence[float] = EARTH,
    floating_base: bool = False,
    seed: int = 0,
) -> Model:
    """A balanced tree of rods: rod i carries rods branching * i + 1 to branching * (i + 1).

    The children of a rod start at its end and are fanned out about z, 60 degrees from it. Arguments
    and errors as in :func:`linkwise.scenes.chain`; ``branching`` 1 is a chain.
    """
    check_bodies(n_bodies)
    check_count("branching", branching)
    check_floating(floating_base)
    check_rod(length, mass, radius)
    directions = joint_axes(axes, n_bodies, seed)
    builder = ModelBuilder("tree", gravity=gravity)
    if floating_base:
        builder.set_floating_base()
    else:
        builder.add_link("ground")
    inertia = rod_inertia(mass, length, radius)
    for i in range(n_bodies):
        name = f"link_{i + 1}"
        builder.add_link(name, mass=mass, com=(0, 0, -length / 2), inertia=inertia)
        if i == 0:
            if not floating_base:
                builder.add_joint(
                    "joint_1", joint, "ground", name, **_axis(joint, directions, 0, damping)
                )
            continue
        parent, place = divmod(i - 1, branching)
        builder.add_joint(
            f"joint_{i + 1}",
            joint,
            f"link_{parent + 1}",
            name,
            translation=(0, 0, -length),
            rotation=_fan(place, branching),
            **_axis(joint, directions, i, damping),
        )
    return builder.build()


def _axis(joint: str, directions: np.ndarray, i: int, damping: float) -> dict[str, Any]:
    options: dict[str, Any] = {"damping": damping}
    axis = directions[i % len(directions)]
    if joint == "universal":
        options["axes"] = [axis, directions[(i + 1) % len(directions)]]
    elif joint not in ("spherical", "floating", "fixed"):
        options["axis"] = axis
    return options


def _fan(place: int, branching: int) -> np.ndarray:
    """Rotation (3, 3) of child ``place``: 60 degrees away from straight, turned about z."""
    if branching == 1:
        return np.eye(3)
    turn, tilt = 2 * np.pi * place / branching, np.pi / 3
    c, s, ct, st = np.cos(turn), np.sin(turn), np.cos(tilt), np.sin(tilt)
    about_z = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    about_y = np.array([[ct, 0, st], [0, 1, 0], [-st, 0, ct]])
    rotation: np.ndarray = about_z @ about_y
    return rotation
