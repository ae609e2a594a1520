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


def two(offset, size):
    """Two links, the second so far out that squares of the distance overflow."""
    builder = lw.ModelBuilder("m")
    builder.add_link("g")
    for k, parent in enumerate(("g", "l0")):
        builder.add_link(f"l{k}", mass=1.0, com=(0, 0, size * k), inertia=np.eye(3) * 0.1)
        builder.add_joint(
            f"j{k}", "revolute", parent, f"l{k}", axis=(1, 0, 0), translation=(0, 0, offset * k)
        )
    return builder.build()


PENDULUM = {"axis": (1, 0, 0)}
USES = {
    "loads": lambda: lw.joint_loads(one(**PENDULUM), [0.5], [1e160]),
    "energy": lambda: lw.kinetic_energy(one(**PENDULUM), [0.5], [1e160]),
    "mass matrix": lambda: lw.mass_matrix(two(1e150, 1e200), [0, 0]),
    "system": lambda: lw.ConstraintSystem(one(**PENDULUM), [0.5], [1e160]),
    "recovered": lambda: lw.ConstraintSystem(one(**PENDULUM), [0.5]).recover([1e308] * 5),
    "product": lambda: lw.ConstraintSystem(one(**PENDULUM), [0.5]).multiply([1e308] * 5),
    "batch": lambda: lw.joint_loads(one(**PENDULUM), [[0.5]] * 9, [[0]] * 8 + [[1e160]]),
}


@pytest.mark.parametrize("use", USES)
def test_an_error_instead_of_nan(use):
    with pytest.raises((lw.NumericsError, lw.InputError), match=r"finite|quaternion"):
        USES[use]()


def test_a_report_says_so():
    found = lw.forward_dynamics(one(**PENDULUM), [0.5], [1e160], full=True)
    assert found.report.outcome == "not_finite"


QUATERNION = {
    "forward_dynamics": lambda m, q: lw.forward_dynamics(m, q, [0] * 4),
    "joint_loads": lambda m, q: lw.joint_loads(m, q, [0] * 4),
    "joint_poses": lw.joint_poses,
    "link_poses": lw.link_poses,
    "mass_matrix": lw.mass_matrix,
    "potential_energy": lw.potential_energy,
    "inverse_dynamics": lambda m, q: lw.inverse_dynamics(m, q, [0] * 4, [0] * 4),
    "rows": lambda m, q: lw.joint_loads(m, [m.initial_configuration(), q], [0] * 4),
    "ConstraintSystem": lw.ConstraintSystem,
    "DynamicsMethod": lambda m, q: lw.DynamicsMethod(m).evaluate(0.0, q),
    "simulate": lambda m, q: lw.simulate(m, duration=0.1, q0=q),
    "simulate_batch": lambda m, q: lw.simulate_batch(m, duration=0.1, step=0.01, q0=[q]),
}


@pytest.mark.parametrize("use", QUATERNION)
def test_a_quaternion_without_length_is_said_with_its_place(use):
    builder = lw.ModelBuilder("m")
    builder.add_link("g")
    for k, (kind, parent) in enumerate((("revolute", "g"), ("spherical", "l0"))):
        builder.add_link(f"l{k}", mass=1.0, com=(0, 0, -1), inertia=np.eye(3) * 0.1)
        options = PENDULUM if kind == "revolute" else {}
        builder.add_joint(f"j{k}", kind, parent, f"l{k}", **options)
    said = r"q\[1:5\]: the quaternion of joint 'j1'.* has no length"
    with pytest.raises(lw.InputError, match=said):
        QUATERNION[use](builder.build(), [0.0] * 5)


def test_a_simulation_does_not_converge_with_nan():
    run = lw.simulate(one(**PENDULUM), duration=1e-3, v0=[1e160], on_failure="return")
    assert run.outcome == "not_finite"
    assert "joint_load" in run.dataset.attrs["message"]
    assert np.isfinite(run.joint_load.values).all()
