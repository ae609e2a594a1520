"""What iterative solvers say of their errors is a bound, also where slow modes hide."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import linkwise as lw
from helpers.random_trees import random_configuration, trees

ITERATIVE = [entry["name"] for entry in lw.solvers() if entry["kind"] == "iterative"]
TOLERANCE = 1e-3
#: What is believed, and rounding.
MOST = 10 * (1 + 1e-6)


def rods(scene, ratio, n=10):
    """Rods of this inertia about their axes, relative to that across."""
    radius = np.sqrt(ratio / 6)
    if scene == "tree":
        return lw.scenes.tree(n, radius=radius)
    return lw.scenes.chain(n, axes=scene, radius=radius)


def energy_size(model, q, a):
    return np.sqrt(2 * lw.kinetic_energy(model, q, a))


def pose(model):
    return np.random.default_rng(0).uniform(-1, 1, model.nv)


@pytest.mark.parametrize("ratio", [1e-4, 1e-6, 1e-9])
@pytest.mark.parametrize("scene", ["random", "alternating", "tree"])
@pytest.mark.parametrize("solver", ITERATIVE)
def test_converged_means_converged_on_thin_rods(solver, scene, ratio):
    model = rods(scene, ratio)
    q = pose(model)
    system = lw.ConstraintSystem(model, q)
    exact, _ = system.solve("thomas", solver_options={"refinement_steps": 2})
    expected = lw.forward_dynamics(model, q, None, method="articulated_body")
    f, report = system.solve(solver, tolerance=TOLERANCE, max_iterations=2000)
    error = system.energy_norm(f - exact) / system.energy_norm(exact)
    if report.outcome in ("converged", "reached_max_iterations", "stagnated"):
        assert report.error_is_bound
        assert error <= report.error_estimate * (1 + 1e-3) + 1e-10
    if report.outcome == "converged":
        assert error <= MOST * TOLERANCE
        acceleration, _ = system.recover(f)
        off = energy_size(model, q, acceleration - expected)
        assert off <= MOST * TOLERANCE * energy_size(model, q, expected)


@pytest.mark.parametrize("ratio", [1e-6, 1e-9])
def test_conjugate_gradients_get_there(ratio):
    """They are not only honest: within ten times as many iterations as unknowns they converge."""
    for solver in ("conjugate_gradient", "rs_conjugate_gradient", "two_level"):
        for scene in ("random", "alternating", "tree"):
            made = lw.ConstraintSystem(model := rods(scene, ratio), pose(model))
            assert made.solve(solver, tolerance=TOLERANCE)[1].outcome == "converged"


@settings(deadline=None, max_examples=60)
@given(tree=trees(max_joints=8), seed=st.integers(0, 2**31))
def test_the_bound_is_the_hypotenuse_of_the_two_errors(tree, seed):
    """[prager1947]: of any f, on any tree, joints, armature and rates, against other methods."""
    model = tree.build()
    rng = np.random.default_rng(seed)
    q, v = random_configuration(model, rng), rng.normal(size=model.nv)
    tau = rng.normal(size=model.nv)
    system = lw.ConstraintSystem(model, q, v, tau)
    if system.size == 0:
        return
    exact, _ = system.solve("thomas", solver_options={"refinement_steps": 2})
    expected = lw.forward_dynamics(model, q, v, tau, method="articulated_body")
    # By the rule residual it stops after a step or two, wherever it is then.
    f, report = system.solve("conjugate_gradient", stop="residual", tolerance=0.3)
    if report.outcome != "converged":
        return
    assert report.error_is_bound
    forces = system.energy_norm(f - exact)
    motion = energy_size(model, q, system.recover(f)[0] - expected)
    gap = np.hypot(forces, motion)
    least = 0.5 * (np.sqrt(gap**2 + 4 * f @ system.b) - gap)  # that the forces can be
    assert report.error_estimate == pytest.approx(gap / least, rel=1e-6, abs=1e-11)


@pytest.mark.parametrize("ratio", [1e-4, 1e-9])
def test_joint_space_conjugate_gradients_are_checked_by_the_recursion(ratio):
    model = rods("random", ratio, 8)
    q = pose(model)
    expected = lw.forward_dynamics(model, q, None, method="articulated_body")
    method = lw.DynamicsMethod(model, method="joint_space_conjugate_gradient", tolerance=TOLERANCE)
    found, _, report = method.evaluate(0.0, q)
    assert report.error_is_bound
    error = energy_size(model, q, found - expected) / energy_size(model, q, expected)
    assert error <= MOST * TOLERANCE
    assert error == pytest.approx(report.error_estimate, rel=0.05, abs=1e-8)


def test_the_limit_of_iterations_holds_for_all_rounds_together():
    model = rods("random", 1e-9)
    system = lw.ConstraintSystem(model, pose(model))
    report = system.solve("conjugate_gradient", tolerance=TOLERANCE, max_iterations=40)[1]
    assert report.outcome == "reached_max_iterations"
    assert report.iterations <= 40
    assert report.error_is_bound


def test_a_run_on_thin_rods_is_right():
    model = rods("random", 1e-9)
    options = {"duration": 0.2, "every": 0.02, "q0": pose(model), "tolerance": 1e-3}
    exact = lw.simulate(model, **options | {"tolerance": 1e-8})
    for solver in ("conjugate_gradient", "rs_conjugate_gradient", "two_level"):
        run = lw.simulate(model, numerics={"solver": solver}, **options)
        assert run.warnings == []
        off = np.abs(run.joint_load.values - exact.joint_load.values).max()
        assert off <= 2e-3 * np.abs(exact.joint_load.values).max()
        assert np.isfinite(lw.loads.bounds(run).algebraic.sel(quantity="force")).all()


def test_a_run_whose_solver_stopped_too_early_says_so():
    model = rods("random", 1e-9)
    run = lw.simulate(
        model,
        duration=0.01,
        q0=pose(model),
        numerics={"solver": "conjugate_gradient", "stop": "paper", "solver_tolerance": 1e-3},
    )
    (said,) = [entry for entry in run.warnings if entry["element"].startswith("solver ")]
    assert "no bound of the loads" in said["text"]
    assert "energy_norm" in said["text"]
    assert run.attrs["solver_error"] == "not bounded"
    found = lw.loads.bounds(run)
    assert np.isnan(found.algebraic).all()
