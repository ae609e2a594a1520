"""Machines with closed loops in motion: assembled, simulated, kept on their constraints."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipj, ellipk

import linkwise as lw
from linkwise.scenes import benchmark


def rod(builder: lw.ModelBuilder, name: str, length: float) -> None:
    """A rod of 1 kg along x from its frame's origin on."""
    inertia = np.diag([1e-3, length**2 / 12, length**2 / 12])
    builder.add_link(name, mass=1.0, com=(length / 2, 0, 0), inertia=inertia)


def tip(model: lw.Model, run: lw.Run, joint: str, point) -> np.ndarray:
    """World position of a point of a joint's frame at the samples."""
    poses = lw.joint_poses(model, run.position.values)[:, model.joint_names.index(joint)]
    return poses[:, :3, :3] @ np.asarray(point, float) + poses[:, :3, 3]


def open_by(model: lw.Model, run: lw.Run) -> float:
    """The widest gap of the four-bars' loops over all samples."""
    gaps = [
        tip(model, run, f"B{k - 1}", (1, 0, 0)) - tip(model, run, f"A{k}", (0, 1, 0))
        for k in range(1, model.n_loops + 1)
    ]
    return float(np.abs(gaps).max())


def state(model: lw.Model, **given: float) -> np.ndarray:
    """Coordinates, or rates, by joints: A and B stand for all of theirs."""
    names = model.joint_names
    return np.array([given.get(name, given.get(name[0], 0.0)) for name in names])


def pendulum(angle: float, rate: float, time) -> np.ndarray:
    """Angle of a pendulum let go at `angle`, of small oscillations of `rate`."""
    k = np.sin(angle / 2) ** 2
    sn = ellipj(ellipk(k) - rate * time, k)[0]
    return 2 * np.arcsin(np.sqrt(k) * sn)


@pytest.mark.parametrize("integrator", ["adams", "bdf", "esdirk", "runge_kutta_8"])
def test_a_parallelogram_swings_as_a_pendulum(integrator):
    model, tolerance, angle = benchmark("four_bars", n=1).model, 1e-8, 1.0
    # About the hanging position: both rods turn about their ends, the bar moves along a circle.
    rate = np.sqrt(9.81 * (2 * 0.5 + 1) / (2 / 3 + 1))
    start = state(model, A=np.pi + angle, B=-np.pi - angle)
    run = lw.simulate(
        model, duration=10, every=0.1, q0=start, integrator=integrator, tolerance=tolerance
    )
    exact = pendulum(angle, rate, run.time.values)
    assert np.abs(run.position.sel(coordinate="A0").values - np.pi - exact).max() < 1e-6
    assert open_by(model, run) < 1e-12
    energy = (run.kinetic_energy + run.potential_energy).values
    assert np.abs(energy - energy[0]).max() < 1e-5


@pytest.mark.parametrize("integrator", ["auto", "runge_kutta_8"])
def test_motions_that_contradict_each_other_later_are_named(integrator):
    """Both rods of a four-bar turn alike until 0.1 s."""
    start = benchmark("four_bars", n=1)

    def apart(t):
        late = max(t - 0.1, 0)
        return -t + 3 * late**4, -1 + 12 * late**3, 36 * late**2

    drives = {"A0": lw.Motion(lambda t: (-t, -1, 0)), "A1": lw.Motion(apart)}
    run = lw.simulate(
        start.model,
        duration=1,
        q0=start.q0,
        v0=start.v0,
        drives=drives,
        integrator=integrator,
        on_failure="return",
    )
    assert run.outcome == "singular_position"
    assert 0.1 <= run.attrs["stop_time"] < 0.11
    assert "motions of 'A0' and 'A1' contradict each other" in run.attrs["message"]


def test_a_bricard_mechanism_falls():
    """A04; the reference was computed in another program, by other equations, to 8 digits."""
    start = benchmark("bricard")
    run = lw.simulate(start.model, duration=1, every=1, q0=start.q0, tolerance=1e-10)
    found = tip(start.model, run, "P2", (0, 0, 1))[-1]
    assert np.abs(found - (0.51050146, -1.64916760, 0.14012311)).max() < 2e-8


def test_andrews_mechanism_at_the_end_of_the_test_set():
    """A03 at 0.03 s, where two other programs agree to 1e-9."""
    start = benchmark("andrews")
    joints = ["beta", "Theta", "gamma", "Phi", "delta", "Omega", "epsilon"]
    q = [
        15.81077119515, -15.75637105841, 0.04082224011965, -0.5347301163421, 0.5244099658800,
        0.5347301163421, 1.048080741042,
    ]  # fmt: skip
    v = [
        1139.920302259, -1424.379295178, 11.03291191055, 19.29337410492, 0.5735699148261,
        -19.29337410492, 0.3231791492473,
    ]  # fmt: skip
    run = lw.simulate(
        start.model, duration=0.03, every=0.03, q0=start.q0, drives=start.drives, tolerance=1e-10
    )
    found = run.position.sel(coordinate=joints).values[-1]
    assert np.abs(found / q - 1).max() < 1e-6
    assert np.abs(run.velocity.sel(dof=joints).values[-1] - v).max() < 1e-4


def slider_crank() -> lw.Model:
    builder = lw.ModelBuilder("slider_crank", gravity=(0, -9.81, 0))
    builder.add_link("ground")
    rod(builder, "crank", 0.2)
    rod(builder, "conrod", 0.5)
    builder.add_link("slider", mass=2.0, inertia=0.01 * np.eye(3))
    builder.add_joint("main", "revolute", "ground", "crank")
    builder.add_joint("pin", "revolute", "crank", "conrod", translation=(0.2, 0, 0))
    builder.add_joint("guide", "prismatic", "ground", "slider", axis=(1, 0, 0))
    builder.add_loop("wrist", "revolute", "conrod", "slider", translation=(0.5, 0, 0))
    return builder.build()


def test_a_driven_slider_crank_follows_its_closed_form():
    model, omega = slider_crank(), 7.0
    crank = lw.Motion(lambda t: (omega * t, omega, 0.0), breakpoints=())
    run = lw.simulate(
        model, duration=1, every=0.01, drives={"main": crank}, q0=[0, 0, 0.7], tolerance=1e-8
    )
    angle = omega * run.time.values
    sine = 0.2 * np.sin(angle)
    exact = 0.2 * np.cos(angle) + np.sqrt(0.25 - sine**2)
    guide = run.position.sel(coordinate="guide").values
    assert np.abs(guide - exact).max() < 1e-7
    # The drive's power is what the energy gains.
    energy = (run.kinetic_energy + run.potential_energy).values
    work = run.drive_work.sel(dof="main").values
    assert np.abs(energy - energy[0] - work).max() < 1e-5


def test_long_runs_stay_on_their_constraints():
    model = benchmark("four_bars").model
    q0 = state(model, A=np.pi - 0.7, B=-np.pi + 0.7)
    run = lw.simulate(model, duration=100, every=1, q0=q0, tolerance=1e-5)
    assert open_by(model, run) < 1e-12
    energy = (run.kinetic_energy + run.potential_energy).values
    assert np.abs(energy - energy[0]).max() < 1e-2


def test_open_loops_are_closed_with_little_change():
    model = benchmark("four_bars", n=1).model
    given = state(model, A0=0.1, A1=0.05)
    found = lw.assemble(model, given, state(model, A0=1))
    assert 0.01 < found.gap < 0.3
    assert np.abs(found.q - given).max() < 0.1
    again = lw.assemble(model, found.q, found.v)
    assert again.gap < 1e-12
    assert np.abs(again.q - found.q).max() < 1e-12
    assert np.abs(again.v - found.v).max() < 1e-12
    left, right = model.joint_names.index("A0"), model.joint_names.index("A1")
    assert found.v[left] == pytest.approx(found.v[right], abs=1e-12)  # of a parallelogram


def test_held_joints_stay_where_they_are():
    model = benchmark("four_bars", n=1).model
    left, right = model.joint_names.index("A0"), model.joint_names.index("A1")
    found = lw.assemble(model, state(model, A0=0.1), state(model, A0=2), hold=["A0"])
    assert found.q[left] == 0.1
    assert found.q[right] == pytest.approx(0.1, abs=1e-12)
    assert found.v[left] == 2
    assert found.v[right] == pytest.approx(2, abs=1e-12)
    assert found.released == ()
    found = lw.assemble(model, state(model, A0=0.1, A1=0.3), hold=["A0", "A1"])
    assert found.released == ("A1",)
    assert found.q[left] == 0.1


def torn(point=(1, 0, 0)) -> lw.Model:
    """A bar that may not reach from one upright rod to this point of the other."""
    builder = lw.ModelBuilder("torn", gravity=(0, -9.81, 0))
    builder.add_link("ground")
    for name, at in (("left", 0.0), ("right", 4.0)):
        rod(builder, name, 1.0)
        builder.add_joint(f"pin_{name}", "revolute", "ground", name, translation=(at, 0, 0))
    rod(builder, "bar", 1.0)
    builder.add_joint("hook", "revolute", "left", "bar", translation=(1, 0, 0))
    ends = {"translation": (1, 0, 0), "child_translation": point}
    builder.add_loop("clasp", "revolute", "bar", "right", **ends)
    return builder.build()


def test_links_that_cannot_meet_are_named():
    model = torn()
    said = r"'clasp'.* open by 1e\+03 mm .* between 'bar' and 'right'"
    with pytest.raises(lw.InputError, match=said):
        lw.assemble(model, [0.3, 0.2, 0.1])
    with pytest.raises(lw.InputError, match="cannot close its loop"):
        lw.simulate(model, duration=1)


def told_numbers(model, q, before):
    """What the message says behind some words, once that the model cannot be assembled."""
    with pytest.raises(lw.InputError) as error:
        lw.assemble(model, q)
    text = str(error.value)
    assert "which closes it" in text
    assert "\n" not in text
    numbers = text.partition(before)[2].strip("( ").replace(",", " ").replace(")", " ").split()
    return [float(x) for x in numbers[:3] if x[-1].isdigit()]


@pytest.mark.parametrize("length", [5.0, 0.5])
def test_the_length_of_a_rod_that_would_reach_is_told(length):
    """Cranks of 0.3 and 0.2 m, 2 m apart, reach 1.5 to 2.5 m."""

    def cranks(length):
        builder = lw.ModelBuilder("cranks")
        builder.add_link("ground")
        for name, at in (("left", 0.0), ("right", 2.0)):
            rod(builder, name, 0.2)
            builder.add_joint(f"pin_{name}", "revolute", "ground", name, translation=(at, 0, 0))
        ends = {"point": (0.3, 0, 0), "child_point": (0.2, 0, 0)}
        builder.add_rod("rod", "left", "right", length=length, **ends)
        return builder.build()

    (told, *_) = told_numbers(cranks(length), [0.1, 0.2], "give it the length")
    assert told == pytest.approx(2.5 if length > 2 else 1.5, abs=3e-3)
    assert lw.assemble(cranks(told), [0.1, 0.2]).released == ()


def test_the_place_of_a_joint_that_would_meet_is_told():
    q = [0.3, 0.2, 0.1]
    told = told_numbers(torn(), q, "place its point at")
    assert np.hypot(*told[:2]) == pytest.approx(2, abs=2e-2)  # 4 m less two bars
    assert lw.assemble(torn(told), q).released == ()


def test_the_offset_that_a_coupling_could_keep_is_told():
    builder = lw.ModelBuilder("cam")
    builder.add_link("frame")
    rod(builder, "shaft", 0.1)
    builder.add_joint("turn", "revolute", "frame", "shaft")
    model = builder.build()
    cam = {"turn": [0.0, 1.0]}  # the square is -0.5 nowhere
    (told,) = told_numbers(
        model.with_coupling("cam", cam, offset=-0.5), [0.3], "give it the offset"
    )
    assert told == pytest.approx(0, abs=1e-2)
    assert lw.assemble(model.with_coupling("cam", cam, offset=told), [0.3]).released == ()


def test_motions_that_contradict_each_other_are_refused():
    model = benchmark("four_bars", n=1).model
    q, v = state(model, A=0.1, B=-0.1), state(model, A0=1, A1=2)
    with pytest.raises(lw.InputError, match="contradict"):
        lw.assemble(model, q, v, hold=["A0", "A1"])


def test_simulations_say_what_they_moved():
    model = benchmark("four_bars", n=1).model
    q0 = state(model, A0=0.1)
    run = lw.simulate(model, duration=0.1, q0=q0)
    assert "joints were moved" in run.attrs["warnings"]
    with pytest.raises(lw.InputError, match="is open"):
        lw.simulate(model, duration=0.1, q0=q0, assemble="exact")


def test_loads_of_loop_joints_stand_behind_the_others():
    model = benchmark("four_bars", n=1).model
    q0 = state(model, A=np.pi + 1, B=-np.pi - 1)
    run = lw.simulate(model, duration=0.1, q0=q0)
    assert list(run.joint_load.joint.values) == [*model.joint_names, *model.loop_names]
    alone = lw.joint_loads(model, run.position.values[3], run.velocity.values[3])
    assert np.abs(run.joint_load.values[3] - alone).max() < 1e-9


def mooring(n: int, joint: str, span: float, length: float) -> lw.Model:
    """A chain of n rods, 100 kg in all, between two anchors at one height."""
    rod, mass = length / n, 100 / n
    builder = lw.ModelBuilder("mooring", gravity=(0, 0, -9.81))
    builder.add_link("ground")
    axis = {"axis": (0, 1, 0)} if joint == "revolute" else {}
    inertia = mass * rod**2 * np.diag([1e-3, 1 / 12, 1 / 12])
    for k in range(n):
        builder.add_link(f"rod_{k}", mass=mass, com=(rod / 2, 0, 0), inertia=inertia)
        parent, at = (f"rod_{k - 1}", rod) if k else ("ground", 0.0)
        builder.add_joint(f"J{k}", joint, parent, f"rod_{k}", translation=(at, 0, 0), **axis)
    builder.add_loop(
        "anchor",
        joint,
        f"rod_{n - 1}",
        "ground",
        translation=(rod, 0, 0),
        child_translation=(span, 0, 0),
        **axis,
    )
    return builder.build()


@pytest.mark.parametrize(
    ("n", "joint"),
    [
        *((n, joint) for n in (10, 1000, 20_000) for joint in ("revolute", "spherical")),
        (100_000, "revolute"),
    ],
)
def test_a_chain_between_two_anchors_hangs_as_a_catenary(n, joint):
    """The horizontal pull is the same everywhere; a rod hangs along the mean pull on it."""
    span, length, weight = 100.0, 120.0, 981.0
    middle = (np.arange(n) + 0.5) / n - 0.5  # of the weight, from the lowest point on
    pull = brentq(
        lambda h: np.sum(length / n / np.sqrt(1 + (weight * middle / h) ** 2)) - span,
        1.0,
        1e5,
        xtol=1e-12,
        rtol=1e-15,
    )
    # A chain of ever shorter rods: span = 2 a asinh(length / 2 a), with a = H length / weight.
    a = brentq(lambda a: 2 * a * np.arcsinh(length / (2 * a)) - span, 1.0, 1e4, xtol=1e-12)
    assert pull == pytest.approx(a * weight / length, rel=0.3 / n**2 + 1e-12)
    model = mooring(n, joint, span, length)
    turns = np.diff(-np.arctan2(weight * middle, pull), prepend=0)
    q = turns
    if joint == "spherical":
        q = np.zeros((n, 4))  # x, y, z, w
        q[:, 1], q[:, 3] = np.sin(turns / 2), np.cos(turns / 2)
        q = q.ravel()
    loads = lw.joint_loads(model, q, np.zeros(model.nv))
    tension = np.linalg.norm(loads[:, :3], axis=1)
    # At joints; the last one is the loop's.
    want = np.hypot(pull, weight * (np.arange(n + 1) / n - 0.5))
    assert np.abs(tension / want - 1).max() < 1e-15 * n**1.5 + 1e-13


def cross(r) -> np.ndarray:
    return np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])


def test_a_net_accelerates_as_its_bodies_do_by_themselves():
    """Newton and Euler of every body with the forces of all pins unknown, as one dense system."""
    n, builder = 6, lw.ModelBuilder("net", gravity=(0, 0, -9.81))
    builder.add_link("ground")
    bodies, pins = {}, [("ground", "knot_0_0", np.zeros(3))]
    slender = np.diag([1e-3, 1 / 12, 1 / 12])

    def add(name: str, mass: float, at, com, inertia) -> None:
        builder.add_link(name, mass=mass, com=com, inertia=inertia)
        bodies[name] = np.asarray(at) + com, np.diag([mass] * 3), np.asarray(inertia)

    for i, j in np.ndindex(n, n):
        add(f"knot_{i}_{j}", 0.5, (j, i, 0), np.zeros(3), 0.01 * np.eye(3))
    builder.add_joint("corner", "spherical", "ground", "knot_0_0")
    for i, j, along in np.ndindex(n, n, 2):
        k, m = (i, j + 1) if along == 0 else (i + 1, j)
        if max(k, m) == n:
            continue
        name, point, at = f"rod_{i}_{j}_{along}", np.eye(3)[along], np.array([j, i, 0.0])
        turned = slender if along == 0 else np.diag(np.diag(slender)[[1, 0, 2]])
        add(name, 1.0, at, point / 2, turned)
        builder.add_joint(f"start_{name}", "spherical", f"knot_{i}_{j}", name)
        close = builder.add_loop if along == 0 and i > 0 else builder.add_joint
        close(f"end_{name}", "spherical", name, f"knot_{k}_{m}", translation=point)
        pins += [(f"knot_{i}_{j}", name, at), (name, f"knot_{k}_{m}", at + point)]
    model = builder.build()
    assert 3 * model.n_loops > 64  # rows: more than are factored densely
    place = {name: 6 * k for k, name in enumerate(bodies)}
    size = 6 * len(bodies)
    yields, pull, rows = np.zeros((size, size)), np.zeros(size), np.zeros((3 * len(pins), size))
    for name, (_, mass, inertia) in bodies.items():
        o = place[name]
        yields[o : o + 3, o : o + 3] = np.linalg.inv(mass)
        yields[o + 3 : o + 6, o + 3 : o + 6] = np.linalg.inv(inertia)
        pull[o + 2] = -9.81 * mass[0, 0]
    for k, (parent, child, at) in enumerate(pins):
        for name, sign in ((parent, 1), (child, -1)):
            if name in place:
                part = np.hstack([np.eye(3), -cross(at - bodies[name][0])])
                rows[3 * k : 3 * k + 3, place[name] : place[name] + 6] = sign * part
    unknown = np.linalg.solve(rows @ yields @ rows.T, rows @ yields @ pull)
    turning = (yields @ (pull - rows.T @ unknown)).reshape(-1, 6)[:, 3:]
    turning = dict(zip(bodies, turning, strict=True), ground=np.zeros(3))
    pairs = zip(model.parent_link_names, model.child_link_names, strict=True)
    want = np.concatenate([turning[child] - turning[parent] for parent, child in pairs])
    found = lw.forward_dynamics(model, model.neutral_configuration(), np.zeros(model.nv))
    assert np.abs(want).max() > 1
    assert np.abs(found - want).max() < 1e-10 * np.abs(want).max()


def flat_triangle(gravity) -> lw.Model:
    """Bars of 1 m and 1 m between hinges 2 m apart: it cannot move, and is not held."""
    builder = lw.ModelBuilder("flat", gravity=gravity)
    builder.add_link("ground")
    for name in ("left", "right"):
        rod(builder, name, 1.0)
    builder.add_joint("a", "revolute", "ground", "left", axis=(0, 1, 0))
    ends = {"translation": (1, 0, 0), "axis": (0, 1, 0)}
    builder.add_joint("b", "revolute", "left", "right", **ends)
    builder.add_rod("c", "ground", "right", length=1.0, point=(3, 0, 0), child_point=(1, 0, 0))
    return builder.build()


def test_a_triangle_folded_flat_stands_or_is_refused():
    with pytest.raises(lw.InputError, match="at rest in a singular position that it cannot leave"):
        lw.simulate(flat_triangle((0, 0, -9.81)), duration=1)
    along = lw.simulate(flat_triangle((-9.81, 0, 0)), duration=1)
    assert along.attrs["outcome"] == "converged"
    np.testing.assert_array_equal(along.position.values, 0)


def test_machines_that_their_loops_hold_stand_still():
    """A bar across a corner: what holds it does so by finite forces."""
    builder = lw.ModelBuilder("strut")
    builder.add_link("ground")
    rod(builder, "bar", 1.0)
    builder.add_joint("a", "revolute", "ground", "bar", axis=(0, 1, 0))
    builder.add_rod("tie", "ground", "bar", length=2**0.5, point=(0, 0, 1), child_point=(1, 0, 0))
    run = lw.simulate(builder.build(), duration=1)
    # Moments about the hinge: half the weight at the tip, along a tie at 45 degrees.
    tie = run.joint_load.sel(joint="tie").values[:, :3]
    np.testing.assert_allclose(np.linalg.norm(tie, axis=1), 9.81 / 2 * 2**0.5, rtol=1e-12)


def test_rates_that_open_loops_are_told():
    model = benchmark("four_bars", n=1).model
    q0, v0 = state(model, A=np.pi + 1, B=-np.pi - 1), state(model, A0=1.0, A1=1.0, B0=-1.0)
    assert "rates" not in str(lw.simulate(model, duration=0.1, q0=q0, v0=v0).warnings)
    v0[list(model.joint_names).index("A1")] = 2.0
    run = lw.simulate(model, duration=0.1, q0=q0, v0=v0)
    got = run.velocity.values[0]
    (said,) = [w["text"] for w in run.warnings if w["element"] == "assembly"]
    for name, asked, rate in zip(model.joint_names, v0, got, strict=True):
        assert f"'{name}' is {rate:.3g} instead of {asked:.3g}" in said
    with pytest.raises(lw.InputError, match="opens"):
        lw.simulate(model, duration=0.1, q0=q0, v0=v0, assemble="exact")
    members = lw.simulate_batch(model, duration=0.1, step=1e-3, q0=[q0, q0], v0=[v0, 0 * v0])
    assert "rates that keep loops closed are not those asked for" in members.attrs["warnings"]


def bent_ring(seed: int) -> lw.Model:
    """A ring of four joints and a rod in space, which can move in one way."""
    rng = np.random.default_rng(seed)
    builder = lw.ModelBuilder("ring")
    builder.add_link("ground")
    corners = [(np.cos(k * np.pi / 2), np.sin(k * np.pi / 2), 0) for k in range(4)]
    at = [np.array(corner) + 0.2 * rng.normal(size=3) for corner in corners]
    for k in (1, 2, 3):
        A, mass = rng.normal(size=(3, 3)), rng.uniform(0.5, 3)
        inertia = 0.05 * A @ A.T + 0.1 * np.eye(3)
        builder.add_link(f"L{k}", mass=mass, com=(at[k] - at[k - 1]) / 2, inertia=inertia)
    axes = rng.normal(size=(4, 2, 3))
    axes /= np.linalg.norm(axes, axis=2, keepdims=True)
    builder.add_joint("a", "planar", "ground", "L1", translation=at[0], axis=axes[0][0])
    for k, name in ((1, "b"), (2, "c")):
        place = {"translation": at[k] - at[k - 1], "axes": list(axes[k])}
        builder.add_joint(name, "universal", f"L{k}", f"L{k + 1}", **place)
    ends = {"translation": at[3], "child_translation": at[3] - at[2]}
    builder.add_loop("d", "revolute", "ground", "L3", axis=axes[3][0], **ends)
    point, child = 1.6 * rng.normal(size=3), 0.4 * rng.normal(size=3)
    length = np.linalg.norm(at[2] + child - point)
    builder.add_rod("rod", "ground", "L3", length=length, point=point, child_point=child)
    return builder.build()


@pytest.mark.parametrize("seed", [74, 553, 733])
def test_runs_that_end_between_samples_say_why(seed):
    """These meet a singular position, and what ends them is a sample, which nobody interrupted."""
    run = lw.simulate(
        bent_ring(seed), duration=1, every=1e-3, tolerance=1e-8, on_failure="return", max_steps=5000
    )
    assert run.attrs["outcome"] in ("singular_position", "converged")
    assert "interrupted" not in run.attrs["message"]
