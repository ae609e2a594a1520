"""Gears, cams and other couplings: their motion, and what they put into their joints."""

import numpy as np
import pytest

import linkwise as lw

Z = (0, 0, 1)
MOTOR, WHEEL = 0.3, 0.8  # kg m2 about their axes


def gear(factors, *, offset=0.0):
    """Two wheels on the ground and a slide, which is the third joint."""
    builder = lw.ModelBuilder("gear", gravity=(0, 0, 0))
    builder.add_link("base", mass=0)
    for name, inertia in (("motor", MOTOR), ("wheel", WHEEL)):
        builder.add_link(name, mass=1, inertia=np.diag([inertia, inertia, inertia]))
        builder.add_joint(name, "revolute", "base", name, axis=Z)
    builder.add_link("valve", mass=2.0, inertia=0.01 * np.eye(3))
    builder.add_joint("valve", "prismatic", "base", "valve", axis=Z)
    builder.add_coupling("gear", factors, offset=offset)
    return builder.build()


def loads_of(run):
    loads = run["coupling_load"]
    return {str(label): loads.sel(coupled=label).values for label in loads.coupled.values}


def test_a_driven_gear_tells_the_torque_of_its_motor():
    """The motor turns the wheel as well: (motor + wheel / ratio^2) times its acceleration."""
    model, ratio = gear({"motor": 1, "wheel": -2.5}), 2.5
    assert model.coupling_joints == [["motor", "wheel"]]
    motion = lw.Motion(lambda t: (np.sin(3 * t), 3 * np.cos(3 * t), -9 * np.sin(3 * t)))
    v0 = [3.0, 3.0 / ratio, 0.0]
    run = lw.simulate(model, duration=1, drives={"motor": motion}, v0=v0, tolerance=1e-9)
    acceleration = -9 * np.sin(3 * run.time.values)
    torque = run.drive_torque.sel(joint="motor").values
    np.testing.assert_allclose(torque, (MOTOR + WHEEL / ratio**2) * acceleration, atol=1e-10)
    loads = loads_of(run)
    np.testing.assert_allclose(loads["gear:wheel"], WHEEL * acceleration / ratio, atol=1e-10)
    np.testing.assert_allclose(loads["gear:motor"], -loads["gear:wheel"] / ratio, atol=1e-12)
    assert run["coupling_load"].attrs["units"] == "N m"
    assert np.abs(lw.loads.energy_balance(run).residual).max() < 1e-9


def test_a_cam_keeps_its_curve_and_its_energy():
    """valve = 0.1 shaft - 0.05 shaft^2 + 0.02 shaft^4: one way to move, whose inertia changes."""
    curve = np.polynomial.Polynomial([0.03, 0.1, -0.05, 0, 0.02])
    powers = [float(-c) for c in curve.coef[1:]]
    model = gear({"valve": 1, "motor": powers}, offset=0.03)
    v0 = np.array([1.5, 0.0, 1.5 * curve.deriv()(0.2)])
    run = lw.simulate(model, duration=1, q0=[0.2, 0, curve(0.2)], v0=v0, tolerance=1e-10)
    shaft, valve = (run.position.sel(joint=name).values for name in ("motor", "valve"))
    rate = run.velocity.sel(joint="motor").values
    np.testing.assert_allclose(valve, curve(shaft), atol=1e-12)
    energy = 0.5 * (MOTOR + 2.0 * curve.deriv()(shaft) ** 2) * rate**2
    np.testing.assert_allclose(energy, energy[0], rtol=1e-8)
    assert np.ptp(rate) > 0.1
    loads = loads_of(run)
    np.testing.assert_allclose(
        loads["gear:valve"], 2.0 * run.acceleration.sel(joint="valve").values, atol=1e-9
    )
    np.testing.assert_allclose(
        loads["gear:motor"], -curve.deriv()(shaft) * loads["gear:valve"], atol=1e-12
    )


def test_an_open_curve_is_closed_at_the_start():
    model = gear({"valve": 1, "motor": [0, -0.1]}, offset=0.02)
    run = lw.simulate(model, duration=0.1, q0=[0.5, 0, 0])
    q = run.position.values[0]
    assert q[2] == pytest.approx(0.02 + 0.1 * q[0] ** 2, abs=1e-12)


@pytest.mark.parametrize("powers", [[], [1, 2, 3, 4, 5], [0.0, 0.0], [np.inf]])
def test_curves_that_are_none_are_refused(powers):
    with pytest.raises(lw.InputError, match=r"coupling .gear.|factor"):
        gear({"valve": 1, "motor": powers})


def test_in_a_scenario(tmp_path):
    path = tmp_path / "cam.toml"
    path.write_text(
        """
[model.chain]
n_bodies = 2
[coupling.cam]
factors = { joint_1 = 1, joint_2 = [0.5, -0.25] }
offset = 0.1
[simulate]
duration = 0.1
"""
    )
    run = lw.run_scenario(path)
    first, second = run.position.values.T
    np.testing.assert_allclose(first + 0.5 * second - 0.25 * second**2, 0.1, atol=1e-12)
    path.write_text(path.read_text().replace("[0.5, -0.25]", "[1, 2, 3, 4, 5]"))
    with pytest.raises(lw.InputError, match=r"cam.toml: coupling\.cam\.factors"):
        lw.load_scenario(path)


@pytest.mark.parametrize("hold", [[], ["joint_1"]])
def test_couplings_that_contradict_each_other_are_both_named(hold):
    arm = lw.scenes.chain(4)
    fine = arm.with_coupling("fine", {"joint_3": 1, "joint_4": -1})
    one = fine.with_coupling("one", {"joint_1": 1, "joint_2": 1})
    both = one.with_coupling("other", {"joint_1": 1, "joint_2": 1}, offset=0.1)
    said = r"^couplings 'one' and 'other' contradict each other: no position"
    with pytest.raises(lw.InputError, match=said):
        lw.simulate(both, duration=0.1, hold=hold)
    with pytest.raises(lw.InputError, match=said):
        lw.assemble(both)


def test_a_coupling_and_a_rod_that_contradict_each_other_are_named():
    arm = lw.scenes.chain(2)
    base, tip = arm.parent_link_names[0], arm.child_link_names[1]
    straight = arm.with_rod("strut", base, tip, length=1.9, child_point=(0, 0, -1))
    folded = straight.with_coupling("fold", {"joint_2": 1}, offset=2.0)
    with pytest.raises(lw.InputError, match=r"^coupling 'fold' and joint 'strut' contradict"):
        lw.simulate(folded, duration=0.1)


def test_a_coupling_that_no_position_keeps_says_by_how_much():
    """q^2 = -1 is nearest at 0."""
    arm = lw.scenes.chain(2).with_coupling("c", {"joint_1": [0, 1]}, offset=-1)
    said = r"^coupling 'c': no position .* at best its coordinates add up to 1 beside its offset"
    with pytest.raises(lw.InputError, match=said):
        lw.simulate(arm, duration=0.1)
