"""The mass matrix of machines with loops, in all coordinates of the tree and in driven ones, and
torques of motions with rotors and drives on the joints that close the loops."""

import numpy as np
import pytest

import linkwise as lw
from helpers.looped_machines import Machine, chain, closed_rates, rows

ROTOR = {"crank": 0.3, "left": 0.05, "right": 0.2, "rocker": 0.7}


def parallelogram(cut, angle=0.7, **properties):
    """Crank and rocker of 0.5 m on the ground, 1.2 m apart, and a bar between their ends."""
    builder = lw.ModelBuilder("parallelogram", gravity=(0, -9.81, 0))
    builder.add_link("ground", mass=0)
    builder.add_link("crank", mass=2, com=(0.2, 0, 0), inertia=np.diag([0.1, 0.1, 0.4]))
    builder.add_link("bar", mass=3, com=(0.5, 0.1, 0), inertia=np.diag([0.1, 0.1, 0.6]))
    builder.add_link("rocker", mass=1, com=(0.3, 0, 0), inertia=np.diag([0.1, 0.1, 0.2]))
    for name, parent, child, on_parent, on_child in (
        ("crank", "ground", "crank", 0, 0),
        ("left", "crank", "bar", 0.5, 0),
        ("right", "bar", "rocker", 1.2, 0.5),
        ("rocker", "ground", "rocker", 1.2, 0),
    ):
        own = {"axis": (0, 0, 1), "armature": ROTOR[name], **properties}
        if name == cut:
            builder.add_loop(
                name,
                "revolute",
                parent,
                child,
                translation=(on_parent, 0, 0),
                child_translation=(on_child, 0, 0),
                **own,
            )
            continue
        if name == "right":  # hung on the bar's end, from which its other end is half a metre away
            builder.add_link("end", mass=0)
            builder.add_joint(name, "revolute", parent, "end", translation=(on_parent, 0, 0), **own)
            builder.add_joint(
                "rigid", "fixed", "end", "rocker", translation=(-0.5, 0, 0), rotation=np.eye(3)
            )
        else:
            builder.add_joint(name, "revolute", parent, child, translation=(on_parent, 0, 0), **own)
    model = builder.build()
    turns = {"crank": angle, "left": -angle, "right": angle, "rocker": angle}
    q = model.neutral_configuration()
    for name in set(model.joint_names) & set(turns):
        q[model.q_slice(name)] = turns[name]
    return model, q


@pytest.mark.parametrize("cut", ["right", "rocker"])
def test_a_parallelogram_is_its_closed_form(cut):
    """The bar moves without turning, and every joint turns as fast as the crank."""
    model, q = parallelogram(cut)
    of_crank = 0.4 + 2 * 0.2**2
    of_rocker = 0.2 + 1 * 0.3**2
    want = of_crank + of_rocker + 3 * 0.5**2 + sum(ROTOR.values())
    for driven in ROTOR:
        M = lw.mass_matrix(model, q, driven=[driven])
        assert M.shape == (1, 1)
        assert M[0, 0] == pytest.approx(want, rel=1e-12)
    N = lw.driven_jacobian(model, q, ["crank"])
    v = dict(zip(model.joint_names, N[:, 0], strict=False))
    assert v["crank"] == pytest.approx(1, rel=1e-14)
    assert v["left"] == pytest.approx(-1, rel=1e-12)


@pytest.mark.parametrize("cut", ["right", "rocker"])
@pytest.mark.parametrize("driven", ["crank", "rocker", "left"])
def test_torques_are_the_derivative_of_energy_over_the_driven_angle(cut, driven):
    """One way to move: tau = d/dt (M w) - w^2 M' / 2 + V', the derivatives by hand. M is constant
    here, so it is M times the acceleration and the weight along the way."""
    angle, w, speeding = 0.7, 1.3, -0.4
    model, q = parallelogram(cut, angle)
    sign = -1 if driven == "left" else 1
    N = lw.driven_jacobian(model, q, [driven])[:, 0]
    M = lw.mass_matrix(model, q, driven=[driven])[0, 0]
    result = lw.inverse_dynamics(model, q, N * w, N * speeding, driven=[driven], full=True)
    arm = np.cos(angle)
    weight = 9.81 * (2 * 0.2 * arm + 3 * 0.5 * arm + 1 * 0.3 * arm)
    torque = result.tau.sum() + result.loop_tau.sum()
    assert np.count_nonzero(result.tau) + np.count_nonzero(result.loop_tau) == 1
    assert torque == pytest.approx(M * speeding + sign * weight, rel=1e-10)


def with_rotor(machine, inertia):
    """The machine with a rotor on the hinge that closes its first loop, and the row of its rate."""
    model = machine.model.with_joint("loop0", armature=inertia)
    hinge = machine._replace(held=[(*machine.held[0][:4], [5])])
    return Machine(model, *machine[1:]), lambda q: rows(hinge, q)[0]


@pytest.mark.parametrize("seed", range(4))
def test_rotors_of_loop_joints_are_in_the_mass_matrix(seed):
    """H of the open tree and the rotor's row, by Jacobians of frames."""
    machine, row = with_rotor(
        chain(np.random.default_rng(seed), [("revolute", "base", "link6")]), 2.5
    )
    r = row(machine.q)
    H = lw.mass_matrix(machine.model, machine.q)
    want = lw.mass_matrix(machine.tree, machine.q) + 2.5 * np.outer(r, r)
    np.testing.assert_allclose(H, want, rtol=0, atol=1e-11 * np.abs(want).max())
    np.testing.assert_array_equal(H, H.T)
    v = closed_rates(machine, np.random.default_rng(seed))
    assert v @ H @ v / 2 == pytest.approx(lw.kinetic_energy(machine.model, machine.q, v), rel=1e-11)


LOOPS = [("revolute", "base", "link6"), ("spherical", "link2", "link8")]


def one_way_to_move(seed):
    """A chain whose loops leave it one way to move, with a rotor on the first loop joint."""
    rng = np.random.default_rng(seed)
    while True:
        machine, row = with_rotor(chain(rng, LOOPS), 1.7)
        K = rows(machine, machine.q)
        way = np.linalg.svd(K)[2][-1]
        if np.linalg.matrix_rank(K) == 8 and abs(row(machine.q) @ way) > 0.1:
            return machine, row, way


@pytest.mark.parametrize("driven", ["tree", "loop0"])
@pytest.mark.parametrize("seed", range(4))
def test_torques_balance_the_dense_system_with_rotors(seed, driven):
    """H a + h + r^T I (r a + r' v) = tau + K^T f, the forces f from the joints without drives."""
    machine, row, way = one_way_to_move(seed)
    model, q, inertia = machine.model, machine.q, 1.7
    name = f"joint{np.abs(way).argmax()}" if driven == "tree" else driven
    v = 0.8 * way
    step = 1e-5
    demand = -(rows(machine, q + step * v) - rows(machine, q - step * v)) @ v / (2 * step)
    a = np.linalg.lstsq(rows(machine, q), demand, rcond=1e-11)[0] + 1.5 * way
    turned = (row(q + step * v) - row(q - step * v)) @ v / (2 * step)
    r = row(q)
    whole = lw.inverse_dynamics(machine.tree, q, v, a) + inertia * r * (r @ a + turned)
    acts = r if driven == "loop0" else np.eye(model.nv)[model.v_slice(name)][0]
    sides = np.column_stack([rows(machine, q).T, acts])
    forces = np.linalg.lstsq(sides, whole, rcond=1e-12)[0]
    assert np.abs(sides @ forces - whole).max() < 1e-6 * np.abs(whole).max()
    result = lw.inverse_dynamics(model, q, v, a, driven=[name], full=True)
    got = result.loop_tau if driven == "loop0" else result.tau[model.v_slice(name)]
    assert got[0] == pytest.approx(forces[-1], rel=1e-6, abs=1e-6 * np.abs(whole).max())
    # And forward again.
    again = lw.forward_dynamics(model, q, v, result.tau, loop_tau=result.loop_tau)
    np.testing.assert_allclose(again, a, rtol=0, atol=1e-6 * np.abs(a).max())
    loads = lw.joint_loads(model, q, v, result.tau, loop_tau=result.loop_tau)
    np.testing.assert_allclose(result.joint_load, loads, rtol=0, atol=1e-9 * np.abs(loads).max())


@pytest.mark.parametrize("seed", range(4))
def test_the_reduced_matrix_is_that_of_the_null_space(seed):
    """N^T H N, N from a singular value decomposition of K."""
    machine, row, way = one_way_to_move(seed)
    name = f"joint{np.abs(way).argmax()}"
    N = way / way[machine.model.v_slice(name)]
    r = row(machine.q)
    H = lw.mass_matrix(machine.tree, machine.q) + 1.7 * np.outer(r, r)
    M = lw.mass_matrix(machine.model, machine.q, driven=[name])
    assert M[0, 0] == pytest.approx(N @ H @ N, rel=1e-8)
    got = lw.driven_jacobian(machine.model, machine.q, [name])
    np.testing.assert_allclose(got[:, 0], N, rtol=0, atol=1e-8 * np.abs(N).max())
    of_loop = lw.driven_jacobian(machine.model, machine.q, ["loop0"])
    np.testing.assert_allclose(
        of_loop[:, 0], N / (r @ N), rtol=0, atol=1e-7 * np.abs(of_loop).max()
    )


def test_a_stewart_platform_in_its_legs():
    """Rates of the legs are rows of frame Jacobians of the platform: v = N l', and l' is the rate
    of the distance of each leg's ends. The matrix is that of the platform alone in them."""
    machine = lw.scenes.benchmark("stewart")
    model, q = machine.model, machine.q0
    legs = [
        n for n, t in zip(model.joint_names, model.joint_types, strict=True) if t == "prismatic"
    ]
    N = lw.driven_jacobian(model, q, legs)
    assert N.shape == (model.nv, 6)
    np.testing.assert_allclose(N[[model.v_slice(n).start for n in legs]], np.eye(6), atol=1e-11)
    H, M = lw.mass_matrix(model, q), lw.mass_matrix(model, q, driven=legs)
    np.testing.assert_allclose(M, N.T @ H @ N, rtol=0, atol=1e-10 * M.max())
    rng = np.random.default_rng(4)
    rates = rng.normal(size=6)
    closed = lw.assemble(model, q, N @ rates)
    np.testing.assert_allclose(closed.v, N @ rates, rtol=0, atol=1e-9 * np.abs(rates).max())
    both = lw.mass_matrix(model, [q, q], driven=legs)
    np.testing.assert_array_equal(both, [M, M])


def test_couplings_by_polynomials_tie_the_driven_coordinates(rng):
    """Slider = angle + 0.4 angle^2: one slope in N, its square in M."""
    builder = lw.ModelBuilder("cam", gravity=(0, 0, 0))
    builder.add_link("ground", mass=0)
    builder.add_link("shaft", mass=1, inertia=np.diag([1, 1, 0.2]))
    builder.add_link("valve", mass=0.6)
    builder.add_joint("shaft", "revolute", "ground", "shaft", axis=(0, 0, 1), armature=0.1)
    builder.add_joint("valve", "prismatic", "ground", "valve", axis=(1, 0, 0))
    builder.add_coupling("cam", {"valve": 1, "shaft": [-1, -0.4]}, offset=0)
    model = builder.build()
    angle = 0.3
    slope = 1 + 0.8 * angle
    q = np.zeros(2)
    q[model.q_slice("shaft")], q[model.q_slice("valve")] = angle, angle + 0.4 * angle**2
    M = lw.mass_matrix(model, q, driven=["shaft"])
    assert M[0, 0] == pytest.approx(0.2 + 0.1 + 0.6 * slope**2, rel=1e-13)
    v, a = np.zeros(2), np.zeros(2)
    w, speeding = 1.5, 0.7
    at = model.v_slice("shaft"), model.v_slice("valve")
    v[at[0]], v[at[1]] = w, slope * w
    a[at[0]], a[at[1]] = speeding, slope * speeding + 0.8 * w**2
    tau = lw.inverse_dynamics(model, q, v, a, driven=["shaft"])
    want = 0.3 * speeding + slope * 0.6 * (slope * speeding + 0.8 * w**2)
    assert tau[at[0]][0] == pytest.approx(want, rel=1e-13)


def test_a_balance_to_rounding_is_one():
    """Four-bars upright and moving: only rounding accelerates them, and no torque is needed."""
    machine = lw.scenes.benchmark("four_bars")
    a = lw.forward_dynamics(machine.model, machine.q0, machine.v0)
    assert 0 < np.abs(a).max() < 1e-13
    tau = lw.inverse_dynamics(machine.model, machine.q0, machine.v0, a, driven=["A0"])
    np.testing.assert_allclose(tau, 0, atol=1e-12)


def test_the_coordinates_of_a_tree_may_be_driven_too():
    model = lw.scenes.chain(4)
    q = np.linspace(0.1, 0.4, 4)
    names = model.joint_names[::-1]
    M = lw.mass_matrix(model, q, driven=names)
    want = lw.mass_matrix(model, q)[::-1, ::-1]
    np.testing.assert_allclose(M, want, rtol=0, atol=1e-12 * want.max())
    with pytest.raises(lw.InputError, match="3 degrees of freedom and the machine moves in 4"):
        lw.mass_matrix(model, q, driven=names[1:])


def test_what_cannot_be_is_said_in_one_line():
    model, q = parallelogram("right")
    with pytest.raises(lw.InputError, match="'rocker' cannot move by itself"):
        lw.mass_matrix(model, q, driven=["crank", "rocker"])
    with pytest.raises(lw.InputError, match="joint 'x' does not exist"):
        lw.driven_jacobian(model, q, ["x"])
    with pytest.raises(lw.InputError, match="given twice"):
        lw.driven_jacobian(model, q, ["crank", "crank"])
    with pytest.raises(lw.InputError, match="is open: what it joins is"):
        lw.mass_matrix(model, q + 0.1, driven=["crank"])
    with pytest.raises(lw.InputError, match=r"'right' closes a loop, and its torque is loop_tau"):
        lw.inverse_dynamics(model, q, None, None, driven=["right"])
