"""Bodies that turn while they fly: linear rates along turning axes cost neither accuracy nor
steps, and what has turned or travelled far is held as well as before."""

import numpy as np
import pytest

import linkwise as lw

MASS = 2.0
INERTIA = np.diag([0.3, 0.5, 0.4])
FIXED_STEP = {entry["name"] for entry in lw.integrators() if entry["fixed_step"]}


def body(joint, **properties):
    builder = lw.ModelBuilder("body", gravity=(0, 0, 0))
    builder.add_link("ground")
    builder.add_link("hull", mass=MASS, inertia=INERTIA)
    builder.add_joint("free", joint, "ground", "hull", **properties)
    return builder.build()


def numerics(integrator, tolerance=1e-6):
    if integrator not in FIXED_STEP:
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


# ---- Armature, damping and friction of joints whose rates turn ----------------------------------


@pytest.mark.parametrize(
    ("joint", "options", "spin"),
    [("floating", {}, [0.5, -1.0, 3.0]), ("planar", {"axis": [0, 0, 1]}, [3.0])],
)
def test_an_armature_does_not_bend_a_straight_flight(joint, options, spin):
    model = body(joint, armature=0.5, **options)
    start = [1.0] + [0.0] * (model.nv - len(spin) - 1)
    run = lw.simulate(model, duration=2, every=0.5, v0=[*start, *spin])
    line = run.time.values[:, None] * np.array(start)
    np.testing.assert_allclose(run.position[:, : len(start)], line, atol=1e-10)
    energy = run.kinetic_energy.values
    np.testing.assert_allclose(energy, energy[0], rtol=1e-5)


def test_rotors_on_a_ball_joint_keep_their_energy():
    """Of unequal armatures the momentum turns with the child: without w x (D w) energy drifts."""
    model = body("spherical", armature=[0.1, 0.6, 0.3])
    run = lw.simulate(model, duration=20, every=1, v0=[1.0, 2.0, -0.5])
    # The armatures act as a body's own inertia, whose energy and momentum Euler's equations keep.
    solid = np.diag(INERTIA) + np.array([0.1, 0.6, 0.3])
    momentum = np.linalg.norm(run.velocity.values * solid, axis=1)
    np.testing.assert_allclose(momentum, momentum[0], rtol=1e-5)
    np.testing.assert_allclose(run.kinetic_energy, run.kinetic_energy[0], rtol=1e-5)


@pytest.mark.parametrize("count", [1, 11])
def test_every_method_and_inverse_dynamics_agree_on_turning_armatures(count, rng):
    builder = lw.ModelBuilder("turning")
    for k in range(3):
        builder.add_link(f"link{k}", mass=1.0 + k, com=(0.1, 0.2, -0.1), inertia=np.eye(3) * 0.1)
    builder.set_floating_base()
    builder.add_joint("ball", "spherical", "link0", "link1", armature=[0.1, 0.2, 0.4])
    builder.add_joint("table", "planar", "link1", "link2", axis=[1, 1, 0], armature=0.3)
    model = builder.build()
    q = np.tile(model.neutral_configuration(), (count, 1))
    v, tau = rng.standard_normal((2, count, model.nv))
    expected = lw.forward_dynamics(model, q, v, tau)
    assert np.abs(expected - lw.forward_dynamics(model, q, 0 * v, tau)).max() > 0.1
    np.testing.assert_allclose(lw.inverse_dynamics(model, q, v, expected), tau, atol=1e-12)
    for method in lw.methods():
        if method["name"] in ("auto", "piecewise"):
            continue
        found = lw.forward_dynamics(model, q, v, tau, method=method["name"], tolerance=1e-14)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)
    system = lw.ConstraintSystem(model, q[0], v[0], tau[0])
    np.testing.assert_allclose(
        system.recover(system.solve()[0])[0], expected[0], rtol=1e-9, atol=1e-9
    )
    causes = ["gravity", "velocity", "drive"]
    for method in ("articulated_body", "constraint_force"):
        shares = lw.joint_loads_by_cause(model, causes, q, v, tau, method=method)
        np.testing.assert_allclose(
            shares.sum(axis=-3), lw.joint_loads(model, q, v, tau), atol=1e-11
        )


def test_unequal_armatures_along_turning_axes_are_refused():
    with pytest.raises(lw.InputError, match="armature differs between its linear"):
        body("floating", armature=[1, 2, 1, 0, 0, 0])


@pytest.mark.parametrize("joint", ["floating", "planar"])
def test_dry_friction_brakes_along_the_line_of_flight(joint):
    """Friction along the parent's axes stops a body that flies along one of them: its spin turns
    no part of the force to the side, and 4 m/s take v / (f / m) = 4 s."""
    friction = {"floating": [2.0] * 3 + [0.0] * 3, "planar": [2.0, 2.0, 0.0]}[joint]
    model = body(joint, friction=friction, friction_velocity=1e-4)
    spin = {"floating": [0, 0, 5.0], "planar": [5.0]}[joint]
    linear = model.nv - len(spin)
    run = lw.simulate(
        model, duration=3.0, every=1.0, v0=[4.0] + [0.0] * (linear - 1) + spin,
        numerics=numerics("bdf"),
    )  # fmt: skip
    travelled = 4 * run.time.values - 0.5 * run.time.values**2
    np.testing.assert_allclose(run.position[:, 0], travelled, atol=1e-4)
    np.testing.assert_allclose(run.position[:, 1], 0, atol=1e-4)
