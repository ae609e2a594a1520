"""A model alone in a pose: its loops closed, and the loads while it is held still there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from linkwise import _core
from linkwise._core import InputError, NumericsError
from linkwise.base import Array
from linkwise.io.complaint import shorten

if TYPE_CHECKING:
    from linkwise._core import Model

_SHOWN = 4  # names in a line
_MOST = 200  # degrees of freedom: of more, what holds a machine would take long to find
_WHERE = "where loops close"
_CLOSED = 1e-9  # m or rad, that assembly moves what is closed by rounding


class Pose:
    """Poses of a model. With loops, some joints are enough to hold the machine: `holders`, the
    first ones from the base that have one axis, or None where none can be found.

    told: what is said of the last pose; held: joints that stay where the first pose has them, as
    long as loops close so.
    """

    def __init__(self, model: Model, held: Sequence[str] = ()) -> None:
        self._model = model
        self._held = list(held)
        self.looped = bool(model.n_loops or model.coupling_names)
        self.told, self._open = "", False
        self.holders: list[str] | None = []

    def assembled(self, q: Array, moved: str | None) -> Array:
        """The position next to `q` that closes all loops, with the joint that was moved where it
        is put if that can be."""
        self.told, self._open = "", False
        if not self.looped:
            return q
        try:
            rest = np.zeros(self._model.nv)
            found = _core.assemble(self._model, q, rest, [moved] if moved else self._held)
        except InputError as error:
            self._open, self.told = True, f"loops stay open here: {shorten(error, 160)}"
            return q
        if found["released"]:
            what = f"it moved back to {_WHERE}" if moved else f"moved to {_WHERE}"
            self.told = f"{_listed(found['released'])} cannot be there: {what}"
        elif moved is None:
            self.told = self._what_moved(q, found["q"])
        return np.asarray(found["q"])

    def _what_moved(self, before: Array, after: Array) -> str:
        """What was assembled, "" where loops were closed already."""
        off = np.abs(after - before) > _CLOSED
        names = [name for name in self._model.joint_names if off[self._model.q_slice(name)].any()]
        return f"loops were open; moved to close them: {_listed(names)}" if names else ""

    def loads(self, q: Array) -> Array:
        """Loads (joints of the tree, then those that close loops; 6) while the machine is held
        still in the pose `q`: by all joints of a tree, of a machine with loops by `holders`. Zeros
        where loops stay open or nothing holds it."""
        model = self._model
        nothing = np.zeros((model.n_joints + model.n_loops, 6))
        if not self.looped:
            rest = np.zeros(model.nv)
            return _core.inverse_dynamics_loads(model, q, rest, rest)
        if self._open:
            return nothing
        if model.nv > _MOST:
            self.told = f"no loads: more than {_MOST} coordinates; those of a run are shown"
            return nothing
        try:
            self.holders = _holders(model, q)
            loads = _core.joint_loads(
                model, q, None, _holding(model, q, self.holders), passive=True
            )
        except (InputError, NumericsError) as error:
            self.told = self.told or f"no loads here: {shorten(error, 160)}"
            return nothing
        self.told = "; ".join(filter(None, (self.told, f"held by {_listed(self.holders)}")))
        return loads


def _listed(names: list[str]) -> str:
    return ", ".join(map(shorten, names[:_SHOWN])) + (", ..." if names[_SHOWN:] else "")


def _holding(model: Model, q: Array, holders: list[str]) -> Array:
    """Torques (nv,) of the holders under which nothing accelerates: these are linear in those."""
    places = [dof for name in holders for dof in range(model.nv)[model.v_slice(name)]]
    torques = np.zeros((len(places) + 1, model.nv))
    torques[np.arange(len(places)), places] = 1.0
    *found, free = (_core.forward_dynamics(model, q, None, tau, passive=True) for tau in torques)
    tau = np.zeros(model.nv)
    tau[places] = np.linalg.lstsq(np.array(found).T - free[:, None], -free, rcond=None)[0]
    return tau


def _holders(model: Model, q: Array) -> list[str]:
    """The first joints that leave no way to move when they are locked, those of one axis first."""
    ways = np.array([_core.assemble(model, q, rate, [])["v"] for rate in np.eye(model.nv)])
    order = sorted(range(model.n_joints), key=lambda joint: model.joint_nv[joint] != 1)
    held: list[str] = []
    rank = 0
    rows = np.zeros((0, model.nv))
    total = np.linalg.matrix_rank(ways, tol=1e-6)
    for joint in order:
        more = np.vstack([rows, ways.T[model.v_slice(model.joint_names[joint])]])
        new = int(np.linalg.matrix_rank(more, tol=1e-6))
        if new > rank:
            held.append(model.joint_names[joint])
            rows, rank = more, new
        if rank == total:
            break
    return held
