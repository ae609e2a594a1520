"""What a machine with loops does depends neither on units nor on which of its joints close them."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import linkwise as lw
from helpers.random_graphs import SI, Units, loads_of, random_graph, rates, whole

SEEDS = st.integers(0, 2**32 - 1)
SCALES = st.sampled_from([1e-4, 1e-3, 0.3048, 1.0, 60.0, 1e3, 1e6])
EXAMPLES = 40


def motion(cut, by_joint=None):
    """Rates by joint (random where none are given), accelerations and loads by joint, the mask."""
    model = cut.model
    q = np.array(model.initial_configuration())
    if by_joint is None:
        v = lw.assemble(model, q, np.random.default_rng(0).standard_normal(model.nv)).v
    else:
        v = rates(cut, by_joint)
    a = lw.forward_dynamics(model, q, v)
    loads = lw.joint_loads(model, q, v)
    mask = np.asarray(lw.indeterminacy(model, q).determinate)
    time = cut.units.time
    moving = whole(cut, v * time, lw.loop_coordinates(model, q, v)[1] * time)
    accelerations = whole(cut, a * time**2, lw.loop_accelerations(model, q, v, a) * time**2)
    known = dict(zip([*model.joint_names, *model.loop_names], mask, strict=True))
    return moving, accelerations, loads_of(cut, loads), known


def assert_same(first, second, conditioned):
    """Accelerations and determinate loads, to what rounding leaves of the largest."""
    _, a, w, known = first
    _, b, u, also = second
    fastest = max(1.0, *(np.abs(own).max(initial=0) for own in a.values()))
    most = max(1.0, *(np.abs(own[known[n]]).max(initial=0) for n, own in w.items()))
    for name in a:
        np.testing.assert_array_equal(known[name], also[name], err_msg=name)
        np.testing.assert_allclose(a[name], b[name], atol=conditioned * fastest, err_msg=name)
        held = known[name]
        np.testing.assert_allclose(
            w[name][held], u[name][held], atol=conditioned * most, err_msg=name
        )


@settings(max_examples=EXAMPLES)
@given(seed=SEEDS, planar=st.booleans(), length=SCALES, mass=SCALES, time=SCALES)
def test_units_change_nothing(seed, planar, length, mass, time):
    """Ranks, too: metres and kilograms, or millimetres and grams, or feet and minutes."""
    graph = random_graph(seed, planar=planar)
    order = np.arange(len(graph.edges))
    graph.rng = np.random.default_rng(seed)
    plain = motion(graph.cut(order))
    graph.rng = np.random.default_rng(seed)  # the same joints are turned round
    other = motion(graph.cut(order, Units(length, mass, time)), plain[0])
    assert_same(plain, other, 1e-8)


@settings(max_examples=EXAMPLES)
@given(seed=SEEDS, planar=st.booleans())
def test_any_spanning_tree_gives_the_same(seed, planar):
    """Joints in another order, others as loops, parents and children swapped."""
    graph = random_graph(seed, planar=planar)
    first = graph.cut(np.arange(len(graph.edges)))
    plain = motion(first)
    for _ in range(2):
        order = graph.rng.permutation(len(graph.edges))
        second = graph.cut(order)
        assert_same(plain, motion(second, plain[0]), 1e-8)


def test_the_machines_are_what_they_are_meant_to_be():
    """Loops, open loads in planar ones, and cuts that differ."""
    graph = random_graph(1, planar=True)
    first, last = (
        graph.cut(order)
        for order in (range(len(graph.edges)), range(-1, -len(graph.edges) - 1, -1))
    )
    assert first.model.n_loops == last.model.n_loops > 0
    assert set(first.model.loop_names) != set(last.model.loop_names)
    assert not all(np.all(mask) for mask in motion(first)[3].values())
    assert SI.loads().tolist() == [1.0] * 6
