"""The implicit integrator esdirk: stiff elastic arms against statics, rigid machines and others."""

import numpy as np
import pytest

import linkwise as lw

SECTION = lw.Section.tube(0.04, 0.004)


def evaluations(run):
    return run.attrs["total_evaluations"]


def elastic_arm(modulus, damping, links=2):
    """Tubes of 0.5 m on hinges, with 2 kg at the end; rigid where the modulus is None."""
    length, mass = 0.5, 3.0
    builder = lw.ModelBuilder("arm")
    builder.add_link("base")
    previous = "base"
    for i in range(links):
        # Of a rod, and of its sections about their own axes.
        inertia = np.diag([0.0, 1.0, 1.0]) * mass * length**2 / 12
        inertia += np.diag([2.0, 1.0, 1.0]) * mass * SECTION.Iy / SECTION.area
        builder.add_link(f"link{i}", mass=mass, com=(length / 2, 0, 0), inertia=inertia)
        hinge = {"axis": (0, 1, 0), "translation": (length if i else 0, 0, 0), "damping": 0.5}
        builder.add_joint(f"hinge{i}", "revolute", previous, f"link{i}", **hinge)
        previous = f"link{i}"
    builder.add_link("tool", mass=2.0, inertia=np.eye(3) * 0.01)
    builder.add_joint("flange", "fixed", previous, "tool", translation=(length, 0, 0))
    for i in range(links if modulus else 0):
        builder.make_flexible(
            f"link{i}",
            section=SECTION,
            E=modulus,
            G=modulus / 2.6,
            damping=damping,
        )
    return builder.build()


def test_a_stiff_arm_takes_a_twentieth_of_the_evaluations_of_bdf():
    model = elastic_arm(2e12, 0.005)
    runs = {
        name: lw.simulate(model, duration=3.0, every=0.1, integrator=name)
        for name in ("esdirk", "bdf")
    }
    np.testing.assert_allclose(runs["esdirk"].position, runs["bdf"].position, atol=1e-5)
    assert 20 * evaluations(runs["esdirk"]) < evaluations(runs["bdf"])


def test_the_cost_does_not_grow_with_stiffness_and_ends_at_the_rigid_machine():
    rigid = elastic_arm(None, 0.0)
    options = {"duration": 1.0, "every": 0.1, "integrator": "esdirk", "tolerance": 1e-7}
    want = lw.simulate(rigid, **options)
    hinges = ["hinge0", "hinge1"]
    angles = [rigid.q_slice(name).start for name in hinges]
    errors, counts = [], []
    for modulus in (2e12, 2e13, 2e14, 2e16):
        model = elastic_arm(modulus, 0.02)
        run = lw.simulate(model, **options)
        own = [model.q_slice(name).start for name in hinges]
        errors.append(np.abs(run.position.values[:, own] - want.position.values[:, angles]).max())
        counts.append(evaluations(run))
    assert errors[1] < 0.15 * errors[0]
    assert errors[-1] < 5e-7
    assert max(counts[1:]) < 1.2 * counts[0]


@pytest.mark.parametrize("tolerance", [1e-5, 1e-7])
def test_a_boom_with_a_weight_comes_to_rest_where_beams_do(tolerance):
    """F L^3 / 3 EI of a weight at its end, and W L^3 / 8 EI of the beam's own."""
    length, weight, mass, modulus = 2.0, 1.0, 1.0, 200e9
    section = lw.Section.tube(0.03, 0.003)
    builder = lw.ModelBuilder("boom")
    builder.add_link("base")
    builder.add_link("boom", mass=mass)
    builder.add_link("weight", mass=weight, inertia=np.eye(3) * 1e-3)
    builder.add_joint("root", "fixed", "base", "boom")
    builder.add_joint("end", "fixed", "boom", "weight", translation=(length, 0, 0))
    builder.make_flexible("boom", section=section, E=modulus, G=modulus / 2.6, damping=0.3)
    model = builder.build()
    run = lw.simulate(model, duration=20.0, every=1.0, integrator="esdirk", tolerance=tolerance)
    tip = lw.link_poses(model, run.position.values[-1])[model.link_names.index("weight")]
    EI = modulus * section.Iy
    sag = -9.81 * (weight * length**3 / (3 * EI) + mass * length**3 / (8 * EI))
    assert tip[2, 3] == pytest.approx(sag, rel=2e-4)
    assert np.abs(run.velocity.values[-1]).max() < 10 * tolerance
    # Explicit steps follow the boom's stretch.
    assert evaluations(run) < 6000


def test_chains_on_stiff_springs_keep_their_energy():
    """A chain that swings on springs of 1e6 N m/rad, without damping: bdf follows them."""
    n, tolerance = 8, 1e-4
    builder = lw.ModelBuilder("chain")
    builder.add_link("ground")
    previous = "ground"
    for i in range(n):
        builder.add_link(f"rod{i}", mass=1.0, com=(0.25, 0, 0), inertia=np.eye(3) * 0.02)
        hinge = {"axis": (0, 1, 0), "translation": (0.5 if i else 0, 0, 0)}
        if i:
            hinge["stiffness"] = 1e6
        builder.add_joint(f"hinge{i}", "revolute", previous, f"rod{i}", **hinge)
        previous = f"rod{i}"
    options = {"duration": 2.0, "every": 0.1, "tolerance": tolerance}
    model = builder.build()
    run = lw.simulate(model, **options, integrator="esdirk")
    energy = run.kinetic_energy.values + run.potential_energy.values
    assert np.ptp(energy) < tolerance * run.kinetic_energy.values.max()
    bdf = lw.simulate(model, **options, integrator="bdf")
    np.testing.assert_allclose(run.position, bdf.position, atol=1e-5)
    assert 2 * evaluations(run) < evaluations(bdf)


def test_branches_on_threads_give_the_same_bits():
    model = lw.scenes.tree(300)
    q0 = 0.1 * np.ones(model.nq)
    runs = [
        lw.simulate(model, duration=0.02, every=0.01, q0=q0, integrator="esdirk", threads=threads)
        for threads in (1, 2, 4)
    ]
    for run in runs[1:]:
        assert np.array_equal(run.position, runs[0].position)
        assert evaluations(run) == evaluations(runs[0])


def test_a_free_hull_with_an_elastic_boom_moves_as_with_adams():
    """Quaternions, and rates in axes that turn."""
    builder = lw.ModelBuilder("craft", gravity=(0, 0, 0))
    builder.add_link("ground")
    builder.add_link("hull", mass=5.0, inertia=np.diag([0.3, 0.5, 0.4]))
    builder.add_link("boom", mass=1.0)
    builder.add_link("tip", mass=0.5, inertia=np.eye(3) * 0.01)
    builder.add_joint("free", "floating", "ground", "hull")
    builder.add_joint("ball", "spherical", "hull", "boom", translation=(0.2, 0, 0), damping=0.1)
    builder.add_joint("end", "fixed", "boom", "tip", translation=(1.0, 0, 0))
    builder.make_flexible("boom", section=lw.Section.round(0.02), E=70e9, G=26e9, damping=0.02)
    model = builder.build()
    v0 = np.zeros(model.nv)
    v0[:6] = 0.5, -0.2, 0.1, 0.3, 1.0, -0.4
    options = {"duration": 1.0, "every": 0.1, "v0": v0, "tolerance": 1e-7}
    run = lw.simulate(model, **options, integrator="esdirk")
    other = lw.simulate(model, **options, integrator="adams")
    np.testing.assert_allclose(run.position, other.position, atol=2e-6)
    assert 2 * evaluations(run) < evaluations(other)


def test_a_run_is_stored_and_opened(tmp_path):
    model = elastic_arm(2e11, 0.02, links=1)
    run = lw.simulate(
        model, duration=0.1, every=0.05, integrator="esdirk", output=tmp_path / "run.zarr"
    )
    again = lw.open_run(tmp_path / "run.zarr")
    assert np.array_equal(again.position, run.position)


def test_steps_that_are_used_up_are_said():
    model = elastic_arm(2e11, 0.02)
    with pytest.raises(lw.SimulationError, match="number of steps is used up"):
        lw.simulate(model, duration=1.0, integrator="esdirk", numerics={"max_steps": 5})


def test_samples_do_not_depend_on_each_other():
    model = elastic_arm(2e11, 0.02)
    few = lw.simulate(model, duration=0.2, every=0.1, integrator="esdirk")
    many = lw.simulate(model, duration=0.2, every=0.001, integrator="esdirk")
    assert np.array_equal(few.position[1], many.position[100])
    assert few.attrs["total_evaluations"] == many.attrs["total_evaluations"]
    fine = lw.simulate(model, duration=0.2, every=0.001, integrator="esdirk", tolerance=1e-9)
    np.testing.assert_allclose(many.position, fine.position, atol=1e-7)
