"""Loads by cause: the shares add up to rounding, and each is what it says."""

from dataclasses import replace

import numpy as np
import pytest

import linkwise as lw
from helpers.loaded_arm import arm, profile
from helpers.machines import G, rod_chain, stopped_arm
from helpers.random_trees import JOINT_TYPES, make_tree, random_configuration
from linkwise import _core
from linkwise.loads.extremes import MISSED


@pytest.mark.parametrize("by", ["force", "motion"])
def test_shares_add_up(swing, by):
    shares = lw.loads.split(swing, by)
    total = shares.sum("cause").transpose(*swing.joint_load.dims).values
    scale = np.abs(swing.joint_load.values).max()
    np.testing.assert_allclose(total, swing.joint_load.values, atol=1e-13 * scale)
    expected = {
        "force": ["gravity", "velocity", "drive", "motion", "passive", "external"],
        "motion": ["gravity", "velocity", "acceleration", "external"],
    }
    assert shares.cause.values.tolist() == expected[by]
    assert all(np.abs(shares.sel(cause=name)).max() > 1e-3 for name in expected[by])


FORCES = ["gravity", "velocity", "drive", "motion", "passive", "external"]


def each_alone(model, causes, q, v, tau, external, prescribed):
    """The slow twin: a whole forward dynamics for every cause."""
    part = {
        "gravity": {},
        "velocity": {"v": v},
        "drive": {"tau": tau},
        "motion": {"prescribed": prescribed},
        "passive": {"tau": lw.passive_torque(model, q, v)},
        "external": {"external": external},
    }
    shares = []
    for cause in causes:
        acting = {"v": None, "tau": None, **part[cause]}
        rest = {"gravity": float(cause == "gravity"), "full": True}
        shares.append(lw.forward_dynamics(model, q, **acting, **rest).joint_load)
    return np.stack(shares, axis=-3)


def acting_on(model, rng, count):
    q = random_configuration(model, rng, (count,))
    v, tau, given = rng.normal(size=(3, count, model.nv))
    return q, v, tau, rng.normal(size=(count, model.n_joints, 6)), given


def mixed_machines(rng):
    """The arm with every passive force, and trees of all kinds of joints; are some joints given?"""
    yield arm(), False
    yield arm().prescribe(["elbow"]), True
    for seed in range(10):
        kinds = rng.choice(JOINT_TYPES, size=3 + seed)
        tree = make_tree(kinds, [int(rng.integers(-1, k)) for k in range(len(kinds))], seed)
        armatures = rng.uniform(0, 1, len(kinds)) * (rng.random(len(kinds)) < 0.4)
        joints = (replace(j, armature=a) for j, a in zip(tree.joints, armatures, strict=True))
        model = replace(tree, joints=tuple(joints)).build()
        quaternions = ("spherical", "floating")
        given = [j.name for j in tree.joints[:: 2 + seed % 3] if j.type not in quaternions]
        held = seed % 2 == 1 and given != []
        yield (model.prescribe(given) if held else model), held


@pytest.mark.parametrize(
    ("method", "tolerance"), [("articulated_body", 1e-13), ("constraint_force", 1e-11)]
)
@pytest.mark.parametrize("count", [1, 2, 9])
def test_one_factorisation_gives_what_each_cause_alone_gives(method, tolerance, count, rng):
    for model, is_held in mixed_machines(rng):
        q, v, tau, external, given = acting_on(model, rng, count)
        held = {"prescribed": given} if is_held else {}
        causes = FORCES if held else [name for name in FORCES if name != "motion"]
        acting = {"external": external, **held}
        shares = _core.joint_loads_by_cause(model, causes, q, v, tau, method=method, **acting)
        expected = each_alone(model, causes, q, v, tau, external, given)
        scale = np.abs(expected).max()
        np.testing.assert_allclose(shares, expected, atol=tolerance * scale, rtol=0)
        whole = lw.forward_dynamics(model, q, v, tau, passive=True, full=True, **acting)
        total = shares.sum(axis=-3)
        np.testing.assert_allclose(total, whole.joint_load, atol=tolerance * scale, rtol=0)


@pytest.mark.parametrize("threads", [2, 3, 7])
def test_threads_change_no_bit_of_a_share(threads, rng):
    model = arm()
    q, v, tau, external, _ = acting_on(model, rng, 701)
    causes = ["gravity", "velocity", "drive", "passive", "external"]

    def by_cause(**options):
        return _core.joint_loads_by_cause(model, causes, q, v, tau, external=external, **options)

    one = by_cause(threads=1)
    assert one.shape == (701, 5, model.n_joints, 6)
    assert (by_cause(threads=threads) == one).all()


def test_a_body_without_inertia_about_its_axis_splits_too(rng):
    """Its joint's constraint-force system has no A; the recursion needs none."""
    builder = lw.ModelBuilder("wire")
    builder.add_link("base")
    builder.add_link("bead", mass=2.0, com=(0.3, 0, 0))
    builder.add_joint("hinge", "revolute", "base", "bead", axis=(0, 1, 0))
    model = builder.build()
    q, v, tau = rng.normal(size=(3, 4, 1))
    shares = _core.joint_loads_by_cause(model, ["gravity", "velocity", "drive"], q, v, tau)
    np.testing.assert_allclose(shares.sum(axis=1), lw.joint_loads(model, q, v, tau), atol=1e-12)
    with pytest.raises(lw.InputError, match=r"bead.*singular inertia"):
        _core.joint_loads_by_cause(model, ["gravity"], q, v, method="constraint_force")


def test_causes_by_unknown_names_and_methods_are_refused():
    q = np.zeros(3)
    with pytest.raises(lw.InputError, match=r"cause 'weight' is unknown; known: gravity, vel"):
        _core.joint_loads_by_cause(arm(), ["weight"], q, None)
    with pytest.raises(lw.InputError, match="'thomas' does not split loads; use"):
        _core.joint_loads_by_cause(arm(), ["gravity"], q, None, method="thomas")
    with pytest.raises(lw.InputError, match=r"use model.prescribe"):
        _core.joint_loads_by_cause(arm(), ["motion"], q, None, prescribed=q)
    with pytest.raises(lw.InputError, match=r"do not broadcast: q \(2, 3\), v \(4, 3\)"):
        _core.joint_loads_by_cause(arm(), ["gravity"], np.zeros((2, 3)), np.zeros((4, 3)))


@pytest.mark.parametrize(
    ("gravity", "drives", "by_force", "by_motion"),
    [
        ((0, 0, -9.81), {"elbow": 1.0}, "gravity velocity drive", "gravity velocity acceleration"),
        ((0, 0, 0), {"elbow": 1.0}, "velocity drive", "velocity acceleration"),
        ((0, 0, -9.81), {}, "gravity velocity", "gravity velocity acceleration"),
        ((0, 0, 0), {"elbow": lw.Free()}, "velocity", "velocity acceleration"),
        ((0, 0, 0), {"elbow": "motion"}, "velocity motion", "velocity acceleration"),
        ((0, 0, -9.81), "locked", "gravity", "gravity"),
        ((0, 0, 0), "locked", "", ""),
    ],
)
def test_causes_that_cannot_happen_are_left_out(gravity, drives, by_force, by_motion):
    machine = arm(gravity=gravity)
    if drives == "locked":
        drives = dict.fromkeys(machine.joint_names, lw.Locked())
    elif drives.get("elbow") == "motion":
        drives = {"elbow": lw.Motion(profile(0.3, 0.2))}
    run = lw.simulate(machine, duration=0.1, every=0.05, drives=drives)
    for by, names in (("force", by_force), ("motion", by_motion)):
        shares = lw.loads.split(run, by)
        found = [name for name in shares.cause.values.tolist() if name != "passive"]
        assert found == names.split()
        total = shares.sum("cause").transpose(*run.joint_load.dims)
        np.testing.assert_allclose(total, run.joint_load, atol=1e-10)
    assert len(run.plot.split("elbow").axes) == 2
    locked = drives.get("wrist") == lw.Locked()
    assert ("passive" in lw.loads.split(run).cause.values) == (not locked)


@pytest.mark.parametrize("solver", ["thomas", "conjugate_gradient"])
def test_shares_add_up_whatever_solved(solver, rng):
    model = lw.scenes.chain(8, joint="spherical")
    run = lw.simulate(
        model,
        q0=random_configuration(model, rng),
        duration=0.3,
        every=0.1,
        numerics=lw.Numerics(method="constraint_force", solver=solver),
        tolerance=1e-7,
    )
    total = lw.loads.split(run).sum("cause").transpose(*run.joint_load.dims).values
    scale = np.abs(run.joint_load.values).max()
    np.testing.assert_allclose(total, run.joint_load.values, atol=1e-6 * scale)


def test_a_locked_cantilever_carries_its_weight_by_gravity_alone():
    model = rod_chain(4)
    locked = dict.fromkeys(model.joint_names, lw.Locked())
    run = lw.simulate(model, duration=0.1, every=0.05, drives=locked)
    for by in ("force", "motion"):
        shares = lw.loads.split(run, by).isel(time=-1)
        k = 4 - np.arange(4)
        np.testing.assert_allclose(shares.sel(cause="gravity", component="fy"), k * G, atol=1e-12)
        np.testing.assert_allclose(
            shares.sel(cause="gravity", component="nz"), k**2 * G / 2, atol=1e-12
        )
        others = shares.drop_sel(cause="gravity")
        np.testing.assert_allclose(others, 0, atol=1e-12)


def test_gravity_is_a_factor():
    model = arm()
    q, v, tau = np.array([0.3, -0.2, 0.1]), np.array([1.0, -2.0, 0.5]), np.ones(3)
    weightless = arm(gravity=(0, 0, 0))
    for gravity, other in ((1.0, model), (0.0, weightless)):
        a = lw.forward_dynamics(model, q, v, tau, gravity=gravity)
        np.testing.assert_allclose(a, lw.forward_dynamics(other, q, v, tau), rtol=1e-14)
        loads = lw.inverse_dynamics_loads(model, q, v, a, gravity=gravity)
        np.testing.assert_allclose(loads, lw.inverse_dynamics_loads(other, q, v, a), rtol=1e-13)


@pytest.mark.parametrize("method", ["articulated_body", "composite_rigid_body", "constraint_force"])
def test_hybrid_dynamics(method, rng):
    """Given accelerations of some joints and torques of the others, against inverse dynamics."""
    model = arm()
    free = model.prescribe(["shoulder", "wrist"])
    q, v, a = rng.normal(size=(3, 5, 3))
    tau = lw.inverse_dynamics(model, q, v, a)
    found = lw.forward_dynamics(free, q, v, tau, prescribed=a, method=method, full=True)
    np.testing.assert_allclose(found.acceleration, a, rtol=1e-9)
    loads = lw.inverse_dynamics_loads(model, q, v, a)
    np.testing.assert_allclose(found.joint_load, loads, atol=1e-9 * np.abs(loads).max())


def test_given_accelerations_need_given_joints():
    with pytest.raises(lw.InputError, match=r"use model.prescribe"):
        lw.forward_dynamics(arm(), np.zeros(3), None, prescribed=np.zeros(3))
    with pytest.raises(lw.InputError, match="elbw"):
        arm().prescribe(["elbw"])


@pytest.mark.parametrize(
    ("quantities", "missing"),
    [
        (["position"], "joint_load"),
        (["joint_load", "position", "velocity"], "drive_torque"),
        (["joint_load", "position", "velocity", "drive_torque"], "external_wrench"),
    ],
)
def test_a_run_that_lacks_something_says_what(quantities, missing):
    wrenches = {"hand": lw.Wrench([1, 0, 0, 0, 0, 0])}
    run = lw.simulate(arm(), duration=0.1, every=0.05, record=quantities, wrenches=wrenches)
    with pytest.raises(lw.InputError, match=f'record the quantity "{missing}"'):
        lw.loads.split(run)


def test_a_split_needs_all_joints():
    run = lw.simulate(arm(), duration=0.1, every=0.05, record=lw.Recording(joints=["elbow"]))
    with pytest.raises(lw.InputError, match="1 of 3 joints"):
        lw.loads.split(run)


@pytest.mark.parametrize("by", ["force", "motion"])
def test_shares_at_a_blow_between_samples(by):
    """They add up to the peak that no sample shows, and are those of a sample put there."""
    machine = stopped_arm(1e7)
    run = lw.simulate(machine, duration=1.0, every=0.25)
    found = lw.loads.split_at_peaks(run, by)
    assert found.at_peak.values.all()
    np.testing.assert_allclose(found.total, found.peak, rtol=1e-6)
    np.testing.assert_allclose(found.share.sum("cause"), found.total, rtol=1e-9)
    peaks = lw.loads.peak_loads(run)
    for half, (name, part) in enumerate((("force", slice(0, 3)), ("moment", slice(3, 6)))):
        sampled = np.linalg.norm(run.joint_load.values[..., part], axis=-1).max()
        assert float(found.peak[half].max()) > 3 * sampled
        np.testing.assert_array_equal(found.time[half], peaks[f"{name}_time"])
    when = np.unique(found.time.values)
    twin = lw.loads.split(lw.simulate(machine, times=[0, *when]), by).sel(time=when)
    for j, joint in enumerate(machine.joint_names):
        for half, part in enumerate((slice(0, 3), slice(3, 6))):
            at = twin.sel(joint=joint).isel(time=np.searchsorted(when, found.time[half, j]))
            total = at.values.sum(axis=0)[part]
            expected = at.values[:, part] @ total / np.linalg.norm(total)
            np.testing.assert_allclose(
                found.share[:, half, j], expected, rtol=5e-3, atol=5e-3 * np.abs(expected).max()
            )


def test_shares_beside_a_peak_whose_state_is_not_held():
    run = lw.simulate(stopped_arm(1e7), duration=1.0, every=0.25)
    without = lw.Run(run.dataset.drop_vars("extreme_state"), model=run.load_model())
    found = lw.loads.split_at_peaks(without)
    assert not found.at_peak.values.any()
    assert np.isin(found.time, run.time).all()
    assert (found.total < found.peak / 3).all()
    sampled = np.linalg.norm(run.joint_load.values[..., :3], axis=-1)
    np.testing.assert_allclose(
        found.total[0], sampled[np.searchsorted(run.time, found.time[0]), [0, 1]], rtol=1e-9
    )
    many = lw.simulate(lw.scenes.chain(51), duration=0.01, every=0.01)
    assert "extreme_state" not in many
    damaged = lw.Run(run.dataset.isel(state=slice(1)), model=run.load_model())
    with pytest.raises(lw.InputError, match="extreme_state is missing or has another shape"):
        lw.loads.split_at_peaks(damaged)


@pytest.mark.parametrize("pulse", [False, True])
def test_a_wrench_that_changes_between_samples_is_not_guessed(pulse):
    """At the top of a pulse that no sample meets the wrench is not known."""
    times, push = [0, 0.101, 0.102, 0.103, 1.0], np.zeros((5, 6))
    push[:, 0] = 3.0
    push[2, 0] = 5000.0 if pulse else 3.0
    run = lw.simulate(
        arm(), duration=1.0, every=0.1, wrenches={"hand": lw.Wrench(lw.Table(times, push))}
    )
    found = lw.loads.split_at_peaks(run)
    if pulse:
        assert not found.at_peak.sel(quantity="force").values.any()
        assert (found.total < found.peak).sel(quantity="force").all()
    else:
        assert found.at_peak.values.all()
        np.testing.assert_allclose(found.total, found.peak, rtol=MISSED)
