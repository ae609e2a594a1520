"""Tables of three samples, and blows on machines at rest."""

import warnings

import numpy as np
import pytest

import linkwise as lw


@pytest.mark.parametrize("times", [(0, 0.1, 0.3), (-2, 5, 5.5), (0, 0.1, 1e30), (0, 1e-12, 1e3)])
def test_three_samples_are_a_parabola(times):
    """At any spacing, and without a warning of SciPy's about uneven times."""
    model = lw.scenes.chain(1, gravity=(0, 0, 0))
    values = [1.0, -2.0, 4.0]
    end = min(times[-1], 1.0)
    drive = {"joint_1": lw.Torque(lw.Table(times, values, "cubic"))}
    at = np.linspace(0, end, 5)[1:]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = lw.simulate(model, times=at, drives=drive, on_failure="return")
    newton = [(1, times[0]), ((values[1] - values[0]) / (times[1] - times[0]), times[1])]
    second = (values[2] - values[1]) / (times[2] - times[1])
    bend = (second - newton[1][0]) / (times[2] - times[0])
    t = run.time.values
    expected = 1 + newton[1][0] * (t - times[0]) + bend * (t - times[0]) * (t - times[1])
    inside = (t >= times[0]) & (t <= times[2])
    np.testing.assert_allclose(
        run.drive_torque.values[inside, 0], expected[inside], rtol=1e-9, atol=1e-9
    )


@pytest.mark.parametrize("integrator", ["adams", "bdf", "esdirk", "auto"])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-8, 1e-11])
def test_a_body_at_rest_is_hit_hard_and_late(integrator, tolerance):
    """A first step that changes nothing by more than the tolerance would be below round-off."""
    builder = lw.ModelBuilder("wheel", gravity=(0, 0, 0))
    builder.add_link("ground")
    builder.add_link("wheel", mass=1, inertia=0.1 * np.eye(3))
    builder.add_joint("axle", "revolute", "ground", "wheel", axis=(0, 0, 1))
    begin, torque = 14.991763, 2.8e5
    jump = lw.Torque(lambda t, q, v: torque * (t >= begin), breakpoints=[begin])
    run = lw.simulate(
        builder.build(),
        times=begin + np.array([0, 1e-9, 1e-6, 1e-3]),
        drives={"axle": jump},
        tolerance=tolerance,
        integrator=integrator,
    )
    elapsed = run.time.values - begin
    np.testing.assert_allclose(run.velocity[:, 0], torque / 0.1 * elapsed, rtol=1e-3, atol=1e-9)
    angle = 0.5 * torque / 0.1 * elapsed[-1] ** 2
    np.testing.assert_allclose(run.position[-1, 0], angle, rtol=100 * tolerance)


@pytest.mark.parametrize("times", [(0, 1e-200), (0, 1e-200, 1.0), (0, 5e-324, 1.0, 2.0)])
def test_samples_closer_than_a_double_can_divide_by(times):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(lw.InputError, match="more than a double holds"):
            lw.Table(times, np.arange(len(times)), "cubic")
