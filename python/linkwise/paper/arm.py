"""The paper's manipulator (its stand-in SRMS-3L5D) and the two maneuvers of Table 2."""

from __future__ import annotations

import time as clock
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from linkwise import _core
from linkwise.base import Array
from linkwise.paper.published import INTEGRATOR_TOLERANCE

if TYPE_CHECKING:
    from linkwise._core import Model

DURATION = 10.0
#: Enough for the slowest scheme, so that none is cut short.
MOST_ITERATIONS = 200_000
# The integrator passes the end by part of a step: the torques go on until there.
_TABLE_END, _TABLE_INTERVALS = 1.2, 2400


@dataclass(frozen=True)
class Maneuver:
    """A motion from rest to rest: every joint by s = t/T - sin(2 pi t/T)/(2 pi) of its way."""

    name: str
    start: tuple[float, ...]
    end: tuple[float, ...]

    def motion(self, times: npt.ArrayLike) -> tuple[Array, Array, Array]:
        """q, v, a at `times`, each of shape times.shape + (n,)."""
        t = np.asarray(times, dtype=np.float64)
        phase = 2 * np.pi * t / DURATION
        start, way = np.array(self.start), np.subtract(self.end, self.start)
        share = t / DURATION - np.sin(phase) / (2 * np.pi)
        return (
            start + np.multiply.outer(share, way),
            np.multiply.outer((1 - np.cos(phase)) / DURATION, way),
            np.multiply.outer(2 * np.pi * np.sin(phase) / DURATION**2, way),
        )

    def apply_torques(self, model: Model, simulation: Any) -> None:
        """Drive every joint with the inverse dynamics of the motion, open loop."""
        times = np.linspace(0.0, _TABLE_END * DURATION, _TABLE_INTERVALS + 1)
        torques = _core.inverse_dynamics(model, *self.motion(times))
        for joint in model.joint_names:
            # The paper's integrator knew no breakpoints, and the rows lie on one smooth curve.
            simulation.drive_torque_table(
                joint, times, torques[:, model.v_slice(joint)], interpolation="cubic", smooth=True
            )


MANEUVERS = {
    "I": Maneuver("I", (0.0, -0.3, 0.5, -0.2, 0.0), (0.0, -0.8, 1.2, 0.5, 0.0)),
    "II": Maneuver("II", (0.2, -0.3, 0.5, -0.2, 0.15), (1.0, -0.8, 1.2, 0.5, 0.6)),
}


@dataclass(frozen=True)
class Protocol:
    """How a maneuver is simulated: guess, stop rule and the two tolerances."""

    name: str
    initial_guess: str
    stop: str
    #: None: what the integrator's error test leaves to the forces.
    solver_tolerance: float | None
    tolerance: float = INTEGRATOR_TOLERANCE
    #: Solutions that the guess "projection" combines.
    history: int = 8


#: Section 5 of the paper.
PAPER_SOLVER_TOLERANCE = 1e-7
PAPER_PROTOCOL = Protocol("paper", "cubic", "paper", PAPER_SOLVER_TOLERANCE)
#: What linkwise does better: projection of the last solutions, and an estimate of the error itself
#: that is measured by what the integrator can notice.
OUR_PROTOCOL = Protocol("ours", "projection", "energy_norm", None, history=16)
#: So tight that what is left at the end is the integrator's error alone, whatever the scheme.
TIGHT_PROTOCOL = Protocol("tight", "projection", "energy_norm", 3e-9, history=16)


def run_maneuver(
    model: Model,
    maneuver: Maneuver,
    protocol: Protocol,
    *,
    method: str = "constraint_force",
    solver: str = "auto",
    solver_options: Mapping[str, Any] | None = None,
    repeats: int = 1,
) -> dict[str, Any]:
    """Simulate once for the figures, and `repeats` times for the shortest time.

    Times are the processor's, which other programs hardly lengthen. Iterations are those of all
    evaluations that the integrator asked for, repeated ones at the same time (its corrector's)
    included, as in the paper.
    """
    simulation = _core.Simulation(
        model,
        method=method,
        solver=solver,
        initial_guess=protocol.initial_guess,
        stop=protocol.stop,
        solver_tolerance=protocol.solver_tolerance,
        max_iterations=MOST_ITERATIONS,
        solver_options={"history": protocol.history, **(solver_options or {})},
        integrator="adams",
        step_tolerance=protocol.tolerance,
    )
    maneuver.apply_torques(model, simulation)
    simulation.keep_trace()
    q0, v0 = np.array(maneuver.start), np.zeros(model.nv)
    times = []
    for _ in range(max(1, repeats)):
        simulation.start(0.0, q0, v0)
        started = clock.process_time()
        reached = simulation.advance([DURATION], {"position", "velocity"})
        times.append(clock.process_time() - started)
    trace = simulation.trace()
    iterations = trace["iterations"]
    outcome = simulation.ending.outcome
    done = outcome == "converged"
    miss = reached["position"][-1] - np.array(maneuver.end) if done else np.full(model.nq, np.nan)
    speed = reached["velocity"][-1] if done else miss
    way = np.abs(np.subtract(maneuver.end, maneuver.start)).max()
    return {
        "method": solver if method == "constraint_force" else method,
        "maneuver": maneuver.name,
        "protocol": protocol.name,
        "outcome": outcome,
        "mean_iterations": float(iterations.mean()),
        "max_iterations": int(iterations.max()),
        "seconds": min(times),
        "solve_seconds": float(trace["seconds"].mean()),
        "final_error": float(np.abs(miss).max()),
        "weighted_final_error": weighted_norm(maneuver, miss, speed, protocol.tolerance),
        "accuracy_percent": float(100 * np.abs(miss).max() / way),
        "evaluations": int(iterations.size),
        "steps": simulation.statistics.steps if done else int(trace["accepted"].sum()),
    }


def weighted_norm(maneuver: Maneuver, miss: Array, speed: Array, tolerance: float) -> float:
    """Error of the state at the end, in the norm and unit of the integrator's error test.

    That is the root mean square of e_i / (TOL |y_i| + TOL).
    """
    y = np.concatenate((maneuver.end, np.zeros_like(speed)))
    error = np.concatenate((miss, speed))
    return float(np.sqrt(np.mean((error / (tolerance * (np.abs(y) + 1))) ** 2)))
