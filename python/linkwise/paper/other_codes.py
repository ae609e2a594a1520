"""The paper's protocol with other codes for Adams' method: SciPy's VODE and LSODA.

They do not tell which steps they accept, so the cubic passes through the solutions of the last four
calls at different times, accepted or not.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise import _core, scenes
from linkwise.base import Array
from linkwise.paper.arm import (
    DURATION,
    MANEUVERS,
    MOST_ITERATIONS,
    PAPER_PROTOCOL,
    PAPER_SOLVER_TOLERANCE,
    Maneuver,
)
from linkwise.paper.published import TABLE_2

if TYPE_CHECKING:
    from linkwise._core import Model

#: Under the rest that J-SI and SOR leave, LSODA changes to its stiff method and takes thousands of
#: steps.
CODES: dict[str, tuple[dict[str, Any], tuple[str, ...]]] = {
    "vode": ({"method": "adams"}, tuple(TABLE_2)),
    "lsoda": ({}, ("jacobi", "conjugate_gradient", "gauss_seidel")),
}


def other_codes(advance: Callable[[str], None]) -> list[dict[str, Any]]:
    """One row a code, scheme and maneuver."""
    advance("other codes for Adams' method")
    model = scenes.srms_3l5d()
    return [
        _run(model, maneuver, solver, code, options)
        for code, (options, solvers) in CODES.items()
        for solver in solvers
        for maneuver in MANEUVERS.values()
    ]


def _run(
    model: Model, maneuver: Maneuver, solver: str, code: str, options: dict[str, Any]
) -> dict[str, Any]:
    from scipy.integrate import ode

    dynamics = _core.DynamicsMethod(
        model,
        solver=solver,
        initial_guess=PAPER_PROTOCOL.initial_guess,
        stop=PAPER_PROTOCOL.stop,
        tolerance=PAPER_SOLVER_TOLERANCE,
        max_iterations=MOST_ITERATIONS,
    )
    iterations: list[int] = []

    def rates(t: float, y: Array) -> Array:
        q, v = np.split(y, 2)
        torque = _core.inverse_dynamics(model, *maneuver.motion(t))
        acceleration, _, report = dynamics.evaluate(t, q, v, torque)
        iterations.append(report.iterations)
        return np.concatenate((v, acceleration))

    tolerance = PAPER_PROTOCOL.tolerance
    integrator = ode(rates).set_integrator(
        code, rtol=tolerance, atol=tolerance, nsteps=100_000, **options
    )
    integrator.set_initial_value(np.concatenate((maneuver.start, np.zeros(model.nv))), 0.0)
    reached = integrator.integrate(DURATION)
    return {
        "code": code,
        "method": solver,
        "maneuver": maneuver.name,
        "outcome": "converged" if integrator.successful() else "failed",
        "mean_iterations": float(np.mean(iterations)),
        "evaluations": len(iterations),
        "final_error": float(np.abs(reached[: model.nq] - maneuver.end).max()),
    }
