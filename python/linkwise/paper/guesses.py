"""Warm starts and stop tests on the arm: what each guess saves, what each test really leaves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from linkwise import _core, scenes
from linkwise.paper.arm import (
    DURATION,
    MANEUVERS,
    MOST_ITERATIONS,
    Maneuver,
    Protocol,
    run_maneuver,
)
from linkwise.paper.published import INTEGRATOR_TOLERANCE, TOLERANCE_RATIO

WARM_SOLVERS = ("conjugate_gradient", "rs_conjugate_gradient", "gauss_seidel")
WARM_STOPS = ("paper", "energy_norm")
STOP_SOLVERS = ("jacobi", "gauss_seidel", "chebyshev", "conjugate_gradient")
STOP_GUESSES = ("zero", "cubic", "projection")
# Even steps, about as long as Adams' method takes at the paper's tolerance.
_STEPS = 44
_SETTLED = 5  # the first steps have no history yet
RATIOS = (1.0, 0.1, 0.01, 0.001)


def warm_start(advance: Callable[[str], None]) -> list[dict[str, Any]]:
    """Iterations by initial guess, in simulations of both maneuvers.

    The paper's stop test at the paper's tolerance, the energy norm at what the integrator's error
    test leaves.
    """
    model = scenes.srms_3l5d()
    epsilon = INTEGRATOR_TOLERANCE * TOLERANCE_RATIO
    rows = []
    for solver in WARM_SOLVERS:
        advance(f"warm starts: {solver}")
        for stop in WARM_STOPS:
            for guess in _core.initial_guesses():
                tolerance = epsilon if stop == "paper" else None
                protocol = Protocol(f"{guess['name']}, {stop}", guess["name"], stop, tolerance)
                for maneuver in MANEUVERS.values():
                    row = run_maneuver(model, maneuver, protocol, solver=solver)
                    rows.append({"initial_guess": guess["name"], "stop": stop, **row})
    return rows


def stop_tests(advance: Callable[[str], None]) -> list[dict[str, Any]]:
    """True error in the A-norm over the tolerance asked for, by stop rule and guess."""
    rows = []
    for solver in STOP_SOLVERS:
        advance(f"stop tests: {solver}")
        for maneuver in MANEUVERS.values():
            for guess in STOP_GUESSES:
                for stop in ("paper", "residual", "energy_norm"):
                    rows.append(_stop_test(maneuver, solver, guess, stop))
    return rows


def _stop_test(maneuver: Maneuver, solver: str, guess: str, stop: str) -> dict[str, Any]:
    model = scenes.srms_3l5d()
    tolerance = INTEGRATOR_TOLERANCE * TOLERANCE_RATIO
    times = (np.arange(_STEPS) + 0.5) * (DURATION / _STEPS)
    q, v, a = maneuver.motion(times)
    tau = _core.inverse_dynamics(model, q, v, a)
    dynamics = _core.DynamicsMethod(
        model,
        solver=solver,
        initial_guess=guess,
        stop=stop,
        tolerance=tolerance,
        max_iterations=MOST_ITERATIONS,
    )
    ratios, iterations, outcomes = [], [], set()
    for k, t in enumerate(times):
        report = dynamics.evaluate(t, q[k], v[k], tau[k])[2]
        system = _core.ConstraintSystem(model, q[k], v[k], tau[k])
        exact = system.solve("thomas")[0]
        error = system.energy_norm(dynamics.constraint_force - exact) / system.energy_norm(exact)
        ratios.append(error / tolerance)
        iterations.append(report.iterations)
        outcomes.add(report.outcome)
    settled = np.array(ratios[_SETTLED:])
    return {
        "method": solver,
        "maneuver": maneuver.name,
        "initial_guess": guess,
        "stop": stop,
        "mean_iterations": float(np.mean(iterations[_SETTLED:])),
        "median_error_over_tolerance": float(np.median(settled)),
        "max_error_over_tolerance": float(settled.max()),
        "outcomes": sorted(outcomes),
    }


def tolerance_ratios(advance: Callable[[str], None]) -> list[dict[str, Any]]:
    """The tolerance of the iteration over the integrator's: the paper's choice is a tenth."""
    model = scenes.srms_3l5d()
    advance("tolerance of the iteration")
    rows = []
    for ratio in RATIOS:
        protocol = Protocol(f"eps = {ratio:g} TOL", "cubic", "paper", ratio * INTEGRATOR_TOLERANCE)
        for maneuver in MANEUVERS.values():
            row = run_maneuver(model, maneuver, protocol, solver="conjugate_gradient", repeats=3)
            rows.append({"ratio": ratio, **row})
    return rows


def count() -> int:
    """How often `advance` will be called by the three."""
    return len(WARM_SOLVERS) + len(STOP_SOLVERS) + 1
