"""A ball joint takes no given motion, and the three hinges that the refusal names do: a body that
turns as it is told to, against Euler's equations; also where they close a loop."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import linkwise as lw

INERTIA, MASS, ARM = np.diag([0.2, 0.5, 0.4]), 2.0, np.array([0.3, -0.1, 0.2])
ABOUT_PIN = INERTIA + MASS * (ARM @ ARM * np.eye(3) - np.outer(ARM, ARM))
TIME = 0.37


def turn(speed, phase):
    """An angle with its rate and acceleration."""
    return lambda t: (
        0.4 * np.sin(speed * t + phase),
        0.4 * speed * np.cos(speed * t + phase),
        -0.4 * speed**2 * np.sin(speed * t + phase),
    )


TURNS = {"one": turn(2.0, 0.3), "two": turn(3.0, -0.2), "three": turn(1.5, 1.0)}
MOTIONS = {name: lw.Motion(course) for name, course in TURNS.items()}


def stacked() -> lw.ModelBuilder:
    """Hinges about z, y and x at one point, with links without mass between them."""
    builder = lw.ModelBuilder("stack")
    for name in ("ground", "first", "second"):
        builder.add_link(name)
    builder.add_link("body", mass=MASS, com=ARM, inertia=INERTIA)
    chain = ("ground", "first", "second", "body")
    for k, (name, axis) in enumerate(zip(TURNS, np.eye(3)[::-1], strict=True)):
        builder.add_joint(name, "revolute", chain[k], chain[k + 1], axis=axis)
    return builder


def orientation(t: float) -> Rotation:
    """From the body's axes to the world's: turned about z, then the new y, then the new x."""
    return Rotation.from_euler("ZYX", [TURNS[name](t)[0] for name in TURNS])


def spin(t: float, h: float = 1e-4) -> np.ndarray:
    """Angular velocity in the world, by differences of the orientation."""
    return (orientation(t + h) * orientation(t - h).inv()).as_rotvec() / (2 * h)


def expected_moment() -> np.ndarray:
    """On the body about the pin, in its axes: d/dt (I w) less the moment of the weight."""

    def momentum(t):
        R = orientation(t).as_matrix()
        return R @ ABOUT_PIN @ R.T @ spin(t)

    h = 1e-3
    R = orientation(TIME).as_matrix()
    change = (8 * (momentum(TIME + h) - momentum(TIME - h))) / (12 * h)
    change -= (momentum(TIME + 2 * h) - momentum(TIME - 2 * h)) / (12 * h)
    return R.T @ (change - np.cross(R @ ARM, [0, 0, -9.81 * MASS]))


def test_three_hinges_turn_a_body_as_a_ball_would() -> None:
    run = lw.simulate(stacked().build(), times=[0, TIME], drives=MOTIONS)
    load = run.joint_load.sel(joint="three").values[-1]
    np.testing.assert_allclose(load[3:], expected_moment(), rtol=1e-6, atol=1e-6)


def test_in_a_loop() -> None:
    """The body's rod pulls a slider along, which weighs it down: the sum is still Euler's."""
    builder = stacked()
    builder.add_link("slider", mass=1.0, inertia=0.1 * np.eye(3))
    builder.add_joint("guide", "prismatic", "ground", "slider", axis=(0, 0, 1))
    builder.add_rod("rod", "body", "slider", length=0.8, point=(0.3, 0, 0), child_point=(0, 0, 1))
    model = builder.build()
    run = lw.simulate(model, times=[0, TIME], drives=MOTIONS)
    load = run.joint_load.sel(joint="three").values[-1]
    q, pull = run.position.values[-1], run.joint_load.sel(joint="rod").values[-1]
    on_slider = lw.frame_pose(model, q, "slider")[:3, :3] @ pull[:3]
    on_body = -orientation(TIME).inv().apply(on_slider)
    reaction = np.cross([0.3, 0, 0], on_body)
    np.testing.assert_allclose(load[3:] + reaction, expected_moment(), rtol=1e-6, atol=1e-6)
    assert np.linalg.norm(reaction) > 0.5


@pytest.mark.parametrize("closes", [False, True])
@pytest.mark.parametrize("kind", ["spherical", "floating"])
def test_a_joint_with_a_quaternion_is_refused_with_that_remedy(kind, closes) -> None:
    builder = lw.ModelBuilder("ball")
    builder.add_link("ground")
    builder.add_link("body", mass=MASS, com=ARM, inertia=INERTIA)
    if closes:
        builder.add_joint("hinge", "revolute", "ground", "body", axis=(0, 0, 1))
        builder.add_loop("ball", kind, "ground", "body")
    else:
        builder.add_joint("ball", kind, "ground", "body")
    model, motion = builder.build(), {"ball": lw.Motion(lambda t: (np.zeros(3),) * 3)}
    with pytest.raises(lw.InputError, match="has a quaternion; let three hinges stand") as error:
        lw.simulate(model, duration=0.1, drives=motion)
    assert "\n" not in str(error.value)
