"""Hints at units: inertias and centres of mass that no body of the machine's size can have."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

#: A radius of gyration so many times the machine's largest length hints at a wrong unit.
FAR = 5.0
#: So does a centre of mass so many times the largest distance between joints from its link's frame.
FAR_CENTRE = 50.0

#: Mass [kg], centre of mass [m] and inertia about it [kg m2] of a link.
Inertial = tuple[float, npt.ArrayLike, npt.ArrayLike]


def unit_hints(
    joints: Iterable[tuple[str, str, float]], inertials: Mapping[str, Inertial]
) -> Iterator[tuple[str, str]]:
    """Link and text of each hint.

    Args:
        joints: Parent, child, and distance of the joint from the parent's frame [m].
        inertials: By link its mass, centre of mass and inertia, as the file gives them.
    """
    reach: dict[str, float] = {}
    for parent, child, length in joints:
        for link in (parent, child):
            reach[link] = max(reach.get(link, 0.0), length)
    largest = max(reach.values(), default=0.0)
    for name, (mass, com, inertia) in inertials.items():
        offset = math.hypot(*np.asarray(com, dtype=float))
        size = max(largest, offset)
        if mass <= 0 or size == 0:
            continue
        if largest > 0 and offset > FAR_CENTRE * largest:
            yield (
                name,
                (
                    f"its centre of mass lies {offset:.3g} m from the link's frame, far beyond a "
                    f"machine whose joints are at most {largest:.3g} m apart; check the units of "
                    "the inertial origin: m (1 mm = 0.001 m)"
                ),
            )
        radius = math.sqrt(max(0.0, float(np.trace(np.asarray(inertia))) / 2 / mass))
        if radius > FAR * size:
            yield name, _of_inertia(radius, size, inertia)


def _of_inertia(radius: float, size: float, inertia: Any) -> str:
    guess = "1 kg m2 is what many exporters write by default"
    if not np.allclose(inertia, np.eye(3)):
        guess = "inertias are kg m2 (1 kg mm2 = 1e-6 kg m2, 1 g mm2 = 1e-9 kg m2)"
    return (
        f"radius of gyration {radius:.3g} m, far beyond a machine whose joints are at "
        f"most {size:.3g} m apart; check the units of mass and inertia: {guess}"
    )
