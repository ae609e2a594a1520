"""What actuators and tendons of an MJCF add to the joints that they act on alone.

MuJoCo puts the rotor inertia (armature) of actuators and tendons into the mass matrix, and the
springs, dampers and friction of tendons among the passive forces. A fixed tendon on one joint, or
an actuator on a joint or on such a tendon, adds to that joint's own properties. What couples
several joints has no place here; :meth:`Transmissions.notes` says so.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from linkwise.io.complaint import shorten


class Transmissions:
    """Per degree of freedom what the actuators and tendons of a compiled model add.

    armature, damping, friction, stiffness: arrays (mj_model.nv,), in the units of the joints;
    moment: (mj_model.nv,), the springs' force at qpos = 0, so that stiffness * rest = moment.
    """

    def __init__(self, mj_model: Any) -> None:
        self._mj = mj_model
        self.armature, self.damping, self.friction, self.stiffness, self.moment = np.zeros(
            (5, mj_model.nv)
        )
        self._coupling: list[tuple[str, list[str]]] = []
        for tendon in range(mj_model.ntendon):
            self._add_tendon(tendon)
        for actuator in range(mj_model.nu):
            self._add_actuator(actuator)

    def _fixed(self, tendon: int) -> tuple[slice, float] | None:
        """Degree of freedom and coefficient of a fixed tendon on one hinge or slide, or None."""
        import mujoco

        mj_model = self._mj
        first = int(mj_model.tendon_adr[tendon])
        wraps = slice(first, first + int(mj_model.tendon_num[tendon]))
        joints = set(mj_model.wrap_objid[wraps].tolist())
        if (mj_model.wrap_type[wraps] != int(mujoco.mjtWrap.mjWRAP_JOINT)).any() or len(
            joints
        ) != 1:
            return None
        dof = int(mj_model.jnt_dofadr[joints.pop()])
        return slice(dof, dof + 1), float(mj_model.wrap_prm[wraps].sum())

    def _add_tendon(self, tendon: int) -> None:
        mj_model, target = self._mj, self._fixed(tendon)
        name = mj_model.tendon(tendon).name or str(tendon)
        low, high = mj_model.tendon_lengthspring[tendon]
        given = {
            key: float(getattr(mj_model, f"tendon_{field}")[tendon])
            for key, field in (
                ("armature", "armature"),
                ("damper", "damping"),
                ("friction", "frictionloss"),
                ("spring", "stiffness"),
            )
        }
        lost = [key for key, value in given.items() if value]
        curved = [
            key
            for key, field in (("damper", "damping"), ("spring", "stiffness"))
            if getattr(mj_model, f"tendon_{field}poly")[tendon].any()
        ]
        if target is not None:
            dof, coefficient = target
            self.armature[dof] += coefficient**2 * given["armature"]
            self.damping[dof] += coefficient**2 * given["damper"]
            self.friction[dof] += abs(coefficient) * given["friction"]
            lost = curved
            if low == high:
                self.stiffness[dof] += coefficient**2 * given["spring"]
                self.moment[dof] += coefficient * given["spring"] * low
            elif given["spring"]:
                lost = [*lost, "spring"]
        if lost:
            self._coupling.append((f"tendon '{shorten(name)}'", lost))

    def _add_actuator(self, actuator: int) -> None:
        import mujoco

        mj_model = self._mj
        armature = float(mj_model.actuator_armature[actuator])
        damping = float(mj_model.actuator_damping[actuator])
        curved = mj_model.actuator_dampingpoly[actuator].any()
        if not (armature or damping or curved):
            return
        # As MuJoCo: the first gear counts, for every degree of freedom of the joint.
        factor = float(mj_model.actuator_gear[actuator][0]) ** 2
        kind = int(mj_model.actuator_trntype[actuator])
        target = int(mj_model.actuator_trnid[actuator][0])
        trn = mujoco.mjtTrn
        lost = [key for key, value in (("armature", armature), ("damper", damping)) if value]
        dofs = None
        if kind in (int(trn.mjTRN_JOINT), int(trn.mjTRN_JOINTINPARENT)):
            first = int(mj_model.jnt_dofadr[target])
            dofs = slice(first, first + (6, 3, 1, 1)[mj_model.jnt_type[target]])
        elif kind == int(trn.mjTRN_TENDON) and (found := self._fixed(target)):
            dofs, coefficient = found
            factor *= coefficient**2
        if dofs is not None:
            self.armature[dofs] += factor * armature
            self.damping[dofs] += factor * damping
            lost = ["damper"] if curved else []
        if lost:
            name = mj_model.actuator(actuator).name or str(actuator)
            self._coupling.append((f"actuator '{shorten(name)}'", lost))

    def spring(self, dof: int, stiffness: float, rest: float) -> tuple[float, float]:
        """Stiffness and rest position of a joint's own spring together with those of tendons."""
        total = stiffness + float(self.stiffness[dof])
        if not self.stiffness[dof]:
            return total, rest
        return total, (stiffness * rest + float(self.moment[dof])) / total

    def notes(self) -> Iterator[tuple[str, str, str]]:
        """Warnings about what couples joints or is not linear, and is therefore left out."""
        for element, lost in self._coupling:
            what = " and ".join(lost)
            tail = (
                ": the mass matrix lacks it, and accelerations differ from MuJoCo's"
                if "armature" in lost
                else ""
            )
            text = f"its {what} acts on several joints or is not linear, and is ignored{tail}"
            yield "warning", element, text
