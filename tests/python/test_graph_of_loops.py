"""All joint constraint forces of machines with closed loops at once: method constraint_force.

Witnesses: the equations of motion as one dense system, and the recursion along the loops.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import linkwise as lw
from benchmarks.closed_loops import net
from tests.helpers import looped_machines

GRAPH = {"method": "constraint_force"}
LOOPS = st.lists(
    st.tuples(
        st.sampled_from(sorted(looped_machines.HELD)),
        st.sampled_from(["base", "link1", "link3", "link5"]),
        st.sampled_from(["link4", "link6", "link7", "link8"]),
    ),
    min_size=1,
    max_size=3,
)


def scale(x):
    return max(1.0, np.abs(x).max())


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 2**31), LOOPS, st.sampled_from([0, 0.3]))
def test_random_machines_move_as_one_dense_system(seed, loops, armature):
    rng = np.random.default_rng(seed)
    machine = looped_machines.chain(rng, loops)
    model, q = machine.model, machine.q
    v, tau = looped_machines.closed_rates(machine, rng), rng.normal(size=model.nv)
    if armature:
        model = model.with_joint("joint1", armature=armature)
        tau[1] = 0
    by_graph = lw.forward_dynamics(model, q, v, tau, **GRAPH)
    by_recursion = lw.forward_dynamics(model, q, v, tau, method="articulated_body")
    np.testing.assert_allclose(by_graph, by_recursion, rtol=0, atol=1e-9 * scale(by_recursion))
    if armature:
        return
    zero = np.zeros_like(q)
    bias = lw.inverse_dynamics(machine.tree, q, v, zero)
    expected, _ = looped_machines.accelerations(machine, v, tau - bias, bias=True)
    # the witness's rows are differentiated by a difference
    np.testing.assert_allclose(by_graph, expected, rtol=0, atol=1e-5 * scale(expected))


@pytest.mark.parametrize("name", ["four_bars", "bricard", "stewart", "andrews", "slider_crank"])
def test_published_machines(name):
    machine = lw.scenes.benchmark(name)
    model, q, v = machine.model, machine.q0, machine.v0
    tau = np.random.default_rng(1).normal(size=model.nv)
    expected = lw.forward_dynamics(model, q, v, tau, method="articulated_body")
    np.testing.assert_allclose(
        lw.forward_dynamics(model, q, v, tau, **GRAPH),
        expected,
        rtol=0,
        atol=1e-10 * scale(expected),
    )
    known = np.array(lw.indeterminacy(model, q).determinate)
    loads = [
        lw.joint_loads(model, q, v, tau, method=m) for m in ("articulated_body", *GRAPH.values())
    ]
    np.testing.assert_allclose(
        loads[1][known], loads[0][known], rtol=0, atol=1e-9 * scale(loads[0])
    )


def test_a_net_by_all_ways():
    model, rng = net(7), np.random.default_rng(3)
    q, v = model.neutral_configuration(), np.zeros(model.nv)
    tau = rng.normal(size=model.nv)
    expected = lw.forward_dynamics(model, q, v, tau, method="articulated_body")
    loads = lw.joint_loads(model, q, v, tau, method="articulated_body")
    for solver in ("thomas", "conjugate_gradient"):
        got = lw.forward_dynamics(model, q, v, tau, **GRAPH, solver=solver, tolerance=1e-12)
        np.testing.assert_allclose(got, expected, rtol=0, atol=1e-8 * scale(expected))
    np.testing.assert_allclose(
        lw.joint_loads(model, q, v, tau, **GRAPH), loads, rtol=0, atol=1e-10 * scale(loads)
    )


def test_auto_takes_what_has_less_to_do_and_says_why():
    small, large = net(3), net(12)
    for model, method in ((small, "articulated_body"), (large, "constraint_force")):
        q = model.neutral_configuration()
        report = lw.forward_dynamics(model, q, np.zeros(model.nv), full=True).report
        assert report.method == method
        assert "closed loops" in report.reason
    assert "multiplications" in report.reason
    row = lw.scenes.benchmark("four_bars", n=300)  # short paths, whatever the number
    full = lw.forward_dynamics(row.model, row.q0, row.v0, full=True)
    assert full.report.method == "articulated_body"


def test_no_bit_depends_on_the_number_of_threads():
    model, rng = net(9), np.random.default_rng(5)
    q = np.tile(model.neutral_configuration(), (3, 1))
    tau = rng.normal(size=(3, model.nv))
    for solver in ("thomas", "conjugate_gradient"):
        one, two = (
            lw.forward_dynamics(model, q, None, tau, **GRAPH, solver=solver, threads=threads)
            for threads in (1, 2)
        )
        np.testing.assert_array_equal(one, two)


def test_loads_by_cause_add_up():
    machine = lw.scenes.benchmark("four_bars", n=2)
    model, q, v = machine.model, machine.q0, machine.v0
    causes = ["gravity", "velocity", "drive"]
    tau = np.random.default_rng(7).normal(size=model.nv)
    shares = lw.joint_loads_by_cause(model, causes, q, v, tau, **GRAPH)
    whole = lw.joint_loads(model, q, v, tau, **GRAPH)
    np.testing.assert_allclose(np.sum(shares, axis=0), whole, rtol=0, atol=1e-6 * scale(whole))


def test_a_net_swings_as_by_the_recursion():
    """Assembled, simulated and kept on its loops without the recursion along them."""
    model = net(9)
    runs = {}
    for method in ("auto", "articulated_body"):
        run = lw.simulate(model, duration=0.2, method=method, tolerance=1e-8)
        runs[method] = run.position.values[-1]
        assert np.abs(lw.loop_gaps(model, runs[method])).max() < 1e-12
    np.testing.assert_allclose(runs["auto"], runs["articulated_body"], rtol=0, atol=1e-6)


def test_solvers_of_trees_are_refused():
    machine = lw.scenes.benchmark("four_bars")
    takes = {solver["name"] for solver in lw.solvers() if solver["takes_loops"]}
    assert takes == {"thomas", "conjugate_gradient"}
    for solver in lw.solvers():
        if solver["name"] in takes:
            continue
        with pytest.raises(lw.InputError, match=r"takes trees, and this machine has closed loops"):
            lw.forward_dynamics(machine.model, machine.q0, machine.v0, solver=solver["name"])


def test_a_body_without_inertia_is_left_to_the_recursion():
    model = lw.scenes.benchmark("pendulum").model
    with pytest.raises(lw.InputError, match=r"singular inertia"):
        lw.forward_dynamics(model, model.neutral_configuration(), None, **GRAPH)
