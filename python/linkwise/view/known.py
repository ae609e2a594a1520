"""Which joint loads rigid bodies determine in the pose that is shown."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from linkwise._core import InputError
from linkwise.base import AnyArray, Array
from linkwise.loads.determinate import FEW_ROWS, Held, components_of, given_joints, loop_rows

if TYPE_CHECKING:
    from linkwise._core import Model
    from linkwise.results import Run

_HALVES = ("force", "moment")


class Known:
    """Of a machine some of whose loads may be open.

    throughout: (joints, 6) [bool] what is determinate in every pose that was looked at, of a model
    alone in the first; `at` looks at others where a look takes a millisecond.
    """

    def __init__(self, model: Model, throughout: AnyArray, given: Iterable[str] = ()) -> None:
        self.throughout = throughout
        self.varies = 0 < loop_rows(model) <= FEW_ROWS
        self._held = Held(model, given) if self.varies else None

    def at(self, q: Array) -> AnyArray:
        """(joints, half) [bool]: whether the loads at the position q (nq,) are determinate."""
        known = self.throughout
        if self._held is not None:
            try:
                known = np.asarray(self._held.indeterminacy(q).determinate, dtype=np.bool_)
            except InputError:  # loops are open there: what was found elsewhere counts
                known = self.throughout
        return halves(known)

    @property
    def possible(self) -> AnyArray:
        """(joints, half) [bool]: where a load may be open in some pose."""
        return np.ones_like(self.sometimes) if self.varies else self.sometimes

    @property
    def sometimes(self) -> AnyArray:
        """(joints, half) [bool]: what is open in some pose that was looked at."""
        return ~halves(self.throughout)


def halves(known: AnyArray) -> AnyArray:
    """(joints, half) of the lengths of force and moment, from (joints, 6) of their components."""
    found: AnyArray = np.all(known.reshape(-1, 2, 3), axis=2)
    return found


def known_in(run: Run, model: Model) -> Known | None:
    """Of a run; None where all its loads are determinate or it does not tell."""
    throughout = components_of(run)
    if throughout is None or throughout.all():
        return None
    return Known(model, throughout, given_joints(run))


def elsewhere(known: AnyArray, sometimes: AnyArray) -> str:
    """What is said of one joint's force and moment (2,) that are `known` here and open in other
    poses, "" of others."""
    named = [name for name, also in zip(_HALVES, known & sometimes, strict=True) if also]
    return f"{' and '.join(named)} not determined in other poses" if named else ""
