"""The run that most tests of loads start from."""

import pytest

import linkwise as lw
from helpers.loaded_arm import arm, profile


@pytest.fixture(scope="session")
def swing():
    """A run with every cause: a given motion, a torque, a wrench, damping, spring and stop."""
    return lw.simulate(
        arm(),
        duration=1.0,
        every=0.01,
        drives={"shoulder": lw.Motion(profile(0.8, 1.0)), "elbow": 3.0},
        wrenches={"hand": lw.Wrench([5.0, -3.0, 2.0, 0.1, 0.2, -0.3])},
        q0=[0, 0.3, 0.25],
        tolerance=1e-9,
    )
