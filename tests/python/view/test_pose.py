"""A model alone: its pose is closed, and its loads are those that hold it still."""

import numpy as np
import pytest

import linkwise as lw
from helpers.press_sdf import PRESS
from linkwise.view.pose import Pose

PRESS_POSE = [0.7, -1.1, 0.0]


def test_a_tree_carries_its_weight(tmp_path):
    model = lw.scenes.chain(2)
    pose = Pose(model)
    q = np.array([0.3, -0.2])
    assert np.array_equal(pose.assembled(q, None), q)
    rest = np.zeros(2)
    assert np.array_equal(pose.loads(q), lw.inverse_dynamics_loads(model, q, rest, rest))
    assert pose.told == ""


def test_what_closing_moved_is_told_and_the_joint_in_hand_stays():
    model = lw.load(PRESS)
    pose = Pose(model)
    q = pose.assembled(np.array(PRESS_POSE), None)
    assert np.abs(lw.loop_gaps(model, q)).max() < 1e-12
    assert pose.told == "loops were open; moved to close them: drive, knee, guide"
    q = pose.assembled(np.array(PRESS_POSE), "drive")
    assert q[0] == PRESS_POSE[0]
    # A crank of 0.15 m and a rod of 0.3 m: the slider is where the two reach.
    reach = 0.15 * np.cos(0.7) + np.sqrt(0.3**2 - (0.15 * np.sin(0.7)) ** 2)
    assert q[2] == pytest.approx(reach - 0.45, abs=1e-12)
    assert pose.told == ""


def test_a_joint_that_cannot_be_there_goes_back():
    model = lw.load(PRESS)
    pose = Pose(model)
    q = pose.assembled(np.array([0.7, -1.1, 0.1]), "guide")
    assert np.abs(lw.loop_gaps(model, q)).max() < 1e-12
    assert pose.told == "guide cannot be there: it moved back to where loops close"


def test_the_holding_torque_is_the_slope_of_the_potential_energy():
    """Virtual work: M d theta = d V along the motion that the loop leaves."""
    model = lw.load(PRESS)
    pose = Pose(model)

    def height(angle):
        q = pose.assembled(np.array([angle, *PRESS_POSE[1:]]), "drive")
        return lw.potential_energy(model, q)

    q = pose.assembled(np.array(PRESS_POSE), "drive")
    loads = pose.loads(q)
    assert pose.told == "held by drive"
    step = 1e-5
    slope = (height(0.7 + step) - height(0.7 - step)) / (2 * step)
    assert abs(slope) > 0.1
    assert loads[0, 3:] @ model.joint_axes[0][0][1] == pytest.approx(slope, rel=1e-8)
    assert loads.shape == (4, 6)


def test_loads_are_those_of_a_run_that_is_held():
    machine = lw.scenes.benchmark("stewart")
    pose = Pose(machine.model)
    q = pose.assembled(machine.q0, None)
    loads = pose.loads(q)
    assert pose.holders == [f"leg_{k}" for k in range(6)]
    held = {name: lw.Locked() for name in pose.holders}
    run = lw.simulate(machine.model, duration=1e-3, every=1e-3, q0=q, drives=held)
    expected = run.joint_load.values[0]
    np.testing.assert_allclose(loads, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_a_machine_whose_loops_cannot_close_has_no_loads():
    bar = lw.ModelBuilder("apart")
    bar.add_link("bar", mass=1, inertia=np.eye(3))
    bar.add_link("ground")
    bar.add_joint("pin", "revolute", "ground", "bar", axis=[0, 1, 0])
    bar.add_loop(
        "far", "spherical", "ground", "bar", translation=[3, 0, 0], child_translation=[1, 0, 0]
    )
    pose = Pose(bar.build())
    q = pose.assembled(np.zeros(1), None)
    assert np.array_equal(q, np.zeros(1))
    assert not pose.loads(q).any()
    assert pose.told.startswith("loops stay open here: ")
