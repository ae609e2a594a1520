"""Chains of equal rods."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from linkwise._core import InputError, as_floats, make_chain, require_memory

if TYPE_CHECKING:
    from linkwise._core import Model

EARTH = (0.0, 0.0, -9.81)
_PATTERNS = ("alternating", "parallel", "random")


#: Products of larger sizes may overflow, SI.
_LARGEST = 1e100


def rod_inertia(mass: float, length: float, radius: float) -> np.ndarray:
    """Central inertia (3, 3) [kg m2] of a solid cylinder along z."""
    across = mass * (3 * radius**2 + length**2) / 12
    return np.diag([across, across, mass * radius**2 / 2])


def check_rod(length: float, mass: float, radius: float) -> None:
    """InputError unless these are a rod's."""
    for name, value in (("length", length), ("mass", mass), ("radius", radius)):
        check_size(name, value)


def joint_axes(axes: str | ArrayLike, n: int, seed: int) -> np.ndarray:
    """Axes (k, 3), used in turn: a pattern by name, or the axes themselves."""
    if not isinstance(axes, str):
        return np.atleast_2d(as_floats(axes, "axes"))
    if axes == "alternating":
        return np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    if axes == "parallel":
        return np.array([[0.0, 1.0, 0.0]])
    if axes == "random":
        return np.random.default_rng(seed).normal(size=(n, 3))
    known = ", ".join(_PATTERNS)
    raise InputError(f"axes {axes!r:.60} is unknown; known: {known}, or an array (k, 3)")


#: Of a model and one evaluation of it; `python -m benchmarks peers --cases memory` measures it.
BYTES_PER_BODY = 1800


def check_bodies(n: int) -> None:
    """InputError unless ``n`` is a number of bodies, MemoryError when there is no room for them."""
    check_count("n_bodies", n)
    require_memory(float(BYTES_PER_BODY * n), f"a machine of {n} bodies")


def check_count(name: str, n: int) -> None:
    """InputError unless ``n`` is a whole number of at least 1 that the core can count to."""
    if isinstance(n, bool) or not isinstance(n, (int, np.integer)) or n < 1:
        raise InputError(f"{name} is {n!r:.60}; give a whole number of at least 1")
    if n >= 2**31:
        raise InputError(f"{name} is {n!r:.60}; give a whole number below 2^31")


def check_floating(floating_base: object) -> None:
    """InputError where it is neither True nor False: "no" would count as true."""
    if not isinstance(floating_base, bool | np.bool_):
        raise InputError(f"floating_base is {floating_base!r:.60}; give True or False")


def check_size(name: str, value: float, *, least: float | None = None) -> None:
    """InputError unless ``value`` is one finite number above 0, or of at least ``least``."""
    real = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(
        value, bool | np.timedelta64
    )
    size = value.item() if real and hasattr(value, "item") else value
    if not (real and abs(size) < _LARGEST and (size > 0 if least is None else size >= least)):
        wanted = "above 0" if least is None else f"of at least {least:g}"
        raise InputError(f"{name} is {value!r:.60}; give a number {wanted} and below {_LARGEST:g}")


def chain(
    n_bodies: int = 10,
    *,
    joint: str = "revolute",
    axes: str | ArrayLike = "alternating",
    length: float = 1.0,
    mass: float = 1.0,
    radius: float = 0.05,
    damping: float = 0.0,
    armature: float = 0.0,
    gravity: Sequence[float] = EARTH,
    floating_base: bool = False,
    seed: int = 0,
) -> Model:
    """A chain of equal solid rods that hangs straight down (-z) at q = 0.

    Args:
        n_bodies: number of rods, 1 to millions; links link_1 ..., joints joint_1 ....
        joint: type of every joint: revolute, prismatic, spherical, universal, ....
        axes: joint axes from link to link: "alternating" (y, x, ...), "parallel" (all y), "random",
            or an array (k, 3) used in turn.
        length, mass, radius: of one rod [m, kg, m].
        damping: viscous, per degree of freedom [N m s/rad or N s/m].
        armature: rotor inertia, per degree of freedom [kg m2 or kg].
        gravity: (3,) [m/s2].
        floating_base: the first rod floats instead of being hinged to the ground.
        seed: of the random axes.

    Raises:
        InputError: a value is out of range.
        MemoryError: there is no room for so many bodies.
    """
    check_bodies(n_bodies)
    check_floating(floating_base)
    check_rod(length, mass, radius)
    return make_chain(
        n_bodies,
        joint=joint,
        axes=joint_axes(axes, n_bodies, seed),
        translation=(0.0, 0.0, -length),
        mass=mass,
        com=(0.0, 0.0, -length / 2),
        inertia=rod_inertia(mass, length, radius),
        gravity=gravity,
        damping=damping,
        armature=armature,
        floating_base=bool(floating_base),
    )
