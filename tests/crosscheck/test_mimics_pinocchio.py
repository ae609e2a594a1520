"""Mimic joints as couplings against Pinocchio, which leaves the followers out of its coordinates.

Pinocchio's articulated-body algorithm takes no mimic joints, its mass matrix and inverse dynamics
do: a = M^-1 (-h) in the coordinates that are left.
"""

import numpy as np
import pinocchio as pin
import pytest
from lxml import etree

import linkwise as lw
from helpers.pinocchio_pair import robot_files


def mimics_of(path):
    """(follower, leader, multiplier, offset) of every mimic joint of a URDF."""
    for joint in etree.parse(str(path)).iterfind("joint"):
        mimic = joint.find("mimic")
        if mimic is not None and joint.get("type") != "fixed":
            numbers = (float(mimic.get(k, d)) for k, d in (("multiplier", 1), ("offset", 0)))
            yield (joint.get("name"), mimic.get("joint"), *numbers)


NOT_COMPARED = {
    "romeo/romeo",  # fingertips without mass: no accelerations either way
    "alex/alex_psyonic_hands",  # names leaders that do not exist
    "talos_data/talos_full_v2",  # Pinocchio wants leaders before followers
    "talos_data/talos_full_v2_box",
}
ROBOTS = {
    name: path
    for name, path in robot_files().items()
    if "<mimic" in path.read_text(errors="replace") and [*mimics_of(path)]
}


def test_there_are_robots_with_mimic_joints():
    assert NOT_COMPARED | {"panda/panda", "baxter/baxter"} <= ROBOTS.keys()


def test_a_leader_that_does_not_exist_is_refused():
    with pytest.raises(lw.InputError, match=r"mimics joint 'index_q1', which does not exist; name"):
        lw.load(ROBOTS["alex/alex_psyonic_hands"])


@pytest.mark.filterwarnings("ignore::linkwise.ModelWarning")
@pytest.mark.parametrize("name", ["talos_data/talos_full_v2", "baxter/baxter"])
def test_followers_follow_in_simulations(name):
    model = lw.load(ROBOTS[name])
    held = lw.simulate(model, duration=0.1).position.values
    position = {joint: held[:, model.q_slice(joint).start] for joint in model.joint_names}
    assert max(np.ptp(values) for values in position.values()) > 0.01
    for follower, leader, multiplier, offset in mimics_of(ROBOTS[name]):
        expected = multiplier * position[leader] + offset
        np.testing.assert_allclose(position[follower], expected, rtol=0, atol=1e-12)


@pytest.mark.filterwarnings("ignore::linkwise.ModelWarning")
@pytest.mark.parametrize("name", sorted(ROBOTS.keys() - NOT_COMPARED))
def test_robots_move_as_pinocchio_says(name):
    path = ROBOTS[name]
    model, reference = lw.load(path), pin.buildModelFromUrdf(str(path), mimic=True)
    followers = {mimic[0]: mimic[1:] for mimic in mimics_of(path)}
    assert sorted(model.coupling_names) == sorted(f"{joint}_mimic" for joint in followers)
    assert reference.nv == model.nv - len(followers)
    data, rng = reference.createData(), np.random.default_rng(1)
    for _ in range(3):
        q_pin = pin.neutral(reference)
        q, v, expected = (np.zeros(model.nv) for _ in range(3))
        v_pin = rng.normal(size=reference.nv)
        for joint in reference.names[1:]:
            joint_id = reference.getJointId(joint)
            if joint not in followers and joint in model.joint_names:
                at = model.q_slice(joint).start
                q[at], v[at] = rng.uniform(-1, 1), v_pin[reference.joints[joint_id].idx_v]
                pose = [np.cos(q[at]), np.sin(q[at])] if reference.nqs[joint_id] == 2 else [q[at]]
                q_pin[reference.idx_qs[joint_id] :][: len(pose)] = pose
        mass = pin.crba(reference, data, q_pin)
        mass = np.triu(mass) + np.triu(mass, 1).T
        a_pin = -np.linalg.solve(mass, pin.nonLinearEffects(reference, data, q_pin, v_pin))
        for joint in model.joint_names:
            at, leader, factor, offset = model.q_slice(joint).start, joint, 1.0, 0.0
            while leader in followers:
                leader, multiplier, shift = followers[leader]
                offset += factor * shift
                factor *= multiplier
            ahead = model.q_slice(leader).start
            q[at], v[at] = factor * q[ahead] + offset, factor * v[ahead]
            expected[at] = factor * a_pin[reference.joints[reference.getJointId(leader)].idx_v]
        found = lw.forward_dynamics(model, q, v)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
