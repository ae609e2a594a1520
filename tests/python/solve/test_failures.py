"""Solves that end without meeting their tolerance stop a simulation with time, joint and remedy."""

import numpy as np
import pytest

import linkwise as lw

KICK = 0.2


def kick(t, q, v):
    """Nothing to solve for until it sets in."""
    return 0.0 if t < KICK else 5.0


@pytest.fixture(scope="module")
def chain():
    return lw.scenes.chain(6, axes="alternating", gravity=(0, 0, 0))


def run_until_it_stops(model, **options):
    with pytest.raises(lw.SimulationError) as caught:
        lw.simulate(model, duration=1.0, every=0.01, drives={"joint_6": kick}, **options)
    message, run = str(caught.value), caught.value.run
    assert "\n" not in message
    assert run.outcome in message
    assert run.attrs["stop_joint"] in model.joint_names
    assert f"joint {run.attrs['stop_joint']!r}" in message
    assert KICK - 0.1 <= run.attrs["stop_time"] <= KICK + 0.1
    assert f"t = {run.attrs['stop_time']:.6g} s" in message
    assert run.time[-1] == pytest.approx(run.attrs["stop_time"], abs=0.011)
    assert np.all(np.isfinite(run.position))
    return message, run


def test_the_iteration_limit(chain):
    numerics = lw.Numerics(solver="jacobi", max_iterations=3)
    message, run = run_until_it_stops(chain, numerics=numerics)
    assert run.outcome == "reached_max_iterations"
    assert "use solver 'thomas' or 'two_level'" in message


def test_stagnation_at_rounding_level(chain):
    numerics = lw.Numerics(solver="conjugate_gradient", solver_tolerance=1e-18)
    message, run = run_until_it_stops(chain, numerics=numerics)
    assert run.outcome == "stagnated"
    assert "loosen the tolerance" in message


def test_divergence():
    star = lw.scenes.tree(13, branching=4, joint="universal", gravity=(0, 0, 0))
    message, run = run_until_it_stops_in(star)
    assert run.outcome == "diverged"
    assert "use a solver that converges for every mechanism" in message


def run_until_it_stops_in(tree):
    with pytest.raises(lw.SimulationError) as caught:
        lw.simulate(
            tree,
            duration=0.5,
            drives={tree.joint_names[-1]: lambda t, q, v: [kick(t, q, v), 0.0]},
            numerics=lw.Numerics(solver="jacobi"),
        )
    assert caught.value.run.attrs["stop_joint"] in tree.joint_names
    return str(caught.value), caught.value.run


def test_an_inertia_that_is_none_is_named_before_anything_is_computed():
    builder = lw.ModelBuilder("wrong")
    builder.add_link("ground")
    builder.add_link("bob", mass=1.0, inertia=np.diag([1.0, 1.0, -0.5]))
    builder.add_joint("pivot", "revolute", "ground", "bob", axis=(0, 1, 0))
    with pytest.raises(lw.InputError, match="bob"):
        builder.build()
