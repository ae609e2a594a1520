"""Sliders that pose a model."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.base import Array
from linkwise.record.labels import joint_scalars

if TYPE_CHECKING:
    from collections.abc import Callable

    import viser

    from linkwise._core import Model
    from linkwise.view.panel import Requests

MOST_SLIDERS = 60


class JointSliders:
    """One slider per coordinate, between its limits; of long models those of the first joints.

    The four coordinates of a quaternion are set by three angles, about x, then y, then z.
    start: (nq,) [rad, m]; moved: the joint that a person moved last, None before that.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        model: Model,
        size: float,
        requests: Requests,
        start: Array,
    ) -> None:
        self._model = model
        self.q = start.copy()
        self._sliders: list[Any] = []
        self._reads: list[Callable[[], float]] = []
        self.moved: str | None = None
        joints = self._shown_joints()
        with server.gui.add_folder("Joints"):
            server.gui.add_button("Zero").on_click(lambda event: self._reset(requests))
            for joint in joints:
                self._add_joint(server, joint, size, requests)
            self._start = self.q.copy()
            if len(joints) < model.n_joints:
                server.gui.add_markdown(f"{model.n_joints - len(joints)} more joints stay at zero.")

    def _shown_joints(self) -> list[int]:
        total, shown = 0, []
        for joint, count in enumerate(self._model.joint_nv):
            total += count
            if total > MOST_SLIDERS:
                break
            shown.append(joint)
        return shown

    def _add_joint(
        self, server: viser.ViserServer, joint: int, size: float, requests: Requests
    ) -> None:
        """Rows of one joint: label, first coordinate, limits, and how it is set."""
        model = self._model
        scalars = joint_scalars(model, [joint])[0]
        first = sum(model.joint_nq[:joint])
        turning = [k for k, label in enumerate(scalars.labels) if _in_quaternion(label, scalars)]
        dof = sum(model.joint_nv[:joint])
        plain = [k for k in range(len(scalars.labels)) if k not in turning]
        for k in plain:
            reach = size if str(scalars.units[k]) == "m" else math.pi
            start = self.q[first + k]
            low, high = _limits(model, dof + k if not turning else -1, start, reach)
            label, at = f"{scalars.labels[k]} [{scalars.units[k]}]", first + k

            def move(value: float, at: int = at) -> None:
                self.q[at] = value

            def read(at: int = at) -> float:
                return float(self.q[at])

            self._add(server, joint, label, low, high, requests, move, read, start)
        if turning:
            name = model.joint_names[joint]
            where = slice(first + turning[0], first + turning[0] + 4)
            angles = angles_of(self.q[where])
            for axis in range(3):

                def turn(value: float, axis: int = axis) -> None:
                    angles[axis] = value
                    self.q[where] = quaternion_of(angles)

                def read_angle(axis: int = axis) -> float:
                    angles[axis] = angles_of(self.q[where])[axis]
                    return float(angles[axis])

                label = f"{name}.{'xyz'[axis]} [rad]"
                start = angles[axis]
                ends = (-math.pi, math.pi)
                self._add(server, joint, label, *ends, requests, turn, read_angle, start)

    def _add(
        self,
        server: Any,
        joint: int,
        label: str,
        low: float,
        high: float,
        requests: Requests,
        act: Any,
        read: Callable[[], float],
        start: Any,
    ) -> None:
        value = float(np.clip(start, low, high))
        act(value)
        slider = server.gui.add_slider(
            label, min=low, max=high, step=(high - low) / 1000, initial_value=value
        )

        def move(event: Any) -> None:
            if event.client is None:  # by `follow` or `_reset`
                return
            act(slider.value)
            self.moved = self._model.joint_names[joint]
            requests.redraw = True

        slider.on_update(move)
        self._sliders.append(slider)
        self._reads.append(read)

    def follow(self, q: Array) -> None:
        """Show this position, where closing the loops moved other joints than the one in hand."""
        if np.array_equal(q, self.q):
            return
        self.q[:] = q
        for slider, read in zip(self._sliders, self._reads, strict=True):
            slider.value = float(np.clip(read(), slider.min, slider.max))

    def _reset(self, requests: Requests) -> None:
        self.moved = None
        self.follow(self._start)
        requests.redraw = True


def _in_quaternion(label: Any, scalars: Any) -> bool:
    return str(label).rpartition(".")[2] in ("qx", "qy", "qz", "qw") and len(scalars.labels) >= 4


def _limits(model: Model, dof: int, start: float, reach: float) -> tuple[float, float]:
    """The joint's own limits where both are finite and apart, else a reach around the start."""
    if dof >= 0:
        low, high = float(model.lower_limit[dof]), float(model.upper_limit[dof])
        if math.isfinite(low) and math.isfinite(high) and high > low:
            return low, high
    return start - reach, start + reach


def angles_of(quaternion: Array) -> Array:
    """The turns about x, then y, then z, that :func:`quaternion_of` makes this quaternion of."""
    x, y, z, w = quaternion
    return np.array(
        [
            math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
            math.asin(min(1.0, max(-1.0, 2 * (w * y - z * x)))),
            math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
        ]
    )


def quaternion_of(angles: Array) -> Array:
    """x, y, z, w of turns about x, then y, then z, each about fixed axes."""
    (sx, sy, sz), (cx, cy, cz) = np.sin(angles / 2), np.cos(angles / 2)
    return np.array(
        [
            sx * cy * cz - cx * sy * sz,
            cx * sy * cz + sx * cy * sz,
            cx * cy * sz - sx * sy * cz,
            cx * cy * cz + sx * sy * sz,
        ]
    )
