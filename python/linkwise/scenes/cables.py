"""Elastic cables and nets: beams that stretch, bend and twist."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise._core import InputError, ModelBuilder, require_memory
from linkwise.flexible.section import Section
from linkwise.scenes.chain import EARTH, check_count, check_size

if TYPE_CHECKING:
    from linkwise._core import Model

#: Of a model and one evaluation of it, for each element.
BYTES_PER_ELEMENT = 8_000

_KINDS = {"weld": "fixed", "spherical": "spherical"}
_TURNED = ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))


def tether(
    n_elements: int = 10,
    *,
    length: float = 100.0,
    EA: float = 1.6e6,
    EI: float = 40.0,
    GJ: float = 15.0,
    mass_per_length: float = 0.35,
    damping: float = 0.0,
    joint: str = "weld",
    held: str = "start",
    span: float | None = None,
    gravity: Sequence[float] = EARTH,
) -> Model:
    """An elastic cable, straight along x and without stress at q = 0: a row of equal beams.

    The numbers given by default are those of a fibre rope, 20 mm thick. Each beam has six
    coordinates: stretch, twist, and two deflections in each plane. Welded to each other, they are
    the links `tether`, `tether:2` ... of one flexible link that ends in `tether:end`. On spherical
    joints `joint_2` ... they are flexible links of their own, `tether_1` ..., which end in
    `tether_1:end` .... Joint `start`, a spherical one, holds the first on the link `ground`, and
    loop joint `end` the end of the last.

    Args:
        n_elements: number of beams.
        length: of them all [m].
        EA: stiffness against stretch [N].
        EI: against bending, the same both ways [N m2].
        GJ: against twist [N m2].
        mass_per_length: [kg/m].
        damping: ratio of every mode of a beam to critical damping.
        joint: between beams: "weld" or "spherical".
        held: "start", "both" ends, or "none": the cable floats.
        span: distance of both ends where they are held [m]; `length` by default. With another the
            loop is open at q = 0, and a run needs `q0`. A taut cable is closed by a stretch of
            (span - length) / n_elements, the first coordinate of each elastic joint.
        gravity: (3,) [m/s2].

    Raises:
        InputError: a value is out of range.
        MemoryError: there is no room for so many beams.
    """
    check_count("n_elements", n_elements)
    require_memory(float(BYTES_PER_ELEMENT * n_elements), f"a tether of {n_elements} elements")
    check_size("length", length)
    _check_beam(EA, EI, GJ, mass_per_length, damping)
    _check_name("joint", joint, tuple(_KINDS))
    _check_name("held", held, ("start", "both", "none"))
    if span is not None:
        check_size("span", span)
        if held != "both":
            raise InputError(
                f"span is the distance of two held ends, and held is {held!r}; leave span out"
            )
    builder = ModelBuilder("tether", gravity=gravity)
    if held == "none":
        builder.set_floating_base()
    else:
        builder.add_link("ground")
    beam = _Beam(EA, EI, GJ, mass_per_length, damping)
    n_links, bodies = (1, n_elements) if joint == "weld" else (n_elements, 1)
    own = length / n_links
    before, at = (None if held == "none" else "ground"), 0.0
    for i in range(1, n_links + 1):
        name = "tether" if joint == "weld" else f"tether_{i}"
        beam.add(builder, name, own, bodies)
        if before is not None:
            given = ("spherical", "start") if i == 1 and held != "none" else (joint, f"joint_{i}")
            kind, joint_name = _KINDS[given[0]], given[1]
            builder.add_joint(joint_name, kind, before, name, translation=(at, 0, 0))
        before, at = name, own
    if held == "both" and before is not None:
        anchor = (length if span is None else span, 0, 0)
        ends: dict[str, Any] = {"translation": anchor, "child_translation": (own, 0, 0)}
        builder.add_loop("end", "spherical", "ground", before, **ends)
    return builder.build()


def net(
    nx: int = 4,
    ny: int = 4,
    *,
    spacing: float = 1.0,
    EA: float = 1.0e4,
    EI: float = 0.05,
    GJ: float = 0.02,
    mass_per_length: float = 0.02,
    damping: float = 0.0,
    knot_mass: float = 0.01,
    knot_radius: float = 0.02,
    joint: str = "spherical",
    held: str = "corners",
    gravity: Sequence[float] = EARTH,
) -> Model:
    """A rectangular net of elastic cords between rigid knots, flat and without stress at q = 0.

    The numbers given by default are those of a cord, 5 mm thick. Knot (i, j), a solid ball, is the
    link `knot_i_j` at (i, j, 0) times the spacing; cord `x_i_j` leads from it along x, `y_i_j`
    along y, each one beam with six coordinates of its own. Joints `x_i_j:start` and `x_i_j:end`
    join a cord and its knots. Knots hang in a tree on cords along x from those of the first column,
    and all other cords close loops at their ends.

    Args:
        nx: knots along x, at least 2.
        ny: along y, at least 2.
        spacing: of the knots, and length of a cord [m].
        EA: of a cord against stretch [N].
        EI: against bending, the same both ways [N m2].
        GJ: against twist [N m2].
        mass_per_length: [kg/m].
        damping: ratio of every mode of a cord to critical damping.
        knot_mass: [kg].
        knot_radius: of the solid ball whose inertia a knot has [m].
        joint: of cords on knots: "spherical" or "weld".
        held: "corners", whose knots turn in the joints `hold_i_j` of the ground, or "none": the net
            floats.
        gravity: (3,) [m/s2].

    Raises:
        InputError: a value is out of range.
        MemoryError: there is no room for so many cords.
    """
    for name, count in (("nx", nx), ("ny", ny)):
        check_count(name, count)
        if count < 2:
            raise InputError(f"{name} is {count}; give at least 2 knots each way")
    cords = (nx - 1) * ny + nx * (ny - 1)
    require_memory(float(BYTES_PER_ELEMENT * cords), f"a net of {cords} cords")
    for name, size in (
        ("spacing", spacing),
        ("knot_mass", knot_mass),
        ("knot_radius", knot_radius),
    ):
        check_size(name, size)
    _check_beam(EA, EI, GJ, mass_per_length, damping)
    _check_name("joint", joint, tuple(_KINDS))
    _check_name("held", held, ("corners", "none"))
    builder = ModelBuilder("net", gravity=gravity)
    if held == "none":
        builder.set_floating_base()
    else:
        builder.add_link("ground")
    ball = np.eye(3) * 0.4 * knot_mass * knot_radius**2
    for i in range(nx):
        for j in range(ny):
            builder.add_link(_knot(i, j), mass=knot_mass, inertia=ball)
    if held == "corners":
        _hold_corners(builder, nx, ny, spacing)
    beam = _Beam(EA, EI, GJ, mass_per_length, damping)
    for i in range(nx):
        for j in range(ny):
            for along_y, k, m in ((False, i + 1, j), (True, i, j + 1)):
                if k == nx or m == ny:
                    continue
                name = f"{'y' if along_y else 'x'}_{i}_{j}"
                beam.add(builder, name, spacing)
                turned: dict[str, Any] = {"rotation": _TURNED} if along_y else {}
                builder.add_joint(f"{name}:start", _KINDS[joint], _knot(i, j), name, **turned)
                back = np.transpose(_TURNED) if along_y else np.eye(3)
                end: dict[str, Any] = {"translation": (spacing, 0, 0), "rotation": back}
                add = builder.add_loop if along_y and i > 0 else builder.add_joint
                add(f"{name}:end", _KINDS[joint], name, _knot(k, m), **end)
    return builder.build()


def _knot(i: int, j: int) -> str:
    return f"knot_{i}_{j}"


def _hold_corners(builder: ModelBuilder, nx: int, ny: int, spacing: float) -> None:
    for i in (0, nx - 1):
        for j in (0, ny - 1):
            add = builder.add_loop if i or j else builder.add_joint
            at = (i * spacing, j * spacing, 0)
            add(f"hold_{i}_{j}", "spherical", "ground", _knot(i, j), translation=at)


class _Beam:
    """The same cord many times."""

    def __init__(
        self, EA: float, EI: float, GJ: float, mass_per_length: float, damping: float
    ) -> None:
        # Of a section what counts are products with moduli, and Iy / area = EI / EA.
        E, G = 1e9, 4e8
        self._given: dict[str, Any] = {
            "section": Section(area=EA / E, Iy=EI / E, Iz=EI / E, J=GJ / G),
            "E": E,
            "G": G,
            "damping": damping,
            "interior_modes": 0,
        }
        self._mass_per_length = mass_per_length

    def add(self, builder: ModelBuilder, name: str, length: float, bodies: int = 1) -> None:
        builder.add_link(name, mass=self._mass_per_length * length)
        builder.make_flexible(name, end=(length, 0, 0), bodies=bodies, **self._given)


def _check_beam(EA: float, EI: float, GJ: float, mass_per_length: float, damping: float) -> None:
    sizes = {"EA": EA, "EI": EI, "GJ": GJ, "mass_per_length": mass_per_length}
    for name, size in sizes.items():
        check_size(name, size)
    check_size("damping", damping, least=0.0)


def _check_name(what: str, name: str, known: Sequence[str]) -> None:
    if name not in known:
        raise InputError(f"{what} {name!r:.60} is unknown; known: {', '.join(known)}")
