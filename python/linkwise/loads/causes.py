"""Joint loads split by cause: the shares add up to the load."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from linkwise import _core
from linkwise.base import Array, lengths
from linkwise.io.complaint import check_one_of
from linkwise.loads.samples import (
    drive_kinds,
    external,
    given_motions,
    joint_names,
    model_of,
    need_whole,
    rows,
)

if TYPE_CHECKING:
    import xarray as xr

    from linkwise._core import Model
    from linkwise.loads.samples import RunLike

By = Literal["force", "motion"]

CAUSES: dict[str, dict[str, str]] = {
    "force": {
        "gravity": "gravity acting alone on the mechanism at rest",
        "velocity": "centrifugal, Coriolis and gyroscopic terms of the joints' rates alone",
        "drive": "the drive torques alone",
        "motion": "the accelerations of the joints whose motion is given, alone",
        "passive": "damping, friction, springs and stops of the joints alone",
        "external": "the external wrenches alone",
    },
    "motion": {
        "gravity": "what holds the mechanism at rest against gravity",
        "velocity": "what the joints' rates need: centrifugal, Coriolis, gyroscopic",
        "acceleration": "what the joints' accelerations need",
        "external": "what balances the external wrenches",
    },
}


_PASSIVE = ("damping", "friction", "stiffness", "limit_stiffness")


class Split:
    """Evaluates the shares of any block of samples of one run.

    At a given position the equations of motion are linear in gravity, the velocity terms, drives,
    external wrenches and passive forces, and what is factored of them depends on the position
    alone: by force, one factorisation serves all causes. By motion nothing is to be solved.
    """

    def __init__(self, run: RunLike, by: By, model: Model | None) -> None:
        check_one_of("by", by, CAUSES)
        self.run, self.by = run, by
        machine = model_of(run, model)
        wanted = ["joint_load", "position", "velocity"]
        wanted += ["drive_torque"] if by == "force" else ["acceleration"]
        self.given = given_motions(run)
        if by == "force" and self.given:
            wanted.append("acceleration")
        need_whole(run, machine, *wanted)
        self.model = machine
        held = by == "force" and self.given
        self.free = machine.prescribe(list(self.given)) if held else machine
        self.imposed = np.zeros(machine.nv, dtype=bool)
        for joint in self.given:
            self.imposed[machine.v_slice(joint)] = True
        self.names = [name for name in CAUSES[by] if self._happens(name)]

    def _happens(self, cause: str) -> bool:
        """Can this cause load the machine at all?"""
        if cause == "gravity":
            return any(self.model.gravity)
        if cause in ("velocity", "acceleration"):
            return not self.imposed.all() or "motion" in self.given.values()
        if cause == "drive":
            kinds = drive_kinds(self.run)
            return kinds is None or not set(kinds.values()) <= {"free", "locked", "motion"}
        if cause == "passive":
            free = ~self.imposed
            return any(self.model.dof_property(name)[free].any() for name in _PASSIVE)
        if cause == "external":
            return "external_wrench" in self.run.dataset
        return "motion" in self.given.values()

    def shares(self, where: slice | Sequence[int]) -> Array:
        """(time, cause, joint, 6) of these samples."""
        q = rows(self.run, "position", where)
        v = rows(self.run, "velocity", where)
        outside = external(self.run, self.model, where)
        if self.by == "force":
            return self._by_force(q, v, outside, where)
        return self._by_motion(q, v, outside, where)

    def _by_force(
        self, q: Array, v: Array, outside: Array | None, where: slice | Sequence[int]
    ) -> Array:
        torque = np.where(self.imposed, 0.0, rows(self.run, "drive_torque", where))
        held = rows(self.run, "acceleration", where) if "motion" in self.names else None
        return _core.joint_loads_by_cause(
            self.free, self.names, q, v, torque, external=outside, prescribed=held
        )

    def _by_motion(
        self, q: Array, v: Array, outside: Array | None, where: slice | Sequence[int]
    ) -> Array:
        shares = np.empty((len(q), len(self.names), self.model.n_joints, 6))
        for k, cause in enumerate(self.names):
            shares[:, k] = _core.inverse_dynamics_loads(
                self.model,
                q,
                v if cause == "velocity" else None,
                rows(self.run, "acceleration", where) if cause == "acceleration" else None,
                external=outside if cause == "external" else None,
                gravity=1.0 if cause == "gravity" else 0.0,
            )
        return shares


def split(run: RunLike, by: By = "force", model: Model | None = None) -> xr.DataArray:
    """Joint loads by cause; the shares add up to the joint load to rounding.

    Args:
        run: Holds `joint_load`, `position`, `velocity` and `drive_torque` of all joints, and
            `external_wrench` where there are wrenches; by motion `acceleration` instead of
            `drive_torque`.
        by: "force": what each acting force alone would load the joints with while the mechanism
            moves freely under it (joints whose motion is given stay held). "motion": what the
            position, the rates and the accelerations of this very motion each need.
        model: The machine, if the run does not hold it.

    Returns:
        DataArray (time, cause, joint, component), frame and signs as `joint_load`. Causes that the
        run cannot have are left out.
    """
    import xarray as xr

    made = Split(run, by, model)
    given = run.dataset["joint_load"]
    about = {f"cause {name}": CAUSES[by][name] for name in made.names}
    return xr.DataArray(
        made.shares(slice(None)),
        dims=("time", "cause", "joint", "component"),
        coords={
            "time": run.dataset["time"],
            "cause": made.names,
            "joint": ("joint", joint_names(run)),
            "component": given["component"],
        },
        attrs={**given.attrs, "long_name": f"joint load by {by}", **about},
        name="joint_load",
    )


def along_total(shares: Array) -> tuple[Array, Array]:
    """Shares (time, cause, 3) along their sum (time, cause), and the size of the sum (time,)."""
    total = shares.sum(axis=1)
    size = lengths(total)
    direction = total / np.where(size > 0, size, 1.0)[:, None]
    return np.einsum("tci,ti->tc", shares, direction), size
