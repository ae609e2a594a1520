"""Joint loads known in closed form. Load: inboard on outboard body, in the joint frame [N, N m]."""

import numpy as np
import pytest

import linkwise as lw
from helpers.compare import load_error
from helpers.machines import G, pendulum, rod_chain
from helpers.methods import METHODS
from helpers.motion import final_state
from helpers.random_trees import random_configuration


@pytest.mark.parametrize("distance", [1.0, 0.6])
@pytest.mark.parametrize("angle", [0.3, -1.2, -np.pi / 2, 2.5])
def test_pendulum_tension_and_shear(distance, angle):
    """Along the arm m (d w^2 + g cos), across it m g sin (1 - d), measured from the vertical."""
    model, w = pendulum(distance), 1.7
    load = lw.joint_loads(model, np.array([angle]), np.array([w]), np.zeros(1))[0]
    below = angle + np.pi / 2  # angle from the downward vertical
    tension = distance * w**2 + G * np.cos(below)
    shear = G * np.sin(below) * (1 - distance)  # m (g sin - d * acceleration), acceleration g sin
    np.testing.assert_allclose(load, [-tension, shear, 0, 0, 0, 0], atol=1e-13)


def test_pendulum_tension_after_ten_seconds():
    model = pendulum()
    q, v = final_state(model, 10.0, q0=[np.pi], tolerance=1e-11)
    load = lw.joint_loads(model, q, v, np.zeros(1))[0]
    assert -load[0] == pytest.approx(28.29456721, abs=5e-8)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("n", [1, 2, 7, 32])
def test_straight_spinning_chain(n, method):
    """n unit rods in line, spinning at w about the vertical: joint k (at radius k) carries the
    centripetal force w^2 (n^2 - k^2)/2, the weight (n-k) g and the moment g (n-k)^2/2."""
    model, w = rod_chain(n, gravity=(0, 0, -G)), 3.0
    v = np.r_[w, np.zeros(n - 1)]
    full = lw.forward_dynamics(model, np.zeros(n), v, np.zeros(n), method=method, full=True)
    k, zero = np.arange(n), np.zeros(n)
    expected = [-(w**2) * (n**2 - k**2) / 2, zero, (n - k) * G, zero, -G * (n - k) ** 2 / 2, zero]
    assert load_error(full.joint_load, np.transpose(expected)) < 1e-9
    np.testing.assert_allclose(full.acceleration, 0, atol=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_hanging_chain_at_rest(method):
    """Joint k carries the weight of the n - k rods below it and nothing else."""
    n = 20
    model = rod_chain(n, gravity=(G, 0, 0))
    zero = np.zeros(n)
    full = lw.forward_dynamics(model, zero, zero, zero, method=method, full=True)
    expected = np.zeros((n, 6))
    expected[:, 0] = -G * (n - np.arange(n))
    np.testing.assert_allclose(full.joint_load, expected, atol=1e-11)
    np.testing.assert_allclose(full.acceleration, 0, atol=1e-10)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("n", [2, 50])
def test_a_falling_chain_is_weightless(n, method, rng):
    """Let go at rest in any shape, every rod falls with g and no joint carries anything."""
    model = rod_chain(n, floating=True)
    q, zero = random_configuration(model, rng), np.zeros(model.nv)
    full = lw.forward_dynamics(model, q, zero, zero, method=method, full=True)
    R = lw.joint_poses(model, q)[0, :3, :3]
    expected = np.r_[R.T @ (0, -G, 0), np.zeros(model.nv - 3)]
    np.testing.assert_allclose(full.acceleration, expected, atol=1e-9)
    np.testing.assert_allclose(full.joint_load, 0, atol=1e-9)


def test_far_from_the_hinge_a_long_chain_falls_freely():
    """Let go horizontally, the tip of 32 rods has fallen g t^2/2 after 1 s (numbers to 1e-10)."""
    q, _ = final_state(rod_chain(32), 1.0, tolerance=1e-11)
    height = np.sin(np.cumsum(q)).sum()
    assert height == pytest.approx(-G / 2, abs=3e-10)
