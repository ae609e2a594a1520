"""All joint constraint forces of machines with flexible links at once: method constraint_force.

Witness: the recursion, which eliminates the same equations body by body.
"""

import numpy as np
import pytest

import linkwise as lw
from linkwise import _core

ROD = {"section": lw.Section.round(0.04), "E": 70e9, "G": 26e9, "density": 2700}
KINDS = [
    ("revolute", ["z"]),
    ("revolute", ["z", "y"]),
    ("spherical", [""]),
    ("fixed", [""]),
]
AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


def chain(n, kind, axes, *, bodies=1, interior_modes=0, payload=0.0):
    builder = lw.ModelBuilder("chain")
    builder.add_link("base")
    for i in range(n):
        builder.add_link(f"link{i}", mass=1.0)
        axis = AXES.get(axes[i % len(axes)])
        given = {} if axis is None else {"axis": axis}
        parent = f"link{i - 1}" if i else "base"
        offset = (1.0 if i else 0.0, 0, 0)
        builder.add_joint(f"joint{i}", kind, parent, f"link{i}", translation=offset, **given)
    if payload:
        builder.add_link("payload", mass=payload, inertia=np.diag([0.1, 0.2, 0.15]))
        builder.add_joint("grip", "fixed", f"link{n - 1}", "payload", translation=(1, 0, 0))
    for i in range(n):
        end = (1, 0, 0) if i == n - 1 and not payload else None
        builder.make_flexible(
            f"link{i}", bodies=bodies, interior_modes=interior_modes, end=end, **ROD
        )
    return builder.build()


def star(depth, mass):
    """Rigid knots among elastic rods on ball joints, three rods to a knot."""
    builder = lw.ModelBuilder("star")
    builder.add_link("base")
    rods = []

    def grow(parent, left):
        for k in range(3):
            name = str(len(rods))
            rods.append(f"rod{name}")
            builder.add_link(f"rod{name}", mass=1)
            builder.add_link(f"knot{name}", mass=mass, inertia=0.01 * mass * np.eye(3))
            builder.add_joint(f"in{name}", "spherical", parent, f"rod{name}")
            turn = 2 * np.pi * k / 3 + 0.3 * left
            tip = (np.cos(turn), np.sin(turn), 0.2)
            builder.add_joint(
                f"out{name}", "spherical", f"rod{name}", f"knot{name}", translation=tip
            )
            if left > 1:
                grow(f"knot{name}", left - 1)

    grow("base", depth)
    for rod in rods:
        builder.make_flexible(rod, **ROD)
    return builder.build()


def state(model, seed):
    rng = np.random.default_rng(seed)
    return 5e-4 * rng.normal(size=model.nq), 0.05 * rng.normal(size=model.nv)


def iterations(model, q, v, tolerance=1e-7):
    method = _core.DynamicsMethod(
        model, method="constraint_force", solver="conjugate_gradient", tolerance=tolerance
    )
    found = method.follow([0.0], q[None], v[None], np.zeros((1, model.nv)), passive=True)
    assert list(found["outcome"]) == ["converged"]
    return int(found["iterations"][0]), found["acceleration"][0]


def everything():
    """A tree with all that joints can be, on and beyond flexible links."""
    builder = lw.ModelBuilder("tree")
    for link, mass in [
        ("base", 0),
        ("hull", 30),
        ("boom", 3),
        ("arm", 2),
        ("hand", 1),
        ("tool", 0.5),
    ]:
        inertia = mass * np.diag([0.02, 0.03, 0.04])
        builder.add_link(link, mass=mass, inertia=inertia, com=(0.05, 0.02, 0.01) if mass else None)
    builder.add_joint("free", "floating", "base", "hull")
    builder.add_joint("slew", "revolute", "hull", "boom", axis=(0, 0.2, 1), armature=0.3, damping=1)
    builder.add_joint("elbow", "revolute", "boom", "arm", axis=(0, 1, 0), translation=(0.8, 0.3, 0))
    builder.add_joint("wrist", "spherical", "arm", "hand", translation=(0.1, 0.7, 0.2))
    builder.add_joint(
        "slide", "prismatic", "arm", "tool", axis=(1, 0, 0), translation=(0.1, 0.7, 0.2)
    )
    for link in ("boom", "arm"):
        builder.make_flexible(link, bodies=2, interior_modes=1, **ROD)
    return builder.build()


def same(model, q, v, tau, bits, **given):
    """Accelerations and loads of two methods."""
    motion = [
        lw.forward_dynamics(model, q, v, tau, method=name, **given)
        for name in ("constraint_force", "articulated_body")
    ]
    loads = [
        lw.joint_loads(model, q, v, tau, method=name, **given)
        for name in ("constraint_force", "articulated_body")
    ]
    for got, want in (motion, loads):
        np.testing.assert_allclose(got, want, rtol=0, atol=bits * np.abs(want).max())


@pytest.mark.parametrize(("kind", "axes"), KINDS)
@pytest.mark.parametrize(("bodies", "payload"), [(1, 0.0), (3, 4.0)])
def test_chains_move_and_load_their_joints_as_by_the_recursion(kind, axes, bodies, payload):
    model = chain(6, kind, axes, bodies=bodies, payload=payload, interior_modes=bodies - 1)
    q, v = state(model, 3)
    rng = np.random.default_rng(4)
    external = rng.normal(size=(model.n_joints, 6))
    same(model, q, v, rng.normal(size=model.nv), 1e-9, external=external, passive=True)


@pytest.mark.parametrize("armature", [0.0, 0.1])
def test_trees_of_all_joints_do_too(armature):
    model = everything().with_joint("elbow", armature=armature)
    rng = np.random.default_rng(8)
    q, v = 0.02 * rng.normal(size=model.nq), 0.3 * rng.normal(size=model.nv)
    external = rng.normal(size=(model.n_joints, 6))
    same(model, q, v, rng.normal(size=model.nv), 1e-10, external=external, passive=True)


def test_runs_follow_the_same_motion():
    model = chain(4, "revolute", ["z", "y"], payload=2.0)
    runs = [
        lw.simulate(model, duration=0.2, method=method, tolerance=1e-9)
        for method in ("constraint_force", "articulated_body")
    ]
    q = [run.position.to_numpy() for run in runs]
    np.testing.assert_allclose(q[0], q[1], rtol=0, atol=1e-7 * np.abs(q[1]).max())


@pytest.mark.parametrize(
    ("kind", "axes", "most"), [(*KINDS[0], 18), (*KINDS[1], 13), (*KINDS[2], 13), (*KINDS[3], 18)]
)
def test_iterations_do_not_grow(kind, axes, most):
    counts = []
    for n in (8, 96, 2000):
        model = chain(n, kind, axes)
        q, v = state(model, n)
        count, a = iterations(model, q, v)
        counts.append(count)
        want = lw.forward_dynamics(model, q, v, passive=True, method="articulated_body")
        assert np.abs(a - want).max() < 1e-5 * np.abs(want).max()
    assert max(counts) <= most
    assert counts[2] <= counts[1] + 1


# [wathen1987] of one cubic element: ball joints [1/2, 3/2], all six directions [.15, 1.85].
@pytest.mark.parametrize(
    ("kind", "axes", "least"),
    [(*KINDS[0], 0.14), (*KINDS[1], 0.14), (*KINDS[2], 0.4999), (*KINDS[3], 0.14)],
)
def test_bodies_bound_the_spectrum(kind, axes, least):
    bounds = []
    for n in (8, 64):
        model = chain(n, kind, axes)
        q, v = state(model, 1)
        found = _core.graph_spectrum(model, q)
        low, high = found.bound
        assert low <= found.found.smallest * (1 + 1e-9)
        assert high >= found.found.largest * (1 - 1e-9)
        assert low > least
        assert high == pytest.approx(2 - low, abs=2e-3)
        assert iterations(model, q, v)[0] <= found.iterations(1e-7)
        bounds.append((low, high))
    np.testing.assert_allclose(bounds[0], bounds[1], rtol=0.02)


@pytest.mark.parametrize("mass", [0.005, 0.5, 50])
def test_rigid_knots_do_not_widen_it(mass):
    model = star(4, mass)
    q, v = state(model, 2)
    found = _core.graph_spectrum(model, q)
    np.testing.assert_allclose(found.bound, (0.5, 1.5), atol=1e-5)
    assert iterations(model, q, v)[0] <= 13


@pytest.mark.parametrize("held", ["corners", "none"])
def test_nets_of_any_size_take_as_many_iterations(held):
    counts = []
    for n in (4, 20):
        model = lw.scenes.net(n, n, held=held)
        rng = np.random.default_rng(n)
        q, v = model.initial_configuration(), np.zeros(model.nv)
        found = _core.graph_spectrum(model, q)
        np.testing.assert_allclose(found.bound, (0.5, 1.5), atol=1e-6)
        assert found.found.smallest >= 0.5 * (1 - 1e-9)
        assert found.found.largest <= 1.5 * (1 + 1e-9)
        tau = rng.normal(size=model.nv)
        method = {"method": "constraint_force", "passive": True}
        direct = lw.forward_dynamics(model, q, v, tau, **method)
        iterated = lw.forward_dynamics(
            model, q, v, tau, solver="conjugate_gradient", tolerance=1e-10, **method
        )
        np.testing.assert_allclose(iterated, direct, rtol=0, atol=1e-6 * np.abs(direct).max())
        counts.append(iterations(model, q, v)[0])
        if n == 4:
            by_recursion = lw.forward_dynamics(
                model, q, v, tau, method="articulated_body", passive=True
            )
            scale = np.abs(by_recursion).max()
            np.testing.assert_allclose(direct, by_recursion, rtol=0, atol=1e-9 * scale)
    assert max(counts) <= 13


def test_rigid_neighbours_have_no_bound():
    builder = lw.ModelBuilder("hands")
    for link in ("base", "boom", "hand", "tool"):
        builder.add_link(link, mass=1, inertia=0.01 * np.eye(3))
    builder.add_joint("root", "revolute", "base", "boom", axis=(0, 0, 1))
    builder.add_joint("wrist", "revolute", "boom", "hand", axis=(0, 0, 1), translation=(1, 0, 0))
    builder.add_joint("grip", "revolute", "hand", "tool", axis=(0, 1, 0), translation=(0.1, 0, 0))
    builder.make_flexible("boom", **ROD)
    model = builder.build()
    found = _core.graph_spectrum(model, np.zeros(model.nq))
    assert found.bound[0] == 0
    assert found.iterations(1e-7) == np.inf


def test_solvers_of_trees_say_what_they_take():
    model = chain(2, "revolute", ["z"])
    q = np.zeros(model.nq)
    with pytest.raises(lw.InputError, match=r"'two_level' takes rigid bodies.*conjugate_gradient"):
        lw.forward_dynamics(model, q, None, method="constraint_force", solver="two_level")
    with pytest.raises(lw.InputError, match=r"takes rigid bodies.*use method constraint_force"):
        lw.ConstraintSystem(model, q)


def test_compare_shows_the_bound():
    from linkwise.compare import compare, free_trajectory

    model = chain(5, "spherical", [""], payload=1.0)
    found = compare(model, free_trajectory(model, 4, 0), time_limit=0.05)
    least, most = found["spectrum_bound"]
    assert 0.4 < least < most < 1.6
    assert found["iterations_bound"] <= 20
    rows = {row["solver"] or row["method"]: row for row in found["rows"] if row["states"]}
    assert {"articulated_body", "thomas", "conjugate_gradient"} <= set(rows)
    assert rows["conjugate_gradient"]["max_iterations"] <= found["iterations_bound"]
    assert rows["thomas"]["error"] < 1e-9
