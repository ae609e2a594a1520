"""Machines with closed loops in, near and through positions where their loops hold less."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_closed_loops import open_by, pendulum, rod, state, tip

import linkwise as lw
from linkwise.scenes import benchmark


@pytest.mark.parametrize(
    ("n", "end"), [(2, (0.3284581115, 0.9445185382)), (40, (0.1805122267, 0.9835727406))]
)
@pytest.mark.parametrize(
    ("tolerance", "within"), [(1e-6, 5e-5), (1e-8, 3e-6), (1e-10, 1e-7), (1e-11, 1e-8)]
)
def test_four_bars_go_through_their_singular_positions(n, end, tolerance, within):
    """A02: the rods turn over, and all bars lie in one line twice in a turn."""
    start = benchmark("four_bars", n=n)
    run = lw.simulate(
        start.model, duration=10, every=10, q0=start.q0, v0=start.v0, tolerance=tolerance
    )
    found = tip(start.model, run, "A0", (0, 1, 0))[-1, :2]
    assert np.abs(found - end).max() < within
    assert open_by(start.model, run) < 1e-10


@pytest.mark.parametrize("n", [1, 2, 13, 40])
def test_starts_in_a_singular_position_take_the_branch_of_their_rates(n):
    model = benchmark("four_bars", n=n).model
    q0, v0 = state(model, A=-np.pi / 2, B=np.pi / 2), state(model, A=-3, B=3)
    with pytest.raises(lw.InputError, match="starts at rest in a singular position"):
        lw.simulate(model, duration=1, q0=q0)
    run = lw.simulate(model, duration=2, every=0.1, q0=q0, v0=v0, tolerance=1e-9)
    rods = run.position.sel(coordinate=[f"A{k}" for k in range(n + 1)]).values
    assert np.abs(rods - rods[:, :1]).max() < 1e-9
    energy = (run.kinetic_energy + run.potential_energy).values
    assert np.ptp(energy) < 1e-5


def test_long_steps_go_through_singular_positions_as_well():
    """A02 by a method whose steps are several windows long."""
    start = benchmark("four_bars", n=40)
    for tolerance, within in ((1e-9, 1e-7), (1e-11, 2e-8)):
        run = lw.simulate(
            start.model,
            duration=10,
            every=10,
            q0=start.q0,
            v0=start.v0,
            tolerance=tolerance,
            integrator="runge_kutta_8",
        )
        found = tip(start.model, run, "A0", (0, 1, 0))[-1, :2]
        assert np.abs(found - (0.1805122267, 0.9835727406)).max() < within


@pytest.mark.parametrize("integrator", ["adams", "runge_kutta_8"])
@pytest.mark.parametrize("apart", [0.003, 0.005])
def test_a_direction_that_is_weak_for_long_is_no_singular_position(apart, integrator):
    """A table on two rods of 1 m, some mm apart, which hold its turning by that lever."""
    builder = lw.ModelBuilder("guide", gravity=(0, -9.81, 0))
    builder.add_link("ground")
    builder.add_link("table", mass=1.0, inertia=np.diag([0.1, 0.1, 0.1]))
    builder.add_joint("plane", "planar", "ground", "table", axis=(0, 0, 1))
    for name, x in (("left", -apart / 2), ("right", apart / 2)):
        builder.add_rod(name, "ground", "table", length=1, point=(x, 0, 0), child_point=(x, 0, 0))
    angle = 1.45  # the rods are in one line at pi / 2
    run = lw.simulate(
        builder.build(),
        duration=5,
        every=0.05,
        q0=[np.sin(angle), -np.cos(angle), 0],
        tolerance=1e-8,
        integrator=integrator,
    )
    x, _, turn = run.position.values.T
    assert np.abs(x - np.sin(pendulum(angle, np.sqrt(9.81), run.time.values))).max() < 1e-6
    assert np.abs(turn).max() < 1e-10
    energy = (run.kinetic_energy + run.potential_energy).values
    assert np.ptp(energy) < 2e-6


@pytest.mark.parametrize(("integrator", "tolerance"), [("adams", 1e-9), ("runge_kutta_8", 1e-10)])
@pytest.mark.parametrize("longer", [1e-3, 1e-4, -1e-4, 1e-5])
def test_a_four_bar_turns_away_from_a_singular_position(longer, integrator, tolerance):
    """Its rods are nearly equal, so that their bars come nearly into one line, where it must turn
    back: on the other branch the bars would cross. The witness are three bodies in the plane with
    Lagrange multipliers."""
    builder = lw.ModelBuilder("four_bar", gravity=(0, -9.81, 0))
    builder.add_link("ground")
    for name, length in (("A", 1.0), ("B", 1.0), ("C", 1.0 + longer)):
        rod(builder, name, length)
    z, one = (0, 0, 1), (1, 0, 0)
    builder.add_joint("a", "revolute", "ground", "A", axis=z)
    builder.add_joint("b", "revolute", "A", "B", translation=one, axis=z)
    builder.add_joint("c", "revolute", "ground", "C", translation=one, axis=z)
    end = (1 + longer, 0, 0)
    builder.add_loop("d", "revolute", "B", "C", translation=one, child_translation=end, axis=z)
    model, until = builder.build(), 1.0
    run = lw.simulate(
        model,
        duration=until,
        every=until,
        q0=[np.pi / 2, -np.pi / 2, np.pi / 2],
        v0=[-4, 4, -4],
        tolerance=tolerance,
        integrator=integrator,
    )
    lengths = np.array([1, 1, 1 + longer])
    q = run.position.values
    start, found = (np.array([a, a + b, c]) for a, b, c in (q[0], q[-1]))
    a, b, c = run.velocity.values[0]
    expected = planar_rods(lengths, start, np.array([a, a + b, c]), until)
    assert np.abs(found - expected).max() < 1e-4 * max(1, 1e-4 / abs(longer))


def planar_rods(lengths, angle, rate, until) -> np.ndarray:
    """World angles of rods 0 and 1 in a row that meet the end of rod 2, which starts at (1, 0):
    H a + J^T f = g(angle), J a = -dJ/dt rate."""
    first, second, third = lengths
    inertia = lengths**2 / 3
    signs = np.array([1, 1, -1])

    def derivative(_, y):
        angle, rate = y[:3], y[3:]
        c, s = np.cos(angle), np.sin(angle)
        H = np.diag(inertia)
        H[0, 0] += first**2
        H[0, 1] = H[1, 0] = first * second / 2 * np.cos(angle[0] - angle[1])
        turn = first * second / 2 * np.sin(angle[0] - angle[1])
        force = -9.81 * np.array([1.5 * first, second / 2, third / 2]) * c
        force[:2] += turn * np.array([-(rate[1] ** 2), rate[0] ** 2])
        J = np.array([-signs * lengths * s, signs * lengths * c])
        bend = -np.array([signs * lengths * c, signs * lengths * s]) @ rate**2
        K = np.block([[H, J.T], [J, np.zeros((2, 2))]])
        return np.r_[rate, np.linalg.solve(K, np.r_[force, -bend])[:3]]

    found = solve_ivp(derivative, (0, until), np.r_[angle, rate], "DOP853", rtol=1e-12, atol=1e-12)
    return found.y[:3, -1]
