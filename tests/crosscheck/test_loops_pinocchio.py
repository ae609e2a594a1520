"""Accelerations, loads by cause and torques of chains with a closed loop against Pinocchio's
constraint dynamics."""

import numpy as np
import pinocchio as pin
import pytest

import linkwise as lw


def random_placement(rng):
    quaternion = rng.normal(size=4)
    quaternion /= np.linalg.norm(quaternion)
    return pin.SE3(pin.Quaternion(quaternion).matrix(), rng.normal(size=3))


CONTACTS = {"spherical": pin.ContactType.CONTACT_3D, "fixed": pin.ContactType.CONTACT_6D}


def closed_chain(kind, to_ground):
    """A model, a state, and what Pinocchio makes of rates, torques and a factor of gravity:
    accelerations and the force of the contact that closes the loop."""
    rng = np.random.default_rng(11)
    theirs = pin.Model()
    builder = lw.ModelBuilder("chains")
    builder.add_link("base", mass=0)
    parents = [-1, 0, 1, 2, 3, 4, 5, 1, 7, 8, 9, 10]
    for i, parent in enumerate(parents):
        place = random_placement(rng)
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        mass, com = rng.uniform(0.5, 2), rng.normal(size=3) * 0.2
        A = rng.normal(size=(3, 3))
        inertia = np.trace(A @ A.T) * np.eye(3) - A @ A.T
        builder.add_link(f"link{i}", mass=mass, com=com, inertia=0.1 * inertia)
        builder.add_joint(
            f"joint{i}",
            "revolute",
            f"link{parent}" if parent >= 0 else "base",
            f"link{i}",
            translation=place.translation,
            rotation=place.rotation,
            axis=axis,
        )
        joint = theirs.addJoint(parent + 1, pin.JointModelRevoluteUnaligned(axis), place, f"j{i}")
        theirs.appendBodyToJoint(joint, pin.Inertia(mass, com, 0.1 * inertia), pin.SE3.Identity())
    q, tau = rng.normal(size=12), rng.normal(size=12)
    weight = theirs.gravity.linear.copy()
    data = theirs.createData()
    pin.forwardKinematics(theirs, data, q)
    on_parent = random_placement(rng)
    end, other = 7, 0 if to_ground else 12
    pose = data.oMi[other].inverse() if other else pin.SE3.Identity()
    on_child = data.oMi[end].inverse() * (pose.inverse() * on_parent)
    parent_name = "base" if to_ground else "link11"
    builder.add_loop(
        "loop",
        kind,
        parent_name,
        "link6",
        translation=on_parent.translation,
        rotation=on_parent.rotation,
        child_translation=on_child.translation,
        child_rotation=on_child.rotation,
    )
    model = builder.build()
    constraint = pin.RigidConstraintModel(
        CONTACTS[kind], theirs, other, on_parent, end, on_child, pin.LOCAL
    )
    constraint_data = constraint.createData()
    # Rates that keep the loop closed.
    K = lw.frame_jacobian(model, q, lw.Frame("link6", origin=on_child.translation))
    if not to_ground:
        K -= lw.frame_jacobian(model, q, lw.Frame("link11", origin=on_parent.translation))
    K = K[: 3 if kind == "spherical" else 6]
    v = rng.normal(size=12)
    v -= np.linalg.pinv(K) @ (K @ v)
    constraints, constraints_data = (
        pin.StdVec_RigidConstraintModel(),
        pin.StdVec_RigidConstraintData(),
    )
    constraints.append(constraint)
    constraints_data.append(constraint_data)
    settings = pin.ProximalSettings(1e-14, 1e-14, 0, 1)

    def solved(v, tau, gravity=1.0):
        theirs.gravity.linear = gravity * weight
        pin.initConstraintDynamics(theirs, data, constraints, constraints_data)
        a = pin.constraintDynamics(
            theirs, data, q, v, tau, constraints, constraints_data, settings
        ).copy()
        force = constraints_data[0].contact_force
        return a, np.concatenate([force.linear, force.angular])

    return model, q, v, tau, solved


@pytest.mark.parametrize("kind", CONTACTS)
@pytest.mark.parametrize("to_ground", [False, True])
def test_accelerations_are_pinocchios(kind, to_ground):
    model, q, v, tau, solved = closed_chain(kind, to_ground)
    want, _ = solved(v, tau)
    np.testing.assert_allclose(
        lw.forward_dynamics(model, q, v, tau), want, rtol=0, atol=1e-9 * np.abs(want).max()
    )


@pytest.mark.parametrize("kind", CONTACTS)
@pytest.mark.parametrize("to_ground", [False, True])
def test_the_loops_load_of_each_cause_is_pinocchios(kind, to_ground):
    model, q, v, tau, solved = closed_chain(kind, to_ground)
    rest = np.zeros(model.nv)
    shares = lw.joint_loads_by_cause(model, ["gravity", "velocity", "drive"], q, v, tau)
    acting = [(rest, rest, 1.0), (v, rest, 0.0), (rest, tau, 0.0)]
    for share, alone in zip(shares[:, -1], acting, strict=True):
        _, force = solved(*alone)
        assert np.abs(force).max() > 1e-3
        np.testing.assert_allclose(share, -force, rtol=0, atol=1e-8 * np.abs(force).max())


@pytest.mark.parametrize(
    ("kind", "on_loop"),
    [("spherical", (0, 1, 2, 3)), ("spherical", (1, 3, 5, 6)), ("fixed", (0,)), ("fixed", (4,))],
)
def test_torques_of_driven_joints_make_pinocchios_motion(kind, on_loop):
    """Joints 0 to 6 are on the loop, the others hang on it. Pinocchio moves by the torques of the
    driven joints as it does by torques in all of them."""
    model, q, v, tau, solved = closed_chain(kind, to_ground=True)
    want, _ = solved(v, tau)
    driven = [f"joint{i}" for i in (*on_loop, 7, 8, 9, 10, 11)]
    torque = lw.inverse_dynamics(model, q, v, want, driven=driven)
    got, force = solved(v, torque)
    np.testing.assert_allclose(got, want, rtol=0, atol=1e-7 * np.abs(want).max())
    load = lw.inverse_dynamics_loads(model, q, v, want, driven=driven)[-1]
    np.testing.assert_allclose(load, -force, rtol=0, atol=1e-7 * np.abs(force).max())
