"""Joints that follow a given motion: exactly, with the torque that it takes."""

import numpy as np
import pytest

import linkwise as lw
from helpers.loaded_arm import arm, profile


def sine(t):
    return 0.15 * np.sin(2 * t), 0.3 * np.cos(2 * t), -0.6 * np.sin(2 * t)


def test_the_joint_is_where_the_table_says(swing):
    table = profile(0.8, 1.0)
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(table.times, table.values[:, 0])
    times = swing.time.values
    for name, order, bound in (("position", 0, 1e-14), ("velocity", 1, 1e-12)):
        found = swing[name].sel(joint="shoulder").values
        np.testing.assert_allclose(found, spline(times, order), atol=bound)
    found = swing.acceleration.sel(joint="shoulder").values
    np.testing.assert_allclose(found, spline(times, 2), atol=1e-9)


def test_the_torque_that_was_reported_makes_the_same_motion():
    """Hybrid dynamics against forward dynamics: the drive torque as a plain torque table."""
    model, end = arm(), 0.5
    drives = {"shoulder": lw.Motion(profile(0.8, end))}
    given = lw.simulate(model, duration=end, every=end / 8000, drives=drives, tolerance=1e-12)
    torques = {
        joint: lw.Table(given.time.values, given.drive_torque.sel(joint=joint).values, "cubic")
        for joint in drives
    }
    start = {"q0": given.position.values[0], "v0": given.velocity.values[0]}
    driven = lw.simulate(model, duration=end, every=0.05, drives=torques, tolerance=1e-12, **start)
    same = given.position.sel(time=driven.time, method="nearest").values
    np.testing.assert_allclose(driven.position.values, same, atol=1e-6)


def test_all_joints_given_is_inverse_dynamics():
    model = arm()
    drives = dict.fromkeys(model.joint_names, lw.Motion(sine))
    run = lw.simulate(model, duration=2.0, every=0.1, drives=drives)
    t = run.time.values[:, None] + np.zeros(3)
    q, v, a = sine(t)
    np.testing.assert_allclose(
        run.joint_load, lw.inverse_dynamics_loads(model, q, v, a), atol=1e-10
    )
    needed = lw.inverse_dynamics(model, q, v, a) - lw.passive_torque(model, q, v)
    np.testing.assert_allclose(run.drive_torque, needed, atol=1e-10)


@pytest.mark.parametrize("method", ["articulated_body", "composite_rigid_body", "constraint_force"])
@pytest.mark.parametrize("integrator", ["adams", "bdf", "runge_kutta_4"])
def test_methods_and_integrators_agree(method, integrator):
    step = {"step": 2e-4} if integrator == "runge_kutta_4" else {}
    run = lw.simulate(
        arm(),
        duration=0.5,
        every=0.1,
        drives={"elbow": lw.Motion(sine)},
        numerics=lw.Numerics(method=method, integrator=integrator, **step),
        tolerance=1e-9,
    )
    reference = lw.simulate(
        arm(), duration=0.5, every=0.1, drives={"elbow": lw.Motion(sine)}, tolerance=1e-11
    )
    np.testing.assert_allclose(run.joint_load, reference.joint_load, atol=2e-5)


def test_a_planar_joint_follows_its_coordinates():
    """Coordinates lie in the parent's plane; a body carried round a circle needs m r w^2."""
    builder = lw.ModelBuilder("puck", gravity=(0, 0, 0))
    builder.add_link("table")
    builder.add_link("puck", mass=2.0, inertia=0.1 * np.eye(3))
    builder.add_joint("glide", "planar", "table", "puck")
    w, r = 3.0, 0.5

    def circle(t):
        c, s = np.cos(w * t), np.sin(w * t)
        return (
            [r * c, r * s, 2 * t],
            [-r * w * s, r * w * c, 2.0],
            [-r * w**2 * c, -r * w**2 * s, 0.0],
        )

    run = lw.simulate(builder.build(), duration=2, every=0.1, drives={"glide": lw.Motion(circle)})
    load = lw.loads.in_frame(run, "world").isel(joint=0).values
    t = run.time.values
    inward = -2.0 * r * w**2 * np.stack([np.cos(w * t), np.sin(w * t)], axis=1)
    np.testing.assert_allclose(load[:, :2], inward, atol=1e-12)
    np.testing.assert_allclose(load[:, 2:], 0, atol=1e-12)


T = np.linspace(0, 4, 201)


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        (np.where(T < 2, 0.0, 1.0), "the position jumps by about .* near t = 1.99 s"),
        (np.abs(T - 2), "the velocity jumps by about 2 near t = 2 s"),
        (np.where(T < 2, 0.0, (T - 2) ** 2), "the acceleration jumps by about 2 near t = 2 s"),
        (np.round(np.sin(T), 3), "the acceleration jumps"),  # three digits at 20 ms
        (np.sin(40 * T), "jumps .* rows closer together"),  # eight rows a period
    ],
)
def test_tables_that_cannot_be_differentiated_are_refused(values, complaint):
    with pytest.raises(lw.InputError, match=complaint):
        lw.Motion(lw.Table(T, values, "cubic"))


@pytest.mark.parametrize(
    "values",
    [
        np.sin(T),
        0 * T,
        3.0 + 0 * T,
        T,
        np.exp(-T),
        T**3,
        np.round(np.sin(T), 9),
        np.tanh(8 * (T - 2)),
    ],
)
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e5])
def test_smooth_tables_are_taken(values, scale):
    lw.Motion(lw.Table(T, scale * values, "cubic"))


def test_uneven_rows_are_taken():
    times = np.cumsum(np.random.default_rng(0).uniform(0.01, 0.03, 200))
    lw.Motion(lw.Table(times, np.sin(times), "cubic"))


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda: lw.Motion(lw.Table(T, np.sin(T))), "velocity of a linear table jumps"),
        (lambda: lw.Motion(lw.Table(T[:7], np.sin(T[:7]), "cubic")), "7 rows; give at least 8"),
        (lambda: lw.Motion(0.3), "neither a Table nor a function"),
    ],
)
def test_what_is_no_motion_is_refused(make, complaint):
    with pytest.raises(lw.InputError, match=complaint):
        make()


@pytest.mark.parametrize(
    ("drive", "complaint"),
    [
        (profile(0.8, 0.5), "covers 0 to 0.5 s, the simulation 0 to 1 s"),
        (profile(3.0, 1.0), r"leaves the joint's limits -0.2 .. 0.2 at t = 0.\d+ s"),
        (lw.Table(np.linspace(0, 1, 50), np.zeros((50, 2)), "cubic"), "gives 2 positions for 1"),
        (lambda t: (0.1 * np.sin(t), np.sin(t), 0.0), "velocity is not the derivative"),
        (lambda t: (0.1 * np.sin(t), 0.1 * np.cos(t), 1.0), "acceleration is not the derivative"),
        (lambda t: 0.1, "returns no three values"),
        (lambda t: (np.nan, 0, 0), "not finite"),
    ],
)
def test_motions_that_do_not_fit_are_refused(drive, complaint):
    with pytest.raises(lw.InputError, match=complaint) as caught:
        lw.simulate(arm(), duration=1.0, drives={"wrist": lw.Motion(drive)})
    assert str(caught.value).startswith("drives['wrist']: motion")


def test_a_quaternion_joint_follows_no_table():
    builder = lw.ModelBuilder("ball")
    builder.add_link("base")
    builder.add_link("body", mass=1.0, inertia=np.eye(3))
    builder.add_joint("ball", "spherical", "base", "body")
    table = lw.Table(T, np.zeros((T.size, 3)), "cubic")
    with pytest.raises(lw.InputError, match=r"'ball'.*quaternion"):
        lw.simulate(builder.build(), duration=1, drives={"ball": lw.Motion(table)})
