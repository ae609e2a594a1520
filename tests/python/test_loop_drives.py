"""Joints that close loops, with drives, rotors and given motions: against the same machine whose
loop is cut at another joint."""

import numpy as np
import pytest

import linkwise as lw
from helpers.looped_machines import chain, closed_rates

Z = (0, 0, 1)
CORNERS = {"a": (0.0, 0.0), "b": (0.3, 0.9), "c": (1.4, 1.1), "d": (1.2, 0.0)}
BARS = {"crank": "ab", "coupler": "bc", "rocker": "cd"}
DRIVEN = "abcd"


def point(corner):
    return np.array([*CORNERS[corner], 0.0])


def four_bar(cut, *, slider=False, coupling=None, **properties):
    """A four-bar in the plane z = 0, or a slider-crank whose last joint slides; the joint `cut`, c
    or d, closes its loop. properties: by joint. Link frames are parallel to the world's. coupling:
    factors, of which those of `wheel` are of a wheel on the coupler."""
    ends = {"a": ("base", "crank"), "b": ("crank", "coupler"), "c": ("coupler", "rocker")}
    ends["d"] = ("base", "rocker")
    origin = {"base": "a", "crank": "a", "coupler": "b", "rocker": "d" if cut == "c" else "c"}
    builder = lw.ModelBuilder("four-bar", gravity=(0.7, -9.81, 0))
    builder.add_link("base", mass=0)
    for k, (link, (first, last)) in enumerate(BARS.items()):
        builder.add_link(
            link,
            mass=1 + 0.3 * k,
            com=(point(first) + point(last)) / 2 - point(origin[link]),
            inertia=np.diag([0.03, 0.04, 0.05 + 0.01 * k]),
        )
    for name, (parent, child) in ends.items():
        kind = "prismatic" if slider and name == "d" else "revolute"
        where = {
            "translation": point(name) - point(origin[parent]),
            "axis": (1, 0.2, 0) if kind == "prismatic" else Z,
        }
        if name == cut:
            where["child_translation"] = point(name) - point(origin[child])
            builder.add_loop(name, kind, parent, child, **where, **properties.get(name, {}))
        else:
            builder.add_joint(name, kind, parent, child, **where, **properties.get(name, {}))
    if coupling:
        builder.add_link("wheel", mass=0.5, inertia=0.2 * np.eye(3))
        builder.add_joint("wheel", "revolute", "coupler", "wheel", axis=Z)
        builder.add_coupling("gear", coupling)
    return builder.build()


def of_joint(run, quantity, name):
    """A quantity of any joint, of the tree or not."""
    tree = run.dataset[quantity]
    dim = tree.dims[1]
    if name in tree[dim].values:
        return tree.sel({dim: name}).values
    loop = run.dataset[f"loop_{quantity}"]
    return loop.sel({loop.dims[1]: name}).values


def assert_same_runs(runs, *, bound=2e-7):
    for quantity in ("position", "velocity", "drive_torque", "drive_work"):
        for name in "abcd":
            first, second = (of_joint(run, quantity, name) for run in runs)
            np.testing.assert_allclose(
                second,
                first,
                rtol=0,
                atol=bound * (1 + np.abs(first).max()),
                err_msg=(quantity, name),
            )
    for name in "abcd":  # forces in the plane and the moment about the axis are determined
        first, second = (run.joint_load.sel(joint=name).values[:, [0, 1, 5]] for run in runs)
        size = 1 + np.abs(first).max()
        np.testing.assert_allclose(second, first, rtol=0, atol=10 * bound * size, err_msg=name)
    for run in runs:
        balance = lw.loads.energy_balance(run)
        size = 1 + np.abs(balance.kinetic_energy).max() + np.abs(balance.drive_work).max()
        assert np.abs(balance.residual).max() < 1e-7 * size


def simulate_both(drives, *, slider=False, spin=0.0, properties=None, coupling=None, **options):
    runs = []
    for cut in "cd":
        model = four_bar(cut, slider=slider, coupling=coupling, **(properties or {}))
        v0 = np.where(np.array(model.joint_names) == "a", spin, 0.0)
        v0 = lw.assemble(model, None, v0, hold=["a"] if spin else []).v
        options = {"duration": 0.8, "every": 0.1, "tolerance": 1e-10} | options
        runs.append(lw.simulate(model, drives=drives, v0=v0, **options))
    return runs


TABLE = lw.Table([0, 0.3, 0.5, 2], [[0], [12], [-5], [4]])
FORCES = {
    "constant": {"d": 4.0, "c": -3.0},
    "table": {"d": lw.Torque(TABLE)},
    "function": {"c": lambda t, q, v: 5 * np.sin(9 * t) - 2 * q[0] - 0.3 * v[0]},
    "pd": {"c": lw.PD(kp=30.0, kd=0.5, target=0.4), "d": lw.PD(kp=20.0, kd=0.2, target=-0.2)},
}


@pytest.mark.parametrize("kind", FORCES)
@pytest.mark.parametrize("slider", [False, True])
def test_drives_act_where_the_loop_is_cut_as_elsewhere(kind, slider):
    runs = simulate_both(FORCES[kind], slider=slider, spin=1.0)
    assert_same_runs(runs)
    driven = max(np.abs(of_joint(runs[0], "drive_torque", name)).max() for name in "cd")
    assert driven > 1


@pytest.mark.parametrize("slider", [False, True])
def test_rotors_turn_where_the_loop_is_cut_as_elsewhere(slider):
    properties = {"c": {"armature": 0.7}, "d": {"armature": 0.4, "damping": 0.3}}
    runs = simulate_both({"a": 6.0}, slider=slider, spin=2.0, properties=properties)
    assert_same_runs(runs)
    plain = simulate_both({"a": 6.0}, slider=slider, spin=2.0)[0]
    slower = np.abs(of_joint(plain, "position", "a") - of_joint(runs[0], "position", "a")).max()
    assert slower > 0.1  # they matter


@pytest.mark.parametrize(
    "factors", [{"c": 1, "wheel": -2}, {"c": [0.5, 0.3, -0.2], "d": [0, 0.4], "wheel": 1.0}]
)
@pytest.mark.parametrize("driven", [{"a": 5.0}, {"c": lw.PD(kp=30.0, kd=0.5, target=0.4)}])
def test_couplings_of_joints_where_the_loop_is_cut(factors, driven):
    runs = simulate_both(driven, spin=1.0, coupling=factors, properties={"c": {"armature": 0.3}})
    assert_same_runs(runs)
    first, second = (run["coupling_load"] for run in runs)
    assert first.coupled.values.tolist() == [f"gear:{joint}" for joint in factors]
    np.testing.assert_allclose(second.values, first.values, atol=1e-6)
    assert np.abs(first.values).max() > 0.1


def test_a_motion_that_a_coupling_loads_where_the_loop_is_cut():
    motion = lw.Motion(lambda t: (0.3 * np.sin(2 * t), 0.6 * np.cos(2 * t), -1.2 * np.sin(2 * t)))
    runs = simulate_both({"c": motion}, coupling={"c": 1, "wheel": -2})
    assert_same_runs(runs)


@pytest.mark.parametrize("joint", ["c", "d"])
@pytest.mark.parametrize("slider", [False, True])
def test_given_motions_are_followed_where_the_loop_is_cut(joint, slider):
    size = 0.1 if slider else 0.4
    motion = lw.Motion(
        lambda t: (size * np.sin(2 * t), 2 * size * np.cos(2 * t), -4 * size * np.sin(2 * t))
    )
    properties = {joint: {"armature": 0.7, "damping": 0.2}}
    runs = simulate_both({joint: motion, "a": -2.0}, slider=slider, properties=properties)
    assert_same_runs(runs)
    for run in runs:
        followed = of_joint(run, "position", joint)
        np.testing.assert_allclose(followed, size * np.sin(2 * run.time.values), atol=1e-11)


@pytest.mark.parametrize("joint", ["c", "d"])
def test_locked_joints_hold_the_machine_where_the_loop_is_cut(joint):
    runs = simulate_both({joint: lw.Locked(), "a": 3.0})
    assert_same_runs(runs)
    for run in runs:
        assert np.ptp(of_joint(run, "position", "a")) < 1e-11
        assert np.abs(of_joint(run, "drive_torque", joint)).min() > 1


def test_motions_that_contradict_each_other_are_refused():
    def turning(rate):
        return lw.Motion(lambda t: (rate * t, rate, 0.0))

    model = four_bar("c")
    with pytest.raises(lw.InputError, match=r"'a' and 'c' contradict each other.*loop.*'c'"):
        lw.simulate(model, duration=1, drives={"a": turning(1.0), "c": turning(1.0)})
    with pytest.raises(lw.InputError, match=r"'a' and 'd' contradict each other.*loop.*'c'"):
        lw.simulate(
            model, duration=1, drives={"a": turning(1.0), "d": lw.Motion(lambda t: (0.3, 0.0, 0.0))}
        )


def test_turns_of_loop_joints_are_counted():
    """A wheel on a crank, whose pin slides in a slot: the loop joint turns with the crank."""
    builder = lw.ModelBuilder("slot", gravity=(0, 0, 0))
    builder.add_link("base", mass=0)
    builder.add_link("crank", mass=1, com=(0.1, 0, 0), inertia=np.diag([0.1, 0.1, 0.2]))
    builder.add_link("block", mass=1, inertia=np.diag([0.1, 0.1, 0.2]))
    builder.add_link("yoke", mass=1, inertia=np.diag([0.1, 0.1, 0.2]))
    builder.add_joint("turn", "revolute", "base", "crank", axis=Z)
    builder.add_joint("yoke", "prismatic", "base", "yoke", axis=(1, 0, 0))
    builder.add_joint("slot", "prismatic", "yoke", "block", axis=(0, 1, 0))
    builder.add_loop(
        "pin", "revolute", "crank", "block", axis=Z, translation=(0.2, 0, 0), stiffness=0.5
    )
    model = builder.build()
    q0, v0 = np.zeros(3), np.zeros(3)
    q0[model.q_slice("yoke")] = 0.2
    v0[model.v_slice("turn")] = 20.0
    run = lw.simulate(model, duration=3, q0=q0, v0=v0, tolerance=1e-9)
    turn, pin = of_joint(run, "position", "turn"), of_joint(run, "position", "pin")
    np.testing.assert_allclose(pin, -turn, atol=1e-7)
    assert np.abs(turn).max() > 10
    assert np.abs(lw.loads.energy_balance(run).residual).max() < 1e-6
    assert run.dataset.loop_position.attrs["units"] == "rad"


def test_rods_take_no_drive():
    length = float(np.linalg.norm(point("b")))
    model = four_bar("c").with_rod("rod", "base", "coupler", length=length)
    assert model.loop_types == ["revolute", "rod"]
    for drive in (1.0, lw.Locked(), lw.PD(kp=1.0, kd=1.0, target=0.0)):
        with pytest.raises(lw.InputError, match=r"joint 'rod'.*no coordinate to drive"):
            lw.simulate(model, duration=1, drives={"rod": drive})


def test_members_of_a_batch_are_single_runs():
    model = four_bar("c", coupling={"c": 1, "wheel": -2})
    drives = {"c": lw.PD(kp=30.0, kd=0.5, target=0.4)}
    options = {"duration": 0.2, "every": 0.05, "integrator": "runge_kutta_4", "step": 1e-3}
    batch = lw.simulate_batch(model, drives=drives, v0=np.zeros((2, 4)), **options)
    single = lw.simulate(model, drives=drives, **options)
    for name in ("loop_position", "loop_drive_torque", "coupling_load"):
        np.testing.assert_array_equal(batch[name].values[1], single[name].values)


def test_peaks_of_drive_power_where_the_loop_is_cut():
    runs = simulate_both(FORCES["pd"], spin=1.0)
    for run, other in (runs, runs[::-1]):
        power = [lw.loads.quantities(r)["drive_power"].sel(joint="c").values for r in (run, other)]
        np.testing.assert_allclose(power[0], power[1], atol=1e-5)
        assert np.abs(power[0]).max() > 0.1
    found = [run["extreme_quantity"].sel(quantity="drive_power") for run in runs]
    for name in "cd":
        np.testing.assert_allclose(*(x.sel(joint=name).values for x in found), atol=2e-3)


def test_shares_and_bounds_know_the_drives_where_the_loop_is_cut():
    properties = {"c": {"armature": 0.3, "damping": 0.2}}
    runs = simulate_both(FORCES["pd"], spin=1.0, properties=properties)
    shares = [lw.loads.split(run) for run in runs]
    for run, share in zip(runs, shares, strict=True):
        total = share.sum("cause").values
        np.testing.assert_allclose(total, run.joint_load.values, atol=1e-8 * np.abs(total).max())
    for name in "abcd":  # of what is determined the shares are the same, wherever the loop is cut
        first, second = (x.sel(joint=name).values[..., [0, 1, 5]] for x in shares)
        np.testing.assert_allclose(second, first, atol=1e-5 * (1 + np.abs(first).max()))


SWING = lw.Motion(lambda t: (0.3 * np.sin(2 * t), 0.6 * np.cos(2 * t), -1.2 * np.sin(2 * t)))


@pytest.mark.parametrize("drives", [{"c": SWING, "a": -2.0}, {"c": lw.Locked(), "d": 3.0}])
def test_shares_and_bounds_of_given_motions_where_the_loop_is_cut(drives):
    properties = {"c": {"armature": 0.7, "damping": 0.2}, "d": {"stiffness": 3.0}}
    runs = simulate_both(drives, properties=properties, spin=0.0)
    shares = [lw.loads.split(run) for run in runs]
    assert ("motion" in shares[0].cause) == (drives["c"] is SWING)
    for run, share in zip(runs, shares, strict=True):
        total = share.sum("cause", skipna=False).values
        np.testing.assert_allclose(total, run.joint_load.values, atol=1e-8 * np.abs(total).max())
    for name in "abcd":  # of what is determined the shares are the same, wherever the loop is cut
        first, second = (x.sel(joint=name).values[..., [0, 1, 5]] for x in shares)
        np.testing.assert_allclose(second, first, atol=1e-5 * (1 + np.abs(first).max()))
    tighter = simulate_both(drives, properties=properties, tolerance=1e-11)
    bounds = [lw.loads.bounds(*pair) for pair in zip(runs, tighter, strict=True)]
    for found in bounds:
        assert np.isfinite(found.plus_minus.sel(quantity="radial").values).all()
        assert found.algebraic.sel(quantity="radial").values.max() < 1e-9
    peaks = [lw.loads.split_at_peaks(run) for run in runs]
    for found in peaks:
        np.testing.assert_allclose(found.share.sum("cause"), found.total, rtol=1e-10)


@pytest.mark.parametrize(
    ("kind", "axes"),
    [
        ("revolute", {"axis": Z}),
        ("helical", {"axis": Z, "pitch": 0.2}),
        ("cylindrical", {"axis": Z}),
        ("universal", {"axes": [(1, 0, 0), (0, 1, 0)]}),
        ("planar", {"axis": Z}),
        ("spherical", {}),
        ("spring", {}),
    ],
)
def test_accelerations_of_loop_joints_are_the_derivatives_of_their_rates(kind, axes, rng):
    while True:
        _, tree, q, _ = chain(rng, [], 10)
        inward = [tree.joint_parents[-1]]
        while inward[-1] >= 0:
            inward.append(tree.joint_parents[inward[-1]])
        if len(inward) > 7:  # joints in the loop, so that it can move
            break
    end = lw.link_poses(tree, q)[tree.link_names.index("link9")]
    place = {"translation": end[:3, 3], "rotation": end[:3, :3]}
    if kind == "spring":
        model = tree.with_spring("end", "base", "link9", length=1.0, stiffness=2.0, point=(1, 2, 3))
    else:
        model = tree.with_loop("end", kind, "base", "link9", **place, **axes)
    v = lw.assemble(model, q, rng.normal(size=tree.nv)).v
    a = lw.forward_dynamics(model, q, v, rng.normal(size=tree.nv))
    step = 1e-5

    def rates_at(t):
        return lw.loop_coordinates(model, q + t * v + t * t / 2 * a, v + t * a)[1]

    got = lw.loop_accelerations(model, q, v, a)
    want = (rates_at(step) - rates_at(-step)) / (2 * step)
    np.testing.assert_allclose(got, want, rtol=0, atol=1e-6 * (1 + np.abs(want).max()))
    assert np.abs(want).max() > 0.1


def test_prescribed_loop_joints_of_one_state(rng):
    """Held by a given acceleration or by the torque that this takes, the machine moves alike."""
    machine = chain(rng, [("revolute", "base", "link6")])
    v = closed_rates(machine, rng)
    tau = rng.normal(size=machine.model.nv)
    held = machine.model.prescribe(["loop0"])
    found = lw.forward_dynamics(held, machine.q, v, tau, loop_prescribed=[2.0], full=True)
    torque = found.joint_load[-1, 5]  # about z, its axis
    free = lw.forward_dynamics(machine.model, machine.q, v, tau, loop_tau=[torque], full=True)
    size = np.abs(free.acceleration).max()
    np.testing.assert_allclose(found.acceleration, free.acceleration, atol=1e-9 * size)
    got = lw.loop_accelerations(machine.model, machine.q, v, free.acceleration)
    assert got[0] == pytest.approx(2.0, abs=1e-9 * size)
    with pytest.raises(lw.InputError, match="loop_prescribed: the model has no joint of given"):
        lw.forward_dynamics(machine.model, machine.q, v, loop_prescribed=[2.0])


@pytest.mark.parametrize("slider", [False, True])
def test_starts_are_given_where_the_loop_is_cut(slider):
    at = 0.1 if slider else 0.3
    of_tree = four_bar("c", slider=slider)
    q0 = np.where(np.array(of_tree.joint_names) == "d", at, 0.0)
    options = {"duration": 0.3, "every": 0.1, "tolerance": 1e-10}
    runs = [
        lw.simulate(of_tree, q0=q0, hold=["d"], **options),
        lw.simulate(four_bar("d", slider=slider), loop_position={"d": at}, **options),
    ]
    assert_same_runs(runs)
    for run in runs:
        assert of_joint(run, "position", "d")[0] == pytest.approx(at, abs=1e-10)
    model = four_bar("d", slider=slider)
    found = lw.assemble(model, None, [1.0, 0, 0], loop_position={"d": at})
    assert lw.loop_coordinates(model, found.q)[0] == pytest.approx(at, abs=1e-10)
    again = lw.assemble(model, found.q, [1.0, 0, 0])  # rates are those of the free machine
    np.testing.assert_allclose(found.v, again.v, atol=1e-9)
    assert np.abs(found.v).max() > 0.1


def test_starts_where_the_loop_is_cut_that_cannot_be():
    model = four_bar("d")
    with pytest.raises(lw.InputError, match="'a' is no joint of one axis that closes a loop"):
        lw.assemble(model, loop_position={"a": 0.1})
    q0 = np.where(np.array(model.joint_names) == "a", 0.5, 0.0)
    run = lw.simulate(model, duration=0.1, q0=q0, hold=["a"], loop_position={"d": 0.1})
    (said,) = [w["text"] for w in run.warnings if w["element"] == "assembly"]
    assert said.startswith("to start with d as given, joints were moved: 'a' by -0.3")
    assert said.endswith("joints that were to be held had to move: a")
    released = lw.assemble(model, q0, hold=["a"], loop_position={"d": 0.1}).released
    assert released == ("a",)
    far = four_bar("d", slider=True)
    with pytest.raises(lw.InputError, match="'d'"):
        lw.assemble(far, loop_position={"d": 50.0})
    turned = [lw.assemble(model, loop_position={"d": x}).q for x in (0.1, 0.1 + 2 * np.pi)]
    np.testing.assert_allclose(*turned, atol=1e-9)
