"""Equality constraints of an MJCF that are joints: <connect> a spherical, <weld> a fixed one.

What MuJoCo's compiler keeps of them (MjModel.eq_data; checked against its residuals): a connect has
its point in body 1 and in body 2; a weld has a point in body 2, the same point in body 1, and the
rotation of body 2 against body 1. Between sites it has none of that: the sites are to meet.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from linkwise.base import Array
from linkwise.io.complaint import shorten

Equality = Literal["ignore", "exact"]


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

    def __init__(self, mj_model: Any, rotation: Any, taken: set[str]) -> None:
        """rotation: matrix of a quaternion; taken: names of joints."""
        self.closures: list[Closure] = []
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
            self.closures.append(self._closure(index, name))

    def notes(self) -> Iterator[tuple[str, str, str]]:
        for reason, count in self._left_out.items():
            yield "warning", "equality", f"{count} equality constraints ignored: {reason}"
        for closure in self.closures:
            kind = "connect" if closure.type == "spherical" else "weld"
            text = f"<{kind}> is made exact: a {closure.type} joint without give"
            yield "info", shorten(closure.name), text

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

        kinds = (int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD))
        if self._model.eq_type[index] not in kinds:
            return "they couple joints, tendons or flexes"
        if self._model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_EQUALITY):
            return "the file switches them off"
        if not self._model.eq_active0[index]:
            return "not active"
        first, second = self._bodies(index)
        if (self._model.body_mocapid[[first, second]] >= 0).any():
            return "they hold a mocap body, which a program moves"
        if self._model.body_weldid[first] == self._model.body_weldid[second]:
            return "both of their bodies are one"
        return ""

    def _closure(self, index: int, name: str) -> Closure:
        import mujoco

        model, none = self._model, np.eye(3)
        bodies = self._bodies(index)
        connect = model.eq_type[index] == int(mujoco.mjtEq.mjEQ_CONNECT)
        kind = "spherical" if connect else "fixed"
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
