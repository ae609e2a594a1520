"""Sums and products of huge numbers overflow: then there is an error, never a NaN as a result."""

import numpy as np
import pytest

import linkwise as lw


def one(kind="revolute", com=(0, 0, -1), **options):
    builder = lw.ModelBuilder("m")
    builder.add_link("g")
    builder.add_link("l", mass=1.0, com=com, inertia=np.eye(3) * 0.1)
    builder.add_joint("j", kind, "g", "l", **options)
    return builder.build()


PENDULUM = {"axis": (1, 0, 0)}
USES = {
    "zero quaternion": lambda: lw.forward_dynamics(one("spherical"), [0] * 4, [0] * 3),
    "its loads": lambda: lw.joint_loads(one("spherical"), [0] * 4, [0] * 3),
    "its poses": lambda: lw.joint_poses(one("spherical"), [0] * 4),
    "its inverse": lambda: lw.inverse_dynamics(one("spherical"), [0] * 4, [0] * 3, [0] * 3),
    "loads": lambda: lw.joint_loads(one(**PENDULUM), [0.5], [1e160]),
    "energy": lambda: lw.kinetic_energy(one(**PENDULUM), [0.5], [1e160]),
    "batch": lambda: lw.joint_loads(one(**PENDULUM), [[0.5]] * 9, [[0]] * 8 + [[1e160]]),
}


@pytest.mark.parametrize("use", USES)
def test_an_error_instead_of_nan(use):
    with pytest.raises((lw.NumericsError, lw.InputError), match=r"finite|quaternion"):
        USES[use]()


def test_a_report_says_so():
    found = lw.forward_dynamics(one("spherical"), [0] * 4, [0] * 3, full=True)
    assert found.report.outcome == "not_finite"


def test_a_simulation_does_not_converge_with_nan():
    run = lw.simulate(one(**PENDULUM), duration=1e-3, v0=[1e160], on_failure="return")
    assert run.outcome == "not_finite"
    assert "joint_load" in run.dataset.attrs["message"]
    assert np.isfinite(run.joint_load.values).all()
