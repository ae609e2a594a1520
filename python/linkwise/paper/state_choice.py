"""The paper's state, absolute velocities of the bodies, beside joint rates: accuracy and drift."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from linkwise import _core, scenes
from linkwise.paper.arm import DURATION, MANEUVERS, MOST_ITERATIONS, PAPER_PROTOCOL, Maneuver

SOLVERS = ("thomas", "conjugate_gradient")
STATES = ("joint_rates", "body_velocities")
_SAMPLES = 101


def state_choice(advance: Callable[[str], None]) -> list[dict[str, Any]]:
    """One row per solver, maneuver and state, under the paper's protocol."""
    advance("choice of the state")
    return [
        _run(maneuver, solver, state)
        for solver in SOLVERS
        for maneuver in MANEUVERS.values()
        for state in STATES
    ]


def _run(maneuver: Maneuver, solver: str, state: str) -> dict[str, Any]:
    model = scenes.srms_3l5d()
    simulation = _core.Simulation(
        model,
        method="constraint_force",
        solver=solver,
        initial_guess=PAPER_PROTOCOL.initial_guess,
        stop=PAPER_PROTOCOL.stop,
        solver_tolerance=PAPER_PROTOCOL.solver_tolerance,
        max_iterations=MOST_ITERATIONS,
        state=state,
        step_tolerance=PAPER_PROTOCOL.tolerance,
    )
    maneuver.apply_torques(model, simulation)
    simulation.start(0.0, np.array(maneuver.start), np.zeros(model.nv))
    drift = 0.0
    for time in np.linspace(0.0, DURATION, _SAMPLES):
        reached = simulation.advance([time], {"position"})
        drift = max(drift, simulation.velocity_drift)
    miss = np.abs(reached["position"][-1] - np.array(maneuver.end))
    return {
        "method": solver,
        "maneuver": maneuver.name,
        "state": state,
        "outcome": simulation.ending.outcome,
        "final_error": float(miss.max()),
        # m/s or rad/s by which the joints' ends part, at most, along the maneuver.
        "greatest_drift": drift,
        "evaluations": simulation.statistics.evaluations,
    }
