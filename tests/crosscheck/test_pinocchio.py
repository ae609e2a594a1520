"""Every robot of example-robot-data against Pinocchio, at random states, fixed and floating base.

Relative errors: the largest deviation over the largest value, per robot and state, taken within
vectors of one kind (accelerations; forces; moments; matrix entries). Torques are Pinocchio's for
unit-size random accelerations, so that every joint's acceleration counts alike: with random
torques a finger would outrun the trunk by 1e5 and hide its errors.
"""

import numpy as np
import pinocchio as pin
import pytest

import linkwise as lw
from helpers.compare import assert_close, load_error
from helpers.methods import METHODS
from helpers.pinocchio_pair import Pair, robot_files
from helpers.random_trees import random_configuration

STATES = 20
TOLERANCE = 1e-9
ROBOTS = robot_files()

# Files that cannot be simulated, with the words that our message must contain.
REFUSED = {
    "ur/ur3": "no links",  # an unexpanded xacro; Pinocchio refuses it too
    "romeo/romeo": "LFinger13",  # massless fingertips on moving joints: no finite acceleration
    "romeo/romeo_laas_small": "link 'body'",  # inertia with the eigenvalue -0.0213 kg m2
}
# A head of mass without inertia on the neck: where its centre comes near the last axis, the
# joint-space inertia has condition up to 3e8, and Pinocchio's own two conventions differ by 1e-7 in
# that one joint. The error is measured in the kinetic-energy norm, in which the problem is well
# conditioned.
ILL_CONDITIONED = {"icub/icub", "icub/icub_reduced"}
# Bodies whose inertia has no inverse, which the constraint-force form needs; it must name one.
SINGULAR = {"icub/icub", "icub/icub_reduced"}
# One rigid body without a moving joint: nothing moves when it is welded to the ground.
SINGLE_BODY = {"hector/quadrotor_base", "iris/iris_simple"}
CASES = [
    (name, base)
    for name in sorted(ROBOTS.keys() - REFUSED.keys())
    for base in ("fixed", "floating")
    if base == "floating" or name not in SINGLE_BODY
]


def reference(pair, rng):
    """STATES random states with torques, and Pinocchio's answers to them."""
    model = pair.model
    q = random_configuration(model, rng, (STATES,), spread=1.5)
    v, a = rng.standard_normal((2, STATES, model.nv))
    rows = []
    for qk, vk, ak in zip(q, v, a, strict=True):
        args = pair.pin, pair.data, pair.pin_configuration(qk)
        v_pin = pair.to_pin(vk)
        row = {"tau": pin.rnea(*args, v_pin, pair.to_pin(ak)).copy()}
        # The LOCAL convention leaves the joint wrenches in data.f, equal to rnea's to rounding.
        row["acceleration"] = pin.aba(*args, v_pin, row["tau"], pin.Convention.LOCAL).copy()
        row["loads"] = pair.wrenches()
        row["tau_again"] = pin.rnea(*args, v_pin, row["acceleration"]).copy()
        assert load_error(pair.wrenches(), row["loads"], floor=1e-9) < 1e-12
        upper = np.triu(pin.crba(*args))
        row["mass"] = (upper + np.triu(upper, 1).T)[np.ix_(pair.dofs, pair.dofs)]
        row["kinetic"] = pin.computeKineticEnergy(*args, v_pin)
        row["potential"] = pin.computePotentialEnergy(*args)
        pin.computeCentroidalMomentum(*args, v_pin)
        linear, angular = pair.data.hg.linear, pair.data.hg.angular
        row["momentum"] = np.r_[linear, angular + np.cross(pair.data.com[0], linear)]
        pin.computeJointJacobians(*args)
        row["jacobian"] = pin.getJointJacobian(pair.pin, pair.data, pair.ids[-1], pin.LOCAL)
        row["jacobian"] = row["jacobian"][:, pair.dofs]
        row["poses"] = [pair.data.oMi[i].homogeneous for i in pair.ids]
        for key in ("tau", "tau_again", "acceleration"):
            row[key] = pair.from_pin(row[key])
        rows.append(row)
    return q, v, a, {key: np.array([row[key] for row in rows]) for key in rows[0]}


@pytest.fixture(params=CASES, ids=lambda case: "-".join(case), scope="module")
def robot(request):
    name, base = request.param
    pair = Pair(ROBOTS[name], floating_base=base == "floating")
    rng = np.random.default_rng(sum(name.encode()))
    return name, pair.model, *reference(pair, rng)


def test_the_package_ships_the_robots():
    assert len(ROBOTS) == 69
    assert REFUSED.keys() | ILL_CONDITIONED | SINGULAR | SINGLE_BODY <= ROBOTS.keys()


@pytest.mark.parametrize("name", sorted(REFUSED))
def test_refused_robots_say_why(name):
    def accelerate():
        model = lw.load(ROBOTS[name], mimic="independent")
        lw.forward_dynamics(model, model.neutral_configuration(), np.zeros(model.nv))

    with pytest.raises(lw.InputError, match=REFUSED[name]) as error:
        accelerate()
    assert "\n" not in str(error.value)
    assert ROBOTS[name].name in str(error.value)


@pytest.mark.parametrize("name", sorted(ROBOTS.keys() - REFUSED.keys()))
def test_joint_order_of_pinocchio(name):
    """If asked for, our joints, and so q, v and tau, come in Pinocchio's order."""
    reference = pin.buildModelFromUrdf(str(ROBOTS[name]))
    model = lw.load(ROBOTS[name], joint_order="pinocchio", mimic="independent")
    assert list(model.joint_names) == list(reference.names)[1:]


@pytest.mark.parametrize("method", METHODS)
def test_accelerations_and_joint_loads(robot, method):
    name, model, q, v, a, ref = robot
    options = {"method": method}
    if method == "constraint_force" and name in SINGULAR:
        with pytest.raises(lw.InputError, match="singular") as error:
            lw.forward_dynamics(model, q, v, ref["tau"], **options)
        assert any(link in str(error.value) for link in model.link_names)
        return
    result = lw.forward_dynamics(model, q, v, ref["tau"], full=True, **options)
    if name in ILL_CONDITIONED:
        error = result.acceleration - ref["acceleration"]
        energy = [np.einsum("ki,kij,kj->k", x, ref["mass"], x) for x in (error, a)]
        assert np.sqrt(np.abs(energy[0]) / energy[1]).max() <= TOLERANCE
    else:
        assert_close(result.acceleration, ref["acceleration"], TOLERANCE, what="acceleration")
    assert load_error(result.joint_load, ref["loads"], floor=1e-9) <= TOLERANCE


def test_joint_loads(robot):
    _, model, q, v, _, ref = robot
    assert load_error(lw.joint_loads(model, q, v, ref["tau"]), ref["loads"], floor=1e-9) < TOLERANCE


def test_inverse_dynamics_and_mass_matrix(robot):
    _, model, q, v, a, ref = robot
    assert_close(lw.inverse_dynamics(model, q, v, a), ref["tau"], 1e-11, what="inverse dynamics")
    assert_close(lw.mass_matrix(model, q), ref["mass"], 1e-11, axis=(-2, -1), what="mass matrix")


def test_energies_and_momenta(robot):
    _, model, q, v, _, ref = robot
    assert_close(lw.kinetic_energy(model, q, v), ref["kinetic"], 1e-12, what="kinetic energy")
    potential = lw.potential_energy(model, q)
    # Pinocchio leaves the links welded to the ground out: a constant that means nothing.
    assert_close(potential - potential[0], ref["potential"] - ref["potential"][0], 1e-11)
    for part in (slice(0, 3), slice(3, 6)):
        ours = lw.momentum(model, q, v)[..., part]
        assert_close(ours, ref["momentum"][..., part], 1e-10, what="momentum")


def test_poses_and_jacobians(robot):
    _, model, q, _, _, ref = robot
    assert_close(lw.joint_poses(model, q), ref["poses"], 1e-11, axis=(-3, -2, -1), what="poses")
    last = model.child_link_names[-1]
    jacobian = lw.body_jacobian(model, q, last)
    assert_close(jacobian, ref["jacobian"], 1e-11, axis=(-2, -1), what=f"Jacobian of {last}")
