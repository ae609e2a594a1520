"""Names and units of joint coordinates and joint velocities, as results are labelled with.

A joint with one degree of freedom lends its own name; a joint with more adds a suffix
per coordinate, so that a floating base `base` has the positions `base.x` ... `base.qw` and the
velocities `base.vx` ... `base.wz`. The order is the one of the compiled core.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from linkwise._core import Model

_ANGLE, _LENGTH, _RATIO = "rad", "m", "1"


class _Scalar(NamedTuple):
    suffix: str
    unit: str


def _scalars(*pairs: tuple[str, str]) -> tuple[_Scalar, ...]:
    return tuple(_Scalar(suffix, unit) for suffix, unit in pairs)


_QUATERNION = _scalars(("qx", _RATIO), ("qy", _RATIO), ("qz", _RATIO), ("qw", _RATIO))
_TURNING = _scalars(("wx", _ANGLE), ("wy", _ANGLE), ("wz", _ANGLE))

# Per joint type: its coordinates, and its velocities with the unit of their integral.
_ONE_ANGLE = _scalars(("", _ANGLE))
_ONE_LENGTH = _scalars(("", _LENGTH))
_SCALARS: dict[str, tuple[tuple[_Scalar, ...], tuple[_Scalar, ...]]] = {
    "fixed": ((), ()),
    "revolute": (_ONE_ANGLE, _ONE_ANGLE),
    "continuous": (_ONE_ANGLE, _ONE_ANGLE),
    "helical": (_ONE_ANGLE, _ONE_ANGLE),
    "prismatic": (_ONE_LENGTH, _ONE_LENGTH),
    "cylindrical": (
        _scalars(("translation", _LENGTH), ("angle", _ANGLE)),
        _scalars(("v", _LENGTH), ("w", _ANGLE)),
    ),
    "universal": (
        _scalars(("angle1", _ANGLE), ("angle2", _ANGLE)),
        _scalars(("w1", _ANGLE), ("w2", _ANGLE)),
    ),
    "spherical": (_QUATERNION, _TURNING),
    "planar": (
        _scalars(("x", _LENGTH), ("y", _LENGTH), ("angle", _ANGLE)),
        _scalars(("vx", _LENGTH), ("vy", _LENGTH), ("wz", _ANGLE)),
    ),
    "floating": (
        _scalars(("x", _LENGTH), ("y", _LENGTH), ("z", _LENGTH)) + _QUATERNION,
        _scalars(("vx", _LENGTH), ("vy", _LENGTH), ("vz", _LENGTH)) + _TURNING,
    ),
}


@dataclass(frozen=True)
class Scalars:
    """One row per scalar: its label, its unit and its index in the model's q or v."""

    labels: npt.NDArray[np.str_]
    units: npt.NDArray[np.str_]
    index: npt.NDArray[np.intp]


def text_array(texts: Iterable[str]) -> npt.NDArray[np.str_]:
    """Fixed-width text: NumPy object arrays cost a Python object per element."""
    listed = list(texts)
    return np.array(listed, dtype=np.str_) if listed else np.zeros(0, dtype="<U1")


def _axis_scalars(axes: Sequence[tuple[str, object]]) -> tuple[_Scalar, ...]:
    """Of a composite joint: its axes counted from 1."""
    units = [_LENGTH if kind == "prismatic" else _ANGLE for kind, _ in axes]
    if len(units) == 1:
        return (_Scalar("", units[0]),)
    return tuple(_Scalar(str(k + 1), unit) for k, unit in enumerate(units))


def _rows(joint: str, first: int, scalars: Sequence[_Scalar]) -> list[tuple[str, str, int]]:
    return [
        (f"{joint}.{scalar.suffix}" if scalar.suffix else joint, scalar.unit, first + k)
        for k, scalar in enumerate(scalars)
    ]


def _starts(counts: Sequence[int]) -> list[int]:
    return [0, *itertools.accumulate(counts)]


def _collect(rows: list[tuple[str, str, int]]) -> Scalars:
    labels, units, index = zip(*rows, strict=True) if rows else ((), (), ())
    return Scalars(text_array(labels), text_array(units), np.array(index, dtype=np.intp))


def joint_scalars(model: Model, joints: Sequence[int]) -> tuple[Scalars, Scalars]:
    """Coordinates and velocities of the joints given by index, in that order."""
    names, types = model.joint_names, model.joint_types
    axes = model.joint_axes if "composite" in types else []
    q_first, v_first = _starts(model.joint_nq), _starts(model.joint_nv)
    positions: list[tuple[str, str, int]] = []
    velocities: list[tuple[str, str, int]] = []
    for joint in joints:
        name = names[joint]
        if types[joint] == "composite":
            q_scalars = v_scalars = _axis_scalars(axes[joint])
        else:
            q_scalars, v_scalars = _SCALARS[types[joint]]
        positions += _rows(name, q_first[joint], q_scalars)
        velocities += _rows(name, v_first[joint], v_scalars)
    return _collect(positions), _collect(velocities)
