"""Frames of every link, welded ones too, against Pinocchio on the robots of example-robot-data."""

import numpy as np
import pinocchio as pin
import pytest

import linkwise as lw
from helpers.compare import assert_close
from helpers.pinocchio_pair import Pair, robot_files
from helpers.random_trees import random_configuration

TOLERANCE = 1e-12
ROBOTS = robot_files()
# Refused: see test_pinocchio.py. One body welded to the ground has nothing that moves.
LEFT_OUT = {"ur/ur3", "romeo/romeo_laas_small", "hector/quadrotor_base", "iris/iris_simple"}
AXES = {"world": pin.LOCAL_WORLD_ALIGNED, "frame": pin.LOCAL}


class Case:
    """One robot at one random state, with frames that stand askew on every link."""

    def __init__(self, name, base):
        self.pair = Pair(ROBOTS[name], floating_base=base == "floating")
        self.model = self.pair.model
        rng = np.random.default_rng(sum(name.encode()))
        self.q = random_configuration(self.model, rng, (), spread=1.5)
        self.v, self.a = rng.standard_normal((2, self.model.nv))
        self.frames = {}
        for link in self.model.link_names:
            origin, turn = rng.standard_normal((2, 3)) * 0.3
            rotation = pin.exp3(turn)
            held = self.pair.pin.frames[self.pair.pin.getFrameId(link, pin.BODY)]
            placed = held.placement * pin.SE3(rotation, origin)
            frame = pin.Frame(f"{link} askew", held.parentJoint, placed, pin.OP_FRAME)
            at = self.pair.pin.addFrame(frame)
            self.frames[link] = lw.Frame(link, origin, rotation), at, rotation, origin
        self.data = self.pair.pin.createData()
        to_pin = self.pair.to_pin
        configuration = self.pair.pin_configuration(self.q)
        state = configuration, to_pin(self.v), to_pin(self.a)
        pin.forwardKinematics(self.pair.pin, self.data, *state)
        pin.computeJointJacobians(self.pair.pin, self.data, configuration)
        pin.updateFramePlacements(self.pair.pin, self.data)


@pytest.fixture(
    params=[(n, b) for n in sorted(ROBOTS.keys() - LEFT_OUT) for b in ("fixed", "floating")],
    ids="-".join,
    scope="module",
)
def case(request):
    return Case(*request.param)


def both(case, ours, theirs):
    """Our values of all links' frames and Pinocchio's."""
    pairs = [(ours(frame), theirs(at)) for frame, at, *_ in case.frames.values()]
    return (np.array(side) for side in zip(*pairs, strict=True))


def test_poses_and_placements(case):
    ours, theirs = both(
        case,
        lambda frame: lw.frame_pose(case.model, case.q, frame),
        lambda at: case.data.oMf[at].homogeneous,
    )
    assert_close(ours, theirs, TOLERANCE, axis=(-3, -2, -1), what="poses")
    for link, (frame, at, *_) in case.frames.items():
        body, rotation, origin = case.model.frame_placement(frame)
        held = case.pair.pin.frames[at]
        if body is None:
            assert held.parentJoint == 0
        else:
            joint = case.pair.pin.names[held.parentJoint]
            assert body == case.model.child_link_names[case.model.joint_index(joint)], link
        np.testing.assert_allclose(rotation, held.placement.rotation, rtol=0, atol=TOLERANCE)
        size = 1 + np.abs(held.placement.translation).max()
        np.testing.assert_allclose(
            origin, held.placement.translation, rtol=0, atol=TOLERANCE * size
        )


@pytest.mark.parametrize("axes", AXES)
def test_jacobians(case, axes):
    ours, theirs = both(
        case,
        lambda frame: lw.frame_jacobian(case.model, case.q, frame, axes=axes),
        lambda at: pin.getFrameJacobian(case.pair.pin, case.data, at, AXES[axes])[
            :, case.pair.dofs
        ],
    )
    assert_close(ours, theirs, TOLERANCE, axis=(-3, -2, -1), what="Jacobians")


@pytest.mark.parametrize("axes", AXES)
def test_velocities_and_accelerations(case, axes):
    ours, theirs = both(
        case,
        lambda frame: lw.frame_velocity(case.model, case.q, case.v, frame, axes=axes),
        lambda at: pin.getFrameVelocity(case.pair.pin, case.data, at, AXES[axes]).vector,
    )
    assert_close(ours, theirs, TOLERANCE, axis=(-2, -1), what="velocities")
    ours, theirs = both(
        case,
        lambda frame: lw.frame_acceleration(case.model, case.q, case.v, case.a, frame, axes=axes),
        lambda at: (
            pin.getFrameClassicalAcceleration(case.pair.pin, case.data, at, AXES[axes]).vector
        ),
    )
    assert_close(ours, theirs, TOLERANCE, axis=(-2, -1), what="accelerations")


def test_the_name_of_a_link_is_its_own_frame(case):
    poses = lw.link_poses(case.model, case.q)
    for pose, link in zip(poses, case.model.link_names, strict=True):
        np.testing.assert_allclose(
            lw.frame_pose(case.model, case.q, link), pose, rtol=0, atol=1e-13 * np.abs(pose).max()
        )
