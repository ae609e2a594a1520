"""Options of solvers by name, guesses and their memory, traces and the choice of the state."""

import numpy as np
import pytest

import linkwise as lw
from linkwise import _core

STATE = ([0.1, -0.4, 0.7, 0.1, 0.2], [0.3, 0.2, -0.1, 0.4, -0.2], [5.0, -3.0, 2.0, 1.0, -1.0])


@pytest.fixture(scope="module")
def arm():
    return lw.scenes.srms_3l5d()


@pytest.mark.parametrize(
    ("options", "parts"),
    [
        ({"omga": 1.0}, ("'omga'", "known: tolerance", "omega", "history")),
        ({"omega": 2.0}, ("omega is 2", "0 < omega < 2")),
        ({"omega": 0.0}, ("omega is 0",)),
        ({"omega": "1.5"}, ("'omega'", "'1.5'", "a number")),
        ({"omega": True}, ("'omega'", "a number")),
        ({"tolerance": 0.0}, ("tolerance is 0", "above 0")),
        ({"tolerance": -1e-9}, ("tolerance",)),
        ({"spectral_radius": 1.0}, ("spectral_radius", "(0, 1)")),
        ({"block_size": 1.5}, ("'block_size'", "whole number")),
        ({"history": 0}, ("history", "1 or more")),
        ({"stop": "soon"}, ("stop rule 'soon'", "paper, residual, energy_norm")),
        ({"form": "one_term"}, ("'one_term'", "two_term, three_term")),
        ({"relaxation": "best"}, ("'best'", "optimal, given, adaptive")),
        ({"estimate_error": 1}, ("'estimate_error'", "True or False")),
        ([("omega", 1.0)], ("not a dictionary",)),
    ],
)
def test_wrong_options_are_refused_in_one_line(arm, options, parts):
    for call in (
        lambda: lw.forward_dynamics(arm, *STATE, solver="sor", solver_options=options),
        lambda: lw.DynamicsMethod(arm, solver="sor", solver_options=options),
        lambda: lw.ConstraintSystem(arm, *STATE).solve("sor", solver_options=options),
    ):
        with pytest.raises(lw.InputError) as caught:
            call()
        message = str(caught.value)
        assert "\n" not in message
        for part in parts:
            assert part in message
    if isinstance(options, dict):
        with pytest.raises(lw.InputError):
            lw.simulate(
                arm,
                duration=1.0,
                numerics=lw.Numerics(solver="sor", solver_options=options),
            )


def test_known_options_are_listed_with_their_defaults():
    listed = {entry["name"]: entry for entry in lw.solver_options()}
    assert listed["omega"]["default"] == 1.0
    assert listed["stop"]["default"] == "energy_norm"
    assert listed["history"]["default"] == 8
    assert all(entry["description"] for entry in listed.values())
    assert [rule["name"] for rule in lw.stop_rules()] == ["paper", "residual", "energy_norm"]
    assert [g["name"] for g in lw.initial_guesses()][:4] == ["zero", "previous", "linear", "cubic"]


def test_omega_means_a_given_factor(arm):
    system = lw.ConstraintSystem(arm, *STATE)
    best = 2 / (1 + np.sqrt(1 - system.spectral_radius() ** 2))
    count = {
        name: system.solve("sor", tolerance=1e-8, solver_options=options)[1].iterations
        for name, options in {
            "optimal": {},
            "given": {"omega": best},
            "poor": {"omega": 1.0},
            "gauss_seidel": {"relaxation": "given"},
        }.items()
    }
    assert abs(count["given"] - count["optimal"]) <= 2
    assert count["poor"] > 2 * count["optimal"]
    assert count["gauss_seidel"] == count["poor"]


def test_options_reach_the_solver(arm):
    system = lw.ConstraintSystem(arm, *STATE)
    given = {"tolerance": 1e-3, "max_iterations": 50}
    loose, report = system.solve("conjugate_gradient", solver_options=given)
    tight, _ = system.solve("conjugate_gradient")
    assert report.iterations < system.solve("conjugate_gradient")[1].iterations
    assert system.energy_norm(loose - tight) <= 1e-3 * system.energy_norm(tight)
    assert np.isnan(system.solve("thomas")[1].error_estimate)
    assert system.solve("thomas", solver_options={"estimate_error": True})[1].error_estimate < 1e-12


def motion(model, times):
    """Angles that swing, with the torques that this takes."""
    rates = np.arange(1, model.nv + 1) / model.nv
    angle = np.multiply.outer(times, rates)
    q, v, a = np.sin(angle), np.cos(angle) * rates, -np.sin(angle) * rates**2
    return q, v, lw.inverse_dynamics(model, q, v, a), a


@pytest.mark.parametrize("guess", [g["name"] for g in lw.initial_guesses()])
def test_a_method_follows_a_motion_whatever_it_starts_from(arm, guess):
    times = np.linspace(0.1, 1.0, 40)
    q, v, tau, a = motion(arm, times)
    dynamics = lw.DynamicsMethod(arm, solver="gauss_seidel", initial_guess=guess, tolerance=1e-8)
    found = dynamics.follow(times, q, v, tau)
    assert set(found["outcome"]) == {"converged"}
    np.testing.assert_allclose(found["acceleration"], a, atol=1e-4)
    assert np.all(found["seconds"] > 0)
    cold = lw.DynamicsMethod(arm, solver="gauss_seidel", initial_guess="zero", tolerance=1e-8)
    most = cold.follow(times, q, v, tau)["iterations"].sum()
    total = found["iterations"].sum()
    assert total == most if guess == "zero" else total < most


def test_a_second_evaluation_at_one_time_starts_from_the_first(arm):
    times = np.array([0.3])
    q, v, tau, _ = motion(arm, times)
    dynamics = lw.DynamicsMethod(
        arm, solver="gauss_seidel", initial_guess="previous", tolerance=1e-7
    )
    first = dynamics.evaluate(0.3, q[0], v[0], tau[0], accept=False)[2]
    again = dynamics.evaluate(0.3, q[0], v[0], tau[0], accept=False)[2]
    assert again.iterations <= 2 < first.iterations
    assert dynamics.constraint_force.shape == (13,)
    dynamics.reset()
    assert dynamics.evaluate(0.3, q[0], v[0], tau[0])[2].iterations == first.iterations


def test_a_method_stops_at_its_time_limit():
    model = lw.scenes.chain(200, axes="parallel")
    times = np.linspace(0.1, 1.0, 50)
    q, v, tau, _ = motion(model, times)
    found = lw.DynamicsMethod(model, solver="jacobi").follow(times, q, v, tau, time_limit=1e-9)
    assert len(found["outcome"]) == len(found["acceleration"]) == 1


def test_a_method_wants_a_time_a_state(arm):
    with pytest.raises(lw.InputError, match="2 states"):
        lw.DynamicsMethod(arm).follow([0.0], np.zeros((2, 5)))


def test_a_trace_holds_every_evaluation(arm):
    simulation = _core.Simulation(arm, solver="conjugate_gradient")
    simulation.keep_trace()
    simulation.start(0.0, STATE[0], STATE[1])
    simulation.advance([0.5], ("position",))
    done = simulation.statistics
    trace = simulation.trace()
    assert trace["time"].size == done.evaluations
    assert trace["iterations"].sum() == done.iterations
    assert trace["accepted"].sum() == done.steps
    assert np.all(trace["seconds"] > 0)
    simulation.start(0.0, STATE[0], STATE[1])
    assert simulation.trace()["time"].size == 0


MODELS = {
    "arm": lambda: lw.scenes.srms_3l5d(gravity=(0, 0, -9.81)),
    "chain": lambda: lw.scenes.chain(4, joint="universal"),
    "armature": lambda: lw.scenes.chain(4, armature=0.1),
    "floating": lambda: lw.scenes.tree(7, joint="spherical", floating_base=True),
}


@pytest.mark.parametrize("name", MODELS)
def test_body_velocities_are_the_same_motion(name):
    model = MODELS[name]()
    v0 = np.random.default_rng(0).normal(size=model.nv) * 0.3
    q0 = model.neutral_configuration()
    options = {"duration": 1.0, "every": 0.25, "q0": q0, "v0": v0, "tolerance": 1e-10}
    joint, body = (
        lw.simulate(model, **options, numerics=lw.Numerics(method="constraint_force", state=state))
        for state in ("joint_rates", "body_velocities")
    )
    for quantity in ("position", "velocity", "joint_load"):
        np.testing.assert_allclose(body[quantity], joint[quantity], atol=2e-6)
    simulation = _core.Simulation(model, state="body_velocities", tolerance=1e-10)
    simulation.start(0.0, q0, v0)
    simulation.advance([1.0], ())
    assert 0 < simulation.velocity_drift < 1e-6


def test_a_locked_joint_stays_locked_with_body_velocities(arm):
    run = lw.simulate(
        arm,
        duration=1.0,
        v0=[0.3, 0.2, 0.0, 0.1, 0.0],
        drives={"elbow": lw.drives.Locked()},
        numerics=lw.Numerics(state="body_velocities"),
    )
    elbow = arm.q_slice("elbow")
    assert np.all(run.position.values[:, elbow] == run.position.values[0, elbow])


def test_body_velocities_need_constraint_forces(arm):
    with pytest.raises(lw.InputError, match="needs method constraint_force"):
        lw.simulate(
            arm,
            duration=1.0,
            numerics=lw.Numerics(method="articulated_body", state="body_velocities"),
        )
    with pytest.raises(lw.InputError, match="joint_rates, body_velocities"):
        lw.simulate(arm, duration=1.0, numerics=lw.Numerics(state="momenta"))
