"""Published machines: loops are closed where they start, bodies weigh as published."""

import numpy as np
import pytest

import linkwise as lw
from helpers.closing_frames import closing_frames
from linkwise._core import InputError
from linkwise.scenes import benchmark

NAMES = ("pendulum", "four_bars", "andrews", "bricard", "slider_crank", "stewart", "biped")
WITH_LOOPS = NAMES[1:]


def held(model, q):
    """What each loop joint holds together: points, and directions of axes, on its two links."""
    frames = closing_frames(model, q)
    rows = [frames[:, :, :3, 3]]
    for loop, axes in enumerate(model.loop_axes):
        for _, axis in axes:
            rows.append(frames[loop : loop + 1, :, :3, :3] @ np.array(axis))
    return np.concatenate(rows)


@pytest.mark.parametrize("name", WITH_LOOPS)
def test_loops_are_closed_where_it_starts(name):
    found = benchmark(name)
    here, there = held(found.model, found.q0).swapaxes(0, 1)
    np.testing.assert_allclose(here, there, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["four_bars", "slider_crank"])
def test_loops_stay_closed_to_first_order(name):
    found, step = benchmark(name), 1e-7
    assert found.v0.any()
    ahead, behind = (held(found.model, found.q0 + s * found.v0) for s in (step, -step))
    parting = np.diff((ahead - behind) / (2 * step), axis=1)
    # Central differences: the error is rounding over the step, and the square of the step.
    np.testing.assert_allclose(parting, 0, atol=1e-8 * max(1.0, np.abs(found.v0).max()))


@pytest.mark.parametrize(
    ("name", "joints", "loops", "mass"),
    [
        ("pendulum", 1, 0, 1.0),
        ("four_bars", 5, 2, 5.0),
        ("andrews", 7, 3, 0.21023),
        ("bricard", 5, 1, 5.0),
        ("slider_crank", 3, 1, 0.586656),
        ("flyball_governor", 4, 2, 13.9),
        ("stewart", 13, 5, 148.0),
        ("biped", 19, 4, 38.2),
    ],
)
def test_sizes_and_masses(name, joints, loops, mass):
    model = benchmark(name).model
    assert (model.n_joints, model.n_loops) == (joints, loops)
    assert model.total_mass == pytest.approx(mass, rel=1e-9)


def test_the_iftomm_numbers_are_names_too():
    named = ("pendulum", "four_bars", "andrews", "bricard", "flyball_governor")
    for number, name in enumerate(named, 1):
        assert benchmark(f"A0{number}").model.hash == benchmark(name).model.hash


def test_the_governor_starts_with_slack_springs():
    """The centre of each arm is half a metre from its pin on the slider."""
    found = benchmark("flyball_governor")
    loads = lw.joint_loads(found.model, found.q0, None, passive=True)
    np.testing.assert_allclose(loads[-2:], 0, atol=1e-9)


def test_four_bars_in_any_number():
    found = benchmark("four_bars", n=40)
    assert (found.model.nv, found.model.n_loops) == (81, 40)
    tips = np.array(
        [lw.link_poses(found.model, found.q0)[found.model.link_names.index(f"rod_{k}")]
         for k in range(41)]
    ) @ [0, 1, 0, 1]  # fmt: skip
    np.testing.assert_array_equal(tips[:, :2], [[k, 1] for k in range(41)])


def test_the_four_bar_moves_to_the_right_at_one_metre_per_second():
    found = benchmark("four_bars")
    step = 1e-6
    tip = [
        lw.link_poses(found.model, found.q0 + s * found.v0)[
            found.model.link_names.index("rod_0")
        ] @ [0, 1, 0, 1]
        for s in (step, -step)
    ]  # fmt: skip
    np.testing.assert_allclose((tip[0] - tip[1])[:2] / (2 * step), [1, 0], atol=1e-9)


def test_kinetic_energy_of_the_four_bars():
    # Rods turn about their ends at 1 rad/s, bars move at 1 m/s: (n + 1) / 6 + n / 2.
    found = benchmark("four_bars", n=3)
    assert lw.kinetic_energy(found.model, found.q0, found.v0) == pytest.approx(4 / 6 + 3 / 2)


def test_andrews_mass_matrix():
    """Entries as the test set for IVP solvers writes them."""
    found = benchmark("andrews")
    model, (phi, omega) = found.model, (0.3, -0.7)
    q = found.q0.copy()
    q[model.q_slice("Phi")], q[model.q_slice("Omega")] = phi, omega

    def energy(*joints):
        v = np.zeros(model.nv)
        for joint in joints:
            v[model.v_slice(joint)] += 1
        return lw.kinetic_energy(model, q, v)

    def entry(a, b):
        return energy(a, b) - energy(a) - energy(b)

    m4, e_ea, zt = 0.00706, 0.02 - 0.01421, 0.04
    assert entry("Phi", "Phi") == pytest.approx(m4 * e_ea**2 + 5.667e-7, rel=1e-9)
    cross = m4 * (e_ea**2 + zt * e_ea * np.sin(phi)) + 5.667e-7
    assert entry("delta", "Phi") == pytest.approx(cross, rel=1e-9)
    m6, zf_fa, u = 0.00706, 0.02 - 0.01421, 0.04
    cross = m6 * (zf_fa**2 - u * zf_fa * np.sin(omega)) + 5.667e-7
    assert entry("epsilon", "Omega") == pytest.approx(cross, rel=1e-9)
    theta, rr, da = 0.0, 0.007, 0.0115
    own = 0.04325 * 0.00092**2 + 0.00365 * (rr**2 - 2 * da * rr * np.cos(theta) + da**2)
    assert entry("beta", "beta") == pytest.approx(own + 2.194e-6 + 4.410e-7, rel=1e-9)
    assert entry("gamma", "gamma") == pytest.approx(
        0.02373 * (0.01874**2 + 0.01043**2) + 5.255e-6, rel=1e-9
    )


def test_andrews_starts_as_published():
    """Accelerations and the forces of the pin of K2 and K3 of the test set for IVP solvers."""
    found = benchmark("andrews")
    model, tau = found.model, np.zeros(found.model.nv)
    tau[model.v_slice("beta")] = found.drives["beta"]
    tau[model.v_slice("gamma")] = found.drives["gamma"](0.0, found.q0[model.q_slice("gamma")], None)
    acceleration = lw.forward_dynamics(model, found.q0, found.v0, tau)
    wanted = {"beta": 14222.4439199541, "Theta": -10666.8329399658}
    for joint in model.joint_names:
        value = acceleration[model.v_slice(joint)][0]
        assert value == pytest.approx(wanted.get(joint, 0.0), rel=1e-12, abs=1e-8)
    loads = lw.joint_loads(model, found.q0, found.v0, tau)[model.n_joints :]
    k3 = lw.link_poses(model, found.q0)[model.link_names.index("K3"), :3, :3]
    force = k3 @ loads[model.loop_names.index("K2_K3"), :3]
    np.testing.assert_allclose(np.abs(force[:2]), [98.5668703962411, 6.12268834425567], rtol=1e-11)
    assert np.abs(loads[1:, :3]).max() < 1e-10


def test_the_heads_of_the_stewart_platform_carry_it():
    """The six heads' forces and moments on the platform are its mass times its acceleration."""
    found = benchmark("stewart")
    model, q, v = found.model, found.q0, found.v0
    tau = np.random.default_rng(1).normal(scale=200, size=model.nv)
    tau[model.v_slice("head_0")] = 0
    result = lw.forward_dynamics(model, q, v, tau, full=True)
    loads = {
        name: load
        for name, load in zip(
            [*model.joint_names, *model.loop_names], result.joint_load, strict=True
        )
        if name.startswith("head")
    }
    assert len(loads) == 6
    pose = lw.link_poses(model, q)[model.link_names.index("platform")]  # along the world's axes
    np.testing.assert_allclose(pose[:3, :3], np.eye(3), atol=1e-15)
    center = model.link_centers_of_mass[model.link_names.index("platform")]
    points = {
        name: place[1][:3, 3]
        for name, place in zip(model.loop_names, model.loop_placements, strict=True)
    }
    points["head_0"] = np.zeros(3)
    force = sum(load[:3] for load in loads.values())
    moment = sum(
        np.cross(points[name] - center, load[:3]) + load[3:] for name, load in loads.items()
    )
    moved = lw.frame_acceleration(model, q, v, result.acceleration, lw.Frame("platform", center))
    np.testing.assert_allclose(force, 100 * (moved[:3] + np.array([0, 0, 9.81])), rtol=1e-11)
    np.testing.assert_allclose(moment, [9, 9, 18] * moved[3:], rtol=1e-10, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "rows", "rank", "mobility"),
    [
        ("four_bars", 10, 4, 1),
        ("andrews", 15, 6, 1),
        ("bricard", 5, 4, 1),
        ("slider_crank", 5, 2, 1),
        ("stewart", 15, 15, 6),
    ],
)
def test_ways_to_move(name, rows, rank, mobility):
    found = benchmark(name)
    held = lw.indeterminacy(found.model, found.q0)
    assert (held.rows, held.rank, held.mobility) == (rows, rank, mobility)


def test_andrews_spring_is_the_slope_of_its_energy():
    torque = benchmark("andrews").drives["gamma"]
    gamma, step = 0.455279819163070380, 1e-6

    def energy(angle):
        x = 0.02 * np.cos(angle) + 0.018 * np.sin(angle) - 0.03635 - 0.014
        y = 0.02 * np.sin(angle) - 0.018 * np.cos(angle) + 0.03273 - 0.072
        return 2265 * (np.hypot(x, y) - 0.07785) ** 2

    slope = (energy(gamma + step) - energy(gamma - step)) / (2 * step)
    assert torque(0.0, np.array([gamma]), np.zeros(1)) == pytest.approx(-slope, rel=1e-6)


def test_bricard_hinges_are_across_both_of_their_rods():
    found = benchmark("bricard")
    poses = dict(zip(found.model.link_names, lw.link_poses(found.model, found.q0), strict=True))
    ends = [poses[f"rod_{i}"][:3, 3] for i in range(5)]
    np.testing.assert_allclose(
        ends, [(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1)], atol=1e-15
    )
    for (_, axis), rod in zip(
        [axes[0] for axes in found.model.joint_axes], np.diff([*ends, (0, 0, 1)], axis=0),
        strict=True,
    ):  # fmt: skip
        assert np.dot(axis, rod) == pytest.approx(0, abs=1e-15)


def test_unknown_ones_are_named():
    with pytest.raises(InputError, match="known: pendulum"):
        benchmark("squeezer")
    with pytest.raises(InputError, match="n is 0"):
        benchmark("four_bars", n=0)
