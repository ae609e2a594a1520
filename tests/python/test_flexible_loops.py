"""Closed loops on machines with elastic links: against dense equations, rigid machines, beam theory
and each other."""

import numpy as np
import pytest
from test_flexible_links import accelerations

import linkwise as lw

E, G = 70e9, 26e9
FREE = {"spherical": 3, "revolute": 1, "fixed": 0, "rod": 5}


def turn(rng):
    """A random rotation."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q * np.linalg.det(q)


class Looped:
    """A machine with elastic links, with and without its loops."""

    def __init__(self, seed, closures, *, bodies=1, modulus=E, floating=False):
        rng = np.random.default_rng(seed)
        builder = lw.ModelBuilder("looped", gravity=(0.4, -1.0, -9.81))
        if floating:
            builder.set_floating_base()
        builder.add_link("base", mass=3.0, inertia=np.diag([0.2, 0.3, 0.4]))
        parents = {"left": "base", "fore": "left", "right": "base", "hand": "right", "tail": "fore"}
        kinds = ["revolute", "revolute", "spherical", "revolute", "universal"]
        for (link, parent), kind in zip(parents.items(), kinds, strict=True):
            inertia = np.diag(rng.uniform(0.05, 0.1, 3))
            builder.add_link(link, mass=rng.uniform(1, 2), com=(0.3, 0, 0), inertia=inertia)
            at = (0, 0, 0) if parent == "base" and link == "left" else (0.9, 0.1, -0.2)
            axes = {"revolute": {"axis": rng.normal(size=3)}, "spherical": {}}
            axes["universal"] = {"axes": [(0, 1, 0), (1, 0, 0)]}
            builder.add_joint(f"J{link}", kind, parent, link, translation=at, **axes[kind])
        for link in ("left", "right", "tail"):
            end = (0.9, 0.1, -0.2)
            builder.make_flexible(
                link,
                section=lw.Section.tube(0.05, 0.002),
                E=modulus,
                G=modulus * G / E,
                bodies=bodies,
                interior_modes=1,
                end=end,
            )
        self.open = builder.build()
        q = self.open.initial_configuration()
        for name in self.open.joint_names:
            part = self.open.q_slice(name)
            small = 0.02 if ":" in name else 0.4
            step = small * rng.normal(size=part.stop - part.start)
            if "hand" in name or ":" in name or part.stop - part.start < 3:
                q[part] += step
        self.q, self.v = q, 0.5 * rng.normal(size=self.open.nv)
        self.loops = []
        model = builder
        for k, (kind, a, b) in enumerate(closures):
            self._close(model, f"L{k}", kind, a, b, rng)
        self.model = model.build()

    def _close(self, builder, name, kind, a, b, rng):
        """Joins links a and b where they are."""
        pose = {link: lw.frame_pose(self.open, self.q, link) for link in (a, b)}
        # On the frame of an elastic link, or of what is at its end.
        on_a = np.zeros(3) if a in ("left", "right", "tail") else rng.normal(size=3) * 0.2
        point = pose[a][:3, :3] @ on_a + pose[a][:3, 3]
        on_b = pose[b][:3, :3].T @ (point - pose[b][:3, 3])
        R_a = turn(rng)
        R_b = pose[b][:3, :3].T @ pose[a][:3, :3] @ R_a
        if kind == "rod":
            on_b = rng.normal(size=3) * 0.2
            there = pose[b][:3, :3] @ on_b + pose[b][:3, 3]
            length = float(np.linalg.norm(there - point))
            builder.add_rod(name, a, b, point=on_a, child_point=on_b, length=length)
        else:
            axis = {"axis": (0, 0, 1)} if kind == "revolute" else {}
            builder.add_loop(
                name,
                kind,
                a,
                b,
                translation=on_a,
                rotation=R_a,
                child_translation=on_b,
                child_rotation=R_b,
                **axis,
            )
        self.loops.append((kind, lw.Frame(a, on_a, R_a), lw.Frame(b, on_b, R_b)))

    def rows(self, q, v):
        """K and r of K du = r, by frames of the open machine, in world axes."""
        K, r, rest = [], [], np.zeros(self.open.nv)
        for kind, E, F in self.loops:
            J = [lw.frame_jacobian(self.open, q, at) for at in (E, F)]
            a = [lw.frame_acceleration(self.open, q, v, rest, at) for at in (E, F)]
            pose = [lw.frame_pose(self.open, q, at) for at in (E, F)]
            V = [j @ v for j in J]
            dJ, da, dV = J[1] - J[0], a[1] - a[0], V[1] - V[0]
            if kind == "rod":
                apart = pose[1][:3, 3] - pose[0][:3, 3]
                K.append(apart @ dJ[:3])
                r.append(-apart @ da[:3] - dV[:3] @ dV[:3])
                continue
            K.extend(dJ[:3])
            r.extend(-da[:3])
            if kind == "spherical":
                continue
            for axis in pose[0][:3, : 2 if kind == "revolute" else 3].T:
                K.append(axis @ dJ[3:])
                r.append(-axis @ da[3:] - dV[3:] @ np.cross(V[0][3:], axis))
        return np.array(K), np.array(r)

    def dense(self, q, v, tau):
        """Accelerations, and forces of all rows, by one dense matrix."""
        H = lw.mass_matrix(self.open, q)
        bias = lw.inverse_dynamics(self.open, q, v, np.zeros(self.open.nv))
        K, r = self.rows(q, v)
        L = np.linalg.cholesky(H)
        free = np.linalg.solve(H, tau - bias)
        W = np.linalg.solve(L, K.T)
        f = np.linalg.lstsq(W.T @ W, r - K @ free, rcond=1e-12)[0]
        return free + np.linalg.solve(H, K.T @ f), f


CLOSURES = [
    [("spherical", "left:end", "right:end")],
    [("fixed", "hand", "tail:end")],
    [("fixed", "left:end", "base"), ("revolute", "hand", "tail:end")],
    [("revolute", "right", "tail:end"), ("rod", "left", "right:end"), ("rod", "tail:end", "base")],
    [("spherical", "hand", "tail:end"), ("spherical", "hand", "tail:end")],
]


def moving(machine, **given):
    found = lw.assemble(machine.model, machine.q, machine.v, **given)
    return found.q, found.v


@pytest.mark.parametrize("bodies", [1, 2])
@pytest.mark.parametrize("floating", [False, True])
@pytest.mark.parametrize("closures", CLOSURES)
def test_accelerations_are_those_of_one_dense_matrix(closures, floating, bodies):
    machine = Looped(3 * bodies + floating, closures, bodies=bodies, floating=floating)
    q, v = moving(machine)
    tau = np.random.default_rng(1).normal(size=machine.model.nv)
    want, _ = machine.dense(q, v, tau)
    found = lw.forward_dynamics(machine.model, q, v, tau)
    assert np.abs(found - want).max() < 1e-9 * np.abs(want).max()


def allowed_rates(model, q):
    """Rates that keep loops closed, as columns."""
    rates = np.array([lw.assemble(model, q, e).v for e in np.eye(model.nv)]).T
    left, size, _ = np.linalg.svd(rates)
    return left[:, : int((size > 1e-6 * size[0]).sum())]


def at_rest(model, q, step=1e-6):
    """The closed position near q in which the machine stands."""
    q, rest = np.array(q), np.zeros(model.nv)
    for _ in range(10):
        N = allowed_rates(model, q)
        slope = [accelerations(model, q + step * n, rest) for n in N.T]
        slope = np.array(slope) - [accelerations(model, q - step * n, rest) for n in N.T]
        move = np.linalg.lstsq(slope.T / (2 * step), -accelerations(model, q, rest), rcond=None)[0]
        q = lw.assemble(model, q + N @ move).q
        if np.abs(move).max() < 1e-12:
            break
    return q


def loads_at_rest(model, q):
    rest = np.zeros(model.nv)
    return lw.joint_loads(model, q, rest, lw.passive_torque(model, q, rest))


L, W, SIDE = 2.0, 0.015, 0.05  # m, N/m, m


def held_beam(end, modulus=E, bodies=2):
    """Clamped at its start, its weight so small that it does not pull on its ends."""
    builder = lw.ModelBuilder("beam", gravity=(0, 0, -0.01))
    builder.add_link("ground")
    builder.add_link("beam", mass=W * L / 0.01)
    builder.add_joint("start", "fixed", "ground", "beam")
    builder.make_flexible(
        "beam",
        section=lw.Section.rectangle(SIDE, SIDE),
        E=modulus,
        G=modulus * G / E,
        end=(L, 0, 0),
        bodies=bodies,
    )
    at = {"translation": (L, 0, 0), "child_translation": (L, 0, 0)}
    builder.add_loop("end", end, "ground", "beam", **at)
    return builder.build()


@pytest.mark.parametrize("modulus", [E, 1e3 * E])
def test_a_beam_clamped_at_both_ends_bends_as_handbooks_say(modulus):
    """End moments w L^2 / 12 whatever E is: the loads of least work."""
    model = held_beam("fixed", modulus)
    q = at_rest(model, np.zeros(model.nq))
    loads = loads_at_rest(model, q)
    assert loads[0] == pytest.approx([0, 0, W * L / 2, 0, -W * L**2 / 12, 0], abs=1e-9)
    assert loads[-1] == pytest.approx([0, 0, W * L / 2, 0, W * L**2 / 12, 0], abs=1e-9)
    middle = lw.frame_pose(model, q, "beam:2")[2, 3]
    EI = modulus * SIDE**4 / 12
    assert middle == pytest.approx(-W * L**4 / (384 * EI), rel=1e-8)
    report = lw.indeterminacy(model, q)
    assert report.rank == report.rows == 6
    assert report.determinate.all()


def test_a_propped_cantilever_shares_its_weight_as_handbooks_say():
    model = held_beam("spherical", bodies=1)
    loads = loads_at_rest(model, at_rest(model, np.zeros(model.nq)))
    root = [0, 0, 5 / 8 * W * L, 0, -W * L**2 / 8, 0]
    assert loads[0] == pytest.approx(root, abs=1e-8)
    assert loads[-1] == pytest.approx([0, 0, 3 / 8 * W * L, 0, 0, 0], abs=1e-8)


#: Lengths of a four-bar's links [m]; its base is as long as the coupler.
CRANK, COUPLER, ROCKER = 0.6, 1.2, 0.9
TUBE = lw.Section.tube(0.05, 0.003)


def four_bar(*flexible, cut="c", modulus=E, damping=0.0, gravity=(0.3, -9.81, 0.5)):
    """A planar linkage in space, of hinges along z; the rocker's frame is where its joint is."""
    builder = lw.ModelBuilder("four_bar", gravity=gravity)
    builder.add_link("base")
    lengths = {"crank": CRANK, "coupler": COUPLER, "rocker": ROCKER}
    gyration = TUBE.Iy / TUBE.area
    for name, length in lengths.items():
        inertia = 2 * length * np.diag([2 * gyration, *[gyration + length**2 / 12] * 2])
        x = -length / 2 if name == "rocker" and cut == "d" else length / 2
        builder.add_link(name, mass=2 * length, com=(x, 0, 0), inertia=inertia)
    z = {"axis": (0, 0, 1)}
    pin = {"translation": (COUPLER, 0, 0)}
    builder.add_joint("a", "revolute", "base", "crank", **z)
    builder.add_joint("b", "revolute", "crank", "coupler", translation=(CRANK, 0, 0), **z)
    if cut == "c":
        builder.add_joint("d", "revolute", "base", "rocker", **pin, **z)
        there = {"child_translation": (ROCKER, 0, 0)}
        builder.add_loop("c", "revolute", "coupler", "rocker", **pin, **there, **z)
    else:
        builder.add_joint("c", "revolute", "coupler", "rocker", **pin, **z)
        there = {"child_translation": (-ROCKER, 0, 0)}
        builder.add_loop("d", "revolute", "base", "rocker", **pin, **there, **z)
    for name in flexible:
        builder.make_flexible(
            name,
            section=TUBE,
            E=modulus,
            G=modulus * G / E,
            damping=damping,
            interior_modes=0,
            stretches=False,
            end=(lengths[name], 0, 0),
        )
    return builder


def upright(model, crank=1.2):
    """Closed with the crank at some angle."""
    B, D = CRANK * np.array([np.cos(crank), np.sin(crank)]), np.array([COUPLER, 0])
    apart = np.linalg.norm(D - B)
    inner = (COUPLER**2 + apart**2 - ROCKER**2) / (2 * COUPLER * apart)
    coupler = np.arctan2(*(D - B)[::-1]) + np.arccos(inner)
    C = B + COUPLER * np.array([np.cos(coupler), np.sin(coupler)])
    rocker = np.arctan2(*(C - D)[::-1])
    angles = {"a": crank, "b": coupler - crank, "d": rocker, "c": rocker - coupler}
    q = model.initial_configuration()
    for name in model.joint_names:
        if name in angles:
            q[model.q_slice(name)] = angles[name]
    return lw.assemble(model, q, hold=["a"]).q


def test_what_rigid_links_leave_open_elastic_ones_decide():
    rigid = four_bar().build()
    open_loads = lw.indeterminacy(rigid, upright(rigid))
    assert (open_loads.rank, open_loads.rows, open_loads.mobility) == (2, 5, 1)
    assert np.array_equal(open_loads.determinate, np.tile([1, 1, 0, 0, 0, 1], (4, 1)))
    for flexible in (["coupler"], ["crank", "coupler"]):
        model = four_bar(*flexible).build()
        report = lw.indeterminacy(model, upright(model))
        assert report.rank == report.rows == 5
        assert report.determinate.all()
        assert report.mobility == model.nv - 5


def test_stiff_links_are_rigid_ones():
    """What a link without end stiff does: elastic forces with which it does not bend."""
    rigid = four_bar().build()
    q = upright(rigid)
    v = lw.assemble(rigid, q, [2.0, 0, 0], hold=["a"]).v
    want = np.asarray(lw.forward_dynamics(rigid, q, v))
    loads = lw.joint_loads(rigid, q, v)
    model = four_bar("crank", "coupler").build()
    at = np.array([model.q_slice(name).start for name in ("a", "b", "d")])
    Q, V = np.zeros(model.nq), np.zeros(model.nv)
    order = [rigid.q_slice(name).start for name in ("a", "b", "d")]
    Q[at], V[at] = q[order], v[order]
    bent = np.setdiff1d(np.arange(model.nv), at)
    free = np.asarray(lw.forward_dynamics(model, Q, V))
    yields = np.array([lw.forward_dynamics(model, Q, V, e) - free for e in np.eye(model.nv)[bent]])
    tau = np.zeros(model.nv)
    tau[bent] = np.linalg.lstsq(yields[:, bent].T, -free[bent], rcond=1e-11)[0]
    found = np.asarray(lw.forward_dynamics(model, Q, V, tau))
    assert found[bent] == pytest.approx(0, abs=1e-8 * np.abs(free).max())
    assert found[at] == pytest.approx(want[order], rel=1e-9)
    own = lw.joint_loads(model, Q, V, tau)
    names = [*model.joint_names, "c"]
    for name in "abcd":
        rows = [*rigid.joint_names, "c"]
        want_load = loads[rows.index(name)][[0, 1, 5]]
        assert own[names.index(name)][[0, 1, 5]] == pytest.approx(want_load, rel=1e-8)


def test_loads_do_not_depend_on_the_cut():
    one = four_bar("crank", "coupler", cut="c").build()
    other = four_bar("crank", "coupler", cut="d").build()
    rng = np.random.default_rng(4)
    q = upright(one)
    bend = [k for name in one.joint_names if ":" in name for k in range(*_range(one, name))]
    q[bend] += 0.01 * rng.normal(size=len(bend))
    found = lw.assemble(one, q, rng.normal(size=one.nv))
    q, v = found.q, found.v
    Q, V = np.zeros(other.nq), np.zeros(other.nv)
    for name in set(one.joint_names) & set(other.joint_names):
        Q[other.q_slice(name)] = q[one.q_slice(name)]
        V[other.v_slice(name)] = v[one.v_slice(name)]
    pose = [lw.frame_pose(one, q, link)[:3, :3] for link in ("coupler:end", "rocker")]
    turned = pose[0].T @ pose[1]
    Q[other.q_slice("c")] = np.arctan2(turned[1, 0], turned[0, 0])
    spin = [lw.frame_velocity(one, q, v, link)[3:] for link in ("coupler:end", "rocker")]
    V[other.v_slice("c")] = pose[1][:, 2] @ (spin[1] - spin[0])
    loads = lw.joint_loads(one, q, v, lw.passive_torque(one, q, v))
    others = lw.joint_loads(other, Q, V, lw.passive_torque(other, Q, V))
    for name in ("a", "b", "c", "d", "crank:1", "coupler:1"):
        load = loads[[*one.joint_names, "c"].index(name)]
        same = others[[*other.joint_names, "d"].index(name)]
        assert same == pytest.approx(load, abs=1e-9 * np.abs(loads).max())


def _range(model, name):
    part = model.q_slice(name)
    return part.start, part.stop


@pytest.mark.parametrize("tolerance", [1e-6, 1e-8])
def test_energy_is_kept_and_loops_stay_closed(tolerance):
    model = four_bar("crank", "coupler", modulus=E / 50).build()
    run = lw.simulate(
        model,
        duration=2.0,
        every=0.02,
        q0=upright(model),
        tolerance=tolerance,
        drives={"a": lw.Torque(4.0)},
    )
    energy = (run.kinetic_energy + run.potential_energy).values - run.drive_work.values.sum(axis=1)
    assert np.abs(energy - energy[0]).max() < 10 * tolerance * float(run.kinetic_energy.max())
    q = run.position.values
    ends = [
        lw.frame_pose(model, q, at) for at in ("coupler:end", lw.Frame("rocker", (ROCKER, 0, 0)))
    ]
    assert np.abs(ends[0][:, :3, 3] - ends[1][:, :3, 3]).max() < 1e-12
    assert np.abs(ends[0][:, :3, 2] - ends[1][:, :3, 2]).max() < 1e-12


class TestWhatElseLoopsDo:
    def closed(self, change=None, **given):
        builder = four_bar("crank", "coupler", damping=0.02, **given)
        if change:
            change(builder)
        model = builder.build()
        rng = np.random.default_rng(2)
        found = lw.assemble(model, upright(model), rng.normal(size=model.nv))
        return model, found.q, found.v, rng

    def test_torques_of_a_motion(self):
        model, q, v, _ = self.closed()
        tau = np.zeros(model.nv)
        tau[model.v_slice("a")] = 3.0
        du = lw.forward_dynamics(model, q, v, tau + lw.passive_torque(model, q, v))
        found = lw.inverse_dynamics(model, q, v, du, driven=["a"], passive=True)
        assert found == pytest.approx(tau, abs=1e-11)
        with pytest.raises(lw.InputError, match="'crank:1' is elastic, and its coordinates have"):
            lw.inverse_dynamics(model, q, v, du, driven=["crank:1"])
        with pytest.raises(lw.InputError, match=r"of 'a', 'b', 'd'|of 'a', 'd', 'b'"):
            lw.inverse_dynamics(model, q, v, du)

    def test_the_mass_matrix_is_that_of_the_open_machine(self):
        model, q, v, _ = self.closed()
        H = lw.mass_matrix(model, q)
        assert 0.5 * v @ H @ v == pytest.approx(lw.kinetic_energy(model, q, v), rel=1e-12)

    def test_batches_and_threads_change_no_bit(self):
        model, q, v, _ = self.closed()
        many, rates = np.tile(q, (9, 1)), np.outer(np.arange(9), v)
        alone = np.array([lw.forward_dynamics(model, q, rate) for rate in rates])
        for threads in (1, 2):
            assert np.array_equal(lw.forward_dynamics(model, many, rates, threads=threads), alone)

    def test_loads_by_cause_add_up(self):
        model, q, v, _ = self.closed()
        tau = np.zeros(model.nv)
        tau[model.v_slice("a")] = 3.0
        causes = ["gravity", "velocity", "drive", "passive"]
        parts = lw.joint_loads_by_cause(model, causes, q, v, tau)
        tau += lw.passive_torque(model, q, v)
        total = lw.joint_loads(model, q, v, tau)
        assert parts.sum(axis=0) == pytest.approx(total, abs=1e-9 * np.abs(total).max())

    def test_couplings_tie_joints_around_elastic_links(self):
        def gear(builder):
            plain = four_bar("crank", "coupler").build()
            q = upright(plain)
            a, d = (float(q[plain.q_slice(name)][0]) for name in ("a", "d"))
            offset = a + 0.3 * d + 0.1 * d * d
            builder.add_coupling("gear", {"a": 1.0, "d": [0.3, 0.1]}, offset=offset)

        model, q, v, _ = self.closed(gear)
        a, d = (model.v_slice(name) for name in ("a", "d"))
        slope = 0.3 + 0.2 * q[model.q_slice("d")]
        assert v[a] + slope * v[d] == pytest.approx(0, abs=1e-12)
        du = lw.forward_dynamics(model, q, v)
        assert du[a] + slope * du[d] + 0.2 * v[d] ** 2 == pytest.approx(0, abs=1e-9)
        assert lw.indeterminacy(model, q).rank == 6
        builder = four_bar("crank", "coupler")
        builder.add_coupling("gear", {"a": 1.0, "coupler:1": 1.0})
        with pytest.raises(lw.InputError, match="is elastic, and its coordinates are not coupled"):
            builder.build()

    def test_drives_and_given_motions_of_joints_in_the_loop(self):
        model, q, *_ = self.closed(modulus=E / 50)
        turn = float(q[model.q_slice("a")][0])
        drives = {"a": lw.Motion(lambda t: (turn + 0.5 * t * t, t, 1.0)), "c": lw.Torque(2.0)}
        run = lw.simulate(model, duration=0.2, every=0.01, q0=q, drives=drives, tolerance=1e-9)
        assert run.velocity.sel(dof="a").values == pytest.approx(run.time.values, abs=1e-9)
        work = run.drive_work.values.sum(axis=1) + run.loop_drive_work.values.sum(axis=1)
        energy = (run.kinetic_energy + run.potential_energy + run.dissipated_energy).values
        assert energy - energy[0] == pytest.approx(work - work[0], abs=1e-7)

    def test_section_loads_start_with_the_joints_load(self, tmp_path):
        model, q, v, _ = self.closed()
        run = lw.simulate(model, duration=0.02, every=0.01, q0=q, v0=v, output=tmp_path / "run")
        again = lw.open_run(run.path)
        inside = lw.loads.section_loads(again, "coupler", 5).section_load
        load = again.joint_load.sel(joint="b").values
        assert inside.isel(section=0).values == pytest.approx(load, abs=1e-9 * np.abs(load).max())
        assert again.determinate.values.all()

    def test_bearings_share_what_elastic_links_leave_open(self):
        """Two hinges side by side hold the same five directions twice."""

        def twice(builder):
            there = {"translation": (COUPLER, 0, 0), "child_translation": (ROCKER, 0, 0)}
            builder.add_loop("c2", "revolute", "coupler", "rocker", axis=(0, 0, 1), **there)

        model, q, v, _ = self.closed(twice)
        report = lw.indeterminacy(model, q)
        assert (report.rows, report.rank) == (10, 5)
        names = [*model.joint_names, "c", "c2"]
        both = report.determinate[[names.index("c"), names.index("c2")]]
        assert not both[:, :5].any()
        single, *_ = self.closed()
        whole = lw.joint_loads(single, q, v)[-1]
        stiff, soft = ({"radial": k, "axial": k, "tilt": k} for k in (1e9, 5e8))
        shared = model.with_bearing("c", **stiff).with_bearing("c2", **soft)
        loads = lw.joint_loads(shared, q, v)
        assert loads[-2] + loads[-1] == pytest.approx(whole, abs=1e-8 * np.abs(whole).max())
        assert loads[-2, :5] == pytest.approx(2 * loads[-1, :5], abs=1e-8 * np.abs(whole).max())

    def test_all_constraint_forces_at_once_give_the_same(self):
        model, q, v, _ = self.closed()
        want = lw.forward_dynamics(model, q, v, method="articulated_body", passive=True)
        for solver, bits in (("thomas", 1e-10), ("conjugate_gradient", 1e-6)):
            given = {"method": "constraint_force", "solver": solver, "passive": True}
            a = lw.forward_dynamics(model, q, v, **given)
            np.testing.assert_allclose(a, want, rtol=0, atol=bits * np.abs(want).max())
        loads = [
            lw.joint_loads(model, q, v, method=name, passive=True)
            for name in ("constraint_force", "articulated_body")
        ]
        np.testing.assert_allclose(*loads, rtol=0, atol=1e-9 * np.abs(loads[1]).max())
        with pytest.raises(lw.InputError, match="takes trees, and this machine has closed loops"):
            lw.forward_dynamics(model, q, v, method="constraint_force", solver="two_level")


def test_joints_of_loops_are_at_the_ends_of_a_flexible_link():
    def frame(at):
        builder = lw.ModelBuilder("frame")
        for name in ("base", "post", "bar"):
            builder.add_link(name, mass=1.0, inertia=np.eye(3))
        builder.add_joint("foot", "spherical", "base", "post")
        builder.add_joint("head", "revolute", "post", "bar", translation=(1, 0, 0))
        builder.add_rod("stay", "base", "post", point=(0, 2, 0), child_point=at, length=2.0)
        builder.make_flexible("post", section=lw.Section.round(0.05), E=E, G=G)
        return builder.build()

    assert frame((1, 0, 0)).n_loops == 1
    with pytest.raises(lw.InputError, match="'head' and 'stay' are at different points of it"):
        frame((0.5, 0, 0))
    # Where the beam starts a rod holds its frame, which nothing bends.
    model = frame((0, 0, 0))
    assert lw.indeterminacy(model, model.initial_configuration()).rank == 0


def test_a_body_of_finite_elements_in_a_loop_accelerates_as_one_dense_matrix_says():
    rng = np.random.default_rng(5)
    nodes = np.array([[x, y, z] for x in (0.0, 1.0, 2.0) for y, z in ((0, 0.2), (0.2, 0), (0, 0))])
    stiffness, mass = np.zeros((27, 27)), 0.5 * np.eye(27)
    for i in range(9):
        for j in range(i):
            d = nodes[j] - nodes[i]
            at = np.r_[3 * i : 3 * i + 3, 3 * j : 3 * j + 3]
            stiffness[np.ix_(at, at)] += 1e6 / (d @ d) ** 1.5 * np.outer(np.r_[-d, d], np.r_[-d, d])
    ends = {"inboard": [0, 1, 2], "outboard": [6, 7, 8]}
    body = lw.FlexibleBody.from_matrices(mass, stiffness, nodes, ends, modes=2)
    end = nodes[6:].mean(axis=0) - nodes[:3].mean(axis=0)

    def machine(closed):
        builder = lw.ModelBuilder("stayed")
        builder.add_link("base")
        builder.add_link("boom")
        builder.add_link("load", mass=2.0, inertia=np.eye(3))
        builder.add_joint("foot", "spherical", "base", "boom")
        builder.add_joint("hook", "spherical", "boom", "load", translation=end)
        if closed:
            pin = {"translation": end, "child_translation": end}
            builder.add_loop("pin", "spherical", "base", "boom", **pin)
        builder.make_flexible("boom", body=body)
        return builder.build()

    free, model = machine(False), machine(True)
    q = model.initial_configuration()
    q[model.q_slice("boom:1")] = 1e-3 * rng.normal(size=body.n)
    found = lw.assemble(model, q, rng.normal(size=model.nv))
    q, v, rest, tau = found.q, found.v, np.zeros(model.nv), rng.normal(size=model.nv)
    K = lw.frame_jacobian(free, q, "boom:end")[:3]
    full = np.block([[lw.mass_matrix(free, q), K.T], [K, np.zeros((3, 3))]])
    asked = -lw.frame_acceleration(free, q, v, rest, "boom:end")[:3]
    right = np.r_[tau - lw.inverse_dynamics(free, q, v, rest), asked]
    want = np.linalg.solve(full, right)[: model.nv]
    got = lw.forward_dynamics(model, q, v, tau)
    assert np.abs(got - want).max() < 1e-9 * np.abs(want).max()
