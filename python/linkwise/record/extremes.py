"""Extremes between the samples: variables of a run without time, from the core's flat numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise._core import peak_state_size
from linkwise.base import COMPONENTS, DERIVED, HALVES, AnyArray, Array
from linkwise.record.labels import text_array
from linkwise.record.variable import Variable

if TYPE_CHECKING:
    from linkwise._core import Model

PREFIX = "extreme_"
#: Of every value: the extreme, when, and what it may have been between two looks.
ROWS = (
    *("minimum", "minimum_time", "minimum_reach"),
    *("maximum", "maximum_time", "maximum_reach"),
)
BOUNDS = ("minimum", "maximum")
PEAKS = tuple(name for name, _, _ in HALVES)


@dataclass(frozen=True)
class Part:
    """One variable, where its numbers stand in a row of the core, and its shape there."""

    variable: Variable
    first: int
    shape: tuple[int, ...]


def _flat_size(model: Model) -> int:
    """Numbers per row: derived quantities and components of loads, coordinates, rates."""
    return (len(DERIVED) + len(COMPONENTS)) * _loaded(model) + model.nq + 3 * model.nv


def _loaded(model: Model) -> int:
    """Joints that carry loads: those of the tree, then those that close loops."""
    return model.n_joints + model.n_loops


def _places(model: Model) -> dict[str, int]:
    load = len(DERIVED) * _loaded(model)
    position = load + len(COMPONENTS) * _loaded(model)
    first = position + model.nq
    names = ("velocity", "acceleration", "drive_torque")
    rates = {name: first + k * model.nv for k, name in enumerate(names)}
    return {"quantity": 0, "joint_load": load, "position": position, **rates}


@dataclass(frozen=True)
class ExtremesLayout:
    """What a run holds of the extremes, and how it is cut from what the core returns."""

    parts: tuple[Part, ...]
    wrench: Variable
    state: Variable | None
    width: int
    joints: int

    @property
    def variables(self) -> tuple[Variable, ...]:
        state = () if self.state is None else (self.state,)
        return (*(part.variable for part in self.parts), self.wrench, *state)

    def split(self, flat: Array) -> dict[str, AnyArray]:
        """Arrays by name, of (..., size) numbers of the core."""
        lead = flat.shape[:-1]
        rows = flat[..., : len(ROWS) * self.width].reshape(*lead, len(ROWS), self.width)
        found = {}
        for part in self.parts:
            count = int(np.prod(part.shape, dtype=np.int64))
            values = rows[..., part.first : part.first + count]
            values = values.reshape(*lead, len(ROWS), *part.shape)
            found[part.variable.name] = _taken(values, part.variable)
        rest = flat[..., len(ROWS) * self.width :]
        shape = (len(BOUNDS), len(DERIVED), self.joints, len(COMPONENTS))
        count = int(np.prod(shape, dtype=np.int64))
        wrench = rest[..., :count].reshape(*lead, *shape)
        found[self.wrench.name] = _taken(wrench, self.wrench)
        if self.state is not None:
            states = rest[..., count:].reshape(*lead, *self.state.shape)
            found[self.state.name] = np.ascontiguousarray(states)
        return found

    def empty(self) -> dict[str, AnyArray]:
        """Where nothing was found."""
        return {v.name: np.full(v.shape, np.nan) for v in self.variables}


def _taken(values: AnyArray, variable: Variable) -> AnyArray:
    """The recorded columns."""
    if variable.take is None:
        return np.ascontiguousarray(values)
    (dim,) = {"joint", "coordinate", "dof"} & set(variable.dims)
    axis = variable.dims.index(dim) - len(variable.dims)
    return np.ascontiguousarray(np.take(values, variable.take, axis=axis))


def extremes_layout(model: Model, variables: Sequence[Variable]) -> ExtremesLayout | None:
    """The layout for a run of these variables; None where no joint loads are recorded."""
    recorded = {variable.name: variable for variable in variables}
    if "joint_load" not in recorded:
        return None
    load = recorded["joint_load"]
    joints, places = load.shape[0], _places(model)
    units = {"units": "of the quantity; times in s"}

    def variable(name: str, dims: Sequence[str], shape: Sequence[int], like: Variable) -> Variable:
        kept = {k: v for k, v in like.attrs.items() if k != "units"}
        about = f"extremes of {name.replace('_', ' ')} over all steps"
        attrs = {**kept, "long_name": about, **units}
        return replace(like, name=PREFIX + name, dims=tuple(dims), shape=tuple(shape), attrs=attrs)

    n, whole = len(ROWS), _loaded(model)
    of_quantities = variable(
        "quantity", ("extreme", "quantity", "joint"), (n, len(DERIVED), joints), load
    )
    of_loads = variable("joint_load", ("extreme", *load.dims), (n, *load.shape), load)
    parts = [
        Part(of_quantities, places["quantity"], (len(DERIVED), whole)),
        Part(of_loads, places["joint_load"], (whole, len(COMPONENTS))),
    ]
    for name in ("position", "velocity", "acceleration", "drive_torque"):
        if name in recorded:
            like = recorded[name]
            made = variable(name, ("extreme", *like.dims), (n, *like.shape), like)
            count = model.nq if name == "position" else model.nv
            parts.append(Part(made, places[name], (count,)))
    wrench = variable(
        "wrench",
        ("bound", "quantity", "joint", "component"),
        (len(BOUNDS), len(DERIVED), joints, len(COMPONENTS)),
        load,
    )
    wrench = replace(wrench, attrs={**load.attrs, "long_name": "joint load at the extreme"})
    state = _state_variable(model, load) if set(_STATE) <= set(recorded) else None
    return ExtremesLayout(tuple(parts), wrench, state, _flat_size(model), whole)


_STATE = ("position", "velocity", "acceleration", "drive_torque")


def _state_variable(model: Model, load: Variable) -> Variable | None:
    """What the loads at the peaks are made of; of runs of all joints, unless these are many."""
    size = peak_state_size(model)
    if load.take is not None or size == 0:
        return None
    names = ", ".join(f"{name}s" for name in _STATE).replace("_", " ")
    about = {
        "long_name": "state of the machine when this load was largest",
        "convention": f"{names} of all joints, one after the other, in the model's order",
        "units": "SI",
    }
    dims, shape = ("peak", "joint", "state"), (len(PEAKS), load.shape[0], size)
    return Variable(f"{PREFIX}state", dims, shape, np.dtype(np.float64), about)


def labels(layout: ExtremesLayout) -> Mapping[str, Any]:
    """Labels of the dimensions that extremes add."""
    found = {
        "extreme": text_array(ROWS),
        "bound": text_array(BOUNDS),
        "quantity": text_array(DERIVED),
    }
    return found | ({"peak": text_array(PEAKS)} if layout.state is not None else {})
