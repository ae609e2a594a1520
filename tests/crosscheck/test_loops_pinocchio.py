"""Accelerations of chains with a closed loop against Pinocchio's constraint dynamics."""

import numpy as np
import pinocchio as pin
import pytest

import linkwise as lw


def random_placement(rng):
    quaternion = rng.normal(size=4)
    quaternion /= np.linalg.norm(quaternion)
    return pin.SE3(pin.Quaternion(quaternion).matrix(), rng.normal(size=3))


@pytest.mark.parametrize(
    ("kind", "contact"),
    [("spherical", pin.ContactType.CONTACT_3D), ("fixed", pin.ContactType.CONTACT_6D)],
)
@pytest.mark.parametrize("to_ground", [False, True])
def test_accelerations_are_pinocchios(kind, contact, to_ground):
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
        contact, theirs, other, on_parent, end, on_child, pin.LOCAL
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
    pin.initConstraintDynamics(theirs, data, constraints, constraints_data)
    settings = pin.ProximalSettings(1e-14, 1e-14, 0, 1)
    want = pin.constraintDynamics(theirs, data, q, v, tau, constraints, constraints_data, settings)
    np.testing.assert_allclose(
        lw.forward_dynamics(model, q, v, tau), want, rtol=0, atol=1e-9 * np.abs(want).max()
    )
