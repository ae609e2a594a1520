"""Numbers with an optional unit, as in scenarios and table headers: 0.3, "30 deg", "5 mm".

A bare number is in SI units (rad, m, s, N). Every unit has one dimension, so that a length given
where an angle belongs is an error and not a wrong answer.
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from linkwise.io.complaint import shorten
from linkwise.io.numbers import parse_number


class Unit(NamedTuple):
    """A unit's dimension and its size in SI."""

    dimension: str
    factor: float


_DEG = math.pi / 180

UNITS: dict[str, Unit] = {
    "rad": Unit("angle", 1.0),
    "deg": Unit("angle", _DEG),
    "rev": Unit("angle", 2 * math.pi),
    "mrad": Unit("angle", 1e-3),
    "m": Unit("length", 1.0),
    "cm": Unit("length", 1e-2),
    "mm": Unit("length", 1e-3),
    "um": Unit("length", 1e-6),
    "km": Unit("length", 1e3),
    "s": Unit("time", 1.0),
    "ms": Unit("time", 1e-3),
    "min": Unit("time", 60.0),
    "h": Unit("time", 3600.0),
    "s/rad": Unit("time per angle", 1.0),
    "s/deg": Unit("time per angle", 1 / _DEG),
    "s/m": Unit("time per length", 1.0),
    "rad/s": Unit("angular velocity", 1.0),
    "deg/s": Unit("angular velocity", _DEG),
    "rev/s": Unit("angular velocity", 2 * math.pi),
    "rpm": Unit("angular velocity", 2 * math.pi / 60),
    "m/s": Unit("velocity", 1.0),
    "cm/s": Unit("velocity", 1e-2),
    "m/min": Unit("velocity", 1 / 60),
    "km/h": Unit("velocity", 1 / 3.6),
    "mm/s": Unit("velocity", 1e-3),
    "m/s2": Unit("acceleration", 1.0),
    "m/rad": Unit("length per angle", 1.0),
    "mm/rad": Unit("length per angle", 1e-3),
    "m/rev": Unit("length per angle", 0.5 / math.pi),
    "mm/rev": Unit("length per angle", 0.5e-3 / math.pi),
    "kg": Unit("mass", 1.0),
    "g": Unit("mass", 1e-3),
    "t": Unit("mass", 1e3),
    "kgm2": Unit("inertia", 1.0),
    "gm2": Unit("inertia", 1e-3),
    "gcm2": Unit("inertia", 1e-7),
    "kgcm2": Unit("inertia", 1e-4),
    "kgmm2": Unit("inertia", 1e-6),
    "gmm2": Unit("inertia", 1e-9),
    "N": Unit("force", 1.0),
    "kN": Unit("force", 1e3),
    "MN": Unit("force", 1e6),
    "mN": Unit("force", 1e-3),
    "Nm": Unit("moment", 1.0),
    "kNm": Unit("moment", 1e3),
    "MNm": Unit("moment", 1e6),
    "Ncm": Unit("moment", 1e-2),
    "Nmm": Unit("moment", 1e-3),
    "mNm": Unit("moment", 1e-3),
    "N/m": Unit("stiffness", 1.0),
    "N/mm": Unit("stiffness", 1e3),
    "kN/m": Unit("stiffness", 1e3),
    "kN/mm": Unit("stiffness", 1e6),
    "N/um": Unit("stiffness", 1e6),
    "Nm/rad": Unit("angular stiffness", 1.0),
    "kNm/rad": Unit("angular stiffness", 1e3),
    "Nm/deg": Unit("angular stiffness", 1 / _DEG),
    "Pa": Unit("pressure", 1.0),
    "MPa": Unit("pressure", 1e6),
    "GPa": Unit("pressure", 1e9),
    "N/mm2": Unit("pressure", 1e6),
    "kg/m3": Unit("density", 1.0),
    "g/cm3": Unit("density", 1e3),
    "m2": Unit("area", 1.0),
    "cm2": Unit("area", 1e-4),
    "mm2": Unit("area", 1e-6),
    "m4": Unit("second moment of area", 1.0),
    "cm4": Unit("second moment of area", 1e-8),
    "mm4": Unit("second moment of area", 1e-12),
    "Ns/m": Unit("damping", 1.0),
    "Ns/mm": Unit("damping", 1e3),
    "kNs/m": Unit("damping", 1e3),
    "Nms/rad": Unit("angular damping", 1.0),
    "Nms/deg": Unit("angular damping", 1 / _DEG),
}

_SPLIT = re.compile(r"\s*([+-]?[0-9.][0-9.eE+-]*)\s*(\S.*?)?\s*\Z", re.DOTALL)


def known_units(*dimensions: str) -> str:
    """The names of the units of the given dimensions (all units without any), for complaints."""
    return ", ".join(n for n, u in UNITS.items() if not dimensions or u.dimension in dimensions)


def parse_unit(text: str) -> Unit:
    """The unit that ``text`` names: "N m", "N*m" and "Nm" are one. ValueError lists the known."""
    name = re.sub(r"[\s*·]", "", text).replace("^", "").replace("²", "2")
    if name == "°":
        name = "deg"
    unit = UNITS.get(name)
    if unit is None:
        raise ValueError(f"unknown unit '{shorten(text)}'; known units: {known_units()}")
    return unit


def parse_quantity(text: str) -> tuple[float, str | None]:
    """Value in SI and dimension (None without a unit) of "30 deg"; ValueError in words."""
    match = _SPLIT.match(text) if len(text) <= 100 else None
    if not match:
        parse_number(text)  # says what is wrong with it
        raise ValueError(f"'{shorten(text)}' is not a number")
    number, unit_text = match.groups()
    value = parse_number(number)
    if unit_text is None:
        return value, None
    unit = parse_unit(unit_text)
    return value * unit.factor, unit.dimension


def check_dimension(dimension: str | None, *allowed: str) -> None:
    """ValueError if a unit was given and its dimension is none of ``allowed``."""
    if dimension is not None and dimension not in allowed:
        if not known_units(*allowed):
            raise ValueError(f"has a unit of {dimension}; give the number alone")
        wanted = " or ".join(f"an {a}" if a[0] in "aeiou" else f"a {a}" for a in allowed)
        raise ValueError(
            f"has a unit of {dimension} where {wanted} belongs; use one of {known_units(*allowed)}"
        )
