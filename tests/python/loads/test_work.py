"""Works are integrated along with the steps: closed forms, any sampling, every integrator."""

import numpy as np
import pytest

import linkwise as lw
from helpers.loaded_arm import arm, profile, swing
from helpers.machines import pendulum
from linkwise import _core

WORKS = ("drive_work", "external_work", "dissipated_energy")


def slider(mass=2.0, **properties):
    builder = lw.ModelBuilder("slider")
    builder.add_link("rail")
    builder.add_link("block", mass=mass, inertia=np.eye(3))
    builder.add_joint("slide", "prismatic", "rail", "block", axis=(1, 0, 0), **properties)
    return builder.build()


def residual(run):
    balance = lw.loads.energy_balance(run)
    assert balance.attrs["integrated"] == "along the steps"
    largest = float(np.abs(balance.kinetic_energy + balance.dissipated).max())
    return float(np.abs(balance.residual).max()) / largest


def test_damped_slider_with_three_samples():
    run = lw.simulate(slider(damping=3.0), v0=[4.0], times=[0, 0.7, 2.0], tolerance=1e-9)
    gone = 0.5 * 2.0 * 4.0**2 * (1 - np.exp(-2 * 3.0 / 2.0 * run.time.values))
    np.testing.assert_allclose(run.dissipated_energy, gone, rtol=1e-8)
    assert np.all(run.drive_work == 0)
    assert np.all(run.external_work == 0)


@pytest.mark.parametrize("samples", [2, 3, 1001])
def test_residual_follows_the_tolerance(samples):
    machine = arm()
    found = []
    for tolerance in (1e-4, 1e-6, 1e-8):
        run = lw.simulate(
            machine,
            times=np.linspace(0, 2, samples),
            q0=[0.3, 0.5, 0.1],
            drives={"elbow": lambda t, q, v: [2 * np.sin(3 * t)], "shoulder": lw.PD(20, 1)},
            wrenches={"hand": lw.Wrench([2.0, 1.0, 0, 0, 0.3, 0], axes="frame")},
            tolerance=tolerance,
        )
        found.append(residual(run))
        assert found[-1] < 20 * tolerance
    assert found[2] < 1e-2 * found[0]


def test_works_do_not_depend_on_the_output_times():
    options = {"duration": 1.0, "q0": [0, 0.3, 0.25], "v0": [1.0, 0, 0]}
    options |= {"drives": {"elbow": lw.PD(30, 2, 0.1)}}
    few = lw.simulate(arm(), every=1.0, **options)
    many = lw.simulate(arm(), every=1e-4, **options)
    assert many.time.size == 10_001
    for name in WORKS:
        np.testing.assert_array_equal(few[name].values, many[name].values[[0, -1]])


def test_what_holds_a_given_motion_does_work():
    """A slide moved by sin(t): the drive gives what the block's energy is; a locked joint none."""
    motion = lw.Motion(lambda t: (np.sin(t), np.cos(t), -np.sin(t)))
    run = lw.simulate(slider(), times=[0, 0.5, 1.3], drives={"slide": motion}, tolerance=1e-9)
    kinetic = 0.5 * 2.0 * np.cos(run.time.values) ** 2
    np.testing.assert_allclose(run.drive_work[:, 0], kinetic - kinetic[0], atol=1e-9)
    assert residual(swing(tolerance=1e-9)) < 1e-8  # a motion, a torque, a wrench, a stop
    held = lw.simulate(pendulum(), duration=1.0, every=0.5, drives={"pivot": lw.Locked()})
    assert np.all(held.drive_work == 0)


@pytest.mark.parametrize("integrator", ["semi_implicit_euler", "runge_kutta_4"])
@pytest.mark.parametrize("step", [0.25, 0.01])
def test_fixed_steps_may_be_longer_than_a_given_motion_swings(integrator, step):
    """The work is what the energy gained, at every sample that ends a step."""
    rate = 40.0

    def swing(t):
        a = 0.5 * rate * t
        return 0.5 * np.sin(a), 0.25 * rate * np.cos(a), -0.125 * rate**2 * np.sin(a)

    drives = {"pivot": lw.Motion(swing, breakpoints=())}
    options = {"integrator": integrator, "step": step}
    run = lw.simulate(pendulum(), duration=1.0, every=0.25, drives=drives, **options)
    energy = run.kinetic_energy + run.potential_energy
    gained = (energy - energy[0]).values
    assert np.abs(gained).max() > 1
    np.testing.assert_allclose(run.drive_work[:, 0], gained, atol=1e-7 * np.abs(gained).max())


def test_work_of_a_wrench():
    wrench = lw.Wrench([6.0, 1.0, 2.0, 0, 0, 3.0])
    run = lw.simulate(slider(), times=[0, 1, 3], wrenches={"block": wrench}, tolerance=1e-10)
    np.testing.assert_allclose(run.external_work, 6.0 * run.position[:, 0], rtol=1e-12, atol=1e-12)


def test_tables_with_corners():
    """Steps end where a table has corners, so that the quadrature sees smooth powers."""
    times = np.array([0, 0.3, 0.30001, 0.5, 2.0])
    force = np.array([0, 0, 400.0, -30.0, 0])
    run = lw.simulate(
        slider(), times=[0, 2.0], drives={"slide": lw.Table(times, force)}, tolerance=1e-10
    )
    kinetic = run.kinetic_energy.values
    assert kinetic[-1] > 1
    np.testing.assert_allclose(run.drive_work[-1, 0], kinetic[-1], rtol=1e-8)


@pytest.mark.parametrize("entry", _core.integrators(), ids=lambda entry: entry["name"])
def test_every_integrator(entry):
    options = {"step": 1e-3} if entry["fixed_step"] else {"tolerance": 1e-6}
    run = lw.simulate(
        arm(),
        duration=1.0,
        every=0.5,
        q0=[0.3, 0.5, 0.1],
        integrator=entry["name"],
        drives={"elbow": 3.0},
        **options,
    )
    loose = entry["name"] == "semi_implicit_euler"
    assert residual(run) < (1e-2 if loose else 2e-5)


def test_bodies_own_velocities_as_state():
    model = lw.scenes.chain(3, joint="revolute", axes="alternating")
    plain = {"duration": 1.0, "every": 0.5, "tolerance": 1e-8, "drives": {model.joint_names[0]: 5}}
    run = lw.simulate(model, state="body_velocities", method="constraint_force", **plain)
    np.testing.assert_allclose(run.drive_work, lw.simulate(model, **plain).drive_work, atol=1e-6)
    assert residual(run) < 1e-6


def test_members_have_what_each_has_alone():
    times = [0, 0.05, 0.31]
    options = {
        "drives": {
            "elbow": lw.PD(30, 2, 0.1),
            "shoulder": lw.Motion(profile(0.5, 1.0)),
        }
    }
    q0 = np.linspace(0, 0.3, 5)[:, None] * np.ones(3)
    batch = lw.simulate_batch(arm(), step=1e-2, times=times, q0=q0, **options)
    for k in range(5):
        alone = lw.simulate(
            arm(), times=times, q0=q0[k], integrator="runge_kutta_4", step=1e-2, **options
        )
        for name in WORKS:
            got = batch[name].isel(member=k)
            np.testing.assert_allclose(got, alone[name], rtol=1e-12, atol=1e-12)


def test_without_works_the_samples_serve_and_it_is_said():
    quantities = ["joint_load", "position", "velocity", "drive_torque", "energy"]
    run = lw.simulate(slider(damping=3.0), v0=[4.0], duration=1, every=0.01, record=quantities)
    balance = lw.loads.energy_balance(run)
    assert balance.attrs["integrated"] == "from the samples"
    np.testing.assert_allclose(balance.residual, 0, atol=1e-3)
    few = lw.simulate(slider(damping=3.0), v0=[4.0], duration=1, every=1, record=quantities)
    assert np.isnan(lw.loads.energy_balance(few).residual).all()
    assert np.isnan(lw.loads.quantities(few).drive_energy).all()


def test_drive_energy_of_each_joint_is_its_work():
    options = {"duration": 1.0, "drives": {"elbow": lw.PD(30, 2, 0.1), "shoulder": 2.0}}
    few = lw.simulate(arm(), every=0.5, joints=["elbow"], **options)
    many = lw.simulate(
        arm(), every=1e-3, record=["joint_load", "velocity", "drive_torque"], **options
    )
    exact = lw.loads.quantities(many).drive_energy.sel(joint="elbow")[-1]
    assert float(exact) != 0
    np.testing.assert_allclose(lw.loads.quantities(few).drive_energy[-1, 0], exact, rtol=1e-4)


def test_a_work_that_is_no_number_ends_the_simulation():
    """Steps too long for the damping: the power overflows before the state does."""
    model = slider(damping=700.0)
    run = lw.simulate(
        model,
        v0=[1e160],
        duration=0.1,
        every=0.001,
        integrator="runge_kutta_4",
        step=0.001,
        record=["position", "velocity", "work"],
        on_failure="return",
    )
    assert run.outcome == "not_finite"
    assert "dissipated_energy is not finite" in run.message
    for name in WORKS:
        assert np.isfinite(run[name].values).all(), name


def test_a_run_says_that_works_are_not_known():
    """A torque is finite at the stages of the steps, where it was asked, and huge between them."""
    step = 0.01

    def torque(t, q, v):
        stage = t / (step / 2)
        return 1.0 if abs(stage - round(stage)) < 1e-6 else 1.7e308

    moved = lw.Motion(lambda t: (np.sin(t), np.cos(t), -np.sin(t)), breakpoints=[])
    run = lw.simulate(
        lw.scenes.chain(2),
        duration=0.1,
        every=0.05,
        integrator="runge_kutta_4",
        step=step,
        drives={"joint_1": moved, "joint_2": lw.Torque(torque, breakpoints=[])},
    )
    assert run.completed
    assert np.isnan(run.drive_work.values[1:]).all()
    (note,) = [note for note in run.warnings if note["element"] == "works"]
    assert "not known" in note["text"]
