"""Positions and rates of machines with closed loops that keep these loops closed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from linkwise import _core
from linkwise._core import InputError
from linkwise.base import Array
from linkwise.io.complaint import shown
from linkwise.notes import Ignored
from linkwise.simulation.arguments import check_mapping, state_vector

if TYPE_CHECKING:
    from linkwise._core import Model


#: As of what the start of a run tells [rad, m].
_WORTH_TELLING = 1e-9


class Assembly(NamedTuple):
    """A state whose loops are closed: coordinates `q`, rates `v`, how far the loops were open
    before (`gap`, relative to their length), and the held joints that had to move (`released`)."""

    q: Array
    v: Array
    gap: float
    released: tuple[str, ...]


def held_joints(hold: Sequence[str]) -> list[str]:
    """Names of joints that assembly leaves where they are."""
    named = not isinstance(hold, str) and isinstance(hold, Sequence)
    if not named or not all(isinstance(name, str) for name in hold):
        raise InputError(f"hold: {shown(hold)} given; give a list of names of joints")
    return list(hold)


def assemble(
    model: Model,
    q0: npt.ArrayLike | None = None,
    v0: npt.ArrayLike | None = None,
    *,
    hold: Sequence[str] = (),
    loop_position: Mapping[str, float] | None = None,
    loop_velocity: Mapping[str, float | Sequence[float]] | None = None,
) -> Assembly:
    """The position near `q0` that closes all loops, and rates near `v0` that keep them closed.

    Args:
        model: The mechanism.
        q0: Coordinates (nq,); the model's `initial_configuration()` by default.
        v0: Rates (nv,); zero by default.
        hold: Names of joints that are to stay where `q0` has them, with the rates of `v0`. Where
            loops do not close so, they are released, the last one first; see `released`.
        loop_position: By name where joints of one axis that close loops are to stand [rad, m], such
            as the length of a cylinder; the joints of the tree follow.
        loop_velocity: By name the rates that joints which close loops are to have [rad/s, m/s], one
            per degree of freedom, such as that of a cylinder. Joints of the tree follow; of those
            held each keeps its rate that can, the first one first.

    Positions change as little as they can in the metric of the mass matrix, step by step, and rates
    by the least kinetic energy that keeps loops closed at the rates of `loop_velocity`.

    Raises:
        InputError: no position was found; the message says which loop stays open by how much. Or
            the rates of held joints, or of loop joints, contradict each other.
    """
    q = state_vector("q0", q0, model.nq, model.initial_configuration())
    v = state_vector("v0", v0, model.nv, np.zeros(model.nv))
    held = held_joints(hold)
    check_mapping("loop_position", loop_position)
    rates = loop_rates(model, loop_velocity)
    if not loop_position:
        found = _core.assemble(model, q, v, held, rates)
        return Assembly(found["q"], found["v"], found["gap"], tuple(found["released"]))
    there = _core.assemble(_with_loops_at(model, loop_position), q, np.zeros(model.nv), held)
    still = [joint for joint in held if joint not in there["released"]]
    found = _core.assemble(model, there["q"], v, still, rates)
    return Assembly(found["q"], found["v"], there["gap"], tuple(there["released"]))


def loop_rates(
    model: Model, loop_velocity: Mapping[str, float | Sequence[float]] | None
) -> list[tuple[str, list[float]]]:
    """The rates of loop joints as the core takes them: names with finite numbers."""
    check_mapping("loop_velocity", loop_velocity)
    found = []
    for joint, rates in (loop_velocity or {}).items():
        if joint not in model.loop_names:
            raise InputError(
                f"loop_velocity: {shown(joint)} is no joint that closes a loop; "
                "rates of joints of the tree stand in v0"
            )
        numbers = np.atleast_1d(np.asarray(rates, dtype=float))
        if numbers.ndim != 1 or not np.isfinite(numbers).all():
            raise InputError(
                f"loop_velocity: {shown(rates)} of {joint!r}; give finite rates [rad/s, m/s]"
            )
        found.append((joint, numbers.tolist()))
    return found


def at_loop_positions(
    model: Model,
    start: tuple[Array, Array],
    hold: Sequence[str],
    loop_position: Mapping[str, float] | None,
) -> tuple[tuple[Array, Array], list[str], list[Ignored]]:
    """The start that has loop joints there, the joints that it can hold, and what moved."""
    held = held_joints(hold)
    if not loop_position:
        return start, held, []
    found = assemble(model, start[0], hold=held, loop_position=loop_position)
    way = found.q - start[0]
    ways = {name: way[model.q_slice(name)] for name in model.joint_names}
    moved = [
        f"{name!r} by {float(own[np.abs(own).argmax()]):.3g}"
        for name, own in ways.items()
        if np.abs(own).max(initial=0.0) > _WORTH_TELLING
    ]
    text = f"to start with {', '.join(loop_position)} as given, joints were moved: "
    text += ", ".join(moved)
    if found.released:
        text += f"; joints that were to be held had to move: {', '.join(found.released)}"
    still = [name for name in held if name not in found.released]
    return (found.q, start[1]), still, [Ignored("", "assembly", text)] if moved else []


def _with_loops_at(model: Model, positions: Mapping[str, float]) -> Model:
    """The machine with couplings that hold joints which close loops where they are to stand."""
    kinds = dict(zip(model.loop_names, model.loop_types, strict=True))
    freedoms = dict(zip(model.loop_names, model.loop_nv, strict=True))
    for joint, value in positions.items():
        if freedoms.get(joint) != 1 or kinds[joint] == "spring":
            raise InputError(
                f"loop_position: {shown(joint)} is no joint of one axis that closes a loop; "
                "positions of joints of the tree stand in q0"
            )
        name = joint
        while name in model.coupling_names:
            name += "_"
        at = float(value)
        if kinds[joint] == "revolute":  # whose angle is within half a turn of zero
            at = math.remainder(at, 2 * math.pi)
        model = model.with_coupling(name, {joint: 1.0}, offset=at)
    return model
