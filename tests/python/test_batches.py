"""Arrays with leading axes: every function, against one state at a time."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import linkwise as lw
from helpers.compare import assert_close
from helpers.random_trees import random_configuration, trees

FUNCTIONS = {
    "forward_dynamics": lambda m, q, v, tau, **o: lw.forward_dynamics(m, q, v, tau, **o),
    "passive": lambda m, q, v, tau, **o: lw.forward_dynamics(m, q, v, tau, passive=True, **o),
    "constraint_force": lambda m, q, v, tau, **o: lw.forward_dynamics(
        m, q, v, tau, method="constraint_force", **o
    ),
    "inverse_dynamics": lambda m, q, v, tau, **o: lw.inverse_dynamics(m, q, v, tau, **o),
    "inverse_dynamics_loads": lambda m, q, v, tau, **o: lw.inverse_dynamics_loads(
        m, q, v, tau, **o
    ),
    "joint_loads": lambda m, q, v, tau, **o: lw.joint_loads(m, q, v, tau, **o),
    "mass_matrix": lambda m, q, v, tau, **o: lw.mass_matrix(m, q, **o),
    "kinetic_energy": lambda m, q, v, tau, **o: lw.kinetic_energy(m, q, v, **o),
    "potential_energy": lambda m, q, v, tau, **o: lw.potential_energy(m, q, **o),
    "momentum": lambda m, q, v, tau, **o: lw.momentum(m, q, v, **o),
    "joint_poses": lambda m, q, v, tau, **o: lw.joint_poses(m, q, **o),
    "link_poses": lambda m, q, v, tau, **o: lw.link_poses(m, q, **o),
    "body_jacobian": lambda m, q, v, tau, **o: lw.body_jacobian(m, q, 0, **o),
    "passive_torque": lambda m, q, v, tau, **o: lw.passive_torque(m, q, v, **o),
}


def states(model, rng, shape):
    q = np.array([random_configuration(model, rng) for _ in range(int(np.prod(shape)))])
    v, tau = rng.standard_normal((2, *shape, model.nv))
    return q.reshape(*shape, model.nq), v, tau


@pytest.mark.parametrize("name", FUNCTIONS)
@given(tree=trees(), count=st.integers(1, 18))
def test_many_states_equal_one_by_one(name, tree, count):
    """Counts around whole groups of 2, 4 and 8 lanes."""
    model, function = tree.build(), FUNCTIONS[name]
    q, v, tau = states(model, tree.rng(), (count,))
    many = function(model, q, v, tau)
    for k in range(count):
        one = function(model, q[k], v[k], tau[k])
        assert_close(many[k], one, 1e-9, floor=1.0, what=f"{name} {k} of {count}")


@pytest.mark.parametrize("name", FUNCTIONS)
def test_leading_axes_broadcast(name, rng):
    model, function = lw.scenes.srms(), FUNCTIONS[name]
    q, v, tau = states(model, rng, (3, 5))
    wide = function(model, q[:, :1], v[:1], tau[0, 0])
    full = function(
        model,
        np.broadcast_to(q[:, :1], q.shape).copy(),
        np.broadcast_to(v[:1], v.shape).copy(),
        np.broadcast_to(tau[0, 0], tau.shape).copy(),
    )
    tail = np.shape(function(model, q[0, 0], v[0, 0], tau[0, 0]))
    lead = wide.shape[: wide.ndim - len(tail)]
    assert lead in ((3, 5), (3, 1))  # (3, 1): a function of q alone
    np.testing.assert_array_equal(np.broadcast_to(wide, (*full.shape,)), full)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_no_states_at_all(name):
    model = lw.scenes.chain(3)
    none = np.zeros((0, 3))
    assert FUNCTIONS[name](model, none, none, none).shape[0] == 0


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("threads", [0, -1, 100_000])
def test_threads_out_of_range(name, threads):
    model = lw.scenes.chain(3)
    with pytest.raises(ValueError, match=rf"threads is {threads}; give a whole number"):
        FUNCTIONS[name](model, np.zeros(3), np.zeros(3), np.zeros(3), threads=threads)


def test_axes_that_do_not_broadcast_are_named():
    model = lw.scenes.chain(3)
    q, v, tau = np.zeros((4, 3)), np.zeros((5, 3)), np.zeros((2, 1, 3))
    message = r"the leading axes do not broadcast: q \(4, 3\), v \(5, 3\); make them equal or 1"
    for function in (lw.forward_dynamics, lw.joint_loads, lw.kinetic_energy, lw.momentum):
        with pytest.raises(ValueError, match=message):
            function(model, q, v)
    with pytest.raises(ValueError, match=r"q \(4, 3\), v \(5, 3\), acceleration \(2, 1, 3\)"):
        lw.inverse_dynamics(model, q, v, tau)
    with pytest.raises(ValueError, match=r"q \(4, 3\), external \(5, 3, 6\)"):
        lw.forward_dynamics(model, q, None, external=np.zeros((5, 3, 6)))


def test_shapes_that_do_not_fit_are_named():
    model = lw.scenes.chain(3)
    with pytest.raises(ValueError, match=r"q has shape \(4,\) but shape \(..., 3\) is expected"):
        lw.forward_dynamics(model, np.zeros(4), np.zeros(3))
    with pytest.raises(ValueError, match=r"q has shape \(\) but shape"):
        lw.joint_poses(model, 1.0)
    with pytest.raises(ValueError, match="an array has more than 16 axes"):
        lw.joint_poses(model, np.zeros((1,) * 20 + (3,)))


@pytest.mark.parametrize(
    "given",
    [
        [[0.1, 0.2, 0.3], [1, 2, 3]],
        np.array([[1, 2, 3]], dtype=np.int32),
        np.array([[1, 2, 3]], dtype=np.float32),
        np.array([[1, 2, 3]], dtype=">f8"),
        np.array([[1, 2, 3]], dtype=np.dtype(float).newbyteorder("<")),  # as Zarr's arrays are
        np.asfortranarray(np.arange(12.0).reshape(4, 3)),
        np.arange(24.0).reshape(4, 6)[:, ::2],
        np.arange(12.0).reshape(4, 3)[::-1],
    ],
    ids=[
        "lists",
        "int32",
        "float32",
        "big-endian",
        "little-endian",
        "fortran",
        "strided",
        "reversed",
    ],
)
def test_whatever_numpy_can_turn_into_numbers(given):
    model = lw.scenes.chain(3)
    plain = np.array(given, dtype=np.float64, order="C")
    np.testing.assert_array_equal(
        lw.forward_dynamics(model, given, np.zeros(3)),
        lw.forward_dynamics(model, plain, np.zeros(3)),
    )


@pytest.mark.parametrize("given", ["abc", object(), [[1, 2], [3]], 1j])
def test_what_is_no_array_of_numbers(given):
    model = lw.scenes.chain(3)
    with pytest.raises(ValueError, match=r"^q (is not|holds) .*; give a float64 array$"):
        lw.forward_dynamics(model, given, np.zeros(3))


def test_results_live_on_their_own():
    """The arrays that come back own their memory and can be written to."""
    model = lw.scenes.chain(3)
    first = lw.forward_dynamics(model, np.full(3, 0.3), np.zeros(3))
    kept = first.copy()
    lw.forward_dynamics(model, np.full(3, 0.9), np.ones(3))
    np.testing.assert_array_equal(first, kept)
    first[:] = 0
    assert first.flags.owndata
