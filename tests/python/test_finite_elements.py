"""Bodies of finite elements: against textbooks, our own beams, and sums over their nodes."""

import itertools
import zipfile

import numpy as np
import pytest
import scipy.sparse as sparse

import linkwise as lw

E, DENSITY, AREA, INERTIA, LENGTH = 70e9, 2700.0, 1e-4, 1e-8, 2.0
EI, PER_LENGTH = E * INERTIA, DENSITY * AREA
HANDLES = {"inboard": [0], "outboard": [12]}


def frame_matrices(n=12, length=LENGTH):
    """Beams of Euler and Bernoulli along x with consistent mass, six dofs per node."""
    h, size = length / n, 6 * (n + 1)
    M, K = np.zeros((size, size)), np.zeros((size, size))
    bend = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]], dtype=float)
    mass = np.array(
        [[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]], dtype=float
    )
    units = np.outer([1, h, 1, h], [1, h, 1, h])
    pull, line = np.array([[1, -1], [-1, 1]]), np.array([[2, 1], [1, 2]]) / 6
    signs = np.outer([1, -1, 1, -1], [1, -1, 1, -1])
    for e in range(n):
        a, b = 6 * e, 6 * (e + 1)
        for dofs, k, m in (
            ([a, b], E * AREA / h * pull, PER_LENGTH * h * line),
            ([a + 3, b + 3], 2 * EI / 2.6 / h * pull, 2 * DENSITY * INERTIA * h * line),
            ([a + 1, a + 5, b + 1, b + 5], EI / h**3 * bend * units, h / 420 * mass * units),
            (
                [a + 2, a + 4, b + 2, b + 4],
                EI / h**3 * bend * units * signs,
                h / 420 * mass * units * signs,
            ),
        ):
            K[np.ix_(dofs, dofs)] += k
            M[np.ix_(dofs, dofs)] += m * (PER_LENGTH if len(dofs) == 4 else 1)
    nodes = np.zeros((n + 1, 3))
    nodes[:, 0] = np.linspace(0, length, n + 1)
    return sparse.csr_matrix(M), sparse.csr_matrix(K), nodes


def rod(modes=8, **more):
    return lw.FlexibleBody.from_matrices(*frame_matrices(), HANDLES, modes=modes, **more)


def cloud(rng, n_nodes=9):
    """A body of three dofs per node that is no beam: springs between all nodes, masses coupled."""
    r = rng.normal(size=(n_nodes, 3))
    size = 3 * n_nodes
    K, mu = np.zeros((size, size)), np.zeros((n_nodes, n_nodes))
    for a, b in itertools.combinations(range(n_nodes), 2):
        d = r[b] - r[a]
        e = np.zeros(size)
        e[3 * a : 3 * a + 3], e[3 * b : 3 * b + 3] = -d, d
        K += 3e3 * rng.random() / (d @ d) * np.outer(e, e)
        share = rng.random() * np.array([[2, 1], [1, 2]]) / 6
        mu[np.ix_([a, b], [a, b])] += share
    return np.kron(mu, np.eye(3)), K, r, mu


def arm(body, *, floating=False, gravity=(0, 0, -9.81), at=None):
    builder = lw.ModelBuilder("arm", gravity=(0, 0, 0) if floating else gravity)
    if floating:
        builder.set_floating_base()
        builder.add_link("boom", mass=1.0)
    else:
        builder.add_link("base")
        builder.add_link("boom", mass=1.0)
        builder.add_joint("hub", "revolute", "base", "boom", axis=(0, 1, 0.3))
    builder.add_link("hand", mass=0.3, com=(0.1, 0.02, 0), inertia=np.diag([0.01, 0.02, 0.015]))
    at = body.axes @ body.outboard if at is None else at
    builder.add_joint("wrist", "revolute", "boom", "hand", axis=(0.2, 0, 1), translation=at)
    builder.make_flexible("boom", body=body)
    return builder.build()


def turned(about, angle):
    about = np.asarray(about) / np.linalg.norm(about)
    K = np.cross(np.eye(3), about) * -1
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


class TestReduction:
    def test_a_cantilever_vibrates_as_textbooks_say(self):
        unit = np.sqrt(EI / (PER_LENGTH * LENGTH**4)) / (2 * np.pi)
        found = rod().frequencies / unit
        # Two planes each; the mesh of 12 elements errs by 6e-6, 2e-4 and 9e-4.
        for k, (exact, error) in enumerate([(3.51602, 1e-5), (22.0345, 2e-4), (61.6972, 1e-3)]):
            assert found[2 * k : 2 * k + 2] == pytest.approx(exact, rel=error)

    @pytest.mark.parametrize("modes", [0, 3, 8])
    def test_loads_at_its_end_bend_it_exactly(self, modes):
        body = rod(modes)
        P = np.concatenate([body.outboard_shift, body.outboard_turn])
        compliance = P @ np.diag(1 / body.stiffness) @ P.T
        L = LENGTH
        assert compliance[0, 0] == pytest.approx(L / (E * AREA), rel=1e-9)
        for shift, turn, sign in ((1, 5, 1), (2, 4, -1)):
            assert compliance[shift, shift] == pytest.approx(L**3 / (3 * EI), rel=1e-9)
            assert compliance[turn, turn] == pytest.approx(L / EI, rel=1e-9)
            assert compliance[shift, turn] == pytest.approx(sign * L**2 / (2 * EI), rel=1e-9)

    def test_it_weighs_what_the_matrices_say(self):
        body = rod()
        assert body.mass == pytest.approx(PER_LENGTH * LENGTH, rel=1e-12)
        assert body.first_moment == pytest.approx([body.mass * LENGTH / 2, 0, 0], abs=1e-12)
        J = body.mass_matrix()[3:6, 3:6]
        assert J[1, 1] == pytest.approx(body.mass * LENGTH**2 / 3, rel=1e-12)
        assert J[0, 0] == pytest.approx(2 * DENSITY * INERTIA * LENGTH, rel=1e-12)
        assert body.rigid_residual < 1e-12
        assert body.outboard == pytest.approx([LENGTH, 0, 0])

    def test_integrals_are_sums_over_nodes(self):
        """With consistent mass of three dofs per node nothing is approximated."""
        M, K, r, mu = cloud(np.random.default_rng(4))
        body = lw.FlexibleBody.from_matrices(
            M, K, r, {"inboard": [0, 1, 2], "outboard": [3, 4, 5]}, modes=4
        )
        r0, phi = body.nodes, body.shapes
        assert r0 == pytest.approx(r - r[:3].mean(axis=0))
        for name, slow in (
            ("mass", mu.sum()),
            ("first_moment", mu.sum(axis=0) @ r0),
            ("second_moment", r0.T @ mu @ r0),
            ("shape_mass", np.einsum("ab,bxk->xk", mu, phi)),
            ("shape_moment", np.einsum("ax,ab,byk->kxy", r0, mu, phi)),
            ("shape_product", np.einsum("axk,ab,byl->klxy", phi, mu, phi)),
        ):
            found = np.asarray(getattr(body, name))
            assert found == pytest.approx(slow, abs=1e-12 * np.abs(slow).max()), name
        # Displacements solve K u = f between the handles, for a load on the outboard one.
        assert np.abs(phi[:3]).max() < 1e-12
        assert np.trace(body.shape_product, axis1=2, axis2=3) == pytest.approx(
            np.diag(body.modal_mass), abs=1e-9 * body.modal_mass.max()
        )

    def test_large_meshes_have_the_modes_of_small_ones(self, monkeypatch):
        dense = rod()
        monkeypatch.setattr("linkwise.flexible.matrices._DENSE", 0)
        assert rod().frequencies == pytest.approx(dense.frequencies, rel=1e-9)

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"M": lambda M: M[:-1, :-1]}, "M has shape (77, 77), with 13 nodes"),
            ({"K": lambda K: sparse.triu(K)}, "K is not symmetric"),
            ({"K": lambda K: K + 1e3 * sparse.eye(78)}, "K resists rigid motion"),
            ({"M": lambda M: 0 * M}, "M is zero"),
            ({"M": lambda M: M @ sparse.diags(np.tile([1, 0, 1, 1, 1, 1.0], 13))}, "not symmetric"),
            ({"K": lambda K: np.nan * K}, "K is not finite"),
            ({"mass": 1.0}, "M weighs 0.54 kg, and mass says 1"),
            ({"modes": 35}, "0 to 34"),
            ({"modes": "many"}, "modes is many"),
            ({"handles": {"outboard": [1]}}, 'has no "inboard"'),
            ({"handles": {"inboard": []}}, "'inboard' has no nodes"),
            ({"handles": {"inboard": [13]}}, "0 to 12"),
            ({"handles": {"inboard": [0, 3], "outboard": [3]}}, "node 3 is in both"),
            ({"handles": {"inboard": [0], "tip": [3]}}, "'tip' is one more than a body can have"),
            ({"points": {"tip": (0, 0, 0)}}, "points has 'tip'"),
            ({"damping": -0.1}, "damping is no ratio of 0 or more"),
            ({"nodes": lambda r: r[:, :2]}, "nodes have shape (13, 2)"),
        ],
    )
    def test_what_is_wrong_is_said_in_one_line(self, change, message):
        M, K, nodes = frame_matrices()
        given = {"M": M, "K": K, "nodes": nodes, "handles": HANDLES, "modes": 2}
        for key, value in change.items():
            given[key] = value(given[key]) if callable(value) else value
        with pytest.raises(lw.InputError) as error:
            lw.FlexibleBody.from_matrices(**given)
        assert message in str(error.value)
        assert "\n" not in str(error.value)

    def test_a_handle_on_a_line_does_not_say_how_it_turns(self):
        M, K, r, _ = cloud(np.random.default_rng(4))
        with pytest.raises(lw.InputError, match="are on a line"):
            lw.FlexibleBody.from_matrices(M, K, r, {"inboard": [0, 1]}, modes=2)


class TestMachines:
    def drawn(self, body):
        model = arm(body)
        rng = np.random.default_rng(2)
        return model, 0.02 * rng.normal(size=model.nq), 0.3 * rng.normal(size=model.nv), rng

    @pytest.mark.parametrize("modes", [2, 20, 34])
    def test_inverse_dynamics_gives_the_torques_back(self, modes):
        M, K, r, _ = cloud(np.random.default_rng(4), 20)
        body = lw.FlexibleBody.from_matrices(
            M, K, r, {"inboard": [0, 1, 2], "outboard": [3, 4, 5]}, modes=modes
        ).rotated(turned((1, 2, 3), 0.8))
        model, q, v, rng = self.drawn(body)
        tau = rng.normal(size=model.nv)
        du = lw.forward_dynamics(model, q, v, tau)
        scale = 1 + np.abs(lw.mass_matrix(model, q)).max() * np.abs(du).max()
        assert np.abs(lw.inverse_dynamics(model, q, v, du) - tau).max() < 1e-12 * scale
        H = lw.mass_matrix(model, q)
        assert 0.5 * v @ H @ v == pytest.approx(lw.kinetic_energy(model, q, v), rel=1e-12)
        states = np.outer(np.linspace(0.5, 1.5, 17), q)  # more than fit in lanes
        together = lw.forward_dynamics(model, states, np.tile(v, (17, 1)), np.tile(tau, (17, 1)))
        alone = [lw.forward_dynamics(model, at, v, tau) for at in states]
        assert together == pytest.approx(np.array(alone), rel=1e-9, abs=1e-9 * np.abs(du).max())

    @pytest.mark.parametrize("solver", ["thomas", "conjugate_gradient"])
    def test_constraint_forces_are_the_loads_of_the_recursion(self, solver):
        model, q, v, rng = self.drawn(rod(modes=4))
        tau = rng.normal(size=model.nv)
        given = {"method": "constraint_force", "solver": solver}
        du = lw.forward_dynamics(model, q, v, tau)
        found = lw.forward_dynamics(model, q, v, tau, **given)
        assert found == pytest.approx(du, abs=1e-8 * np.abs(du).max())
        load = lw.joint_loads(model, q, v, tau)
        assert lw.joint_loads(model, q, v, tau, **given) == pytest.approx(
            load, abs=1e-8 * np.abs(load).max()
        )

    def test_coordinates_have_names_and_units(self):
        model = arm(rod(modes=2))
        assert list(model.joint_names) == ["hub", "boom:1", "wrist"]
        run = lw.simulate(model, duration=0.001)
        assert "boom:1.mode8" in run.coordinate.values
        with pytest.raises(lw.InputError, match="'boom' is of finite elements"):
            lw.loads.section_loads(run, "boom", 5)

    def test_energy_is_the_sum_over_nodes(self):
        """Of the deformed body, node by node, without any integral."""
        M, K, r, mu = cloud(np.random.default_rng(4))
        body = lw.FlexibleBody.from_matrices(M, K, r, {"inboard": [0, 1, 2]}, modes=4)
        builder = lw.ModelBuilder("free", gravity=(0.3, 0.2, -9.81))
        builder.set_floating_base()
        builder.add_link("part", mass=1.0)
        builder.make_flexible("part", body=body.rotated(turned((1, 2, 3), 0.8)))
        model = builder.build()
        rng = np.random.default_rng(6)
        q, v = 0.3 * rng.normal(size=model.nq), rng.normal(size=model.nv)
        q[3:7] = [0, 0, 0, 1]
        eta, xi = q[7:], v[6:]
        axes = turned((1, 2, 3), 0.8)
        at = (body.nodes + body.displacement(eta)) @ axes.T
        speed = v[:3] + np.cross(v[3:6], at) + body.displacement(xi) @ axes.T
        kinetic = 0.5 * np.einsum("ax,ab,bx->", speed, mu, speed)
        assert lw.kinetic_energy(model, q, v) == pytest.approx(kinetic, rel=1e-12)
        momentum = np.einsum("ab,bx->x", mu, speed)
        assert lw.momentum(model, q, v)[:3] == pytest.approx(momentum, rel=1e-11, abs=1e-12)
        weight = -np.einsum("ab,bx,x->", mu, at + q[:3], [0.3, 0.2, -9.81])
        strain = 0.5 * eta @ np.diag(body.stiffness) @ eta
        assert lw.potential_energy(model, q) == pytest.approx(weight + strain, rel=1e-12)

    def test_it_moves_as_our_own_beam(self):
        """The same rod, kicked a little, without loads along it."""
        fine = lw.FlexibleBody.from_matrices(
            *frame_matrices(30), {"inboard": [0], "outboard": [30]}, modes=8
        )
        tips = []
        for flexible in (
            {"body": fine},
            {
                "section": lw.Section(area=AREA, Iy=INERTIA, Iz=INERTIA, J=2 * INERTIA),
                "E": E,
                "G": E / 2.6,
                "density": DENSITY,
                "interior_modes": 4,
            },
        ):
            builder = lw.ModelBuilder("rod", gravity=(0, 0, 0))
            builder.add_link("base")
            builder.add_link("boom", mass=1.0)
            builder.add_joint("hub", "fixed", "base", "boom")
            builder.add_link("hand", mass=0.3, inertia=np.diag([0.01, 0.02, 0.015]))
            builder.add_joint("wrist", "fixed", "boom", "hand", translation=(LENGTH, 0, 0))
            builder.make_flexible("boom", **flexible)
            model = builder.build()
            kick = lw.Wrench(lambda t: [0, 0.3 * np.sin(40 * t) ** 2, 0.2 * np.sin(9 * t), 0, 0, 0])
            run = lw.simulate(model, duration=0.3, wrenches={"hand": kick}, tolerance=1e-10)
            hand = model.link_names.index("hand")
            tips.append(lw.link_poses(model, np.asarray(run.position))[:, hand, :3, 3])
        assert np.abs(tips[0][:, 1:]).max() > 1e-3
        assert np.abs(tips[0] - tips[1])[:, 1:].max() < 1e-6

    def test_energy_and_momentum_stay_when_it_tumbles(self):
        model = arm(rod(modes=2), floating=True)
        tolerance = 1e-8
        v0 = 0.5 * np.random.default_rng(3).normal(size=model.nv)
        v0[6:] *= 0.02
        run = lw.simulate(model, duration=0.3, v0=v0, tolerance=tolerance)
        q, v = np.asarray(run.position), np.asarray(run.velocity)
        energy = [
            lw.kinetic_energy(model, *at) + lw.potential_energy(model, at[0])
            for at in zip(q, v, strict=True)
        ]
        assert np.ptp(energy) < 10 * tolerance * (1 + max(map(abs, energy)))
        momentum = np.array([lw.momentum(model, *at) for at in zip(q, v, strict=True)])
        assert np.ptp(momentum, axis=0).max() < 10 * tolerance * (1 + np.abs(momentum).max())

    def test_a_stiff_body_is_a_rigid_one(self):
        """At its equilibrium, as K grows."""
        M, K, nodes = frame_matrices()
        errors = []
        for factor in (1e4, 1e6):
            body = lw.FlexibleBody.from_matrices(M, factor * K, nodes, HANDLES, modes=2)
            model, v = arm(body), np.zeros(arm(body).nv)
            v[0], v[-1] = 0.4, -0.3
            q = np.zeros(model.nq)
            q[0], q[-1] = 0.3, 0.5
            free = slice(1, model.nv - 1)
            H = lw.mass_matrix(model, q)
            for _ in range(3):  # forces of springs that keep the modes from accelerating
                du = lw.forward_dynamics(model, q, v, lw.passive_torque(model, q, v))
                reduced = H[free, free] - H[free, [0, -1]] @ np.linalg.solve(
                    H[np.ix_([0, -1], [0, -1])], H[[0, -1], free]
                )
                q[free] += reduced @ du[free] / (factor_of(model, free))
            du = lw.forward_dynamics(model, q, v, lw.passive_torque(model, q, v))
            rigid = self.rigid(body)
            exact = lw.forward_dynamics(rigid, [0.3, 0.5], [0.4, -0.3])
            errors.append(np.abs(du[[0, -1]] - exact).max() / np.abs(exact).max())
        assert errors[1] < 1e-5
        assert errors[1] < 0.02 * errors[0]

    def rigid(self, body):
        c = body.first_moment / body.mass
        builder = lw.ModelBuilder("rigid")
        builder.add_link("base")
        across = np.eye(3) * (c @ c) - np.outer(c, c)
        inertia = body.mass_matrix()[3:6, 3:6] - body.mass * across
        builder.add_link("boom", mass=body.mass, com=c, inertia=inertia)
        builder.add_link("hand", mass=0.3, com=(0.1, 0.02, 0), inertia=np.diag([0.01, 0.02, 0.015]))
        builder.add_joint("hub", "revolute", "base", "boom", axis=(0, 1, 0.3))
        at = {"axis": (0.2, 0, 1), "translation": body.outboard}
        builder.add_joint("wrist", "revolute", "boom", "hand", **at)
        return builder.build()

    def test_damping_takes_its_share(self):
        """A mode of ratio 0.05, alone: its amplitude falls by exp(-zeta omega t)."""
        body = lw.FlexibleBody.from_matrices(
            *frame_matrices(), {"inboard": [0]}, modes=1, damping=0.05
        )
        builder = lw.ModelBuilder("rod", gravity=(0, 0, 0))
        builder.add_link("base")
        builder.add_link("boom", mass=1.0)
        builder.add_joint("hub", "fixed", "base", "boom")
        builder.make_flexible("boom", body=body)
        model = builder.build()
        run = lw.simulate(model, duration=0.5, q0=[1e-3], tolerance=1e-9)
        omega = 2 * np.pi * body.frequencies[0]
        t, z = np.asarray(run.time), 0.05
        fast = omega * np.sqrt(1 - z**2)
        exact = (
            1e-3 * np.exp(-z * omega * t) * (np.cos(fast * t) + z * omega / fast * np.sin(fast * t))
        )
        assert np.asarray(run.position)[:, 0] == pytest.approx(exact, abs=1e-9)

    def test_what_does_not_fit_is_said(self):
        body = rod(modes=2)
        model = arm(body)
        leaf = lw.FlexibleBody.from_matrices(*frame_matrices(), {"inboard": [0]}, modes=2)
        section = lw.Section.round(0.02)
        for act, message in (
            (lambda: arm(body, at=(1.9, 0, 0)), "joints at (1.9, 0, 0)"),
            (lambda: arm(leaf, at=(2, 0, 0)), "has no outboard handle"),
            (lambda: model.with_flexible("boom", body=body), "is flexible already"),
            (lambda: model.with_flexible("hand", body=3), "give a linkwise.FlexibleBody"),
            (lambda: model.with_flexible("hand", body=leaf, E=E), "E is given beside body"),
            (lambda: model.with_flexible("hand", section=section, E=E), "G is missing"),
            (lambda: model.with_link("boom", mass=3.0), "whose finite elements say"),
            (
                lambda: lw.forward_dynamics(
                    model, np.zeros(model.nq), np.zeros(model.nv), method="composite_rigid_body"
                ),
                "is of kind modal, which method composite_rigid_body does not take",
            ),
        ):
            with pytest.raises(lw.InputError) as error:
                act()
            assert message in str(error.value)
            assert "\n" not in str(error.value)


def factor_of(model, free):
    rest, step = np.zeros(model.nq), np.zeros(model.nq)
    step[free] = 1.0
    return -lw.passive_torque(model, rest + step, np.zeros(model.nv))[free]


class TestInvariants:
    def test_given_integrals_are_those_of_the_body(self):
        body = rod(modes=3)
        again = lw.FlexibleBody.from_invariants(
            mass=body.mass,
            first_moment=body.first_moment,
            second_moment=body.second_moment,
            shape_mass=body.shape_mass,
            shape_moment=body.shape_moment,
            shape_product=body.shape_product,
            stiffness=body.stiffness,
            outboard=body.outboard,
            outboard_shift=body.outboard_shift,
            outboard_turn=body.outboard_turn,
        )
        assert again.parameters() == body.parameters()

    def test_a_full_stiffness_is_brought_to_modes(self):
        body = rod(modes=3)
        mix = np.eye(body.n) + 0.3 * np.random.default_rng(1).normal(size=(body.n, body.n))
        mixed = lw.FlexibleBody.from_invariants(
            mass=body.mass,
            first_moment=body.first_moment,
            second_moment=body.second_moment,
            shape_mass=body.shape_mass @ mix,
            shape_moment=np.einsum("iab,ik->kab", body.shape_moment, mix),
            shape_product=np.einsum("ijab,ik,jl->klab", body.shape_product, mix, mix),
            stiffness=mix.T @ np.diag(body.stiffness) @ mix,
            outboard=body.outboard,
            outboard_shift=body.outboard_shift @ mix,
            outboard_turn=body.outboard_turn @ mix,
        )
        assert mixed.frequencies == pytest.approx(body.frequencies, rel=1e-6)
        one, other = arm(body), arm(mixed)
        eta = 0.01 * np.random.default_rng(2).normal(size=body.n)
        q = np.concatenate([[0.2], eta, [0.4]])
        given = np.linalg.solve(mix, eta)
        p = np.concatenate([[0.2], np.linalg.solve(mixed.basis, given), [0.4]])
        at = lw.link_poses(one, q)
        assert lw.link_poses(other, p) == pytest.approx(at, abs=1e-9)
        for a, b in ((lw.potential_energy(one, q), lw.potential_energy(other, p)),):
            assert b == pytest.approx(a, rel=1e-9)

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"shape_mass": np.zeros((3, 2))}, "shape_mass of a flexible body has shape (3, 2)"),
            ({"mass": 0.0}, "mass of a flexible body is 0.0"),
            ({"stiffness": -np.ones(9)}, "stiffness of a flexible body is negative"),
            ({"second_moment": -np.eye(3)}, "has a negative eigenvalue"),
            ({"outboard_turn": None}, "is given alone"),
            ({"shape_moment": "x"}, "is no array of numbers"),
        ],
    )
    def test_what_is_wrong_is_said(self, change, message):
        body = rod(modes=3)
        names = (
            "mass first_moment second_moment shape_mass shape_moment shape_product stiffness "
            "outboard outboard_shift outboard_turn"
        )
        given = {name: getattr(body, name) for name in names.split()} | change
        with pytest.raises(lw.InputError) as error:
            lw.FlexibleBody.from_invariants(**given)
        assert message in str(error.value)
        assert "\n" not in str(error.value)


class TestFiles:
    def test_a_saved_body_is_the_same(self, tmp_path):
        body = rod(damping=0.01).rotated(turned((0, 0, 1), 0.3))
        body.save(tmp_path / "part.npz")
        again = lw.FlexibleBody.load(tmp_path / "part.npz")
        assert again.parameters() == body.parameters()
        assert np.array_equal(again.shapes, body.shapes)
        with np.load(tmp_path / "part.npz", allow_pickle=False) as file:
            assert float(file["mass"]) == body.mass

    def test_files_that_are_none_are_refused_in_one_line(self, tmp_path):
        path = tmp_path / "part.npz"
        body = rod(modes=1)
        body.save(path)
        good = path.read_bytes()
        arrays = dict(np.load(path))

        def other(**changes):
            with path.open("wb") as file:
                np.savez(file, **(arrays | changes))

        def member(data):
            with zipfile.ZipFile(path, "w") as archive:
                archive.writestr("mass.npy", data)

        huge = b"\x93NUMPY\x01\x00\x76\x00" + (
            b"{'descr': '<f8', 'fortran_order': False, 'shape': (900000000000,), }".ljust(117)
            + b"\n"
        )
        for make, message in (
            (lambda: path.write_bytes(b""), "is damaged or no npz"),
            (lambda: path.write_bytes(good[: len(good) // 2]), "is damaged or no npz"),
            (lambda: path.write_bytes(good[:1500] + b"x" * 40 + good[1540:]), "is damaged"),
            (lambda: other(evil=np.zeros(3)), "holds 'evil'"),
            (lambda: other(mass=np.array({}, dtype=object)), "no 64-bit numbers"),
            (lambda: other(mass=np.zeros(2)), "mass is no single number"),
            (lambda: other(stiffness=np.zeros(3)), "has shape"),
            (lambda: member(huge), "not as long as it says"),
            (lambda: member(b"nothing"), "is damaged or no npz"),
            (lambda: other(stiffness=np.full(7, np.nan)), "is not finite"),
        ):
            make()
            with pytest.raises(lw.InputError) as error:
                lw.FlexibleBody.load(path)
            assert message in str(error.value)
            assert "\n" not in str(error.value)

    def test_a_scenario_takes_a_body_from_a_file(self, tmp_path):
        body = rod(modes=2)
        body.save(tmp_path / "part.npz")
        scenario = tmp_path / "arm.toml"
        text = """
            [model]
            path = "arm.urdf"
            [flexible.boom]
            file = "part.npz"
            damping = 0.02
            [simulate]
            duration = 0.01
            """
        (tmp_path / "arm.urdf").write_text(
            """<robot name="arm"><link name="base"/><link name="boom"/>
            <link name="load"><inertial><mass value="1"/>
            <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
            <joint name="hub" type="continuous"><parent link="base"/><child link="boom"/>
            <axis xyz="0 1 0"/></joint>
            <joint name="hook" type="fixed"><parent link="boom"/><child link="load"/>
            <origin xyz="2 0 0"/></joint></robot>""",
            encoding="utf-8",
        )
        scenario.write_text(text, encoding="utf-8")
        run = lw.run_scenario(scenario)
        assert run.outcome == "converged"
        assert "boom:1.mode1" in run.coordinate.values
        for bad, message in (
            (text.replace("part.npz", "other.npz"), "file cannot be read"),
            (text.replace("damping = 0.02", 'E = "70 GPa"'), "E is given beside file"),
            (text.replace('file = "part.npz"', ""), "section is missing"),
        ):
            scenario.write_text(bad, encoding="utf-8")
            with pytest.raises(lw.InputError) as error:
                lw.run_scenario(scenario)
            assert message in str(error.value)
            assert "\n" not in str(error.value)


def test_a_body_that_bends_too_far_is_said():
    body = rod(modes=0)
    model = arm(body, gravity=(0, 0, 0))
    assert model.flexible_links == {"boom": "modal"}
    for angle, said in ((0.1, 0), (0.3, 1)):
        q0 = np.zeros(model.nq)
        k = int(np.argmax(np.abs(body.outboard_turn[2])))
        q0[1 + k] = angle / body.outboard_turn[2, k]
        run = lw.simulate(model, duration=1e-5, q0=q0)
        told = [w for w in run.warnings if "displacements, linear in its modes" in w["text"]]
        assert [w["element"] for w in told] == ["boom"] * said


def test_models_keep_their_bodies():
    import pickle

    model = arm(rod(modes=2))
    again = pickle.loads(pickle.dumps(model))
    q = 0.01 * np.arange(model.nq)
    assert np.array_equal(
        lw.forward_dynamics(model, q, q * 0), lw.forward_dynamics(again, q, q * 0)
    )
