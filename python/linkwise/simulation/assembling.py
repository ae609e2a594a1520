"""Positions and rates of machines with closed loops that keep these loops closed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from linkwise import _core
from linkwise._core import InputError
from linkwise.base import Array
from linkwise.io.complaint import shown
from linkwise.simulation.arguments import state_vector

if TYPE_CHECKING:
    from linkwise._core import Model


class Assembly(NamedTuple):
    """A state whose loops are closed: coordinates `q`, rates `v`, how far the loops were open
    before (`gap`, relative to their length), and the held joints that had to move (`released`)."""

    q: Array
    v: Array
    gap: float
    released: tuple[str, ...]


def held_joints(hold: Sequence[str]) -> list[str]:
    """Names of joints that assembly leaves where they are."""
    named = not isinstance(hold, str) and isinstance(hold, Sequence)
    if not named or not all(isinstance(name, str) for name in hold):
        raise InputError(f"hold: {shown(hold)} given; give a list of names of joints")
    return list(hold)


def assemble(
    model: Model,
    q0: npt.ArrayLike | None = None,
    v0: npt.ArrayLike | None = None,
    *,
    hold: Sequence[str] = (),
) -> Assembly:
    """The position near `q0` that closes all loops, and rates near `v0` that keep them closed.

    Args:
        model: The mechanism.
        q0: Coordinates (nq,); the model's `initial_configuration()` by default.
        v0: Rates (nv,); zero by default.
        hold: Names of joints that are to stay where `q0` has them, with the rates of `v0`. Where
            loops do not close so, they are released, the last one first; see `released`.

    Positions change as little as they can in the metric of the mass matrix, step by step, and rates
    by the least kinetic energy.

    Raises:
        InputError: no position was found; the message says which loop stays open by how much. Or
            the rates of held joints contradict each other.
    """
    found = _core.assemble(
        model,
        state_vector("q0", q0, model.nq, model.initial_configuration()),
        state_vector("v0", v0, model.nv, np.zeros(model.nv)),
        held_joints(hold),
    )
    return Assembly(found["q"], found["v"], found["gap"], tuple(found["released"]))
