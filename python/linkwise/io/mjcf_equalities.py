"""Equality constraints of an MJCF: <connect> is a spherical joint, <weld> a fixed one, and <joint>
a coupling.

What MuJoCo's compiler keeps of them (MjModel.eq_data; checked against its residuals): a connect has
its point in body 1 and in body 2; a weld has a point in body 2, the same point in body 1, and the
rotation of body 2 against body 1. Between sites it has none of that: the sites are to meet.
A joint has q1 = c0 + c1 q2 + ..., both counted from the pose that is drawn, as they are here.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from linkwise.base import Array
from linkwise.io.complaint import shorten

Equality = Literal["exact", "ignore"]


@dataclass
class Closure:
    """What ModelBuilder.add_loop takes; places are in the bodies' MJCF frames."""

    name: str
    type: str
    bodies: tuple[int, int]
    translation: Array
    rotation: Array
    child_translation: Array
    child_rotation: Array


class Equalities:
    """The equality constraints of a compiled file."""

    def __init__(self, mj_model: Any, rotation: Any, joints: list[str]) -> None:
        """rotation: matrix of a quaternion; joints: their names."""
        self.closures: list[Closure] = []
        self.couplings: list[tuple[str, dict[str, list[float]], float]] = []
        taken = set(joints)
        self._model, self._rotation = mj_model, rotation
        self._left_out: dict[str, int] = {}
        for index in range(mj_model.neq):
            reason = self._reason(index)
            if reason:
                self._left_out[reason] = self._left_out.get(reason, 0) + 1
                continue
            name = mj_model.eq(index).name or f"equality{index}"
            while name in taken:
                name += "_"
            taken.add(name)
            if self._is(index, "JOINT"):
                self.couplings.append((name, *self._coupling(index, joints)))
            else:
                self.closures.append(self._closure(index, name))

    def notes(self) -> Iterator[tuple[str, str, str]]:
        for reason, count in self._left_out.items():
            yield "warning", "equality", f"{count} equality constraints ignored: {reason}"
        for closure in self.closures:
            kind = "connect" if closure.type == "spherical" else "weld"
            text = f"<{kind}> is made exact: a {closure.type} joint without give"
            yield "warning", shorten(closure.name), text
        for name, *_ in self.couplings:
            yield "warning", shorten(name), "<joint> is made exact: a coupling without give"

    def _is(self, index: int, kind: str) -> bool:
        import mujoco

        return bool(self._model.eq_type[index] == int(getattr(mujoco.mjtEq, f"mjEQ_{kind}")))

    def _coupled(self, index: int) -> list[int]:
        """The one or two joints of a joint constraint."""
        ends = (int(self._model.eq_obj1id[index]), int(self._model.eq_obj2id[index]))
        return [joint for joint in ends if joint >= 0]

    def _coupling(self, index: int, joints: list[str]) -> tuple[dict[str, list[float]], float]:
        """Factors by joint, of its powers, and offset: y = a0 + a1 x + ... of the two joints."""
        data = [float(x) for x in self._model.eq_data[index][:5]]
        factors = [[1.0], [-x for x in data[1:]]]
        coupled = zip(self._coupled(index), factors, strict=False)
        return {joints[k]: powers for k, powers in coupled if any(powers)}, data[0]

    def _bodies(self, index: int) -> tuple[int, int]:
        ends = (int(self._model.eq_obj1id[index]), int(self._model.eq_obj2id[index]))
        if self._between_sites(index):
            return (int(self._model.site_bodyid[ends[0]]), int(self._model.site_bodyid[ends[1]]))
        return (ends[0], max(ends[1], 0))

    def _between_sites(self, index: int) -> bool:
        import mujoco

        return bool(self._model.eq_objtype[index] == int(mujoco.mjtObj.mjOBJ_SITE))

    def _reason(self, index: int) -> str:
        """Why a constraint is left out, or ""."""
        import mujoco

        if not any(self._is(index, kind) for kind in ("CONNECT", "WELD", "JOINT")):
            return "they couple tendons or flexes"
        if self._model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_EQUALITY):
            return "the file switches them off"
        if not self._model.eq_active0[index]:
            return "not active"
        if self._is(index, "JOINT"):
            return self._reason_of_coupling(index)
        first, second = self._bodies(index)
        if (self._model.body_mocapid[[first, second]] >= 0).any():
            return "they hold a mocap body, which a program moves"
        if self._model.body_weldid[first] == self._model.body_weldid[second]:
            return "both of their bodies are one"
        return ""

    def _reason_of_coupling(self, index: int) -> str:
        import mujoco

        ends = self._coupled(index)
        one_axis = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
        if any(self._model.jnt_type[joint] not in one_axis for joint in ends):
            return "they couple joints of several degrees of freedom"
        return ""

    def _closure(self, index: int, name: str) -> Closure:
        model, none = self._model, np.eye(3)
        bodies = self._bodies(index)
        kind = "spherical" if self._is(index, "CONNECT") else "fixed"
        if self._between_sites(index):
            places = [
                (np.array(model.site_pos[site]), self._rotation(model.site_quat[site]))
                for site in (model.eq_obj1id[index], model.eq_obj2id[index])
            ]
            return Closure(name, kind, bodies, *places[0], *places[1])
        data = np.array(model.eq_data[index])
        if kind == "spherical":
            return Closure(name, kind, bodies, data[:3], none, data[3:6], none)
        turned = self._rotation(data[6:10] / np.linalg.norm(data[6:10]))
        return Closure(name, kind, bodies, data[3:6], turned, data[:3], none)
