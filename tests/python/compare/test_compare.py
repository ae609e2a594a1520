"""Comparing solvers: what fails, does not apply or takes too long stays in the table."""

import numpy as np
import pytest

import linkwise as lw
from linkwise import compare


@pytest.fixture(scope="module")
def hub():
    """A body with three outboard joints: Jacobi diverges there, and it is no chain."""
    model = lw.scenes.tree(13, branching=3, joint="universal")
    motion = compare.free_trajectory(model, states=3, seed=0)
    return compare.compare(model, motion, time_limit=600.0)


def rows_of(found, solver):
    return [row for row in found["rows"] if row["solver"] == solver]


def test_what_diverges_is_shown_as_such(hub):
    assert hub["spectral_radius"] > 1
    rows = rows_of(hub, "jacobi")
    assert [row["initial_guess"] for row in rows]
    assert {row["outcome"] for row in rows if row["initial_guess"] == "zero"} == {"diverged"}
    for row in rows_of(hub, "conjugate_gradient"):
        assert row["outcome"] == "converged"


def test_what_does_not_apply_says_why(hub):
    for solver in ("twisted", "cyclic_reduction"):
        (row,) = rows_of(hub, solver)
        assert row["outcome"] == "does not apply"
        assert "chains only" in row["message"]
        assert row["seconds"] is None


def test_rows_that_converge_come_first_the_fastest_on_top(hub):
    outcomes = [row["outcome"] for row in hub["rows"]]
    first = outcomes.index(next(o for o in outcomes if o != "converged"))
    assert "converged" not in outcomes[first:]
    times = [row["seconds"] for row in hub["rows"][:first]]
    assert times == sorted(times)
    assert outcomes[-1] == "does not apply"


def test_errors_are_against_the_recursion(hub):
    by_solver = {row["solver"] or row["method"]: row for row in hub["rows"]}
    assert by_solver["articulated_body"]["error"] == 0
    assert by_solver["composite_rigid_body"]["error"] < 1e-12
    assert by_solver["thomas"]["error"] < 1e-10


def test_what_takes_too_long_is_stopped_and_shown():
    model = lw.scenes.chain(64, axes="parallel")
    motion = compare.free_trajectory(model, states=2, seed=0)
    found = compare.compare(model, motion, time_limit=1e-9)
    assert found["unknowns"] == 320
    slow = [row for row in found["rows"] if row["outcome"] == "too slow"]
    assert slow
    for row in slow:
        assert "1e-09 s" in row["message"]


def test_a_singular_inertia_leaves_the_other_methods():
    builder = lw.ModelBuilder("point")
    builder.add_link("ground")
    builder.add_link("bob", mass=1.0, com=(0, 0, -1.0))
    builder.add_joint("pivot", "revolute", "ground", "bob", axis=(0, 1, 0))
    model = builder.build()
    found = compare.compare(model, compare.free_trajectory(model, states=2, seed=0))
    assert found["unknowns"] is None
    assert "bob" in found["system_message"]
    for row in found["rows"]:
        if row["solver"]:
            assert row["outcome"] == "does not apply"
            assert "bob" in row["message"]
    assert found["rows"][0]["outcome"] == "converged"


def test_contestants_follow_the_tables_of_the_core():
    everyone = list(compare.contestants())
    direct = [s["name"] for s in lw.solvers() if s["kind"] == "direct"]
    iterative = [s["name"] for s in lw.solvers() if s["kind"] == "iterative"]
    assert len(set(everyone)) == len(everyone)
    assert len(everyone) == (
        len(lw.methods()) - 1 + len(direct) + len(iterative) * len(lw.initial_guesses())
    )


def test_random_poses_keep_to_limits_and_quaternions_stay():
    builder = lw.ModelBuilder("limits")
    builder.set_floating_base()
    for k in range(3):
        builder.add_link(f"link{k}", mass=1.0, inertia=np.eye(3))
    builder.add_joint("a", "revolute", "link0", "link1", lower=0.2, upper=0.3)
    builder.add_joint("b", "continuous", "link1", "link2")
    model = builder.build()
    for seed in range(20):
        q = compare.random_pose(model, np.random.default_rng(seed))
        assert 0.2 <= q[model.q_slice("a")][0] <= 0.3
        assert abs(q[model.q_slice("b")][0]) <= 1
        np.testing.assert_array_equal(q[:7], model.neutral_configuration()[:7])
