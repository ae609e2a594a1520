"""Bodies that turn while they fly: linear rates along turning axes cost neither accuracy nor
steps, and what has turned or travelled far is held as well as before."""

import numpy as np
import pytest

import linkwise as lw

MASS = 2.0
INERTIA = np.diag([0.3, 0.5, 0.4])


def body(joint, **properties):
    builder = lw.ModelBuilder("body", gravity=(0, 0, 0))
    builder.add_link("ground")
    builder.add_link("hull", mass=MASS, inertia=INERTIA)
    builder.add_joint("free", joint, "ground", "hull", **properties)
    return builder.build()


def numerics(integrator, tolerance=1e-6):
    if integrator in ("adams", "bdf"):
        return lw.Numerics(integrator=integrator, tolerance=tolerance)
    return lw.Numerics(integrator=integrator, step=0.01)


@pytest.mark.parametrize("integrator", [i["name"] for i in lw.integrators()])
@pytest.mark.parametrize(("speed", "spin", "duration"), [(1.0, 3.0, 10.0), (7500.0, 1.0, 100.0)])
def test_a_spinning_free_body_flies_straight(integrator, speed, spin, duration):
    rates = [speed, 0, 0, 0.3 * spin, -0.5 * spin, 0.8 * spin]
    model = body("floating")
    run = lw.simulate(
        model, duration=duration, every=duration / 10, v0=rates, numerics=numerics(integrator)
    )
    straight = speed * run.time.values[:, None] * [1, 0, 0]
    np.testing.assert_allclose(run.position[:, :3], straight, atol=1e-9 * speed * duration)
    momentum = lw.momentum(model, run.position, run.velocity)[:, :3]
    np.testing.assert_allclose(momentum, [[MASS * speed, 0, 0]] * 11, atol=1e-11 * speed)


def test_the_flight_costs_no_steps():
    model = body("floating")
    spin = [0.9, -1.5, 2.4]
    steps = [
        int(lw.simulate(model, duration=10, v0=[v, 0, 0, *spin]).attrs["total_steps"])
        for v in (0.0, 1.0, 7500.0)
    ]
    assert max(steps) < 1.2 * steps[0]


@pytest.mark.parametrize("integrator", [i["name"] for i in lw.integrators()])
def test_a_turning_planar_body_moves_straight(integrator):
    model = body("planar", axis=[0, 0, 1])
    run = lw.simulate(
        model, duration=10, every=1.0, v0=[3.0, 4.0, 2.0], numerics=numerics(integrator)
    )
    line = run.time.values[:, None] * [3.0, 4.0, 2.0]
    np.testing.assert_allclose(run.position, line, atol=1e-9)
    angle = run.position.values[:, 2]
    along_x = np.cos(angle) * run.velocity[:, 0] - np.sin(angle) * run.velocity[:, 1]
    np.testing.assert_allclose(along_x, 3.0, rtol=1e-12)


def test_members_of_a_batch_fly_straight():
    model = body("floating")
    v0 = np.array([[k, 0, 0, 0.5, 0.2, k] for k in range(5)], float)
    runs = lw.simulate_batch(model, duration=5, every=5, v0=v0, step=0.01)
    np.testing.assert_allclose(runs.position[:, -1, 0], 5.0 * np.arange(5), atol=1e-10)


def swing(joint, offset, integrator, tolerance):
    """A pendulum, or a slider on a spring, whose coordinate starts at `offset` instead of 0."""
    builder = lw.ModelBuilder("swing")
    builder.add_link("ground")
    builder.add_link("bob", mass=1.0, com=(0, 0, -0.5), inertia=np.eye(3) * 0.01)
    options = {} if joint == "continuous" else {"stiffness": 30.0, "rest_position": offset}
    builder.add_joint("hinge", joint, "ground", "bob", axis=[1, 0, 0], **options)
    run = lw.simulate(
        builder.build(), duration=20, every=0.5, q0=[offset], v0=[3.0],
        numerics=numerics(integrator, tolerance),
    )  # fmt: skip
    return run.position.values[:, 0] - offset


@pytest.mark.parametrize("integrator", ["adams", "bdf"])
@pytest.mark.parametrize(
    ("joint", "offset"), [("continuous", 2 * np.pi * 2.0**20), ("prismatic", 2.0**20)]
)
def test_what_has_come_far_is_held_as_well(joint, offset, integrator):
    exact = swing(joint, 0.0, "adams", 1e-11)
    near, far = (
        np.abs(swing(joint, start, integrator, 1e-6) - exact).max() for start in (0.0, offset)
    )
    assert far < 3 * near
