"""Identities that hold for any tree of any joints, at one state."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import linkwise as lw
from helpers.compare import assert_close, load_error
from helpers.methods import METHODS
from helpers.newton_euler import newton_euler
from helpers.random_trees import random_configuration, random_rotation, trees


def state(tree, model):
    rng = tree.rng()
    return random_configuration(model, rng), *rng.standard_normal((2, model.nv))


@given(trees())
def test_inverse_dynamics_and_joint_loads_are_newton_and_eulers(tree):
    """Against an independent world-frame implementation; the load is the wrench it finds."""
    model = tree.build()
    q, v, a = state(tree, model)
    tau, loads, motions = newton_euler(tree, model, q, v, a)
    assert_close(lw.inverse_dynamics(model, q, v, a), tau, 1e-11, floor=1.0, what="torque")
    expected = [loads[name] for name in model.joint_names]
    assert load_error(lw.joint_loads(model, q, v, tau), expected, floor=1.0) < 1e-9
    poses = lw.joint_poses(model, q)
    np.testing.assert_allclose(
        poses[:, :3, :3], [motions[n].R for n in model.joint_names], atol=1e-12
    )
    np.testing.assert_allclose(
        poses[:, :3, 3], [motions[n].p for n in model.joint_names], atol=1e-11
    )


@pytest.mark.parametrize("method", METHODS)
@given(tree=trees())
def test_forward_of_inverse_is_the_identity(method, tree):
    model = tree.build()
    q, v, a = state(tree, model)
    full = lw.forward_dynamics(
        model, q, v, lw.inverse_dynamics(model, q, v, a), method=method, full=True
    )
    assert_close(full.acceleration, a, 1e-9, floor=1.0, what=method)
    _, loads, _ = newton_euler(tree, model, q, v, a)
    expected = [loads[name] for name in model.joint_names]
    assert load_error(full.joint_load, expected, floor=1.0) < 1e-9


@given(trees())
def test_inverse_of_forward_is_the_identity(tree):
    model = tree.build()
    q, v, tau = state(tree, model)
    a = lw.forward_dynamics(model, q, v, tau)
    assert_close(lw.inverse_dynamics(model, q, v, a), tau, 1e-9, floor=np.abs(a).max())


@given(trees())
def test_mass_matrix_and_kinetic_energy(tree):
    model = tree.build()
    q, v, a = state(tree, model)
    M = lw.mass_matrix(model, q)
    assert_close(M, M.T, 1e-13, axis=(-2, -1), what="symmetry")
    assert np.linalg.eigvalsh(M)[0] > 0
    effect = lw.inverse_dynamics(model, q, v, a) - lw.inverse_dynamics(model, q, v, 0 * a)
    assert_close(M @ a, effect, 1e-11, floor=1.0, what="M a")
    assert lw.kinetic_energy(model, q, v) == pytest.approx(v @ M @ v / 2, rel=1e-12)


@given(trees(), st.integers(0, 7))
def test_jacobian_gives_the_body_velocity(tree, pick):
    """V = J v in the body frame, linear first, at the origin of the body frame."""
    model = tree.build()
    q, v, a = state(tree, model)
    pick %= len(model.joint_names)
    motion = newton_euler(tree, model, q, v, a)[2][model.joint_names[pick]]
    velocity = np.r_[motion.R.T @ motion.v, motion.R.T @ motion.w]
    J = lw.body_jacobian(model, q, model.child_link_names[pick])
    assert_close(J @ v, velocity, 1e-11, floor=1.0)


@given(trees())
def test_momentum_and_energy_are_sums_over_bodies(tree):
    model = tree.build()
    q, v, a = state(tree, model)
    motions = newton_euler(tree, model, q, v, a)[2]
    expected, potential, kinetic = np.zeros(6), 0.0, 0.0
    for joint in tree.joints:
        body = motions[joint.name]
        com = body.moved_by(np.eye(3), joint.com)
        spin = body.R @ joint.inertia @ body.R.T @ body.w
        p = joint.mass * com.v
        expected += np.r_[p, np.cross(com.p, p) + spin]
        potential -= joint.mass * tree.gravity @ com.p
        kinetic += (joint.mass * com.v @ com.v + body.w @ spin) / 2
    assert_close(lw.momentum(model, q, v), expected, 1e-11, floor=1.0)
    assert lw.potential_energy(model, q) == pytest.approx(potential, rel=1e-11, abs=1e-11)
    assert lw.kinetic_energy(model, q, v) == pytest.approx(kinetic, rel=1e-11)


@given(trees(), st.integers(0, 2**16))
def test_the_world_has_no_origin_and_no_direction(tree, seed):
    rng = np.random.default_rng(seed)
    R, shift = random_rotation(rng), 3 * rng.standard_normal(3)
    moved_tree = tree.moved(R, shift)
    model, moved = tree.build(), moved_tree.build()
    q, v, tau = state(tree, model)
    here = lw.forward_dynamics(model, q, v, tau, full=True)
    there = lw.forward_dynamics(moved, q, v, tau, full=True)
    assert_close(there.acceleration, here.acceleration, 1e-9, floor=1.0)
    assert load_error(there.joint_load, here.joint_load, floor=1.0) < 1e-9
    linear, angular = np.split(lw.momentum(model, q, v), 2)
    expected = np.r_[R @ linear, R @ angular + np.cross(shift, R @ linear)]
    assert_close(lw.momentum(moved, q, v), expected, 1e-11, floor=1.0)
    fall = model.total_mass * (R @ tree.gravity) @ shift
    assert lw.potential_energy(moved, q) == pytest.approx(
        lw.potential_energy(model, q) - fall, rel=1e-10, abs=1e-9
    )


@given(trees(), st.randoms(use_true_random=False))
def test_numbering_does_not_matter(tree, random):
    """Joints added in any order, children before parents too, give the same motion by name."""
    order = list(range(len(tree.joints)))
    random.shuffle(order)
    model, other = tree.build(), tree.build(order)
    assert sorted(model.joint_names) == sorted(other.joint_names)
    q, v, tau = state(tree, model)
    q2, v2, tau2 = np.empty(other.nq), np.empty(other.nv), np.empty(other.nv)
    for name in model.joint_names:
        q2[other.q_slice(name)] = q[model.q_slice(name)]
        v2[other.v_slice(name)] = v[model.v_slice(name)]
        tau2[other.v_slice(name)] = tau[model.v_slice(name)]
    here = lw.forward_dynamics(model, q, v, tau, full=True)
    there = lw.forward_dynamics(other, q2, v2, tau2, full=True)
    back = [other.joint_index(name) for name in model.joint_names]
    dofs = np.concatenate([np.r_[other.v_slice(name)] for name in model.joint_names])
    assert_close(there.acceleration[dofs], here.acceleration, 1e-9, floor=1.0)
    assert load_error(there.joint_load[back], here.joint_load, floor=1.0) < 1e-9


@given(trees(max_joints=5))
def test_a_model_equals_its_copies_bit_by_bit(tree):
    model = tree.build()
    q, v, tau = state(tree, model)
    for again in (pickle.loads(pickle.dumps(model)), lw.Model.from_bytes(model.to_bytes())):
        assert again.hash == model.hash
        assert again.to_bytes() == model.to_bytes()
        np.testing.assert_array_equal(
            lw.forward_dynamics(again, q, v, tau), lw.forward_dynamics(model, q, v, tau)
        )


def test_axes_of_unit_length_stay_as_they_are(rng, tmp_path):
    """Normalised again, half of them would change their last bit each time a model is made."""
    axes = rng.standard_normal((200, 3))
    builder = lw.ModelBuilder("axes")
    builder.add_link("link0")
    for k, axis in enumerate(axes):
        builder.add_link(f"link{k + 1}", mass=1.0, inertia=np.eye(3))
        builder.add_joint(f"joint{k}", "revolute", f"link{k}", f"link{k + 1}", axis=axis)
    model = builder.build()
    for _ in range(3):
        again = lw.Model.from_bytes(model.to_bytes())
        assert again.to_bytes() == model.to_bytes()
    run = lw.simulate(model, times=[0.0], output=tmp_path / "run.zarr")
    assert lw.open_run(tmp_path / "run.zarr").load_model().hash == model.hash == run.model_hash


def test_model_data_with_broken_text_is_refused():
    good = lw.scenes.chain(2).to_bytes()
    assert good.count(b"joint_1") == 1
    with pytest.raises(lw.InputError, match="no UTF-8 text"):
        lw.Model.from_bytes(good.replace(b"joint_1", b"joint\xff\xfe"))


@given(trees(max_joints=5), st.integers(0, 2**16))
def test_armature_adds_to_the_diagonal(tree, seed):
    """Rotor inertia acts on its own freedom alone and leaves inverse-dynamics loads as they are.

    In a plane its momentum r u along axes that turn changes by w x (r u), too."""
    rng = np.random.default_rng(seed)
    rotors = rng.uniform(0.1, 1.0, len(tree.joints))
    geared = replace(
        tree,
        joints=tuple(
            replace(joint, armature=float(r)) if joint.type not in ("floating",) else joint
            for joint, r in zip(tree.joints, rotors, strict=True)
        ),
    )
    plain, model = tree.build(), geared.build()
    q, v, a = state(tree, model)
    extra, turning = np.zeros((2, model.nv))
    for joint in geared.joints:
        own = model.v_slice(joint.name)
        extra[own] = joint.armature
        if joint.type == "planar":
            u, w = v[own][:2], v[own][2]
            turning[own] = [-w * joint.armature * u[1], w * joint.armature * u[0], 0]
    assert_close(
        lw.mass_matrix(model, q), lw.mass_matrix(plain, q) + np.diag(extra), 1e-12, axis=(-2, -1)
    )
    tau = lw.inverse_dynamics(model, q, v, a)
    expected = lw.inverse_dynamics(plain, q, v, a) + extra * a + turning
    assert_close(tau, expected, 1e-11, floor=1.0)
    for method in METHODS:
        assert_close(lw.forward_dynamics(model, q, v, tau, method=method), a, 1e-9, floor=1.0)


def test_a_turned_quaternion_is_the_same_attitude(rng):
    """q and -q are one attitude: nothing may depend on the sign."""
    builder = lw.ModelBuilder("ball")
    builder.add_link("ground")
    builder.add_link("bob", mass=1.0, com=(0.2, 0.1, -0.5), inertia=np.diag([0.1, 0.2, 0.25]))
    builder.add_joint("ball", "spherical", "ground", "bob")
    model = builder.build()
    q, (v, tau) = Rotation.random(random_state=1).as_quat(), rng.standard_normal((2, 3))
    assert_close(
        lw.forward_dynamics(model, -q, v, tau), lw.forward_dynamics(model, q, v, tau), 1e-14
    )
