"""Many simulations in one call: initial states, torques, machines side by side."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from linkwise import _core
from linkwise._core import Frame, InputError, Model, as_floats
from linkwise.base import AnyArray, Array
from linkwise.io.complaint import shown
from linkwise.loads.engineering import joint_directions
from linkwise.notes import Ignored, tell, warning_attrs, warnings_of
from linkwise.record.provenance import plain, provenance
from linkwise.record.schema import TABLE, TIME_ATTRS, Schema, build_schema
from linkwise.results import Run
from linkwise.simulation.arguments import (
    check_model,
    check_steps,
    number,
    optional_count,
    sample_times,
)
from linkwise.simulation.bends import Bends
from linkwise.simulation.determinacy import Determinacy, is_looked_at, not_looked_at
from linkwise.simulation.recording import Recording
from linkwise.simulation.simulate import (
    SimulationInterrupted,
    check_driven,
    driven_attrs,
    set_driven,
)

if TYPE_CHECKING:
    import xarray as xr

    from linkwise.drives import Drive, Wrench

QUANTITIES = tuple(dict.fromkeys(row["group"] for row in TABLE if row["of_members"]))


#: What members share; elastic joints of one type differ in how many coordinates they have.
_ALIKE = ("joint_names", "joint_types", "joint_nq", "joint_nv")


def _machines(model: Model | Sequence[Model]) -> list[Model]:
    """The models, alike in their joints."""
    if isinstance(model, str) or not isinstance(model, Iterable | Model):
        check_model(model)
    models = [model] if isinstance(model, Model) else list(model)
    if not models or not all(isinstance(one, Model) for one in models):
        raise InputError("model: give a Model, or a sequence of at least one")
    for k, one in enumerate(models):
        if any(getattr(one, name) != getattr(models[0], name) for name in _ALIKE):
            raise InputError(f"model: model[{k}] has other joints than model[0]; simulate it apart")
    return models


def _rows(name: str, values: Any, width: int) -> Array:
    """(..., width) finite numbers."""
    array = as_floats(values, name)
    if array.ndim == 0 or array.shape[-1] != width:
        raise InputError(f"{name}: expected shape (..., {width}), given shape {array.shape}")
    if not np.isfinite(array).all():
        at = tuple(int(k) for k in np.argwhere(~np.isfinite(array))[0])
        raise InputError(f"{name}: expected finite numbers, {name}{list(at)} is {array[at]}")
    return array


def _members(given: dict[str, Array], models: int) -> tuple[tuple[int, ...], dict[str, Array]]:
    """The members' axes, and every argument as rows (models * members, width)."""
    try:
        lead = np.broadcast_shapes(*(array.shape[:-1] for array in given.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in given.items())
        raise InputError(
            f"the leading axes do not broadcast: {shapes}; make them equal or 1"
        ) from None
    rows = {
        name: np.broadcast_to(array, (models, *lead, array.shape[-1])).reshape(-1, array.shape[-1])
        for name, array in given.items()
    }
    return lead, rows


def _dataset(
    columns: dict[str, Any],
    endings: list[_core.Ending],
    lead: tuple[int, ...],
    schema: Schema,
    times: Array,
    several: bool,
) -> xr.Dataset:
    """The arrays (members, times, ...) of the core, with their axes and labels."""
    import xarray as xr

    axes = len(lead) - several
    dims = (*(("model",) if several else ()), *(f"member_{k + 1}" for k in range(axes)))
    if axes == 1:
        dims = (*dims[:-1], "member")
    data = {
        variable.name: (
            (*dims, "time", *variable.dims),
            columns[variable.name].reshape((*lead, times.size, *variable.shape)),
            dict(variable.attrs),
        )
        for variable in schema.variables
    }
    data |= {
        variable.name: (
            (*dims, *variable.dims),
            columns[variable.name].reshape((*lead, *variable.shape)),
            dict(variable.attrs),
        )
        for variable in schema.timeless
    }
    coordinates = {
        name: (coordinate.dims, coordinate.values, dict(coordinate.attrs))
        for name, coordinate in schema.coordinates.items()
    }
    ends = {
        "outcome": (dims, np.array([e.outcome for e in endings], dtype=np.str_).reshape(lead)),
        "stop_time": (dims, np.array([e.time for e in endings]).reshape(lead), {"units": "s"}),
        "stop_joint": (dims, np.array([e.joint for e in endings], dtype=np.str_).reshape(lead)),
        "message": (dims, np.array([e.text for e in endings], dtype=np.str_).reshape(lead)),
    }
    return xr.Dataset(
        data, coords={"time": ("time", times, dict(TIME_ATTRS)), **coordinates, **ends}
    )


def _forces_in_doubt(members: int, worst: int, text: str, count: int) -> list[Ignored]:
    """What is said of forces of large gain that the steps do not resolve."""
    if not members:
        return []
    said = text if count == 1 else f"in {members} of {count} members; in member {worst} {text}"
    return [Ignored("", "forces", said)]


def _of_loops(
    models: Sequence[Model],
    rows: Mapping[str, Array],
    said: Sequence[tuple[str, str]],
    schema: Schema,
) -> list[Ignored]:
    """What was moved to close the loops of members, and which of their loads are not known."""
    notes = []
    for element, texts in zip(("assembly", "joint_load"), zip(*said, strict=True), strict=True):
        of = [member for member, text in enumerate(texts) if text]
        if of:
            more = f"; the like of {len(of) - 1} more members" if len(of) > 1 else ""
            notes.append(Ignored("", element, f"member {of[0]}: {texts[of[0]]}{more}"))
    return notes + (not_looked_at(models) if "joint_load" in schema.quantities else [])


def _schema(models: Sequence[Model], record: Collection[str] | None, extremes: bool) -> Schema:
    """What a batch holds."""
    known = all(is_looked_at(one) for one in models)
    wanted = QUANTITIES if record is None else record
    return build_schema(models[0], wanted, extremes=extremes, determinate=known)


def _asked(schema: Schema) -> tuple[str, ...]:
    """What the core is to return: positions even where they are not recorded, to look at them."""
    positions = ("position",) if schema.marks else ()
    return tuple(dict.fromkeys((*schema.quantities, *positions)))


def _add_determinate(
    columns: dict[str, AnyArray],
    schema: Schema,
    models: Sequence[Model],
    rows: Mapping[str, Array],
    drives: Mapping[str, Drive],
    times: Array,
) -> list[Ignored]:
    """Add which loads of each member rigid bodies determine; what is said of those that they do
    not. columns: positions (members, time, nq), and the states at peaks where they are kept."""
    if not schema.marks:
        return []
    known: dict[str, list[AnyArray]] = {mark.name: [] for mark in schema.marks}
    said: dict[Ignored, list[int]] = {}
    positions, states = columns["position"], columns.get("extreme_state")
    loads = columns.get("joint_load")
    each = len(positions) // len(models)
    for member, path in enumerate(positions):
        model = models[member // each]
        start = _core.assemble(model, rows["q0"][member], rows["v0"][member], [])["q"]
        seen = Determinacy(model, drives, start, len(path), explain=False)
        seen.see(path, None if loads is None else loads[member], times)
        seen.see_peaks(None if states is None else states[member])
        marks = seen.marks()
        for name, of_members in known.items():
            of_members.append(marks[name])
        for note in seen.notes():
            said.setdefault(note, []).append(member)
    notes = []
    for note, members in said.items():
        whose = "" if len(members) == len(positions) else f"member {members[0]}: "
        more = f"; the same of {len(members) - 1} more members" if whose and members[1:] else ""
        notes.append(note._replace(text=f"{whose}{note.text}{more}"))
    columns.update({name: np.array(of_members) for name, of_members in known.items()})
    return notes


def _of_bends(
    columns: Mapping[str, AnyArray], models: Sequence[Model], times: Array
) -> list[Ignored]:
    """What is said of elastic links that bend further than they can follow, once per link."""
    found: dict[str, Ignored] = {}
    positions = columns.get("position", ())
    for member, path in enumerate(positions):
        bends = Bends(models[member // (len(positions) // len(models))])
        bends.take(path, times)
        for note in bends.notes():
            found.setdefault(note.element, note._replace(text=f"member {member}: {note.text}"))
    return list(found.values())


def simulate_batch(
    model: Model | Sequence[Model],
    *,
    step: float,
    duration: float | None = None,
    q0: npt.ArrayLike | None = None,
    v0: npt.ArrayLike | None = None,
    tau: npt.ArrayLike | None = None,
    drives: Mapping[str, Drive | Any] | None = None,
    wrenches: Mapping[str | Frame, Wrench | Any] | None = None,
    every: float | None = None,
    times: npt.ArrayLike | None = None,
    integrator: str = "runge_kutta_4",
    record: Collection[str] | None = None,
    extremes: bool | None = None,
    threads: int | None = None,
) -> xr.Dataset:
    """Simulate many motions at once with fixed steps: members in SIMD lanes, lanes over threads.

    Args:
        model: The mechanism, or several with the same joints (payloads, parameters), each of which
            is simulated with all states. Members of one model share SIMD lanes; a model with one
            state has none to share them with.
        step: Step of the integrator [s].
        duration: Seconds to simulate; may be left out when `times` are given.
        q0: Initial coordinates (..., nq); the model's `initial_configuration()` by
            default.
        v0: Initial velocities (..., nv); zero by default.
        tau: Constant joint torques (..., nv) beside the drives. The leading axes of q0, v0 and tau
            broadcast to those of the members.
        drives, wrenches: As for `simulate`, the same for all members; functions are refused.
        every, times: When to record, as for `simulate`.
        integrator: One with a fixed step: "runge_kutta_4" or "semi_implicit_euler".
        record: Names of the quantities to record, of those that `linkwise.quantities()` marks
            `of_members`; all of them by default.
        extremes: Whether the extremes between samples are kept as well, where joint loads are
            recorded; by default as in `Recording`. The search for them takes as long as the steps
            or twice as long: 200 motions of 500 steps take 0.29 s instead of 0.15 s for an arm of
            6 joints, 2.7 s instead of 0.87 s for a chain of 30. Without it peaks are those of the
            samples; `record` without "joint_load" needs no search either.
        threads: Worker threads; the results do not depend on it.

    Returns:
        The variables of a run with the members' axes in front: `model` where several are given,
        then `member`, or `member_1`, `member_2`, ... A member that cannot go on ends alone: its
        `outcome` and `message` say why, `stop_time` when, `stop_joint` where, and its later samples
            are NaN.

    Raises:
        InputError: an argument is wrong; nothing was simulated.
        MemoryError: the samples would not fit into memory; nothing was simulated.
        SimulationInterrupted: Ctrl-C; `.run` holds what was computed.
    """
    models = _machines(model)
    first = models[0]
    sampled = sample_times(duration, every, times)
    keep = Recording(extremes=extremes).keeps_extremes(first.n_joints)
    schema = _schema(models, record, keep)
    unknown = [name for name in schema.quantities if name not in QUANTITIES]
    if unknown:
        raise InputError(f"record: a batch has no {shown(unknown[0])}; use {', '.join(QUANTITIES)}")
    given = {
        "q0": _rows("q0", first.initial_configuration() if q0 is None else q0, first.nq),
        "v0": _rows("v0", np.zeros(first.nv) if v0 is None else v0, first.nv),
    }
    if tau is not None:
        given["tau"] = _rows("tau", tau, first.nv)
    fixed = [entry["name"] for entry in _core.integrators() if entry["fixed_step"]]
    if integrator not in fixed:
        raise InputError(f"integrator: a batch takes {' or '.join(fixed)}, not {shown(integrator)}")
    options: dict[str, Any] = {"integrator": integrator, "step": number("step", step)}
    check_steps(float(sampled[-1]), options)
    simulations = []
    for one in models:
        by_joint, by_name = check_driven(one, drives, wrenches)
        simulation = _core.Simulation(one, **options, method="articulated_body", threads=1)
        notes = set_driven(simulation, one, by_joint, by_name, float(sampled[-1]))
        if schema.extremes:
            simulation.keep_extremes(joint_directions(one))
        simulations.append(simulation)
    lead, rows = _members(given, len(models))
    lead = lead if isinstance(model, Model) else (len(models), *lead)
    count = int(np.prod(lead, dtype=np.int64))
    _core.require_memory(
        float(count) * (sampled.size * schema.row_bytes + schema.extremes_bytes),
        f"{sampled.size} samples of {count} members",
    )
    ignored = warnings_of(*models)
    tell(ignored, reading=False)
    columns, flat, endings, interrupted, doubt, said = _core.simulate_members(
        simulations,
        q0=rows["q0"],
        v0=rows["v0"],
        tau=rows.get("tau"),
        times=sampled,
        quantities=_asked(schema),
        threads=optional_count("threads", threads),
    )
    if schema.extremes:
        columns |= schema.extremes.split(flat)
    notes += _of_bends(columns, models, sampled)
    notes += _add_determinate(columns, schema, models, rows, by_joint, sampled)
    dataset = _dataset(columns, endings, lead, schema, sampled, not isinstance(model, Model))
    if not interrupted:
        ignored = [*ignored, *_of_loops(models, rows, said, schema)]
    early = sum(ending.outcome != "converged" for ending in endings)
    attrs = provenance(first, options={**options, "members": count}, cpu_target=_core.cpu_target)
    noticed = _forces_in_doubt(*doubt, count)
    attrs |= driven_attrs(by_joint, by_name) | warning_attrs([*noticed, *notes, *ignored])
    attrs |= {"outcome": "converged" if not early else f"{early} of {count} members ended early"}
    dataset = dataset.assign_attrs({name: plain(value) for name, value in attrs.items()})
    if interrupted:
        raise SimulationInterrupted(
            f"interrupted; {early} of {count} members are not complete", Run(dataset)
        )
    return dataset
