"""What a run holds: its variables, dimensions, labels, units, frames and sign conventions.

One description serves the results kept in memory, those in a Zarr store and those exported.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from linkwise._core import InputError
from linkwise.base import COMPONENTS, AnyArray
from linkwise.record.labels import Scalars, joint_scalars, text_array

if TYPE_CHECKING:
    from linkwise._core import Model

QUANTITIES = (
    "position",
    "velocity",
    "acceleration",
    "joint_load",
    "drive_torque",
    "external_wrench",
    "energy",
    "statistics",
)

_LOAD_ATTRS = {
    "long_name": "joint load",
    "units": "N, N m",
    "frame": "joint frame, fixed in the outboard body",
    "point": "joint point: the origin of the joint frame",
    "convention": "wrench that the inboard body exerts on the outboard body through the joint",
}
_WRENCH_ATTRS = {
    "long_name": "external wrench",
    "units": "N (fx, fy, fz), N m (nx, ny, nz)",
    "frame": "joint frame, fixed in the body",
    "point": "origin of the joint frame",
    "convention": "wrench that acts on the body from outside, by the wrenches of the simulation",
}
_SCALAR_ATTRS: dict[str, dict[str, str]] = {
    "position": {
        "long_name": "joint position",
        "convention": "zero as in the model file; angles are not wrapped; "
        "quaternions are x, y, z, w and take components in the joint frame to the inboard body's",
    },
    "velocity": {
        "long_name": "joint velocity",
        "frame": "of the outboard body relative to the inboard body; joints with more than one "
        "degree of freedom: in the joint frame, linear components first",
    },
    "acceleration": {
        "long_name": "joint acceleration",
        "convention": "time derivative of velocity, component by component",
    },
    "drive_torque": {
        "long_name": "drive torque or force",
        "convention": "power into the mechanism is drive_torque * velocity",
    },
}
_RATE_SUFFIX = {"velocity": "/s", "acceleration": "/s^2"}
_ENERGY_ATTRS = {
    "kinetic_energy": {"long_name": "kinetic energy", "units": "J"},
    "potential_energy": {
        "long_name": "potential energy of gravity and springs",
        "units": "J",
    },
}
_COUNTS = {
    "steps": "accepted integration steps since the start",
    "evaluations": "evaluations of the equations of motion since the start",
    "iterations": "iterations of the linear solver since the start",
}


@dataclass(frozen=True)
class Variable:
    """One recorded array; `take` picks its columns from what the core returns."""

    name: str
    dims: tuple[str, ...]
    shape: tuple[int, ...]  # without time
    dtype: np.dtype[Any]
    attrs: Mapping[str, str]
    take: npt.NDArray[np.intp] | None = None

    @property
    def row_bytes(self) -> int:
        return int(np.prod(self.shape, dtype=np.int64)) * self.dtype.itemsize

    def rows(self, chunk: Mapping[str, Any], count: int) -> AnyArray:
        """This variable's rows of one chunk returned by `Simulation.advance`."""
        values = np.asarray(chunk[self.name])
        if values.ndim == 0:  # a counter that the core reports once per chunk
            values = np.full(count, values)
        if self.take is not None:
            values = values[:, self.take]
        return np.ascontiguousarray(values, dtype=self.dtype).reshape((count, *self.shape))


@dataclass(frozen=True)
class Coordinate:
    dims: tuple[str, ...]
    values: AnyArray
    attrs: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Schema:
    variables: tuple[Variable, ...]
    coordinates: Mapping[str, Coordinate]
    quantities: tuple[str, ...]

    @property
    def row_bytes(self) -> int:
        return 8 + sum(variable.row_bytes for variable in self.variables)


# The order in which a dataset lists its variables.
ORDER = (
    *_SCALAR_ATTRS,
    "joint_load",
    "external_wrench",
    *_ENERGY_ATTRS,
    *_COUNTS,
    "step_size",
    "order",
)
TIME_ATTRS = {"long_name": "time", "units": "s"}


def resolve_quantities(quantities: Collection[str] | None) -> tuple[str, ...]:
    """The quantities to record, in canonical order; None means all."""
    if quantities is None:
        return QUANTITIES
    if isinstance(quantities, str):
        quantities = [quantities]
    for name in quantities:
        if name not in QUANTITIES:
            raise InputError(f"quantities: unknown quantity {name!r}; use {', '.join(QUANTITIES)}")
    return tuple(name for name in QUANTITIES if name in quantities)


def resolve_joints(model: Model, joints: Sequence[str] | None) -> list[int]:
    """Indices of the joints to record, in the model's order; None means all."""
    if joints is None:
        return list(range(model.n_joints))
    if isinstance(joints, str):
        joints = [joints]
    return sorted({model.joint_index(name) for name in joints})


def _scalar_variable(
    name: str, dim: str, scalars: Scalars, whole: int, coordinates: dict[str, Coordinate]
) -> Variable:
    """A variable with one column per joint coordinate or velocity, and its units."""
    attrs = dict(_SCALAR_ATTRS[name])
    if name == "drive_torque":
        units = text_array(
            {"rad": "N m", "m": "N"}.get(u, "N m or N") for u in scalars.units.tolist()
        )
    else:
        suffix = _RATE_SUFFIX.get(name, "")
        units = text_array(u + suffix for u in scalars.units.tolist())
    distinct = np.unique(units)
    if distinct.size == 1:
        attrs["units"] = str(distinct[0])
    elif distinct.size > 1:
        attrs["units"] = f"mixed, see {name}_units"
        coordinates[f"{name}_units"] = Coordinate((dim,), units)
    everything = np.array_equal(scalars.index, np.arange(whole))
    take = None if everything else scalars.index
    shape = (int(scalars.index.size),)
    return Variable(name, (dim,), shape, np.dtype(np.float64), attrs, take)


def _statistics() -> list[Variable]:
    count, real = np.dtype(np.int64), np.dtype(np.float64)
    counters = [
        Variable(name, (), (), count, {"long_name": text, "units": "1"})
        for name, text in _COUNTS.items()
    ]
    step_size = {"long_name": "size of the last integration step", "units": "s"}
    order = {"long_name": "order of the integration method in the last step", "units": "1"}
    return [
        *counters,
        Variable("step_size", (), (), real, step_size),
        Variable("order", (), (), count, order),
    ]


def _joint_variables(
    model: Model, kept: Sequence[str], selected: Sequence[int]
) -> tuple[list[Variable], dict[str, Coordinate]]:
    """What is recorded per joint, coordinate or degree of freedom, with its labels."""
    positions, velocities = joint_scalars(model, selected)
    joint_names, body_names = model.joint_names, model.body_names  # lists made on every access
    names = text_array(joint_names[k] for k in selected)
    one_each = np.array_equal(positions.labels, names) and np.array_equal(velocities.labels, names)
    q_dim, v_dim = ("joint", "joint") if one_each else ("coordinate", "dof")

    coordinates: dict[str, Coordinate] = {}
    variables: list[Variable] = []
    for name in ("position", "velocity", "acceleration", "drive_torque"):
        if name in kept:
            on_q = name == "position"
            scalars, dim = (positions, q_dim) if on_q else (velocities, v_dim)
            whole = model.nq if on_q else model.nv
            variables.append(_scalar_variable(name, dim, scalars, whole, coordinates))
            coordinates[dim] = Coordinate((dim,), scalars.labels)
    if "joint_load" in kept:
        take = None if len(selected) == model.n_joints else np.array(selected, dtype=np.intp)
        shape = (len(selected), len(COMPONENTS))
        real = np.dtype(np.float64)
        variables.append(
            Variable("joint_load", ("joint", "component"), shape, real, _LOAD_ATTRS, take)
        )
        coordinates["joint"] = Coordinate(("joint",), names)
        coordinates["component"] = Coordinate(("component",), text_array(COMPONENTS))
        coordinates["joint_load_units"] = Coordinate(
            ("component",), text_array(["N"] * 3 + ["N m"] * 3)
        )
    if "joint" in coordinates:
        bodies = text_array(body_names[k] for k in selected)
        about = {"long_name": "outboard body of the joint"}
        coordinates["body"] = Coordinate(("joint",), bodies, about)
    return variables, coordinates


def _wrench_variable(
    model: Model, wrenched: Collection[str], coordinates: dict[str, Coordinate]
) -> Variable:
    """The wrenches on the bodies that have any; the others would be columns of zeros."""
    names = model.body_names
    bodies = [k for k in range(model.n_joints) if names[k] in wrenched]
    coordinates["wrenched_body"] = Coordinate(
        ("wrenched_body",), text_array(names[k] for k in bodies)
    )
    coordinates["component"] = Coordinate(("component",), text_array(COMPONENTS))
    take = np.array(bodies, dtype=np.intp)
    shape, real = (len(bodies), len(COMPONENTS)), np.dtype(np.float64)
    return Variable(
        "external_wrench", ("wrenched_body", "component"), shape, real, _WRENCH_ATTRS, take
    )


def build_schema(
    model: Model,
    quantities: Collection[str] | None = None,
    joints: Sequence[str] | None = None,
    wrenched: Collection[str] = (),
) -> Schema:
    """Describe a run of `model` that keeps these quantities of these joints.

    `wrenched` names the bodies with an external wrench, which is recorded for them alone.
    """
    kept = resolve_quantities(quantities)
    if not wrenched:
        kept = tuple(name for name in kept if name != "external_wrench")
    selected = resolve_joints(model, joints)
    variables: list[Variable] = []
    coordinates: dict[str, Coordinate] = {}
    if not set(kept) <= {
        "energy",
        "statistics",
        "external_wrench",
    }:  # labels of a million joints take seconds
        variables, coordinates = _joint_variables(model, kept, selected)
    if "external_wrench" in kept:
        variables.append(_wrench_variable(model, wrenched, coordinates))
    if "energy" in kept:
        real = np.dtype(np.float64)
        variables += [Variable(name, (), (), real, attrs) for name, attrs in _ENERGY_ATTRS.items()]
    if "statistics" in kept:
        variables += _statistics()
    return Schema(tuple(variables), coordinates, kept)
