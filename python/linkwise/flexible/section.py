"""Cross-sections of beams."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

from linkwise._core import InputError


@dataclass(frozen=True, kw_only=True)
class Section:
    """What a beam's section gives to its stiffness and inertia.

    The beam's x axis is along it, y and z are the principal axes of its section.

    Args:
        area: [m2].
        Iy, Iz: second moments of area [m4] about the y axis, which bending in z meets, and the z
            axis.
        J: torsion constant [m4]: a round section's polar moment, less for others.
        width, height: of its outside along y and along z [m], which stresses need; 0: not known.
        shape: "round", where the outside is a circle of diameter width, or "rectangle": stresses
            are those of its corners.

    Raises:
        InputError: a number is not positive and finite, or only one of width and height is given.
    """

    area: float
    Iy: float
    Iz: float
    J: float
    width: float = 0.0
    height: float = 0.0
    shape: Literal["round", "rectangle"] = "rectangle"

    def __post_init__(self) -> None:
        for name in ("area", "Iy", "Iz", "J"):
            _require_positive(name, getattr(self, name))
        if self.shape not in ("round", "rectangle"):
            raise InputError(
                f"shape of a section: {self.shape!r} is unknown; use round or rectangle"
            )
        if self.width == 0 and self.height == 0:
            return
        for name in ("width", "height"):
            _require_positive(name, getattr(self, name))
        if self.shape == "round" and self.width != self.height:
            raise InputError(
                f"width of a round section is {self.width!r} and height {self.height!r}; "
                "give its diameter as both"
            )

    @classmethod
    def round(cls, diameter: float) -> Section:
        """A full circle; diameter [m]."""
        _require_positive("diameter", diameter)
        I = math.pi * diameter**4 / 64  # noqa: E741
        return cls(area=math.pi * diameter**2 / 4, Iy=I, Iz=I, J=2 * I, **_circle(diameter))

    @classmethod
    def tube(cls, diameter: float, wall: float) -> Section:
        """A round tube; outer diameter and wall [m]."""
        _require_positive("diameter", diameter)
        _require_wall(wall, diameter)
        inner = diameter - 2 * wall
        I = math.pi * (diameter**4 - inner**4) / 64  # noqa: E741
        area = math.pi * (diameter**2 - inner**2) / 4
        return cls(area=area, Iy=I, Iz=I, J=2 * I, **_circle(diameter))

    @classmethod
    def rectangle(cls, width: float, height: float) -> Section:
        """A full rectangle; width along y, height along z [m].

        J by Saint-Venant's series [timoshenko1970, section 109].
        """
        _require_positive("width", width)
        _require_positive("height", height)
        a, b = max(width, height), min(width, height)
        series = sum(math.tanh(n * math.pi * a / (2 * b)) / n**5 for n in range(1, 40, 2))
        return cls(
            area=width * height,
            Iy=width * height**3 / 12,
            Iz=height * width**3 / 12,
            J=a * b**3 / 3 * (1 - 192 / math.pi**5 * b / a * series),
            width=width,
            height=height,
        )

    @classmethod
    def box(cls, width: float, height: float, wall: float) -> Section:
        """A rectangular tube; outer width along y, outer height along z, wall [m].

        J by Bredt's formula for thin walls.
        """
        _require_positive("width", width)
        _require_positive("height", height)
        _require_wall(wall, min(width, height))
        w, h = width - 2 * wall, height - 2 * wall
        middle = (width - wall) * (height - wall)
        return cls(
            area=width * height - w * h,
            Iy=(width * height**3 - w * h**3) / 12,
            Iz=(height * width**3 - h * w**3) / 12,
            J=2 * wall * middle**2 / (width + height - 2 * wall),
            width=width,
            height=height,
        )


def _circle(diameter: float) -> Any:
    return {"width": diameter, "height": diameter, "shape": "round"}


def _require_positive(name: str, value: float) -> None:
    if not (isinstance(value, int | float) and 0 < value < math.inf):
        raise InputError(f"{name} of a section is {value!r}; give a positive number, in SI units")


def _require_wall(wall: float, outside: float) -> None:
    _require_positive("wall", wall)
    if not 2 * wall < outside:
        raise InputError(
            f"wall of a section is {wall!r}, half of {outside!r} or more; give a thinner one, "
            "or a full section"
        )
