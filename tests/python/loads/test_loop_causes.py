"""Loads by cause of machines with closed loops: what each cause alone does, and their sum."""

import numpy as np
import pytest

import linkwise as lw
from helpers.looped_machines import accelerations, chain, closed_rates, rows

LOOPS = [("spherical", "link1", "link11"), ("revolute", "base", "link8")]
CAUSES = ["gravity", "velocity", "drive", "external"]


def test_each_cause_loads_loops_as_the_dense_system_says(rng):
    """The loops' forces of a cause are the multipliers of the dense system under it alone, and
    along their axes joints of the tree have what drives them, no other cause."""
    machine = chain(rng, LOOPS, 12)
    while np.linalg.matrix_rank(K := rows(machine, machine.q)) < len(K):
        machine = chain(rng, LOOPS, 12)
    model, tree, q = machine.model, machine.tree, machine.q
    v, tau = closed_rates(machine, rng), rng.normal(size=model.nv)
    shares = lw.joint_loads_by_cause(model, ["gravity", "velocity", "drive"], q, v, tau)
    rest = np.zeros(tree.nv)
    acting = [
        (rest, -lw.inverse_dynamics(tree, q, None, None), rest),
        (v, -lw.inverse_dynamics(tree, q, v, None, gravity=0.0), rest),
        (rest, tau, tau),
    ]
    for share, (rates, force, driven) in zip(shares, acting, strict=True):
        _, f = accelerations(machine, rates, force, bias=rates is v)
        largest = np.abs(share).max()
        for j, ((kind, axis),) in enumerate(model.joint_axes):
            half = share[j, 3:] if kind == "revolute" else share[j, :3]
            assert np.dot(half, axis) == pytest.approx(driven[j], abs=1e-10 * largest)
        ball, hinge = share[model.n_joints :]
        got = np.concatenate([ball[:3], hinge[:5]])
        np.testing.assert_allclose(got, -f, rtol=0, atol=1e-8 * largest)
        assert np.abs(f).max() > 1e-3


@pytest.mark.parametrize("name", ["four_bars", "stewart", "andrews", "bricard"])
def test_shares_add_up_in_published_machines(name, rng):
    machine = lw.scenes.benchmark(name)
    model, q, v = machine.model, machine.q0, machine.v0
    tau, external = rng.normal(size=model.nv), rng.normal(size=(model.n_joints, 6))
    shares = lw.joint_loads_by_cause(model, [*CAUSES, "passive"], q, v, tau, external=external)
    whole = lw.joint_loads(model, q, v, tau, external=external, passive=True)
    assert shares.shape == (5, model.n_joints + model.n_loops, 6)
    scale = np.abs(shares).max()
    np.testing.assert_allclose(shares.sum(axis=0), whole, rtol=0, atol=1e-12 * scale)
    for k, alone in enumerate(
        [
            {},
            {"v": v, "gravity": 0.0},
            {"tau": tau, "gravity": 0.0},
            {"external": external, "gravity": 0.0},
        ]
    ):
        want = lw.forward_dynamics(model, q, **({"v": None} | alone), full=True).joint_load
        np.testing.assert_allclose(shares[k], want, rtol=0, atol=1e-12 * scale)


def test_springs_dampers_and_given_motions_have_shares(rng):
    machine = chain(rng, LOOPS[:1], 12, damping=0.4, stiffness=3.0)
    model, q = machine.model.prescribe(["joint2"]), machine.q
    v, given = closed_rates(machine, rng), np.zeros(model.nv)
    given[2] = 1.5
    causes = ["gravity", "velocity", "motion", "passive"]
    shares = lw.joint_loads_by_cause(model, causes, q, v, prescribed=given)
    whole = lw.forward_dynamics(model, q, v, passive=True, prescribed=given, full=True).joint_load
    scale = np.abs(shares).max()
    np.testing.assert_allclose(shares.sum(axis=0), whole, rtol=0, atol=1e-12 * scale)
    without = lw.forward_dynamics(model, q, v, prescribed=given, full=True).joint_load
    np.testing.assert_allclose(shares[3], whole - without, rtol=0, atol=1e-11 * scale)
    assert np.abs(shares).max(axis=(1, 2)).min() > 1e-3


def test_determined_shares_do_not_depend_on_the_cut():
    """A four-bar closed at one hinge or another: each cause has the same forces in the plane."""
    from test_loops import four_bar, loads_by_name, rates

    found = {}
    for cut in "cd":
        model = four_bar(cut)
        v, _ = rates(model, 1.7)
        tau = np.zeros(3)
        tau[model.v_slice("a")] = 2.0
        shares = lw.joint_loads_by_cause(model, CAUSES[:3], np.zeros(3), v, tau)
        found[cut] = [loads_by_name(model, share) for share in shares]
    for one, other in zip(found["c"], found["d"], strict=True):
        for joint in "abcd":
            np.testing.assert_allclose(one[joint][:2], other[joint][:2], atol=1e-11)


def test_a_run_of_loops_is_split():
    machine = lw.scenes.benchmark("four_bars")
    run = lw.simulate(machine.model, duration=0.5, every=0.1, q0=machine.q0, v0=machine.v0)
    shares = lw.loads.split(run)
    total = shares.sum("cause", skipna=False).transpose(*run.joint_load.dims).values
    scale = np.abs(shares.values).max()
    np.testing.assert_allclose(total, run.joint_load.values, rtol=0, atol=1e-10 * scale)
    assert shares.joint.values.tolist() == run.joint_load.joint.values.tolist()
    assert "rigid bodies do not determine" in shares.attrs["undetermined"]
    peaks = lw.loads.split_at_peaks(run)
    np.testing.assert_allclose(peaks.share.sum("cause"), peaks.total, rtol=1e-12)
    assert "rigid bodies do not determine" in peaks.attrs["undetermined"]
    with pytest.raises(lw.InputError, match="none does in this run; name them by driven"):
        lw.loads.split(run, "motion")
    by_motion = lw.loads.split(run, "motion", driven=["A0"])
    assert by_motion.cause.values.tolist() == ["gravity", "velocity", "acceleration"]
    total = by_motion.sum("cause", skipna=False).transpose(*run.joint_load.dims).values
    planar = [0, 1, 5]
    scale = np.abs(by_motion.values).max()
    np.testing.assert_allclose(
        total[..., planar], run.joint_load.values[..., planar], rtol=0, atol=1e-8 * scale
    )


def test_what_rigid_bodies_do_not_determine_has_no_bound():
    """Hinges along z of a planar row hold fz, nx and ny over and over; fx and fy are determined."""
    machine = lw.scenes.benchmark("four_bars")
    options = {"duration": 0.3, "every": 0.1, "q0": machine.q0, "v0": machine.v0}
    runs = [lw.simulate(machine.model, tolerance=t, **options) for t in (1e-6, 1e-8)]
    bound = lw.loads.bounds(*runs).plus_minus
    for name in ("force", "axial", "moment", "tilting_moment"):
        assert np.isnan(bound.sel(quantity=name)).all(), name
    assert np.isfinite(bound.sel(quantity=["radial", "torque"])).all()
    ball = lw.scenes.benchmark("stewart")
    options |= {"q0": ball.q0, "v0": ball.v0}
    runs = [lw.simulate(ball.model, tolerance=t, **options) for t in (1e-6, 1e-8)]
    assert np.isfinite(lw.loads.bounds(*runs).plus_minus.sel(quantity=["force", "moment"])).all()


def test_a_singular_position_has_no_shares():
    """Where a linkage is stretched straight its state does not say how the loads split: NaN."""
    machine = lw.scenes.benchmark("four_bars")
    run = lw.simulate(machine.model, duration=0.2, every=0.1, q0=machine.q0, v0=machine.v0)
    run.dataset["joint_load"][1] += 1.0  # as if it were that of the polynomial of coasting
    shares = lw.loads.split(run)
    assert np.isnan(shares.values[1]).all()
    assert np.isfinite(shares.values[[0, 2]]).all()


def test_passive_forces_are_a_cause_where_there_are_any():
    machine = lw.scenes.benchmark("four_bars", n=1)
    options = {"duration": 0.1, "q0": machine.q0, "v0": machine.v0}
    bare = lw.loads.split(lw.simulate(machine.model, **options))
    assert bare.cause.values.tolist() == ["gravity", "velocity"]
    for joint in ("A0", "C1"):  # of the tree, and one that closes the loop
        model = machine.model.with_joint(joint, damping=0.3)
        run = lw.simulate(model, **options)
        shares = lw.loads.split(run)
        assert shares.cause.values.tolist() == ["gravity", "velocity", "passive"]
        own = shares.sel(joint=joint, component="nz", cause="passive")
        kind = "velocity" if joint == "A0" else "loop_velocity"
        dof = {"dof" if joint == "A0" else "loop_dof": joint}
        np.testing.assert_allclose(own, -0.3 * run[kind].sel(dof), rtol=1e-9, atol=1e-12)
