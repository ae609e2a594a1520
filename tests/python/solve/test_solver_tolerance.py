"""In simulations the integrator's error test says how accurate constraint forces have to be."""

import numpy as np
import pytest

import linkwise as lw
from linkwise import _core
from linkwise.paper.arm import DURATION, MANEUVERS, weighted_norm

TOLERANCE = 1e-6


def follow(maneuver, solver, tolerance=TOLERANCE, **options):
    """(error at the end in the unit of the error test, iterations) of a maneuver."""
    model = lw.scenes.srms_3l5d()
    simulation = _core.Simulation(
        model,
        **{
            "solver": solver,
            "initial_guess": "projection",
            "max_iterations": 200_000,
            "step_tolerance": tolerance,
            **options,
        },
    )
    maneuver.apply_torques(model, simulation)
    simulation.start(0.0, np.array(maneuver.start), np.zeros(model.nv))
    reached = simulation.advance([DURATION], {"position", "velocity"})
    assert simulation.ending.outcome == "converged"
    miss = reached["position"][-1] - np.array(maneuver.end)
    error = weighted_norm(maneuver, miss, reached["velocity"][-1], tolerance)
    return error, simulation.statistics.iterations


@pytest.mark.parametrize("solver", ["conjugate_gradient", "rs_conjugate_gradient", "sor", "jacobi"])
def test_the_end_point_is_nearly_as_good_as_with_direct_solutions(solver):
    around = TOLERANCE * np.linspace(0.95, 1.05, 5)  # which steps are taken is partly chance
    for maneuver in MANEUVERS.values():
        direct = np.median([follow(maneuver, "thomas", t)[0] for t in around])
        tied = np.median([follow(maneuver, solver, t)[0] for t in around])
        assert tied <= 3 * direct


def test_a_relative_tolerance_of_a_tenth_was_not_enough():
    maneuver = MANEUVERS["II"]
    direct, _ = follow(maneuver, "thomas")
    relative, _ = follow(maneuver, "jacobi", solver_tolerance=TOLERANCE / 10)
    assert relative > 2 * direct


def test_a_given_tolerance_goes_first():
    maneuver = MANEUVERS["II"]
    tied = follow(maneuver, "conjugate_gradient")
    same = follow(maneuver, "conjugate_gradient", solver_options={"history": 8})
    assert tied == same
    for given in (
        {"solver_tolerance": 1e-3},
        {"solver_options": {"tolerance": 1e-3}},
        {"stop": "residual"},
    ):
        assert follow(maneuver, "conjugate_gradient", **given) != tied
    loose = follow(maneuver, "conjugate_gradient", solver_tolerance=1e-3)[1]
    assert loose < tied[1] < follow(maneuver, "conjugate_gradient", solver_tolerance=1e-13)[1]


def test_started_from_zero_solutions_depend_on_the_state_alone():
    maneuver = MANEUVERS["II"]
    stateless = follow(maneuver, "conjugate_gradient", initial_guess="zero")
    fixed = follow(
        maneuver, "conjugate_gradient", initial_guess="zero", solver_tolerance=TOLERANCE / 10
    )
    assert stateless == fixed


def test_long_chains_that_rounding_keeps_from_the_bound_go_on():
    model = lw.scenes.chain(48, axes="parallel")
    run = lw.simulate(
        model,
        duration=0.05,
        every=0.05,
        q0=np.full(48, 0.05),
        tolerance=1e-11,
        numerics=lw.Numerics(solver="two_level", initial_guess="projection"),
    )
    direct = lw.simulate(model, duration=0.05, every=0.05, q0=np.full(48, 0.05), tolerance=1e-11)
    np.testing.assert_allclose(run.position[-1], direct.position[-1], atol=1e-8)


def coarse_notes(**options):
    options = {"method": "constraint_force", "solver": "conjugate_gradient"} | options
    run = lw.simulate(lw.scenes.chain(4), duration=0.2, every=0.2, q0=np.full(4, 0.3), **options)
    return {note["element"]: note["text"] for note in run.warnings}


@pytest.mark.parametrize("integrator", ["auto", "adams"])
def test_steps_that_are_short_for_the_solvers_errors_are_not_stiff(integrator):
    said = coarse_notes(solver_tolerance=1e-3, integrator=integrator)
    assert "integrator" not in said
    assert "give 1e-06 at most, or leave it out" in said["solver_tolerance"]
    assert "solver_tolerance" in coarse_notes(solver_options={"tolerance": 1e-3})


def test_solvers_that_steps_bear_are_passed_over():
    assert not coarse_notes()
    assert not coarse_notes(solver_tolerance=1e-6)
    assert not coarse_notes(solver="thomas", solver_tolerance=1e-3)
    assert not coarse_notes(solver_tolerance=1e-3, integrator="runge_kutta_4", step=1e-3)
