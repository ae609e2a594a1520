"""Stiff machines: fixed steps that are too long say so."""

import numpy as np
import pytest

import linkwise as lw


@pytest.fixture(scope="module")
def finger():
    """Two light links; drives of kp 1000, kd 10 make rates of 1e9 1/s."""
    builder = lw.ModelBuilder("finger")
    builder.add_link("base")
    builder.add_link("near", mass=0.02, com=(0, 0, 0.02), inertia=np.diag([1e-6, 1e-6, 5e-7]))
    builder.add_link("far", mass=0.005, com=(0, 0, 0.01), inertia=np.diag([1e-8, 1e-8, 1e-9]))
    builder.add_joint("j1", "revolute", "base", "near", axis=(0, 1, 0))
    builder.add_joint("j2", "revolute", "near", "far", axis=(0, 1, 0), translation=(0, 0, 0.04))
    return builder.build()


DRIVES = {"j1": lw.PD(1000, 10, 0.5), "j2": lw.PD(1000, 10, -0.3)}


def test_a_fixed_step_that_is_too_long_says_so(finger):
    with pytest.raises(lw.SimulationError, match="take a smaller step"):
        lw.simulate(
            finger,
            duration=0.05,
            drives=DRIVES,
            numerics={"integrator": "semi_implicit_euler", "step": 1e-3},
        )
