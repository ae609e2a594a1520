"""Every dynamics method, linear solver and initial guess on one model, side by side."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from linkwise import _core
from linkwise._core import InputError
from linkwise.base import Array
from linkwise.drives import as_drive, as_wrench
from linkwise.plot.charts import Dot, DotChart, dots_to_svg
from linkwise.simulation.arguments import number
from linkwise.simulation.assembling import assemble

if TYPE_CHECKING:
    from linkwise._core import Model

REFERENCE = "articulated_body"
#: The first states of a motion fill the guesses' histories and are not counted.
WARM_UP = 8
# A run that makes states to compare on is given up after this many seconds of computing.
_RUN_LIMIT = 10.0
# A free motion is long enough when it has as many steps as states are wanted, or at this time.
_FREE_DURATION = 5.0
_FIRST_CALL = 4096  # a part of the duration
_MOST_STEPS = 100_000
# Each contestant repeats its pass over the states for about this long.
_TIMING_SECONDS = 0.1
_SPECTRUM_STATES = 3


class Trajectory(NamedTuple):
    """Successive states of a motion, a step of the integrator apart."""

    times: Array
    q: Array
    v: Array
    tau: Array
    description: str


@dataclass(frozen=True)
class Contestant:
    """One way to compute accelerations."""

    method: str
    solver: str = ""
    initial_guess: str = ""


class Step(NamedTuple):
    """What is about to be measured, and how many of how many are done."""

    what: str
    done: int
    total: int


def contestants() -> Iterator[Contestant]:
    """All of them, from the tables of the core."""
    guesses = [entry["name"] for entry in _core.initial_guesses()]
    for method in _core.methods():
        if method["name"] != "constraint_force":
            yield Contestant(method["name"])
            continue
        for solver in _core.solvers():
            if solver["kind"] == "direct":
                yield Contestant(method["name"], solver["name"])
            else:
                for guess in guesses:
                    yield Contestant(method["name"], solver["name"], guess)


def free_trajectory(model: Model, states: int, seed: int) -> Trajectory:
    """The model let go in a random pose within its limits, at random rates (seeded).

    At rest a floating machine would fall without any force in its joints.
    """
    simulation = _core.Simulation(model, method=REFERENCE)
    rng = np.random.default_rng(seed)
    q0 = random_pose(model, rng)
    return _record(
        simulation,
        model,
        q0,
        rng.uniform(-0.3, 0.3, model.nv),
        _FREE_DURATION,
        states,
        "let go at random rates",
        # Past the short steps of the start.
        most_steps=lambda wanted: 2 * wanted + 50,
    )


def driven_trajectory(model: Model, arguments: Mapping[str, Any], states: int) -> Trajectory:
    """The motion of a scenario, as `Scenario.simulate_arguments` describes it, to its middle."""
    options = arguments["numerics"]
    kept = ("integrator", "tolerance", "step_tolerance", "step", "max_step")
    simulation = _core.Simulation(
        model, method=REFERENCE, **{name: options[name] for name in kept if name in options}
    )
    for joint, drive in (arguments.get("drives") or {}).items():
        as_drive(drive).apply(simulation, joint)
    for body, wrench in (arguments.get("wrenches") or {}).items():
        as_wrench(wrench).apply(simulation, body)
    q0, v0 = arguments.get("q0"), arguments.get("v0")
    loops = arguments.get("loop_position")
    rates = arguments.get("loop_velocity")
    if loops or rates:
        given = {"loop_position": loops, "loop_velocity": rates}
        start = assemble(model, q0, v0, hold=arguments.get("hold", ()), **given)
        q0, v0 = start.q, start.v if rates else v0
    return _record(
        simulation,
        model,
        model.initial_configuration() if q0 is None else q0,
        np.zeros(model.nv) if v0 is None else v0,
        float(arguments["duration"]) / 2,
        states,
        "the scenario's motion",
        most_steps=lambda wanted: wanted + _MOST_STEPS,
    )


def random_pose(model: Model, rng: np.random.Generator) -> Array:
    """Coordinates within their limits, up to 1 rad or m about where it starts
    where there are none."""
    q = np.array(model.initial_configuration(), dtype=float)
    for k, joint in enumerate(model.joint_names):
        if model.joint_nq[k] != model.joint_nv[k]:
            continue  # quaternions stay as they are
        places, rates = model.q_slice(joint), model.v_slice(joint)
        low = np.maximum(model.lower_limit[rates], q[places] - 1.0)
        high = np.minimum(model.upper_limit[rates], q[places] + 1.0)
        inside = low < high
        q[places] = np.where(inside, rng.uniform(np.minimum(low, high), high), q[places])
    return q


def _record(
    simulation: Any,
    model: Model,
    q0: npt.ArrayLike,
    v0: npt.ArrayLike,
    duration: float,
    states: int,
    description: str,
    most_steps: Callable[[int], int],
) -> Trajectory:
    """The last accepted steps of a run, with their torques."""
    simulation.keep_trace()
    simulation.start(0.0, q0, v0)
    wanted = states + WARM_UP
    started = clock.monotonic()
    # Calls cannot be interrupted: short ones first, in case the motion takes tiny steps.
    step, time = duration / _FIRST_CALL, 0.0
    while time < duration:
        time = min(duration, time + step)
        simulation.advance([time], ())
        spent = clock.monotonic() - started
        taken, ending = simulation.statistics.steps, simulation.ending
        if ending.outcome != "converged" or spent > _RUN_LIMIT or taken > most_steps(wanted):
            break
        if spent < _RUN_LIMIT / 10:
            step *= 2
    trace = simulation.trace()
    end = min(duration, float(trace["time"][trace["accepted"]].max(initial=0.0)))
    if end == 0:
        raise InputError(
            f"compare: the motion of {model.name!r} ends at once "
            f"({ending.outcome}: {ending.text}); give another state or scenario"
        )
    times = np.unique(trace["time"][trace["accepted"]])
    times = times[(times > 0) & (times <= end)][-wanted:]
    if times.size < wanted:  # so calm a motion that it takes few steps
        times = np.linspace(0.0, end, wanted + 1)[1:]
    simulation.start(0.0, q0, v0)
    found = simulation.advance(times, ("position", "velocity", "acceleration", "drive_torque"))
    q, v = found["position"], found["velocity"]
    return Trajectory(found["time"], q, v, found["drive_torque"], description)


def compare(
    model: Model,
    trajectory: Trajectory,
    *,
    tolerance: float = 1e-7,
    stop: str = "energy_norm",
    max_iterations: int = 0,
    time_limit: float = 0.5,
    progress: Callable[[Step], object] | None = None,
) -> dict[str, Any]:
    """Measure all contestants along `trajectory`; rows are sorted, the fastest that converge first.

    Errors are those of the accelerations in the kinetic-energy norm against the articulated-body
    recursion, the largest along the motion relative to the largest acceleration. Beside them stands
    what iterative solvers say themselves, the largest `error_estimate` of the constraint forces in
    the same norm, and whether it is a bound. A contestant that
    fails, that does not suit the model, or that needs more than `time_limit` seconds stays in the
    table and says so.
    """
    options: dict[str, Any] = {
        "tolerance": number("tolerance", tolerance),
        "stop": stop,
        "max_iterations": max_iterations,
    }
    reference = _core.DynamicsMethod(model, method=REFERENCE, **options).follow(
        trajectory.times, trajectory.q, trajectory.v, trajectory.tau, passive=True
    )
    expected = reference["acceleration"]
    everyone = list(contestants())
    rows = []
    for k, contestant in enumerate(everyone):
        if progress is not None:
            name = " ".join(filter(None, (contestant.solver, contestant.initial_guess)))
            progress(Step(name or contestant.method, k, len(everyone)))
        rows.append(_measure(model, trajectory, contestant, expected, time_limit, options))
    return {
        "model": model.name,
        "bodies": model.n_bodies,
        "degrees_of_freedom": model.nv,
        "motion": trajectory.description,
        "states": int(trajectory.times.size - WARM_UP),
        "mean_step": float(np.diff(trajectory.times).mean()),
        "tolerance": tolerance,
        "stop": stop,
        **_system(model, trajectory, tolerance),
        "rows": sorted(rows, key=_rank),
    }


def _rank(row: Mapping[str, Any]) -> tuple[int, float, float]:
    seconds, error = row["seconds"], row["error"]
    order = 0 if row["outcome"] == "converged" else 2 if seconds is None else 1
    return order, math.inf if seconds is None else seconds, math.inf if error is None else error


def _measure(
    model: Model,
    trajectory: Trajectory,
    contestant: Contestant,
    expected: Array,
    time_limit: float,
    options: Mapping[str, Any],
) -> dict[str, Any]:
    row: dict[str, Any] = {
        "method": contestant.method,
        "solver": contestant.solver,
        "initial_guess": contestant.initial_guess,
        "mean_iterations": None,
        "max_iterations": None,
        "seconds": None,
        "error": None,
        "error_estimate": None,
        "error_is_bound": False,
        "states": 0,
        "outcome": "converged",
        "message": "",
    }
    try:
        dynamics = _core.DynamicsMethod(
            model,
            method=contestant.method,
            solver=contestant.solver or "auto",
            initial_guess=contestant.initial_guess or "zero",
            **options,
        )
        started = clock.monotonic()
        found = _pass(dynamics, trajectory, time_limit)
        if found["seconds"].size < trajectory.times.size:  # or was it another program's fault?
            found = max(found, _pass(dynamics, trajectory, time_limit), key=_states_reached)
    except InputError as error:
        return {**row, "outcome": "does not apply", "message": str(error)}
    seconds = found["seconds"]
    while clock.monotonic() - started < _TIMING_SECONDS:
        again = _pass(dynamics, trajectory, time_limit)["seconds"]
        count = min(seconds.size, again.size)
        seconds = np.minimum(seconds[:count], again[:count])
    row["states"] = max(0, seconds.size - WARM_UP)
    counted = slice(WARM_UP if seconds.size > WARM_UP else 0, None)
    failed = [outcome for outcome in found["outcome"] if outcome != "converged"]
    if failed:
        row["outcome"] = failed[0]
    elif seconds.size < trajectory.times.size:
        row["outcome"] = "too slow"
        row["message"] = f"stopped after {time_limit:g} s"
    row["seconds"] = float(seconds[counted].mean())
    if contestant.initial_guess or found["iterations"].any():
        row["mean_iterations"] = float(found["iterations"][counted].mean())
        row["max_iterations"] = int(found["iterations"][counted].max())
    row["error"] = _error(model, trajectory, found["acceleration"], expected)
    if contestant.initial_guess or contestant.method == "joint_space_conjugate_gradient":
        row["error_estimate"] = float(found["error_estimate"].max())
        row["error_is_bound"] = found["error_is_bound"]
    return row


def _states_reached(found: Mapping[str, Any]) -> int:
    return int(found["seconds"].size)


def _pass(dynamics: Any, trajectory: Trajectory, time_limit: float) -> dict[str, Any]:
    dynamics.reset()
    found: dict[str, Any] = dynamics.follow(
        trajectory.times,
        trajectory.q,
        trajectory.v,
        trajectory.tau,
        passive=True,
        time_limit=time_limit,
    )
    return found


def _error(
    model: Model, trajectory: Trajectory, acceleration: Array, expected: Array
) -> float | None:
    count = len(acceleration)
    q = trajectory.q[:count]
    with np.errstate(all="ignore"):
        off = acceleration - expected[:count]
        if not np.isfinite(off).all():
            return None
        # T(q, a) = a^T H a / 2: the norm in which the constraint forces' error is measured too.
        error = _core.kinetic_energy(model, q, off)
        size = _core.kinetic_energy(model, q, expected[:count])
    return float(np.sqrt(error.max() / size.max())) if size.max() > 0 else float(error.max())


def _system(model: Model, trajectory: Trajectory, tolerance: float) -> dict[str, Any]:
    """The system A f = b: its size, and the worst of its conditioning at some states."""
    places = np.linspace(0, trajectory.times.size - 1, _SPECTRUM_STATES).astype(int)
    found: dict[str, Any] = {
        "unknowns": None,
        "condition_estimate": None,
        "spectral_radius": None,
        "system_message": "",
        "spectrum_bound": None,
        "iterations_bound": None,
    }
    try:
        if model.n_loops or model.coupling_names or model.beam_lengths:
            graphs = [_core.graph_spectrum(model, trajectory.q[k]) for k in places]
            spectra, found["unknowns"] = [graph.found for graph in graphs], graphs[0].unknowns
            least, most = (min(g.bound[0] for g in graphs), max(g.bound[1] for g in graphs))
            if least > 0:
                found["spectrum_bound"] = [least, most]
                found["iterations_bound"] = max(graph.iterations(tolerance) for graph in graphs)
        else:
            systems = [_core.ConstraintSystem(model, trajectory.q[k]) for k in places]
            spectra, found["unknowns"] = [s.spectrum() for s in systems], systems[0].size
    except InputError as error:
        return {**found, "system_message": str(error)}
    found["condition_estimate"] = max(s.condition for s in spectra)
    found["spectral_radius"] = max(s.radius for s in spectra)
    return found


def plot(comparison: Mapping[str, Any]) -> str:
    """Time per call of every solver and guess, as SVG."""
    guesses = [entry["name"] for entry in _core.initial_guesses()]
    labels: dict[str, list[Dot]] = {}
    remarks: dict[str, str] = {}
    for row in comparison["rows"]:
        label = row["solver"] or row["method"]
        dots = labels.setdefault(label, [])
        if row["outcome"] != "converged":
            remarks[label] = row["outcome"]
        if row["seconds"] is not None:
            series = guesses.index(row["initial_guess"]) + 1 if row["initial_guess"] else 0
            dots.append(Dot(1e6 * row["seconds"], series, row["outcome"] == "converged"))
    return dots_to_svg(
        DotChart(
            f"{comparison['model']}: time of one evaluation",
            "time [us]; hollow: did not converge",
            [(label, dots, remarks.get(label, "")) for label, dots in labels.items()],
            ("no guess", *guesses),
        )
    )
