"""What a run holds: its variables, dimensions, labels, units, frames and sign conventions.

One description serves the results kept in memory, those in a Zarr store and those exported.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise._core import InputError
from linkwise._core import quantities as recorded_quantities
from linkwise.base import COMPONENTS, AnyArray
from linkwise.io.complaint import shown
from linkwise.record.extremes import ExtremesLayout, extremes_layout, labels
from linkwise.record.labels import Scalars, joint_scalars, loop_scalars, text_array
from linkwise.record.variable import Variable

if TYPE_CHECKING:
    from linkwise._core import Model

#: What the core records: name, group, axis, units and texts of every quantity.
TABLE = recorded_quantities()
QUANTITIES = tuple(dict.fromkeys(row["group"] for row in TABLE))


#: Axes of what is recorded of joints that close loops, and the names of their dimensions.
LOOP_AXES = {"loop_coordinates": "loop_coordinate", "loop_rates": "loop_dof"}


def _attrs(row: Mapping[str, Any]) -> dict[str, str]:
    """The texts of a quantity; the units of joint coordinates are found per joint."""
    keys = ("long_name", "units", "frame", "point", "convention")
    per_joint = row["axis"] in ("coordinates", "rates", "terms", *LOOP_AXES)
    return {key: row[key] for key in keys if row[key] and not (key == "units" and per_joint)}


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
    extremes: ExtremesLayout | None = None
    marks: tuple[Variable, ...] = ()

    @property
    def timeless(self) -> tuple[Variable, ...]:
        extremes = self.extremes.variables if self.extremes else ()
        return (*extremes, *self.marks)

    @property
    def extremes_bytes(self) -> int:
        return sum(variable.row_bytes for variable in self.timeless)

    @property
    def row_bytes(self) -> int:
        return 8 + sum(variable.row_bytes for variable in self.variables)


# The order in which a dataset lists its variables; extremes follow.
ORDER = tuple(row["name"] for row in TABLE)
#: Of runs of machines with loops: (joint, component); the second one where there are bearings.
DETERMINATE, BY_BEARINGS = "determinate", "by_bearings"
TIME_ATTRS = {"long_name": "time", "units": "s"}


def _is_list(value: object) -> bool:
    """An array without axes is a Collection that cannot be walked."""
    return isinstance(value, Collection) and not (isinstance(value, np.ndarray) and value.ndim == 0)


def resolve_quantities(quantities: Collection[str] | None) -> tuple[str, ...]:
    """The quantities to record, in canonical order; None means all."""
    if quantities is None:
        return QUANTITIES
    if isinstance(quantities, str):
        quantities = [quantities]
    if not _is_list(quantities):
        raise InputError(f"record: {shown(quantities)} given; give a list of quantities")
    for name in quantities:
        if not isinstance(name, str) or name not in QUANTITIES:
            known = ", ".join(QUANTITIES)
            raise InputError(f"record: unknown quantity {shown(name)}; use {known}")
    return tuple(name for name in QUANTITIES if name in quantities)


def resolve_joints(model: Model, joints: Sequence[str] | None) -> list[int]:
    """Indices of the joints to record, in the model's order, those that close loops behind the
    others; None means all."""
    if joints is None:
        return list(range(model.n_joints + model.n_loops))
    if isinstance(joints, str):
        joints = [joints]
    if not _is_list(joints) or not all(isinstance(name, str) for name in joints):
        raise InputError(f"joints: {shown(joints)} given; give a list of names of joints")
    return sorted({model.load_index(name) for name in joints})


def _dtype(row: Mapping[str, Any]) -> np.dtype[Any]:
    return np.dtype(np.int64 if row["is_count"] else np.float64)


def _scalar_variable(
    row: Mapping[str, Any],
    dim: str,
    scalars: Scalars,
    whole: int,
    coordinates: dict[str, Coordinate],
) -> Variable:
    """A variable with one column per joint coordinate or velocity, and its units."""
    name, attrs = row["name"], _attrs(row)
    if row["units"] == "force":
        units = text_array(
            {"rad": "N m", "m": "N"}.get(u, "N m or N") for u in scalars.units.tolist()
        )
    elif row["units"] == "energy":
        units = text_array("J" for _ in scalars.units)
    else:
        units = text_array(u + row["units"] for u in scalars.units.tolist())
    distinct = set(units.tolist())
    if len(distinct) == 1:
        attrs["units"] = distinct.pop()
    elif distinct:
        attrs["units"] = f"mixed, see {name}_units"
        coordinates[f"{name}_units"] = Coordinate((dim,), units)
    everything = np.array_equal(scalars.index, np.arange(whole))
    take = None if everything else scalars.index
    return Variable(name, (dim,), (int(scalars.index.size),), _dtype(row), attrs, take)


def _wrench_variable(row: Mapping[str, Any], dim: str, take: Sequence[int], all_: bool) -> Variable:
    """A variable with six components for each of the joints or bodies `take`."""
    kept = None if all_ else np.array(take, dtype=np.intp)
    shape = (len(take), len(COMPONENTS))
    return Variable(row["name"], (dim, "component"), shape, _dtype(row), _attrs(row), kept)


def _joint_variables(
    model: Model, rows: Sequence[Mapping[str, Any]], selected: Sequence[int]
) -> tuple[list[Variable], dict[str, Coordinate]]:
    """What is recorded per joint, coordinate or degree of freedom, with its labels."""
    of_tree = [k for k in selected if k < model.n_joints]
    positions, velocities = joint_scalars(model, of_tree)
    joint_names, children = model.joint_names, model.child_link_names  # lists made on every access
    names = text_array(joint_names[k] for k in of_tree)
    load_names = [*joint_names, *model.loop_names]
    one_each = (
        not model.n_loops
        and np.array_equal(positions.labels, names)
        and np.array_equal(velocities.labels, names)
    )
    q_dim, v_dim = ("joint", "joint") if one_each else ("coordinate", "dof")

    coordinates: dict[str, Coordinate] = {}
    variables: list[Variable] = []
    everything = len(selected) == len(load_names)
    for row in rows:
        if row["axis"] == "joints":
            variables.append(_wrench_variable(row, "joint", selected, everything))
            coordinates["joint"] = Coordinate(
                ("joint",), text_array(load_names[k] for k in selected)
            )
            coordinates["component"] = Coordinate(("component",), text_array(COMPONENTS))
            units = text_array(["N"] * 3 + ["N m"] * 3)
            coordinates[f"{row['name']}_units"] = Coordinate(("component",), units)
            continue
        on_q = row["axis"] == "coordinates"
        scalars, dim = (positions, q_dim) if on_q else (velocities, v_dim)
        whole = model.nq if on_q else model.nv
        if not of_tree:  # joints that close loops alone
            continue
        variables.append(_scalar_variable(row, dim, scalars, whole, coordinates))
        coordinates[dim] = Coordinate((dim,), scalars.labels)
    if "joint" in coordinates:
        bodies = text_array([*children, *model.loop_child_link_names][k] for k in selected)
        about = {"long_name": "outboard body of the joint"}
        coordinates["body"] = Coordinate(("joint",), bodies, about)
    return variables, coordinates


def _loop_variables(
    model: Model,
    rows: Sequence[Mapping[str, Any]],
    selected: Sequence[int],
    coordinates: dict[str, Coordinate],
) -> list[Variable]:
    """Coordinates, rates and drives of joints that close loops, with their labels."""
    loops = [k - model.n_joints for k in selected if k >= model.n_joints]
    positions, velocities = loop_scalars(model, loops)
    ends = model.loop_slices[-1]
    variables = []
    for row in rows:
        dim = LOOP_AXES[row["axis"]]
        on_q = row["axis"] == "loop_coordinates"
        scalars, whole = (positions, ends[0].stop) if on_q else (velocities, ends[1].stop)
        if not scalars.index.size:
            continue
        variables.append(_scalar_variable(row, dim, scalars, whole, coordinates))
        coordinates[dim] = Coordinate((dim,), scalars.labels)
    return variables


def _coupling_variables(
    model: Model, rows: Sequence[Mapping[str, Any]], coordinates: dict[str, Coordinate]
) -> list[Variable]:
    """What couplings put into their joints, labelled "coupling:joint"."""
    unit_of: dict[str, str] = {}
    for found in _all_positions(model):
        unit_of |= dict(zip(found.labels.tolist(), found.units.tolist(), strict=True))
    pairs = [
        (f"{name}:{joint}", unit_of[joint])
        for name, joints in zip(model.coupling_names, model.coupling_joints, strict=True)
        for joint in joints
    ]
    named, units = (text_array(column) for column in zip(*pairs, strict=True))
    coordinates["coupled"] = Coordinate(("coupled",), named)
    scalars = Scalars(named, units, np.arange(len(pairs)))
    return [_scalar_variable(row, "coupled", scalars, len(pairs), coordinates) for row in rows]


def _all_positions(model: Model) -> tuple[Scalars, Scalars]:
    return joint_scalars(model, range(model.n_joints))[0], loop_scalars(
        model, range(model.n_loops)
    )[0]


def _body_variables(
    model: Model,
    rows: Sequence[Mapping[str, Any]],
    wrenched: Collection[str],
    coordinates: dict[str, Coordinate],
) -> list[Variable]:
    """Wrenches on the bodies that have any; the others would be columns of zeros."""
    names = model.child_link_names
    bodies = [k for k in range(model.n_joints) if names[k] in wrenched]
    labels = text_array(names[k] for k in bodies)
    coordinates["wrenched_body"] = Coordinate(("wrenched_body",), labels)
    coordinates["component"] = Coordinate(("component",), text_array(COMPONENTS))
    return [_wrench_variable(row, "wrenched_body", bodies, False) for row in rows]


_MARKS = {
    DETERMINATE: {
        "long_name": "whether rigid bodies determine the component of the joint load",
        "convention": "true: in every pose of the run that was looked at; false: the value "
        "in joint_load is one choice of many",
    },
    BY_BEARINGS: {
        "long_name": "whether the stiffness of bearings decides the component of the joint load",
        "convention": "true: determinate, in some pose of the run that was looked at by bearings "
        "alone; false: by rigid bodies, or not at all",
    },
}


def _marks(model: Model, variables: Sequence[Variable]) -> tuple[Variable, ...]:
    """Of every component of the loads that are recorded, what determines it."""
    names = _MARKS if model.bearing_joints else (DETERMINATE,)
    return tuple(
        replace(load, name=name, dtype=np.dtype(np.bool_), attrs=_MARKS[name])
        for load in variables
        if load.name == "joint_load"
        for name in names
    )


def build_schema(
    model: Model,
    quantities: Collection[str] | None = None,
    joints: Sequence[str] | None = None,
    wrenched: Collection[str] = (),
    *,
    extremes: bool = False,
    determinate: bool = False,
) -> Schema:
    """Describe a run of `model` that keeps these quantities of these joints.

    `wrenched` names the bodies with an external wrench, which is recorded for them alone;
    `extremes` keeps those of loads between the samples, where loads are recorded;
    `determinate` says which of their components rigid bodies determine, and which bearings.
    """
    kept = resolve_quantities(quantities)
    rows = [row for row in TABLE if row["group"] in kept]
    if not wrenched:
        rows = [row for row in rows if row["axis"] != "bodies"]
    kept = tuple(dict.fromkeys(row["group"] for row in rows))
    selected = resolve_joints(model, joints)
    variables: list[Variable] = []
    coordinates: dict[str, Coordinate] = {}
    of_joints = [row for row in rows if row["axis"] in ("coordinates", "rates", "joints")]
    if of_joints:  # labels of a million joints take seconds
        variables, coordinates = _joint_variables(model, of_joints, selected)
    if selected and selected[-1] >= model.n_joints:
        of_loops = [row for row in rows if row["axis"] in LOOP_AXES]
        variables += _loop_variables(model, of_loops, selected, coordinates)
    if model.coupling_names and len(selected) == model.n_joints + model.n_loops:
        of_couplings = [row for row in rows if row["axis"] == "terms"]
        variables += _coupling_variables(model, of_couplings, coordinates)
    of_bodies = [row for row in rows if row["axis"] == "bodies"]
    if of_bodies:
        variables += _body_variables(model, of_bodies, wrenched, coordinates)
    variables += [
        Variable(row["name"], (), (), _dtype(row), _attrs(row))
        for row in rows
        if row["axis"] == "none"
    ]
    marks = _marks(model, variables) if determinate else ()
    schema = Schema(tuple(variables), coordinates, kept, marks=marks)
    layout = extremes_layout(model, schema.variables) if extremes else None
    if layout is None:
        return schema
    coordinates |= {name: Coordinate((name,), values) for name, values in labels(layout).items()}
    return replace(schema, extremes=layout)
