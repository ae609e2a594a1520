"""Rods with stiffness and damping: springs and dampers between two points of any links."""

import numpy as np
import pytest

import linkwise as lw


def ball(length, **elastic):
    """A point mass on three slides, tied to the ground's origin."""
    builder = lw.ModelBuilder("ball", gravity=(0, 0, -9.81))
    builder.add_link("base", mass=0)
    builder.add_link("ball", mass=2.0, inertia=0.01 * np.eye(3))
    builder.add_joint("free", "floating", "base", "ball")
    builder.add_rod("tie", "base", "ball", length=length, **elastic)
    return builder.build()


def test_a_mass_on_a_spring_swings_up_and_down():
    """z'' = -g - (k / m) (z + L) - (c / m) z' below its anchor, in closed form."""
    m, k, c, length = 2.0, 300.0, 4.0, 0.5
    model = ball(length, stiffness=k, damping=c)
    assert (model.loop_types, model.loop_nv) == (["spring"], [6])
    q0 = model.initial_configuration()
    q0[2] = -length
    run = lw.simulate(model, duration=2, q0=q0, tolerance=1e-10)
    assert run.outcome == "converged"
    t = run.time.values
    rest = -length - m * 9.81 / k
    decay, rate = c / (2 * m), np.sqrt(k / m - (c / (2 * m)) ** 2)
    wave = np.cos(rate * t) + decay / rate * np.sin(rate * t)
    z = rest + (-length - rest) * np.exp(-decay * t) * wave
    found = run.position.values[:, 2]
    np.testing.assert_allclose(found, z, atol=1e-8)
    # The tie pulls the ball up by k stretch + c rate, along the line: it is its load.
    pull = k * (-found - length) - c * run.velocity.values[:, 2]
    load = run.joint_load.sel(joint="tie").values
    np.testing.assert_allclose(load[:, 2], pull, atol=1e-9)
    np.testing.assert_allclose(load[:, [0, 1, 3, 4, 5]], 0, atol=1e-9)
    assert np.abs(lw.loads.energy_balance(run).residual).max() < 1e-7


def test_a_stiff_rod_tends_to_a_rigid_one():
    """A pendulum on a rod: the force of the elastic one, at rest, is that of the rigid one."""
    loads = []
    for elastic in ({}, {"stiffness": 1e7, "damping": 1e3}):
        model = ball(0.5, **elastic)
        q0 = model.initial_configuration()
        q0[:3] = (0.3, 0, -0.4)
        tau = np.zeros(model.nv)
        result = lw.forward_dynamics(model, q0, None, tau, passive=True, full=True)
        loads.append(result.joint_load[-1, :3])
    np.testing.assert_allclose(loads[0], 2.0 * 9.81 * 0.8 * np.array([-0.6, 0, 0.8]), atol=1e-9)
    assert np.abs(loads[1]).max() < 1e-6  # not stretched yet
    model = ball(0.5, stiffness=1e7, damping=1e3)
    assert lw.joint_loads(model, q0, None, passive=False)[-1] == pytest.approx(np.zeros(6))


def test_its_energy_and_that_of_two_integrators():
    """The stiff flyball governor of the IFToMM benchmarks."""
    found = lw.scenes.benchmark("A05")
    options = {"q0": found.q0, "v0": found.v0, "duration": 0.5, "every": 0.05}
    runs = [
        lw.simulate(found.model, integrator=name, tolerance=tolerance, **options)
        for name, tolerance in (("adams", 1e-9), ("bdf", 1e-9))
    ]
    for quantity in ("position", "velocity"):
        one, other = (run[quantity].values for run in runs)
        np.testing.assert_allclose(other, one, atol=2e-5 * (1 + np.abs(one).max()))
    balance = lw.loads.energy_balance(runs[0])
    assert np.abs(balance.residual).max() < 1e-6 * balance.kinetic_energy.max()
    # Nothing turns it about the shaft: its angular momentum stays.
    q, v = runs[0].position.values, runs[0].velocity.values
    momentum = lw.momentum(found.model, q, v)[:, 5]
    np.testing.assert_allclose(momentum, momentum[0], rtol=1e-7)
    assert found.model.loop_types == ["spring", "spring"]
    gaps = runs[0].joint_load.sel(joint=["spring_1", "spring_2"]).values
    assert np.abs(gaps).max() > 10


def test_the_numbers_of_the_benchmarks_are_names():
    for number, name in (("A01", "pendulum"), ("A02", "four_bars"), ("A04", "bricard")):
        assert lw.scenes.benchmark(number).model == lw.scenes.benchmark(name).model


@pytest.mark.parametrize("elastic", [{"stiffness": -1.0}, {"damping": np.nan}])
def test_bad_numbers_are_refused(elastic):
    with pytest.raises(lw.InputError, match=r"'tie'.*stiffness or damping"):
        ball(0.5, **elastic)


def test_in_a_scenario(tmp_path):
    path = tmp_path / "s.toml"
    path.write_text(
        """
[model.chain]
n_bodies = 2
[rod.tie]
parent = "ground"
child = "link_2"
length = "30 cm"
stiffness = "2 N/mm"
damping = 5
[simulate]
duration = 0.1
"""
    )
    model = lw.load_scenario(path).load_model()
    assert model.loop_types == ["spring"]
    assert lw.run_scenario(path).outcome == "converged"
