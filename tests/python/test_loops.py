"""Accelerations and joint loads of machines with closed loops."""

import numpy as np
import pytest

import linkwise as lw

Z = (0, 0, 1)
ROD = {"mass": 1.2, "inertia": np.diag([0.02, 0.03, 0.04])}
# Corners of a four-bar in the plane z = 0, hinges along z.
A, B, C, D = (np.array(p) for p in [(0, 0, 0), (0.3, 0.9, 0), (1.4, 1.1, 0), (1.2, 0, 0)])
ORIGIN = {"crank": A, "coupler": B}


def four_bar(cut, *, joint="revolute", spring=0.0):
    """The hinge `cut` (c or d) closes the loop. Link frames are parallel to the world's."""
    origin = ORIGIN | {"base": A, "rocker": D if cut == "c" else C}
    builder = lw.ModelBuilder("four-bar", gravity=(0, -9.81, 0))
    builder.add_link("base", mass=0)
    for link, middle in (("crank", (A + B) / 2), ("coupler", (B + C) / 2), ("rocker", (C + D) / 2)):
        builder.add_link(link, com=middle - origin[link], **ROD)
    hinges = {
        "a": ("base", "crank", A),
        "b": ("crank", "coupler", B),
        "c": ("coupler", "rocker", C),
        "d": ("base", "rocker", D),
    }
    for name, (parent, child, point) in hinges.items():
        properties = {"stiffness": spring, "damping": spring / 3} if name == "c" else {}
        kind = joint if name == "c" else "revolute"
        axis = {"axis": Z} if kind == "revolute" else {}
        where = {"translation": point - origin[parent]} | axis
        if name == cut:
            where["child_translation"] = point - origin[child]
            builder.add_loop(name, kind, parent, child, **where, **properties)
        else:
            builder.add_joint(name, kind, parent, child, **where, **properties)
    return builder.build()


def rates(model, crank):
    """Rates of a, b, c and d at the drawn position, in the model's order."""
    # Velocity of C along both ways: w_a z x (C - A) + w_b z x (C - B) = w_d z x (C - D).
    w_b, w_d = np.linalg.solve(np.column_stack([(C - B)[:2], -(C - D)[:2]]), -crank * (C - A)[:2])
    by_name = {"a": crank, "b": w_b, "d": w_d, "c": w_d - crank - w_b}
    return np.array([by_name[name] for name in model.joint_names]), by_name


def loads_by_name(model, loads):
    return dict(zip([*model.joint_names, *model.loop_names], loads, strict=True))


def test_loads_stand_behind_those_of_the_tree():
    model = four_bar("c")
    assert (model.n_joints, model.n_loops, model.loop_names) == (3, 1, ["c"])
    loads = lw.joint_loads(model, np.zeros((2, 3)), None)
    assert loads.shape == (2, 4, 6)
    np.testing.assert_array_equal(loads[0], loads[1])


@pytest.mark.parametrize("spring", [0.0, 7.0])
def test_it_does_not_matter_where_the_loop_is_cut(spring):
    answers = []
    for cut in ("c", "d"):
        model = four_bar(cut, spring=spring)
        v, _ = rates(model, 1.7)
        q = np.zeros(3)
        tau = np.where(np.array(model.joint_names) == "a", 2.0, 0.0)
        result = lw.forward_dynamics(model, q, v, tau, passive=True, full=True)
        acceleration = dict(zip(model.joint_names, result.acceleration, strict=True))
        loads = loads_by_name(model, result.joint_load)
        mask = loads_by_name(model, lw.indeterminacy(model, q).determinate)
        answers.append((acceleration, loads, mask))
    (first, loads, mask), (second, other_loads, other_mask) = answers
    for name in first.keys() & second.keys():
        assert first[name] == pytest.approx(second[name], rel=1e-12)
    for name in "abcd":
        np.testing.assert_array_equal(mask[name], [1, 1, 0, 0, 0, 1])
        np.testing.assert_array_equal(mask[name], other_mask[name])
        np.testing.assert_allclose(
            loads[name][mask[name]], other_loads[name][mask[name]], rtol=0, atol=1e-10
        )
    assert loads["c"][5] == pytest.approx(-spring / 3 * rates(four_bar("c"), 1.7)[1]["c"])


def test_repeated_constraints_change_no_acceleration():
    """Hinges hold the plane again and again; a ball at one joint, once less."""
    q = np.zeros(3)
    hinge, ball = four_bar("c"), four_bar("c", joint="spherical")
    v, _ = rates(hinge, 0.8)
    np.testing.assert_allclose(
        lw.forward_dynamics(hinge, q, v), lw.forward_dynamics(ball, q, v), rtol=1e-12
    )
    found = lw.indeterminacy(hinge, q)
    assert (found.rows, found.rank, found.mobility) == (5, 2, 1)
    assert found.self_stresses.shape == (3, 4, 6)
    np.testing.assert_allclose(
        lw.joint_loads(hinge, q, v)[:, [0, 1, 5]],
        lw.joint_loads(ball, q, v)[:, [0, 1, 5]],
        atol=1e-10,
    )


def door(hinges):
    builder = lw.ModelBuilder("door")
    builder.add_link("wall", mass=0)
    builder.add_link("door", mass=20, com=(0.4, 0, 1), inertia=np.diag([6.0, 8.0, 1.1]))
    builder.add_joint("low", "revolute", "wall", "door", axis=Z)
    if hinges == 2:
        high = {"translation": (0, 0, 2), "child_translation": (0, 0, 2)}
        builder.add_loop("high", "revolute", "wall", "door", axis=Z, **high)
    return builder.build()


def test_a_door_on_two_hinges_shares_the_load_of_one():
    q, v = np.array([0.3]), np.array([2.0])
    one = lw.joint_loads(door(1), q, v)[0]
    low, high = lw.joint_loads(door(2), q, v)
    np.testing.assert_allclose(low[:3] + high[:3], one[:3], atol=1e-11)
    moment = low[3:] + high[3:] + np.cross([0, 0, 2], high[:3])
    np.testing.assert_allclose(moment, one[3:], atol=1e-11)
    found = lw.indeterminacy(door(2), q)
    assert (found.rank, len(found.self_stresses), found.mobility) == (0, 5, 1)
    assert not found.determinate[:, :5].any()


def stewart():
    """Six legs of two parts: universal joints on the ground, slides, balls on the platform."""
    angles = np.radians([0, 50, 120, 170, 240, 290])
    feet = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(6)])
    angles = np.radians([20, 30, 140, 150, 260, 270])
    heads = 0.6 * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(6)])
    pose = np.array([0.05, -0.03, 1.2])
    builder = lw.ModelBuilder("hexapod")
    builder.add_link("base", mass=0)
    builder.add_link("platform", mass=8, com=(0.02, 0.01, 0.1), inertia=np.diag([0.7, 0.6, 1.1]))
    builder.add_joint("free", "floating", "base", "platform", translation=pose)
    for i, (foot, head) in enumerate(zip(feet, heads, strict=True)):
        along = pose + head - foot
        length = np.linalg.norm(along)
        z = along / length
        x = np.cross([0.3, 1, 0.1], z)
        x /= np.linalg.norm(x)
        turned = np.column_stack([x, np.cross(z, x), z])
        for part, com in (("lower", 0.3), ("upper", -0.3)):
            builder.add_link(
                f"{part}{i}", mass=0.7, com=(0, 0, com), inertia=np.diag([0.03, 0.03, 0.002])
            )
        builder.add_joint(
            f"foot{i}",
            "universal",
            "base",
            f"lower{i}",
            translation=foot,
            rotation=turned,
            axes=[(1, 0, 0), (0, 1, 0)],
        )
        slide = {"translation": (0, 0, length)}
        builder.add_joint(f"slide{i}", "prismatic", f"lower{i}", f"upper{i}", axis=Z, **slide)
        builder.add_loop(f"head{i}", "spherical", f"upper{i}", "platform", child_translation=head)
    return builder.build(), heads


def test_legs_carry_what_newton_and_euler_ask_of_the_platform():
    model, heads = stewart()
    rng = np.random.default_rng(3)
    q = model.neutral_configuration()
    v = np.zeros(model.nv)
    free = model.v_slice("free")
    v[free] = rng.normal(size=6)
    for i, head in enumerate(heads):  # rates of the legs that follow the platform
        placed = [lw.frame_jacobian(model, q, lw.Frame(f"upper{i}"))[:3], None]
        columns = [
            *range(*model.v_slice(f"foot{i}").indices(model.nv)),
            *range(*model.v_slice(f"slide{i}").indices(model.nv)),
        ]
        velocity = v[free][:3] + np.cross(v[free][3:], head)
        v[columns] = np.linalg.solve(placed[0][:, columns], velocity)
    tau = np.zeros(model.nv)
    for i in range(6):
        tau[model.v_slice(f"slide{i}")] = rng.normal() * 30
    result = lw.forward_dynamics(model, q, v, tau, full=True)
    assert lw.indeterminacy(model, q).mobility == 6
    loads = loads_by_name(model, result.joint_load)
    # All in the platform's axes, which are the world's here, at its origin.
    a = result.acceleration[free]
    m, c, I = 8, np.array([0.02, 0.01, 0.1]), np.diag([0.7, 0.6, 1.1])  # noqa: E741
    w, alpha = v[free][3:], a[3:]
    of_origin = a[:3] + np.cross(w, v[free][:3])  # rates of a floating joint turn with the child
    of_com = of_origin + np.cross(alpha, c) + np.cross(w, np.cross(w, c))
    force = m * (of_com - [0, 0, -9.81])
    moment = I @ alpha + np.cross(w, I @ w) + np.cross(c, force)
    np.testing.assert_allclose(sum(loads[f"head{i}"][:3] for i in range(6)), force, atol=1e-9)
    np.testing.assert_allclose(
        sum(np.cross(head, loads[f"head{i}"][:3]) for i, head in enumerate(heads)),
        moment,
        atol=1e-9,
    )
    for i in range(6):
        np.testing.assert_allclose(loads[f"head{i}"][3:], 0, atol=1e-9)


def test_a_rod_is_two_balls():
    """A rod without mass, and one of a milligram between a ball and a universal joint."""

    def machine(rod):
        builder = lw.ModelBuilder("rod")
        builder.add_link("base", mass=0)
        for i, x in enumerate((0.0, 1.0)):
            builder.add_link(f"arm{i}", mass=2, com=(0.2, 0.4, 0), inertia=np.eye(3) * 0.1)
            builder.add_joint(
                f"hinge{i}",
                "revolute",
                "base",
                f"arm{i}",
                translation=(x, 0, 0),
                axis=(0.1 * i, 0, 1),
            )
        tip = np.array([0.1, 0.8, 0.2])
        if rod:
            builder.add_rod("link", "arm0", "arm1", length=1.0, point=tip, child_point=tip)
        else:
            builder.add_link("rod", mass=1e-6, com=(0.5, 0, 0), inertia=np.eye(3) * 1e-7)
            axes = [(0, 1, 0), (0, 0, 1)]
            builder.add_joint("ball", "universal", "arm0", "rod", translation=tip, axes=axes)
            builder.add_loop(
                "link", "spherical", "rod", "arm1", translation=(1, 0, 0), child_translation=tip
            )
        return builder.build()

    light, massless = machine(rod=False), machine(rod=True)
    want = lw.forward_dynamics(light, np.zeros(light.nq), None)
    got, loads = (f(massless, np.zeros(2), None) for f in (lw.forward_dynamics, lw.joint_loads))
    np.testing.assert_allclose(
        got, [want[light.v_slice(f"hinge{i}")][0] for i in range(2)], rtol=1e-4
    )
    force = loads[2][:3]
    np.testing.assert_allclose(np.delete(force, 0), 0, atol=1e-10)
    assert force[0] == pytest.approx(
        lw.joint_loads(light, np.zeros(light.nq), None)[-1][0], rel=1e-4
    )


def test_states_that_leave_a_loop_open_are_refused():
    model = four_bar("c")
    with pytest.raises(lw.InputError, match=r"joint 'c' is open: .* mm and .* rad apart"):
        lw.forward_dynamics(model, [0.1, 0, 0], None)
    with pytest.raises(lw.InputError, match=r"joint 'c' opens: .* m/s"):
        lw.joint_loads(model, [0, 0, 0], [1, 0, 0])
    with pytest.raises(lw.InputError, match=r"state 1: joint 'c' is open"):
        lw.forward_dynamics(model, [[0, 0, 0], [0, 0.2, 0]], None)


@pytest.mark.parametrize(
    "ask",
    [
        lambda m, name=method["name"]: lw.forward_dynamics(m, np.zeros(3), None, method=name)
        for method in lw.methods()
        if not method["takes_loops"]
    ],
)
def test_what_takes_trees_alone_says_so(ask):
    with pytest.raises(lw.InputError, match=r"closes a loop, and .* takes none"):
        ask(four_bar("c"))


def test_a_method_with_memory_takes_loops():
    machine = lw.scenes.benchmark("stewart")
    q, v = np.tile(machine.q0, (3, 1)), np.tile(machine.v0, (3, 1))
    tau = np.random.default_rng(1).normal(size=(3, machine.model.nv))
    method = lw.DynamicsMethod(machine.model)
    expected = lw.forward_dynamics(machine.model, q, v, tau)
    acceleration, loads, _ = method.evaluate(0.0, q[0], v[0], tau[0])
    np.testing.assert_allclose(acceleration, expected[0], rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(loads, lw.joint_loads(machine.model, q[0], v[0], tau[0]), rtol=1e-10)
    steps = method.follow(np.arange(3.0), q, v, tau)
    np.testing.assert_allclose(steps["acceleration"], expected, rtol=1e-10, atol=1e-10)
    q[1, 0] += 0.1
    with pytest.raises(lw.InputError, match=r"joint 'head_1' is open"):
        method.follow(np.arange(3.0), q, v)


def test_a_linkage_stretched_straight_is_singular():
    """Two equal cranks and a coupler on the line of the ground: the loop may fold two ways."""
    builder = lw.ModelBuilder("straight", gravity=(0, 0, 0))
    builder.add_link("base", mass=0)
    for link in ("crank", "coupler", "rocker"):
        builder.add_link(link, com=(0.5, 0, 0), **ROD)
    builder.add_joint("a", "revolute", "base", "crank", axis=Z)
    builder.add_joint("b", "revolute", "crank", "coupler", translation=(1, 0, 0), axis=Z)
    builder.add_joint(
        "d",
        "revolute",
        "base",
        "rocker",
        translation=(3, 0, 0),
        axis=Z,
        rotation=np.diag([-1.0, -1.0, 1.0]),
    )
    builder.add_loop(
        "c",
        "revolute",
        "coupler",
        "rocker",
        translation=(1, 0, 0),
        child_translation=(1, 0, 0),
        axis=Z,
    )
    model = builder.build()
    assert lw.indeterminacy(model, np.zeros(3)).mobility == 2
    with pytest.raises(lw.NumericsError, match="contradicts itself"):
        lw.forward_dynamics(model, np.zeros(3), [1.0, -2.0, 0.0])


def test_gaps_that_overflow_are_no_numbers_to_go_by():
    far = lw.scenes.chain(2).with_rod("rod", "ground", "link_2", length=1e200, point=(1e200, 0, 0))
    with pytest.raises(lw.NumericsError, match="not finite"):
        lw.loop_gaps(far, far.initial_configuration())
