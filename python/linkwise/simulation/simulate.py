"""Simulating a model: from its drives to labelled results, in memory or on disk."""

from __future__ import annotations

import contextlib
import json
import os
import time as clock
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from linkwise import _core
from linkwise._core import Frame, InputError
from linkwise.base import AnyArray, Array
from linkwise.drives import as_drive, as_wrench
from linkwise.drives.course import Span
from linkwise.io.complaint import shown
from linkwise.loads.engineering import joint_directions
from linkwise.notes import Ignored, tell, warning_attrs, warnings_of
from linkwise.record.claim import check_target
from linkwise.record.memory import MemoryRecord
from linkwise.record.provenance import describe, provenance
from linkwise.record.schema import Schema, build_schema
from linkwise.record.store import RunWriter
from linkwise.results import Run
from linkwise.simulation.arguments import (
    check_called,
    check_mapping,
    check_steps,
    optional_count,
    options_object,
    sample_times,
    state_vector,
)
from linkwise.simulation.assembling import at_loop_positions, loop_rates
from linkwise.simulation.bends import Bends
from linkwise.simulation.determinacy import Determinacy, is_looked_at, not_looked_at
from linkwise.simulation.numerics import DEFAULTS, Numerics
from linkwise.simulation.recording import Recording
from linkwise.simulation.time_loop import Progress, run_time_loop

if TYPE_CHECKING:
    from linkwise._core import Ending, Model, Simulation
    from linkwise.drives import Drive, Wrench


class _Stopped(BaseException):
    """A simulation that ended early, with the run until then; pickles and copies whole."""

    def __init__(self, message: str, run: Run) -> None:
        super().__init__(message)
        self.run = run

    def __reduce__(self) -> tuple[type[_Stopped], tuple[str, Run]]:
        # Exceptions are rebuilt from `args`, which is what they print: the message alone. One that
        # cannot be rebuilt ends the thread of a process pool that reads it, and the pool hangs.
        return type(self), (str(self), self.run)


class SimulationError(_Stopped, RuntimeError):
    """A simulation that could not go on; `run` holds everything until then."""


class SimulationInterrupted(_Stopped, KeyboardInterrupt):
    """Ctrl-C during a simulation; `run` holds everything until then."""


def check_driven(
    model: Model, drives: Mapping[str, Any] | None, wrenches: Mapping[Any, Any] | None
) -> tuple[dict[str, Drive], dict[str, Wrench]]:
    """Drives by joint and wrenches by name, each with its frame; unknown names and unusable values
    are refused."""
    by_joint, by_name = {}, {}
    check_mapping("drives", drives)
    check_mapping("wrenches", wrenches)
    for joint, drive in (drives or {}).items():
        if not isinstance(joint, str):
            raise InputError(f"drives: {shown(joint)} names no joint; give names in quotes")
        model.load_index(joint)
        try:
            by_joint[joint] = as_drive(drive)
        except InputError as error:
            raise InputError(f"drives[{shown(joint)}]: {error}") from None
    for frame, wrench in (wrenches or {}).items():
        name = str(frame)
        try:
            by_name[name] = _placed(as_wrench(wrench), frame)
            wrenched_bodies(model, {name: by_name[name]})
            _check_start(model, by_name[name].at)
        except InputError as error:
            raise InputError(f"wrenches[{shown(name)}]: {error}") from None
    return by_joint, by_name


def _check_start(model: Model, at: str | Frame | None) -> None:
    """A wrench bends nothing of the body on whose frame it is."""
    if isinstance(at, Frame) and at.link in model.flexible_links and at.origin.any():
        raise InputError(
            "acts on the frame of a flexible link, where that starts, and would not bend it; name "
            f"'{at.link}:end', or one of its further beams, or let it act at the origin"
        )


def _placed(wrench: Wrench, frame: Any) -> Wrench:
    """The wrench with the frame where it acts: its own, or the one that it was given for."""
    if wrench.at is not None and not isinstance(frame, str):
        raise InputError("is given for a frame and has another one; leave one of them out")
    return wrench.placed(frame)


def wrenched_bodies(model: Model, wrenches: Mapping[str, Wrench]) -> set[str]:
    """The bodies that the wrenches act on, once these are checked."""
    bodies = (model.frame_placement(wrench.at)[0] for wrench in wrenches.values() if wrench.at)
    return {body for body in bodies if body is not None}


def set_driven(
    simulation: Simulation,
    model: Model,
    by_joint: Mapping[str, Drive],
    by_name: Mapping[str, Wrench],
    end: float,
    start: tuple[Array, Array] | None = None,
) -> list[Ignored]:
    """Give the simulation its drives and wrenches, which must last until `end` [s].

    Functions are looked at over that time, where the state at the start is given. Returns what the
    reader of the run should know.
    """
    notes = []
    for joint, drive in by_joint.items():
        try:
            drive.check(model, joint, end)
            span = None
            if start is not None:
                span = Span(end, *_joint_state(model, joint, start))
            drive.apply(simulation, joint, span)
        except InputError as error:
            raise InputError(f"drives[{shown(joint)}]: {error}") from None
        notes += [Ignored("", f"drives[{joint!r}]", note) for note in drive.notes(end)]
    for name, wrench in by_name.items():
        try:
            wrench.apply(simulation, name, None if start is None else Span(end))
        except InputError as error:
            raise InputError(f"wrenches[{shown(name)}]: {error}") from None
        notes += [Ignored("", f"wrenches[{name!r}]", note) for note in wrench.notes(end)]
    return _each_once(notes)


def _joint_state(model: Model, joint: str, start: tuple[Array, Array]) -> tuple[Array, Array]:
    """A joint's own coordinates and rates at a state of the tree."""
    loop = model.load_index(joint) - model.n_joints
    if loop < 0:
        q, v = model.q_slice(joint), model.v_slice(joint)
        return start[0][q].copy(), start[1][v].copy()
    q, v = model.loop_slices[loop]
    coordinates, rates = _core.loop_coordinates(model, *start)
    return coordinates[q], rates[v]


_MOST_NAMED = 3  # drives of which the same is said


def _each_once(notes: list[Ignored]) -> list[Ignored]:
    """What is said of several drives or wrenches, in one note."""
    elements: dict[str, list[str]] = {}
    for note in notes:
        elements.setdefault(note.text, []).append(note.element)
    found = []
    for text, names in elements.items():
        more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
        found.append(Ignored("", ", ".join(names[:_MOST_NAMED]) + more, text))
    return found


def driven_attrs(drives: Mapping[str, Drive], wrenches: Mapping[str, Wrench]) -> dict[str, str]:
    """What drives the machine, as JSON text; functions of runs read it."""
    return {
        "drives": json.dumps({joint: describe(drive) for joint, drive in drives.items()}),
        "wrenches": json.dumps({name: describe(wrench) for name, wrench in wrenches.items()}),
    }


def _chosen(
    simulation: Simulation, drives: Mapping[str, Drive], wrenches: Mapping[str, Wrench]
) -> dict[str, Any]:
    """Attributes that the prepared simulation adds to the provenance."""
    return {
        **driven_attrs(drives, wrenches),
        "method": simulation.method,
        "solver": simulation.solver or "none",
        "reason": simulation.reason,
    }


def _recorder(
    model: Model,
    schema: Schema,
    attrs: Mapping[str, Any],
    samples: int,
    output: str | os.PathLike[str] | None,
    extremes: Callable[[], dict[str, AnyArray]],
) -> MemoryRecord | RunWriter:
    if output is None:
        return MemoryRecord(schema, attrs)
    return RunWriter(output, schema, attrs, samples=samples, model=model, extremes=extremes)


def _timeless(
    simulation: Simulation, schema: Schema, determinacy: Determinacy | None, *, ended: bool = False
) -> dict[str, AnyArray]:
    """The extremes that were found so far, by variable; none where a function of the caller's fails
    again. With them, where loops are closed, which loads are determinate."""
    found: dict[str, AnyArray] = {}
    if schema.extremes is not None:
        found = schema.extremes.empty()
        with contextlib.suppress(Exception):
            found = schema.extremes.split(simulation.extremes())
    if determinacy is not None:
        if ended:
            determinacy.see_peaks(found.get("extreme_state"))
            determinacy.see_extremes(found.get("extreme_quantity"))
        marks = determinacy.marks()
        for mark in schema.marks:
            known = marks[mark.name]
            found[mark.name] = known if mark.take is None else known[mark.take]
    return found


def _record(
    model: Model,
    simulation: Simulation,
    record: MemoryRecord | RunWriter,
    schema: Schema,
    times: npt.NDArray[np.float64],
    progress: Callable[[Progress], object] | None,
    solver_doubt: Callable[[float], Ignored | None],
    ignored: Sequence[Ignored],
    determinacy: Determinacy | None,
) -> tuple[Run, Ending]:
    """Simulate and record. Whatever goes wrong, the samples so far become a complete run.

    ignored: what its reader should know from before the run.
    """
    started = clock.monotonic()
    bends = Bends(model)
    try:
        looking = _looking(determinacy, bends)
        ending = run_time_loop(simulation, record, schema, times, progress, *looking)
    except BaseException as error:
        # A function of the caller's (a drive, the progress) raised an exception, or the disk is
        # full.
        said = {"outcome": "error", "message": f"{type(error).__name__}: {error}"}
        with contextlib.suppress(Exception):
            found = _timeless(simulation, schema, determinacy, ended=True)
            noticed = [*_noticed(simulation, ignored), *ignored, *_open(determinacy)]
            said |= warning_attrs([*noticed, *bends.notes()])
            record.finish(said, found)
        raise
    attrs = _attributes_at_end(simulation, clock.monotonic() - started)
    doubt = solver_doubt(simulation.statistics.solver_error)
    attrs["solver_error"] = "bounded" if doubt is None else "not bounded"
    found = _timeless(simulation, schema, determinacy, ended=True)
    noticed = [*_noticed(simulation, ignored), *ignored, *_open(determinacy)]
    noticed += [*([] if doubt is None else [doubt]), *bends.notes()]
    finished = record.finish(attrs | warning_attrs(noticed), found)
    return Run(finished, record.path, model), ending


def _looking(
    determinacy: Determinacy | None, bends: Bends
) -> tuple[Callable[[Mapping[str, Array]], object], Collection[str]] | tuple[()]:
    """What looks at each chunk of samples, and the quantities that it needs."""
    if determinacy is not None:  # loops are not closed on elastic links
        see = determinacy.see
        return lambda of: see(of["position"], of.get("joint_load"), of["time"]), determinacy.needs
    return () if bends.none else (bends.see, bends.needs)


def _noticed(simulation: Simulation, ignored: Sequence[Ignored]) -> list[Ignored]:
    """What was noticed about stiffness, forces of large gain, singular positions: the warnings."""
    said = {
        "integrator": simulation.stiffness,
        "forces": simulation.force_doubt,
        "joint_load": simulation.loop_doubt,
    }
    if any(note.element == COARSE for note in ignored):
        said.pop("integrator")  # short steps have another reason
    noticed = [Ignored("", element, text) for element, text in said.items() if text]
    if not simulation.knows_works:
        noticed.append(Ignored("", "works", _UNKNOWN_WORKS))
    return noticed


COARSE = "solver_tolerance"
_UNKNOWN_WORKS = (
    "drive_work, external_work and dissipated_energy are not known from where they are NaN: what "
    "holds a given motion could not be computed within a step; take shorter steps, or leave works "
    "out"
)


#: The share of a number that the error test allows always: 64 roundings.
_FINEST = 64 * float(np.finfo(float).eps)


def _fine(simulation: Simulation, options: Mapping[str, Any]) -> list[Ignored]:
    """What is said of a tolerance that doubles cannot hold."""
    fixed = {row["name"] for row in _core.integrators() if row["fixed_step"]}
    least = simulation.step_tolerance
    if least >= _FINEST / 10 or options.get("integrator", DEFAULTS["integrator"]) in fixed:
        return []
    text = f"steps are held to {_FINEST:.1e} of each number, the rounding of doubles, and not to "
    return [Ignored("", "tolerance", f"{text}{least:.1e}; give 1e-13 or more")]


def _coarse_solver(simulation: Simulation, options: Mapping[str, Any]) -> list[Ignored]:
    """What is said where the errors of an iterative solver are more than the error test bears.

    From ten times the step tolerance on, steps get shorter: `docs/theory/simulate.md`.
    """
    kinds = {row["name"]: row["kind"] for row in _core.solvers()}
    fixed = {row["name"] for row in _core.integrators() if row["fixed_step"]}
    integrator = options.get("integrator", DEFAULTS["integrator"])
    given = (options.get("solver_options") or {}).get("tolerance", options.get("solver_tolerance"))
    bearable = 10 * simulation.step_tolerance
    if given is None or not given > bearable or integrator in fixed:
        return []
    if kinds.get(simulation.solver) != "iterative":
        return []
    return [
        Ignored(
            "",
            COARSE,
            f"{given:g} is more than the error test of the steps bears: forces are wrong by as "
            f"much, and steps get short because of it; give {bearable:.1g} at most, or leave it "
            "out",
        )
    ]


def _of_loops(simulation: Simulation, model: Model, schema: Schema) -> list[Ignored]:
    """What was moved to close the loops, and whether their loads were not looked at."""
    moved = simulation.assembled
    said = [Ignored("", "assembly", moved)] if moved else []
    return said + (not_looked_at([model]) if "joint_load" in schema.quantities else [])


def _open(determinacy: Determinacy | None) -> list[Ignored]:
    """Which loads are not determined."""
    return [] if determinacy is None else determinacy.notes()


def _attributes_at_end(simulation: Simulation, wall_time: float) -> dict[str, Any]:
    ending, done = simulation.ending, simulation.statistics
    return {
        "outcome": ending.outcome,
        "message": ending.text,
        "stop_time": ending.time,
        "stop_joint": ending.joint,
        "wall_time": wall_time,
        "total_steps": done.steps,
        "total_evaluations": done.evaluations,
        "total_iterations": done.iterations,
    }


def _solver_doubt(options: Mapping[str, Any], default: float, error: float) -> Ignored | None:
    """What a run says of an iterative solver whose errors are too large or not known.

    `error`: the largest of them, relative; infinite where it is not known. `default`: what the
    solver was asked for without `solver_tolerance`. By the rule energy_norm the error is known, and
    small enough.
    """
    allowed = options.get("solver_tolerance", default)
    rule = options.get("stop", DEFAULTS["stop"])
    if np.isfinite(error) and (rule == "energy_norm" or error <= 10 * allowed):
        return None
    solver = options.get("solver", DEFAULTS["solver"])
    size = f"up to {error:.1g} of the forces" if np.isfinite(error) else "not bounded"
    cure = "a direct solver" if rule == "energy_norm" else 'stop "energy_norm" or a direct solver'
    return Ignored(
        "",
        f"solver {solver!r}",
        f"its errors are {size}, where {allowed:.1g} was asked for, and no bound of the loads holds"
        f"; use {cure}",
    )


def failure_message(model: Model, ending: Ending) -> str:
    """One line: what happened, when, where, and (from the core) what to do."""
    joint = f", joint {ending.joint!r}" if ending.joint else ""
    detail = f": {ending.text}" if ending.text else ""
    return (
        f"simulation of {model.name!r} stopped at t = {ending.time:.6g} s with outcome "
        f"{ending.outcome}{joint}{detail}"
    )


def _require_memory(schema: Schema, samples: int) -> None:
    """MemoryError if a recording of so many samples would not fit into memory."""
    # The chunks of the largest variable and the array that they are joined to exist together.
    largest = max((variable.row_bytes for variable in schema.variables), default=0)
    _core.require_memory(
        float(samples) * (schema.row_bytes + largest),
        f"a recording of {samples} samples in memory (output= writes them to disk)",
    )


def _start(model: Model, q0: npt.ArrayLike | None, v0: npt.ArrayLike | None) -> tuple[Array, Array]:
    return (
        state_vector("q0", q0, model.nq, model.initial_configuration()),
        state_vector("v0", v0, model.nv, np.zeros(model.nv)),
    )


def simulate(
    model: Model,
    *,
    duration: float | None = None,
    drives: Mapping[str, Drive | Any] | None = None,
    wrenches: Mapping[str | Frame, Wrench | Any] | None = None,
    q0: npt.ArrayLike | None = None,
    v0: npt.ArrayLike | None = None,
    every: float | None = None,
    times: npt.ArrayLike | None = None,
    tolerance: float | None = None,
    numerics: Numerics | Mapping[str, Any] | None = None,
    threads: int | None = None,
    hold: Sequence[str] = (),
    loop_position: Mapping[str, float] | None = None,
    loop_velocity: Mapping[str, float | Sequence[float]] | None = None,
    record: Recording | Mapping[str, Any] | Collection[str] | None = None,
    output: str | os.PathLike[str] | None = None,
    progress: Callable[[Progress], object] | None = None,
    on_failure: Literal["raise", "return"] = "raise",
    **options: Any,
) -> Run:
    """Simulate the motion of `model` from time 0 and return labelled results.

    Args:
        model: The mechanism.
        duration: Seconds to simulate; may be left out when `times` are given.
        drives: Per joint name, loop joints too, a drive (`Torque`, `PD`, `Spring`, `Motion`,
            `Locked`, `Free`), or what makes a `Torque`: a number, one number per degree of freedom,
            or a callable `f(t, q, v)` of the joint's own coordinates and velocities. Joints
            without a drive move freely.
        wrenches: Per frame an external `Wrench`, or what makes one along the world's axes: six
            numbers, a `Table`, a function of time. A frame is the name of any link, merged ones
            too, or a `Frame`. A wrench that says itself where it acts (`at=`) may have any name.
            Those on one body add up.
        q0: Initial coordinates, shape (nq,); the model's
            `initial_configuration()` by default.
        v0: Initial velocities, shape (nv,); zero by default.
        every: Interval between samples [s]; a thousandth of the duration by default.
        times: The sample times instead [s], increasing.
        tolerance: Accuracy to aim at, relative to the size of the state and absolute; 1e-6 by
            default.
        numerics: Integrator, step, method, solver and the rarer options: a `Numerics`, or a
            dictionary. `linkwise.numerics()` lists all with their defaults.
        hold: Joints that closing the loops of the start leaves where `q0` has them; where loops do
            not close so, they are released, the last one first, and `run.warnings` says so.
        loop_position: By name where joints of one axis that close loops start: see `assemble`.
        loop_velocity: The same of the rates of such joints, also of several axes.
        threads: Worker threads; the results do not depend on it.
        record: Names of the quantities to record, such as `["joint_load", "position"]`, or a
            `Recording`, which also picks joints; everything by default.
        output: Path of a Zarr store to write while simulating; in memory when left out. An
            existing linkwise run there is replaced when this one has samples beyond its start;
            a person's files in its folder stay. Anything else there is refused.
        progress: Called with a `Progress` a few times a second.
        on_failure: "raise" SimulationError (SimulationInterrupted on Ctrl-C), or "return" the run
            that ended early; its `outcome` says why.
        options: Single fields of `numerics` and `record`, such as `integrator="bdf"`,
            `step=1e-3` or `joints=["elbow"]`; they go before those objects.

    Raises:
        InputError: an argument is wrong; nothing was written.
        SimulationError: the simulation could not go on; `.run` holds the results until then.

    What was ignored or assumed when the model was made is in `run.warnings`, and a ModelWarning
    each where `linkwise.load` did not say it. `run.warnings` also names tables that do not cover
    the run, functions whose short changes may be missed, since when the motion is stiff, forces
    whose gain is so large that they are not known well, loads of closed loops that rigid bodies do
    not determine (`run.determinate`), and an iterative solver whose errors are not bounded.
    """
    check_called(model, progress)
    sampled = sample_times(duration, every, times)
    start, hold, brought = at_loop_positions(model, _start(model, q0, v0), hold, loop_position)
    by_joint, by_name = check_driven(model, drives, wrenches)
    recording = Recording.of(record, options)
    chosen = options_object("numerics", Numerics, numerics, options)
    for name in options:
        raise TypeError(f"simulate() got an unexpected keyword argument {name!r}")
    schema = build_schema(
        model,
        recording.quantities,
        recording.joints,
        wrenched_bodies(model, by_name),
        extremes=recording.keeps_extremes(model.n_joints),
        determinate=is_looked_at(model),
    )
    if on_failure not in ("raise", "return"):
        raise InputError(f'on_failure: {shown(on_failure)} is unknown; use "raise" or "return"')
    if output is not None:
        check_target(output)
        output = os.path.abspath(output)  # a function of the caller's may change the folder
    options = chosen.options(tolerance)
    check_steps(float(sampled[-1]), options)
    count = optional_count("threads", threads)
    simulation = _core.Simulation(model, **options, threads=count)
    notes = set_driven(simulation, model, by_joint, by_name, float(sampled[-1]), start)
    if schema.extremes:
        simulation.keep_extremes(joint_directions(model))
    simulation.start(0.0, *start, hold=hold, loop_rates=loop_rates(model, loop_velocity))
    attrs = provenance(
        model,
        options={
            **DEFAULTS,
            **options,
            "step_tolerance": simulation.step_tolerance,
            "threads": count,
            "duration": float(sampled[-1]),
            "quantities": schema.quantities,
        },
        scenario=recording.scenario_text,
        cpu_target=_core.cpu_target,
    )
    attrs |= _chosen(simulation, by_joint, by_name)
    notes += [*brought, *_of_loops(simulation, model, schema), *_fine(simulation, options)]
    looked = model, by_joint, simulation.start_position, sampled.size
    determinacy = Determinacy(*looked) if schema.marks else None
    ignored = [*notes, *_coarse_solver(simulation, options), *warnings_of(model)]
    attrs |= warning_attrs([*ignored, *_open(determinacy)])
    if output is None:
        _require_memory(schema, sampled.size)
    tell(warnings_of(model), reading=False)
    timeless = partial(_timeless, simulation, schema, determinacy)
    recorder = _recorder(model, schema, attrs, sampled.size, output, timeless)
    told = partial(_solver_doubt, options, simulation.step_tolerance / 10), ignored, determinacy
    run, ending = _record(model, simulation, recorder, schema, sampled, progress, *told)
    if on_failure == "raise":
        raise_failure(model, ending, run)
    return run


def raise_failure(model: Model, ending: Ending, run: Run) -> None:
    """Raise the error that belongs to a run that did not reach its end."""
    if ending.outcome == "interrupted":
        where = f"; the results until then are in {run.path}" if run.path else ""
        raise SimulationInterrupted(f"interrupted at t = {ending.time:g} s{where}", run)
    if ending.outcome != "converged":
        raise SimulationError(failure_message(model, ending), run)
