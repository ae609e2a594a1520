"""What actuators and tendons of an MJCF add to the joints that they act on alone.

MuJoCo puts the rotor inertia (armature) of actuators and tendons into the mass matrix, and the
springs, dampers and friction of tendons among the passive forces. A fixed tendon on one joint, or
an actuator on a joint or on such a tendon, adds to that joint's own properties. What couples
several joints has no place here; :meth:`Transmissions.notes` says so, and how much it is.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from linkwise.io.complaint import shorten

#: What is left out has its size computed for so many tendons and actuators.
_MOST_SIZES = 50


@contextmanager
def without_warnings() -> Iterator[None]:
    """MuJoCo otherwise prints warnings and appends them to a file in the working directory."""
    import mujoco

    previous = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda message: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(previous)


class _Lost(NamedTuple):
    """What of a tendon or actuator is left out: its parts, None where a part is no number."""

    kind: str
    number: int
    parts: dict[str, float | None]


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
        self._lost: list[_Lost] = []
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
        lost: dict[str, float | None] = {key: value for key, value in given.items() if value}
        curved: dict[str, float | None] = {
            key: None
            for key, field in (("damper", "damping"), ("spring", "stiffness"))
            if getattr(mj_model, f"tendon_{field}poly")[tendon].any()
        }
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
                lost = {**lost, "spring": given["spring"]}
        if lost:
            self._lost.append(_Lost("tendon", tendon, {**curved, **lost}))

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
        lost: dict[str, float | None] = {"armature": armature} if armature else {}
        if damping or curved:
            lost["damper"] = damping or None
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
            lost = {"damper": None} if curved else {}
        if lost:
            self._lost.append(_Lost("actuator", actuator, lost))

    def spring(self, dof: int, stiffness: float, rest: float) -> tuple[float, float]:
        """Stiffness and rest position of a joint's own spring together with those of tendons."""
        total = stiffness + float(self.stiffness[dof])
        if not self.stiffness[dof]:
            return total, rest
        return total, (stiffness * rest + float(self.moment[dof])) / total

    def notes(self) -> Iterator[tuple[str, str, str]]:
        """Warnings about what couples joints or is not linear, and is therefore left out."""
        said_of = self._sizes()
        for count, lost in enumerate(self._lost):
            name = getattr(self._mj, lost.kind)(lost.number).name or str(lost.number)
            what = " and ".join(lost.parts)
            text = f"its {what} acts on several joints or is not linear, and is ignored"
            if count < len(said_of) and said_of[count]:
                text += f"; as drawn {said_of[count]}"
            if "armature" in lost.parts:
                text += ": the mass matrix lacks it, and accelerations differ from MuJoCo's"
            yield "warning", f"{lost.kind} '{shorten(name)}'", text

    def _sizes(self) -> list[str]:
        """How much the first of those left out are; none where MuJoCo cannot say."""
        import mujoco

        if not self._lost or not self._mj.nv:
            return []
        with without_warnings():
            try:
                sizes = _Sizes(self._mj)
                return [sizes.of(lost) for lost in self._lost[:_MOST_SIZES]]
            except (mujoco.FatalError, ValueError, MemoryError):
                return []


class _Sizes:
    """How much of each joint's own the parts that are left out are, in the pose that is drawn."""

    def __init__(self, mj_model: Any) -> None:
        import mujoco

        # The caller's model stays as it is. Contacts are the slow part, and have none here.
        self._mj = copy.copy(mj_model)
        self._mj.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
        self._mj.tendon_armature[:] = 0
        self._mj.actuator_armature[:] = 0
        self._along = np.cos(np.arange(mj_model.nv, dtype=np.float64))
        self._data = mujoco.MjData(self._mj)
        self._plain = self._times(self._along)

    def _times(self, vector: Any) -> Any:
        """The mass matrix times a vector."""
        import mujoco

        mujoco.mj_fwdPosition(self._mj, self._data)
        product = np.zeros(self._mj.nv)
        mujoco.mj_mulM(self._mj, self._data, product, vector)
        return product

    def _arms(self, lost: _Lost) -> Any:
        """Change of a tendon's or actuator's length with each degree of freedom: with an armature
        of 1 it adds J J^T to the mass matrix, so that a product is J times a number."""
        field = getattr(self._mj, f"{lost.kind}_armature")
        field[lost.number] = 1
        added = self._times(self._along) - self._plain
        field[lost.number] = 0
        square = float(self._along @ added)
        return added / np.sqrt(square) if square > 0 else np.zeros_like(added)

    def of(self, lost: _Lost) -> str:
        """In words; empty where no part is a number."""
        import mujoco

        if not any(lost.parts.values()):
            return ""
        arms = np.abs(self._arms(lost))
        dof = int(arms.argmax())
        joint = int(self._mj.dof_jntid[dof])
        name = self._mj.joint(joint).name or str(joint)
        first = int(self._mj.jnt_dofadr[joint])
        kind = int(self._mj.jnt_type[joint])
        slides = kind == int(mujoco.mjtJoint.mjJNT_SLIDE) or (
            kind == int(mujoco.mjtJoint.mjJNT_FREE) and dof < first + 3
        )
        unit = np.zeros(self._mj.nv)
        unit[dof] = 1
        force, per, inertia = ("N", "m", "kg") if slides else ("N m", "rad", "kg m2")
        units = {
            "armature": f"{inertia} beside {self._times(unit)[dof]:.3g}",
            "damper": f"{force} s/{per}",
            "friction": force,
            "spring": f"{force}/{per}",
        }
        words = [
            f"{part} {value * (arms[dof] if part == 'friction' else arms[dof] ** 2):.3g} "
            f"{units[part]}"
            for part, value in lost.parts.items()
            if value
        ]
        return f"at joint '{shorten(name)}' {', '.join(words)}"
