"""Elastic links: against closed forms, published numbers, rigid machines and their own energy."""

import numpy as np
import pytest

import linkwise as lw

E, G = 70e9, 26e9


def machine(*, bodies=1, interior_modes=2, stretches=True, modulus=E, damping=0.0, gravity=None):
    """An arm with an elastic upper link that lies across its frame, and a hand on a hinge."""
    builder = lw.ModelBuilder("arm", gravity=gravity)
    builder.add_link("base")
    builder.add_link("boom", mass=6.0, com=(0.75, 0.4, -0.15), inertia=np.diag([0.3, 1.0, 1.2]))
    builder.add_link("hand", mass=1.5, com=(0.1, 0.02, 0.03), inertia=np.diag([0.01, 0.02, 0.015]))
    hub = {"axis": (0, 1, 0.3), "translation": (0.1, 0.2, 0.3)}
    builder.add_joint("hub", "revolute", "base", "boom", **hub)
    wrist = {"axis": (1, 0.2, 0.4), "translation": (1.5, 0.8, -0.3)}
    builder.add_joint("wrist", "revolute", "boom", "hand", **wrist)
    builder.make_flexible(
        "boom",
        section=lw.Section.tube(0.05, 0.002),
        E=modulus,
        G=modulus * G / E,
        bodies=bodies,
        interior_modes=interior_modes,
        stretches=stretches,
        damping=damping,
    )
    return builder.build()


def cantilever(
    length, EI, mass_per_length, *, axis=None, EA=1e9, bodies=1, interior_modes=2, stretches=True
):
    """A beam along x on the ground, or on a hinge about `axis`, without gravity."""
    builder = lw.ModelBuilder("cantilever", gravity=(0, 0, 0))
    builder.add_link("base")
    builder.add_link("beam", mass=mass_per_length * length)
    if axis is None:
        builder.add_joint("root", "fixed", "base", "beam")
    else:
        builder.add_joint("root", "revolute", "base", "beam", axis=axis)
    # A modulus that makes the section's own inertia small: the closed forms have none.
    modulus = 1e13
    inertia = EI / modulus
    builder.make_flexible(
        "beam",
        section=lw.Section(area=EA / modulus, Iy=inertia, Iz=inertia, J=2 * inertia),
        E=modulus,
        G=modulus / 3,
        end=(length, 0, 0),
        bodies=bodies,
        interior_modes=interior_modes,
        stretches=stretches,
    )
    return builder.build()


def mass_matrix_by_differences(model, q):
    rest = np.zeros(model.nv)
    bias = lw.inverse_dynamics(model, q, rest, rest)
    return np.array([lw.inverse_dynamics(model, q, rest, e) - bias for e in np.eye(model.nv)]).T


def accelerations(model, q, v, external=None):
    tau = lw.passive_torque(model, q, v)
    return np.asarray(lw.forward_dynamics(model, q, v, tau, external=external))


def at_rest(model, q, v, free, external=None):
    """The position near q in which the free coordinates have no acceleration."""
    q = np.array(q)
    for _ in range(8):
        q[free] -= np.linalg.solve(
            stiffness(model, q, v, free, external), accelerations(model, q, v, external)[free]
        )
    return q


def stiffness(model, q, v, free, external=None):
    step = 1e-6 * np.eye(model.nq)
    return (
        np.array(
            [
                accelerations(model, q + step[k], v, external)[free]
                - accelerations(model, q - step[k], v, external)[free]
                for k in free
            ]
        ).T
        / 2e-6
    )


STATES = [(1, 0, True), (1, 2, False), (3, 1, True), (1, 4, True)]


@pytest.mark.parametrize(("bodies", "interior_modes", "stretches"), STATES)
class TestStates:
    def drawn(self, bodies, interior_modes, stretches):
        model = machine(bodies=bodies, interior_modes=interior_modes, stretches=stretches)
        rng = np.random.default_rng(bodies + 10 * interior_modes)
        q = rng.normal(size=model.nq) * 0.02
        return model, q, rng.normal(size=model.nv) * 0.3, rng.normal(size=model.nv)

    def test_inverse_dynamics_gives_the_torques_back(self, bodies, interior_modes, stretches):
        model, q, v, tau = self.drawn(bodies, interior_modes, stretches)
        du = lw.forward_dynamics(model, q, v, tau)
        assert np.abs(lw.inverse_dynamics(model, q, v, du) - tau).max() < 1e-10
        load = lw.joint_loads(model, q, v, tau)
        assert load == pytest.approx(lw.inverse_dynamics_loads(model, q, v, du), abs=1e-10)

    def test_the_mass_matrix_is_that_of_the_kinetic_energy(self, bodies, interior_modes, stretches):
        model, q, v, _ = self.drawn(bodies, interior_modes, stretches)
        H = lw.mass_matrix(model, q)
        assert pytest.approx(H, abs=1e-12 * np.abs(H).max()) == H.T
        assert 0.5 * v @ H @ v == pytest.approx(lw.kinetic_energy(model, q, v), rel=1e-12)
        assert pytest.approx(mass_matrix_by_differences(model, q), abs=1e-10) == H

    def test_velocity_terms_are_those_of_lagrange(self, bodies, interior_modes, stretches):
        model, q, v, _ = self.drawn(bodies, interior_modes, stretches)
        step = 1e-6
        dH = np.array(
            [
                (lw.mass_matrix(model, q + step * e) - lw.mass_matrix(model, q - step * e))
                for e in np.eye(model.nq)
            ]
        ) / (2 * step)
        want = np.einsum("kij,k,j->i", dH, v, v) - 0.5 * np.einsum("ijk,j,k->i", dH, v, v)
        rest = np.zeros(model.nv)
        found = lw.inverse_dynamics(model, q, v, rest) - lw.inverse_dynamics(model, q, rest, rest)
        assert found == pytest.approx(want, abs=1e-7 * (1 + np.abs(want).max()))

    def test_gravity_and_springs_are_the_slope_of_the_potential_energy(
        self, bodies, interior_modes, stretches
    ):
        model, q, _, _ = self.drawn(bodies, interior_modes, stretches)
        step = 1e-6
        slope = np.array(
            [
                lw.potential_energy(model, q + step * e) - lw.potential_energy(model, q - step * e)
                for e in np.eye(model.nq)
            ]
        ) / (2 * step)
        rest = np.zeros(model.nv)
        held = lw.inverse_dynamics(model, q, rest, rest) - lw.passive_torque(model, q, rest)
        assert held == pytest.approx(slope, rel=1e-6, abs=1e-6 * np.abs(slope).max())

    def test_the_port_moves_as_its_jacobian_says(self, bodies, interior_modes, stretches):
        model, q, v, _ = self.drawn(bodies, interior_modes, stretches)
        at = model.link_names.index("hand")
        step = 1e-6

        def place(t):
            return lw.link_poses(model, q + t * v)[at, :3, 3]

        speed = (place(step) - place(-step)) / (2 * step)
        found = lw.frame_velocity(model, q, v, "hand")
        assert found[:3] == pytest.approx(speed, abs=1e-7)
        assert lw.frame_jacobian(model, q, "hand") @ v == pytest.approx(found, abs=1e-12)

    def test_many_states_are_as_one_by_one(self, bodies, interior_modes, stretches):
        model, q, v, tau = self.drawn(bodies, interior_modes, stretches)
        many = q + 0.01 * np.random.default_rng(5).normal(size=(21, model.nq))
        found = lw.forward_dynamics(model, many, v, tau)
        alone = np.array([lw.forward_dynamics(model, one, v, tau) for one in many])
        assert found == pytest.approx(alone, rel=1e-9, abs=1e-9 * np.abs(alone).max())
        assert np.array_equal(found, lw.forward_dynamics(model, many, v, tau, threads=2))

    def test_sections_balance_the_joints(self, bodies, interior_modes, stretches):
        """At its start a beam carries its inboard joint's load, at its end its outboard one's."""
        model, q, v, tau = self.drawn(bodies, interior_modes, stretches)
        du, load = lw.forward_dynamics(model, q, v, tau), lw.joint_loads(model, q, v, tau)
        length = model.beam_lengths["boom"]
        found = _core_section_loads(model, ["boom", "boom"], [0.0, length], q, v, du, load)
        x = np.array([1.5, 0.8, -0.3])
        x /= np.linalg.norm(x)
        z = np.array([0, 0, 1]) - x[2] * x
        z /= np.linalg.norm(z)
        axes = np.stack([x, np.cross(z, x), z], axis=1)
        hub = load[model.joint_names.index("hub")]
        scale = np.abs(load).max()
        assert axes @ found[0, :3] == pytest.approx(hub[:3], abs=1e-12 * scale)
        assert axes @ found[0, 3:6] == pytest.approx(hub[3:], abs=1e-12 * scale)
        end = load[model.joint_names.index("boom:1")]
        assert found[1, :6] == pytest.approx(end, abs=1e-12 * scale)


def _core_section_loads(*given):
    from linkwise import _core

    return _core.section_loads(*given)


@pytest.mark.parametrize(("bodies", "interior_modes"), [(1, 0), (3, 2)])
def test_a_cantilever_bends_as_beams_do(bodies, interior_modes):
    """F L^3 / 3 EI and F L^2 / 2 EI for a small force, exact with any number of modes."""
    length, EI, force = 10.0, 1.4e4, 1e-3
    model = cantilever(length, EI, 1.2, bodies=bodies, interior_modes=interior_modes)
    wrench = np.zeros((model.n_joints, 6))
    wrench[-1, 2] = force
    free = list(range(model.nv))
    q = at_rest(model, np.zeros(model.nq), np.zeros(model.nv), free, wrench)
    tip = lw.link_poses(model, q)[model.link_names.index("beam:end")]
    assert tip[2, 3] == pytest.approx(force * length**3 / (3 * EI), rel=1e-8)
    assert tip[2, 0] == pytest.approx(force * length**2 / (2 * EI), rel=1e-8)


def test_section_loads_of_a_hanging_beam_are_those_of_its_weight():
    """A beam at rest under its weight: w (L - x), w (L - x)^2 / 2; its strains follow with modes
    of degree 4."""
    length, EI, weight = 2.0, 1e6, 30.0 * 9.81
    builder = lw.ModelBuilder("shelf")
    builder.add_link("wall")
    builder.add_link("shelf", mass=60.0)
    builder.add_joint("root", "fixed", "wall", "shelf")
    section = lw.Section(area=1e-3, Iy=EI / E, Iz=EI / E, J=2 * EI / E)
    builder.make_flexible("shelf", section=section, E=E, G=G, end=(length, 0, 0))
    model = builder.build()
    free = list(range(model.nv))
    rest = np.zeros(model.nv)
    q = at_rest(model, np.zeros(model.nq), rest, free)
    load = lw.joint_loads(model, q, rest, lw.passive_torque(model, q, rest))
    x = np.linspace(0, length, 5)
    found = _core_section_loads(model, ["shelf"] * 5, list(x), q, rest, rest, load)
    moment = weight * (length - x) ** 2 / 2
    # The wall carries the shelf, up; its sag turns the sections by 1e-3.
    assert found[:, 2] == pytest.approx(weight * (length - x), rel=1e-5, abs=1e-9)
    assert -found[:, 4] == pytest.approx(moment, rel=1e-5, abs=1e-9)
    assert found[:, 8] == pytest.approx(found[:, 4], rel=1e-4, abs=1e-6 * moment[0])


@pytest.mark.parametrize(
    ("gamma", "flap"), [(0, 3.51602), (2, 4.13732), (5, 6.44954), (10, 11.20233)]
)
@pytest.mark.parametrize(("bodies", "stretches"), [(4, True), (4, False)])
def test_a_spinning_beam_stiffens(gamma, flap, bodies, stretches):
    """Flapping of a rotating cantilever, hub radius 0 [wright1982]; lagging is less by the spin
    itself, sqrt(flap^2 - gamma^2)."""
    length, EI, mass_per_length = 10.0, 1.4e4, 1.2
    unit = np.sqrt(mass_per_length * length**4 / EI)
    model = cantilever(
        length, EI, mass_per_length, axis=(0, 0, 1), EA=1e10, bodies=bodies, stretches=stretches
    ).prescribe(["root"])
    v = np.zeros(model.nv)
    v[0] = gamma / unit
    free = list(range(1, model.nv))
    q = at_rest(model, np.zeros(model.nq), v, free)
    K = stiffness(model, q, v, free)
    step = 1e-3 * np.eye(model.nv)
    D = (
        np.array(
            [
                accelerations(model, q, v + step[k])[free]
                - accelerations(model, q, v - step[k])[free]
                for k in free
            ]
        ).T
        / 2e-3
    )
    n = len(free)
    state = np.block([[np.zeros((n, n)), np.eye(n)], [K, D]])
    found = np.sort(np.abs(np.linalg.eigvals(state).imag))[::2] * unit
    assert found[1] == pytest.approx(flap, rel=1e-4)
    assert found[0] == pytest.approx(np.sqrt(flap**2 - gamma**2), rel=3e-4)


def test_a_blade_lags_as_published_when_it_spins_up():
    """Kane, Ryan and Banerjee's beam, 8 m, to 4 rad/s in 15 s; -0.53375 m at 6.765 s for one that
    bends without stretching, as a chain of rods extrapolated to infinitely many has it."""
    length, speed, time = 8.0, 4.0, 15.0
    model = cantilever(
        length, 566.6, 0.2019, axis=(0, 0, 1), bodies=2, interior_modes=0, stretches=False
    )
    a = 2 * np.pi / time

    def motion(t):
        angle = speed / time * (t * t / 2 + (np.cos(a * t) - 1) / a**2)
        return angle, speed / time * (t - np.sin(a * t) / a), speed / time * (1 - np.cos(a * t))

    run = lw.simulate(model, duration=7.0, tolerance=1e-6, drives={"root": lw.Motion(motion)})
    assert run.outcome == "converged"
    end = model.link_names.index("beam:end")
    tip = lw.link_poses(model, np.asarray(run.position))[:, end, :3, 3]
    angle = np.array([motion(t)[0] for t in np.asarray(run.time)])
    lag = np.cos(angle) * tip[:, 1] - np.sin(angle) * tip[:, 0]
    assert lag.min() == pytest.approx(-0.53375, rel=2e-3)
    assert float(run.time[lag.argmin()]) == pytest.approx(6.765, abs=0.01)


@pytest.mark.parametrize("floating", [False, True])
def test_energy_and_momentum_stay(floating):
    if floating:
        builder = lw.ModelBuilder("free", gravity=(0, 0, 0))
        builder.set_floating_base()
        builder.add_link("hull", mass=3.0, inertia=np.diag([0.3, 0.4, 0.5]))
        builder.add_link("boom", mass=2.0)
        builder.add_joint("root", "fixed", "hull", "boom", translation=(0.2, 0, 0))
        builder.add_link("tip", mass=0.5, inertia=np.diag([0.01, 0.01, 0.02]))
        builder.add_joint("ball", "spherical", "boom", "tip", translation=(0, 1.5, 0))
        builder.make_flexible("boom", section=lw.Section.round(0.02), E=E, G=G, stretches=False)
        model = builder.build()
    else:
        model = machine(stretches=False, gravity=(0, 0, -9.81))
    tolerance = 1e-8
    v0 = 0.5 * np.random.default_rng(3).normal(size=model.nv)
    v0[-8:] *= 0.01
    run = lw.simulate(model, duration=0.5, v0=v0, tolerance=tolerance)
    q, v = np.asarray(run.position), np.asarray(run.velocity)
    energy = [
        lw.kinetic_energy(model, *at) + lw.potential_energy(model, at[0])
        for at in zip(q, v, strict=True)
    ]
    assert np.ptp(energy) < 10 * tolerance * (1 + max(map(abs, energy)))
    if floating:
        momentum = np.array([lw.momentum(model, *at) for at in zip(q, v, strict=True)])
        assert np.ptp(momentum, axis=0).max() < 10 * tolerance * (1 + np.abs(momentum).max())


def test_a_stiff_link_is_a_rigid_one():
    """As E grows, accelerations and loads at its equilibrium become those of the rigid machine."""
    builder = lw.ModelBuilder("rigid")
    soft = machine(modulus=E)
    builder.add_link("base")
    x = np.array([1.5, 0.8, -0.3])
    across = np.eye(3) * (x @ x) - np.outer(x, x)
    builder.add_link("boom", mass=6.0, com=x / 2, inertia=6.0 / 12 * across)
    builder.add_link("hand", mass=1.5, com=(0.1, 0.02, 0.03), inertia=np.diag([0.01, 0.02, 0.015]))
    hub = {"axis": (0, 1, 0.3), "translation": (0.1, 0.2, 0.3)}
    builder.add_joint("hub", "revolute", "base", "boom", **hub)
    builder.add_joint("wrist", "revolute", "boom", "hand", axis=(1, 0.2, 0.4), translation=x)
    rigid = builder.build()
    v = np.array([0.7, -1.1])
    want = np.asarray(lw.forward_dynamics(rigid, [0.3, 0.4], v))
    load = lw.joint_loads(rigid, [0.3, 0.4], v)
    errors = []
    for modulus in (1e11, 1e13):
        model = machine(modulus=modulus)
        q, u = np.zeros(model.nq), np.zeros(model.nv)
        q[[0, -1]], u[[0, -1]] = (0.3, 0.4), v
        names = list(model.joint_names)
        order = [names.index("hub"), names.index("wrist")]
        at = [model.q_slice(name).start for name in ("hub", "wrist")]
        q[:] = 0
        u[:] = 0
        q[at], u[at] = (0.3, 0.4), v
        free = [k for k in range(model.nv) if k not in at]
        q = at_rest(model, q, u, free)
        errors.append(np.abs(accelerations(model, q, u)[at] - want).max() / np.abs(want).max())
        found = lw.joint_loads(model, q, u, lw.passive_torque(model, q, u))[order]
        assert found == pytest.approx(load, rel=1e-2, abs=2e-2 * np.abs(load).max())
    assert errors[1] < 2e-4
    assert errors[1] < 0.1 * errors[0]
    assert soft.nv == len(free) + 2


def test_damped_links_come_to_rest_and_their_work_is_counted():
    model = machine(damping=0.05, stretches=False, interior_modes=0)
    run = lw.simulate(model, duration=0.3, tolerance=1e-7, drives={"hub": lw.Torque(30.0)})
    balance = lw.loads.energy_balance(run)
    assert float(abs(balance.residual).max()) < 1e-5 * float(abs(balance.drive_work).max())
    assert float(run.dissipated_energy[-1]) > 0


def test_a_run_gives_section_loads_along_the_link():
    model = machine(bodies=2, interior_modes=1)
    run = lw.simulate(model, duration=0.02, tolerance=1e-7)
    found = lw.loads.section_loads(run, "boom", 9)
    assert found.section_load.dims == ("time", "section", "component")
    assert float(found.x[-1]) == pytest.approx(np.linalg.norm([1.5, 0.8, -0.3]))
    middle = run.joint_load.sel(joint="boom:1")  # of the first beam on the second
    assert found.section_load[:, 4].values == pytest.approx(middle.values, abs=1e-9)
    assert not np.isnan(found.discretisation_error.sel(component=["fx", "nx", "ny", "nz"])).any()


class TestRefusals:
    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"E": 0.0}, "E is 0; give a positive number in Pa"),
            ({"G": -1.0}, "G is -1; give a positive number in Pa"),
            ({"density": 0.0}, "density is 0; give a positive number in kg/m3"),
            ({"damping": -0.1}, "damping is -0.1; give the damping ratio of its modes, 0 or more"),
            ({"bodies": 0}, "bodies is 0; give the number of beams in a row, 1 to 100000"),
            ({"interior_modes": 5}, "interior_modes is 5; give 0 to 4, or more bodies"),
            ({"end": (0, 0, 0)}, "its ends coincide; give end"),
            ({"z": (1.5, 0.8, -0.3)}, "z is along the beam or zero; give a direction across it"),
            ({"section": 3.0}, "give a linkwise.Section"),
        ],
    )
    def test_a_wrong_number_is_named(self, change, message):
        given = {"section": lw.Section.round(0.05), "E": E, "G": G} | change
        builder = lw.ModelBuilder("arm")
        builder.add_link("base")
        builder.add_link("boom", mass=2.0)
        builder.add_link("hand", mass=1.0, inertia=np.eye(3))
        builder.add_joint("hub", "revolute", "base", "boom")
        builder.add_joint("wrist", "revolute", "boom", "hand", translation=(1.5, 0.8, -0.3))
        with pytest.raises(lw.InputError) as error:
            builder.build().with_flexible("boom", **given)
        assert message in str(error.value)
        assert "\n" not in str(error.value)

    def test_what_elastic_links_do_not_take_is_said(self):
        model = machine()
        q, rod = np.zeros(model.nq), {"length": 1.0}
        section = {"section": lw.Section.round(0.05), "E": E, "G": G}
        for act, message in (
            (lambda: model.with_flexible("boom", **section), "is flexible already"),
            (lambda: model.with_flexible("hand", **section), "carries no joint"),
            (lambda: model.with_flexible("bom", **section), "did you mean 'boom'?"),
            (lambda: model.with_link("boom", mass=3.0), "is an elastic beam"),
            (lambda: model.with_payload("boom", mass=3.0), "hang on the link at its end"),
            (lambda: model.with_joint("boom:1", damping=1.0), "has no properties of its own"),
            (lambda: model.prescribe(["boom:1"]), "its motion cannot be given"),
            (
                lambda: model.with_rod("r", "base", "boom", child_point=(0.1, 0, 0), **rod),
                "let the joint be where it starts, or on the link at its end",
            ),
            (
                lambda: lw.forward_dynamics(model, q, q, method="composite_rigid_body"),
                "is of kind beam, which method composite_rigid_body does not take",
            ),
            (
                lambda: lw.simulate(model, duration=0.1, drives={"boom:1": lw.Torque(1.0)}),
                "is elastic, and its coordinates have no drive",
            ),
        ):
            with pytest.raises(lw.InputError) as error:
                act()
            assert message in str(error.value)

    def test_joints_at_several_points_are_named(self):
        builder = lw.ModelBuilder("arm")
        for name in ("base", "boom", "hand", "tool"):
            builder.add_link(name, mass=1.0, inertia=np.eye(3))
        builder.add_joint("hub", "revolute", "base", "boom")
        builder.add_joint("wrist", "revolute", "boom", "hand", translation=(1, 0, 0))
        builder.add_joint("other", "revolute", "boom", "tool", translation=(0.5, 0, 0))
        builder.make_flexible("boom", section=lw.Section.round(0.05), E=E, G=G)
        with pytest.raises(lw.InputError, match="'wrist' and 'other' are at different points"):
            builder.build()

    def test_a_section_asks_for_what_is_possible(self):
        with pytest.raises(lw.InputError, match="wall of a section"):
            lw.Section.tube(0.05, 0.03)
        with pytest.raises(lw.InputError, match="diameter of a section is -1"):
            lw.Section.round(-1)


def test_sections_have_the_values_of_handbooks():
    square = lw.Section.rectangle(0.1, 0.1)
    assert pytest.approx(0.1406e-4, rel=1e-3) == square.J
    flat = lw.Section.rectangle(0.1, 0.01)
    assert pytest.approx(0.312 * 0.1 * 0.01**3, rel=2e-3) == flat.J
    assert pytest.approx(0.1 * 0.01**3 / 12) == flat.Iy
    tube = lw.Section.tube(0.05, 0.002)
    assert pytest.approx(np.pi / 64 * (0.05**4 - 0.046**4)) == tube.Iy
    box = lw.Section.box(0.05, 0.08, 0.003)
    assert pytest.approx((0.05 * 0.08**3 - 0.044 * 0.074**3) / 12) == box.Iy


def test_models_keep_their_elastic_links(tmp_path):
    import pickle

    model = machine(bodies=2)
    again = pickle.loads(pickle.dumps(model))
    q = 0.01 * np.arange(model.nq)
    assert np.array_equal(
        lw.forward_dynamics(model, q, q * 0), lw.forward_dynamics(again, q, q * 0)
    )
    assert again.beam_lengths == model.beam_lengths
    assert list(model.joint_names) == ["hub", "boom:1", "boom:2", "wrist"]


def test_a_scenario_makes_a_link_of_any_model_elastic(tmp_path):
    (tmp_path / "arm.urdf").write_text(
        """<robot name="arm"><link name="base"/>
        <link name="boom"><inertial><mass value="4"/><origin xyz="0.5 0 0"/>
        <inertia ixx="0.1" iyy="0.4" izz="0.4" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <link name="load"><inertial><mass value="10"/>
        <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="hub" type="continuous"><parent link="base"/><child link="boom"/>
        <axis xyz="0 1 0"/></joint>
        <joint name="hook" type="fixed"><parent link="boom"/><child link="load"/>
        <origin xyz="1 0 0"/></joint></robot>""",
        encoding="utf-8",
    )
    scenario = tmp_path / "arm.toml"
    text = """
        [model]
        path = "arm.urdf"
        [flexible.boom]
        section = "tube"
        diameter = "40 mm"
        wall = "2 mm"
        E = "70 GPa"
        G = "26 GPa"
        damping = 0.01
        [simulate]
        duration = 0.01
        """
    scenario.write_text(text, encoding="utf-8")
    run = lw.run_scenario(scenario)
    assert run.outcome == "converged"
    assert "boom:1.z1" in run.coordinate.values
    # The load is held by the beam's end, whose load is that of its elastic joint.
    for bad, message in (
        (text.replace('wall = "2 mm"', ""), "wall is missing: a tube section is given by"),
        (text.replace('"70 GPa"', '"70 mm"'), "has a unit of length where a pressure belongs"),
        (text.replace("flexible.boom", "flexible.bom"), "the model has no link 'bom'"),
    ):
        scenario.write_text(bad, encoding="utf-8")
        with pytest.raises(lw.InputError) as error:
            lw.run_scenario(scenario)
        assert message in str(error.value)


@pytest.mark.parametrize(("force", "angle"), [(0.3, 0.15), (0.6, 0.3)])
def test_one_beam_errs_by_the_square_of_its_bend(force, angle):
    """A force that stays vertical on a clamped beam, against 16 beams in a row."""
    found = []
    for bodies in (1, 16):
        given = {"EA": 1e6, "bodies": bodies, "interior_modes": 0, "stretches": False}
        model = cantilever(1.0, 1.0, 1.0, **given)
        end = model.link_names.index("beam:end")
        q, rest = np.zeros(model.nq), np.zeros(model.nv)

        def moved(q, model=model, end=end, rest=rest):
            wrench = np.zeros((model.n_joints, 6))
            wrench[-1, :3] = lw.link_poses(model, q)[end, 2, :3] * force
            return accelerations(model, q, rest, wrench)

        step = 1e-6 * np.eye(model.nq)
        for _ in range(12):
            slope = np.array([moved(q + e) - moved(q - e) for e in step]).T / 2e-6
            q = q - np.linalg.solve(slope, moved(q))
        found.append(lw.link_poses(model, q)[end, 2, 3])
    assert found[0] / found[1] - 1 == pytest.approx(0.44 * angle**2, rel=0.05)


def long_boom(bodies):
    """A soft boom that falls from the level and hangs far down."""
    builder = lw.ModelBuilder("boom")
    builder.add_link("wall")
    builder.add_link("boom", mass=3.0)
    builder.add_joint("root", "fixed", "wall", "boom")
    section = lw.Section.round(0.012)
    given = {"section": section, "E": E, "G": G, "end": (2.0, 0, 0), "stretches": False}
    builder.make_flexible("boom", bodies=bodies, interior_modes=0, damping=0.05, **given)
    return builder.build()


def test_a_link_that_bends_too_far_is_said():
    """Once per link, with the bodies to give; not where these follow it."""
    run = lw.simulate(long_boom(1), duration=0.4)
    told = [warning for warning in run.warnings if "bends by" in warning["text"]]
    assert [warning["element"] for warning in told] == ["boom"]
    text = told[0]["text"]
    needed = int(text.rpartition("give bodies = ")[2])
    angle = float(text.partition("bends by ")[2].split()[0])
    q = np.asarray(run.position)
    tip = lw.link_poses(long_boom(1), q)[:, -1]
    turned = np.arccos((np.trace(tip[:, :3, :3].T) - 1) / 2)
    assert angle == pytest.approx(turned.max(), rel=0.05)
    again = lw.simulate(long_boom(needed), duration=0.4)
    assert not [warning for warning in again.warnings if "bends by" in warning["text"]]


def test_members_that_bend_too_far_are_said():
    model = long_boom(1)
    found = lw.simulate_batch(model, step=1e-4, duration=0.4, q0=np.zeros((2, model.nq)))
    assert "member 0: it bends by" in str(found.attrs)
