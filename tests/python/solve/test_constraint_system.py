"""A f = b from Python: looked at, solved, and read back."""

import numpy as np
import pytest
import scipy.sparse

import linkwise as lw


def state(model, seed=0):
    rng = np.random.default_rng(seed)
    q = np.array(model.neutral_configuration(), dtype=float)
    free = [j for k, j in enumerate(model.joint_names) if model.joint_nq[k] == model.joint_nv[k]]
    for joint in free:
        places = model.q_slice(joint)
        q[places] = rng.uniform(-1, 1, q[places].shape)
    return q, rng.standard_normal(model.nv), rng.standard_normal(model.nv)


MODELS = {
    "chain": lambda: lw.scenes.chain(5, joint="universal"),
    "hub": lambda: lw.scenes.tree(13, branching=3, joint="revolute"),
    "floating": lambda: lw.scenes.tree(7, joint="spherical", floating_base=True),
    "armature": lambda: lw.scenes.chain(4, armature=0.1),
    "arm": lw.scenes.srms_3l5d,
}


@pytest.fixture(params=MODELS)
def model(request):
    return MODELS[request.param]()


def test_dense_sparse_and_product_agree(model):
    system = lw.ConstraintSystem(model, *state(model))
    A = system.dense()
    assert A.shape == (system.size, system.size)
    np.testing.assert_allclose(A, A.T, atol=1e-12 * np.abs(A).max())
    assert np.linalg.eigvalsh(A).min() > 0
    sparse = system.sparse()
    assert scipy.sparse.issparse(sparse)
    np.testing.assert_allclose(sparse.toarray(), A, atol=1e-12 * np.abs(A).max())
    x = np.random.default_rng(1).standard_normal(system.size)
    np.testing.assert_allclose(system.multiply(x), A @ x, rtol=1e-10, atol=1e-10)
    assert system.energy_norm(x) == pytest.approx(np.sqrt(x @ A @ x))
    assert sum(system.rows_per_joint) == system.size


def test_the_solution_is_the_motion(model):
    q, v, tau = state(model)
    system = lw.ConstraintSystem(model, q, v, tau)
    f = np.linalg.solve(system.dense(), system.b)
    acceleration, load = system.recover(f)
    expected = lw.forward_dynamics(model, q, v, tau, full=True)
    scale = np.abs(expected.acceleration).max()
    np.testing.assert_allclose(acceleration, expected.acceleration, atol=1e-9 * scale)
    load_scale = np.abs(expected.joint_load).max()
    np.testing.assert_allclose(load, expected.joint_load, atol=1e-9 * load_scale)


def test_an_error_in_forces_is_an_acceleration_error_in_kinetic_energy():
    # A spherical joint at the tip alone: every error of its force moves bodies freely, so that the
    # A-norm is the kinetic energy of the bodies' accelerations [sharf1993, eqs. (7), (11)].
    model = lw.scenes.chain(1, joint="spherical", gravity=(0, 0, 0))
    system = lw.ConstraintSystem(model, model.neutral_configuration())
    inertia = 1.0 / 12 * (3 * 0.05**2 + 1)
    # A unit force at the rod's end: a = 1/m there, plus (L/2)^2 / I across.
    across = 1 + 0.25 / inertia
    np.testing.assert_allclose(np.sort(np.diag(system.dense())), [1, across, across])


def test_every_solver_reports_and_agrees():
    model = lw.scenes.srms_3l5d()
    system = lw.ConstraintSystem(model, *state(model))
    exact = np.linalg.solve(system.dense(), system.b)
    for solver in lw.solvers():
        f, report = system.solve(solver["name"], tolerance=1e-9)
        assert report.outcome == "converged", solver["name"]
        assert report.solver == solver["name"]
        assert system.energy_norm(f - exact) <= 1e-8 * system.energy_norm(exact)
        assert (report.iterations > 0) == (solver["kind"] == "iterative")


def test_a_good_guess_saves_iterations():
    model = lw.scenes.srms_3l5d()
    system = lw.ConstraintSystem(model, *state(model))
    f, cold = system.solve("gauss_seidel", tolerance=1e-6)
    # Four of six digits are there, and an iteration always gains as much.
    _, warm = system.solve("gauss_seidel", guess=f * (1 + 1e-4), tolerance=1e-6)
    assert 0 < warm.iterations < 0.5 * cold.iterations


def test_a_limit_of_iterations_is_an_outcome_not_an_exception():
    model = lw.scenes.chain(10)
    system = lw.ConstraintSystem(model, *state(model))
    f, report = system.solve("jacobi", max_iterations=3)
    assert report.outcome == "reached_max_iterations"
    assert report.iterations == 3
    assert np.isfinite(f).all()


def test_spectrum_against_dense_eigenvalues(model):
    system = lw.ConstraintSystem(model, *state(model))
    A, D = system.dense(), np.zeros((system.size, system.size))
    end = 0
    for rows in system.rows_per_joint:
        block = slice(end, end + rows)
        D[block, block] = A[block, block]
        end += rows
    values = np.sort(np.linalg.eigvals(np.linalg.solve(D, A)).real)
    spectrum = system.spectrum()
    assert spectrum.converged
    assert spectrum.smallest == pytest.approx(values[0], rel=2e-3)
    assert spectrum.largest == pytest.approx(values[-1], rel=2e-3)
    assert system.condition_estimate() == pytest.approx(values[-1] / values[0], rel=4e-3)
    assert system.spectral_radius() == pytest.approx(np.abs(1 - values).max(), rel=2e-3)


def test_rows_of_a_joint_hold_its_forces():
    model = lw.scenes.srms_3l5d()
    system = lw.ConstraintSystem(model, *state(model))
    rows = [system.rows(joint) for joint in model.joint_names]
    assert [(r.start, r.stop) for r in rows] == [(0, 4), (4, 9), (9, 13)]
    with pytest.raises(lw.InputError, match="wrist"):
        system.rows("wrst")


def test_forces_and_moments_stay_apart_in_joints_of_several_axes():
    # In the plane of the arm's motion nothing acts across it: those unknowns are zero exactly, and
    # no guess by extrapolation can stir them.
    model = lw.scenes.srms_3l5d()
    rng = np.random.default_rng(0)
    q, v, tau = (rng.uniform(-1, 1, 5) * (0, 1, 1, 1, 0) for _ in range(3))
    system = lw.ConstraintSystem(model, q, v, tau)
    f, _ = system.solve("thomas")
    for joint in ("shoulder", "wrist"):
        assert np.abs(f[system.rows(joint)]).min(initial=0) == 0
        assert np.count_nonzero(f[system.rows(joint)]) == 2


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (((0.0, 0.0),), ("q has shape", "(..., 5)")),
        (([np.nan] * 5,), ("q holds a NaN",)),
        (([[0.0] * 5] * 2,), ("q has shape (2, 5)", "axes")),
    ],
)
def test_wrong_states_are_refused(arguments, parts):
    with pytest.raises(lw.InputError) as caught:
        lw.ConstraintSystem(lw.scenes.srms_3l5d(), *arguments)
    for part in parts:
        assert part in str(caught.value)


def test_wrong_forces_and_solvers_are_refused():
    system = lw.ConstraintSystem(lw.scenes.srms_3l5d(), [0.1] * 5)
    with pytest.raises(lw.InputError, match="guess"):
        system.solve("conjugate_gradient", guess=[1.0])
    with pytest.raises(lw.InputError, match="known: thomas"):
        system.solve("magic")
    with pytest.raises(lw.InputError, match=r"f has shape"):
        system.recover([1.0])
