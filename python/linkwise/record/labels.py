"""Names and units of joint coordinates and joint velocities, as results are labelled with.

A joint with one degree of freedom lends its own name; a joint with more adds a suffix per
coordinate, so that a floating base `base` has the positions `base.x` ... `base.qw` and the
velocities `base.vx` ... `base.wz`. Suffixes, units and their order are the core's.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from linkwise._core import Model


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


def _rows(joint: str, first: int, labels: Sequence[tuple[str, str]]) -> list[tuple[str, str, int]]:
    return [
        (f"{joint}.{suffix}" if suffix else joint, unit, first + k)
        for k, (suffix, unit) in enumerate(labels)
    ]


def _starts(counts: Sequence[int]) -> list[int]:
    return [0, *itertools.accumulate(counts)]


def _collect(rows: list[tuple[str, str, int]]) -> Scalars:
    labels, units, index = zip(*rows, strict=True) if rows else ((), (), ())
    return Scalars(text_array(labels), text_array(units), np.array(index, dtype=np.intp))


def loop_scalars(model: Model, loops: Sequence[int]) -> tuple[Scalars, Scalars]:
    """Coordinates and velocities of joints that close loops, given by index, in that order; rods
    and fixed ones have none."""
    names, slices = model.loop_names, model.loop_slices
    positions: list[tuple[str, str, int]] = []
    velocities: list[tuple[str, str, int]] = []
    for loop in loops:
        name, (q, v) = names[loop], slices[loop]
        coordinates, rates = model.loop_labels(loop)
        positions += _rows(name, q.start, coordinates[: q.stop - q.start])
        velocities += _rows(name, v.start, rates[: v.stop - v.start])
    return _collect(positions), _collect(velocities)


def joint_scalars(model: Model, joints: Sequence[int]) -> tuple[Scalars, Scalars]:
    """Coordinates and velocities of the joints given by index, in that order."""
    names = model.joint_names
    q_first, v_first = _starts(model.joint_nq), _starts(model.joint_nv)
    positions: list[tuple[str, str, int]] = []
    velocities: list[tuple[str, str, int]] = []
    for joint in joints:
        coordinates, rates = model.joint_labels(joint)
        positions += _rows(names[joint], q_first[joint], coordinates)
        velocities += _rows(names[joint], v_first[joint], rates)
    return _collect(positions), _collect(velocities)
