"""What holds each other in closed loops, and remedies that were tried on the model."""

from __future__ import annotations

import numpy as np
import pytest
from test_bearings import door
from test_loops import four_bar

import linkwise as lw

pytestmark = pytest.mark.filterwarnings("ignore::linkwise.ModelWarning")


def gears(ratio: float = 1 / 6, scale: float = 1.0) -> lw.Model:
    """Three wheels, each geared to the next."""
    builder = lw.ModelBuilder("gears")
    builder.add_link("frame")
    for k in range(3):
        builder.add_link(f"wheel{k}", mass=1, com=(0.1, 0, 0), inertia=0.01 * np.eye(3))
        place = {"axis": (0, 0, 1), "translation": (0.3 * k, 0, 0)}
        builder.add_joint(f"axle{k}", "revolute", "frame", f"wheel{k}", **place)
    builder.add_coupling("first", {"axle1": scale, "axle0": 2 * scale})
    builder.add_coupling("second", {"axle2": 1, "axle1": 3})
    builder.add_coupling("third", {"axle0": 1, "axle2": -ratio})
    return builder.build()


@pytest.mark.parametrize("scale", [1.0, 1e-6, 1e6])
def test_gears_in_a_ring_leave_only_their_own_loads_open(scale: float) -> None:
    model = gears(scale=scale)
    found = lw.indeterminacy(model, np.zeros(3))
    assert (found.rows, found.rank, found.mobility) == (3, 2, 1)
    assert found.determinate.all()
    assert not found.couplings.any()
    (only,) = lw.undecided_loads(model)
    assert only.text == (
        "coupling 'first', coupling 'second' and coupling 'third' hold each other; "
        "one of them repeats the others"
    )
    run = lw.simulate(model, duration=0.01)
    assert run.determinate.all()
    said = [w["text"] for w in run.warnings]
    assert "what couplings 'first', 'second' and 'third' carry" in said[0]
    assert "bearing" not in said[0]


def test_a_coupling_beside_the_ring_is_determinate() -> None:
    builder = lw.ModelBuilder("two")
    builder.add_link("frame")
    for k in range(4):
        builder.add_link(f"wheel{k}", mass=1, inertia=0.01 * np.eye(3))
        builder.add_joint(f"axle{k}", "revolute", "frame", f"wheel{k}", axis=(0, 0, 1))
    builder.add_coupling("once", {"axle0": 1, "axle1": 2})
    builder.add_coupling("again", {"axle0": 2, "axle1": 4})
    builder.add_coupling("alone", {"axle2": 1, "axle3": 2})
    model = builder.build()
    found = lw.indeterminacy(model, np.zeros(4))
    assert found.couplings.tolist() == [False, False, True]


def test_hinges_of_a_door() -> None:
    told = lw.undecided_loads(door("revolute"))
    by_parts = {one.joints["lower"]: one for one in told}
    assert {parts: one.self_stresses for parts, one in by_parts.items()} == {
        ("fz",): 1,
        ("fx", "ny"): 2,
        ("fy", "nx"): 2,
    }
    assert by_parts["fz",].text == (
        "'lower' fz and 'upper' fz hold each other; to decide it, say how stiff their bearings "
        "are ([bearing.JOINT]: axial of 'lower' and 'upper'), or make 'upper' cylindrical"
    )
    assert sum(one.self_stresses for one in told) == 5


@pytest.mark.parametrize(
    ("model", "q"),
    [
        (door("revolute"), None),
        (door("spherical"), None),
        (four_bar("c"), None),
        (four_bar("d"), None),
        (lw.scenes.benchmark("bricard").model, lw.scenes.benchmark("bricard").q0),
    ],
)
def test_every_self_stress_is_told_once(model: lw.Model, q: np.ndarray | None) -> None:
    where = model.initial_configuration() if q is None else q
    found = lw.indeterminacy(model, where)
    told = lw.undecided_loads(model, q)
    assert sum(one.self_stresses for one in told) == len(found.undecided)
    names = [*model.joint_names, *model.loop_names]
    marked = {
        (joint, part) for one in told for joint, parts in one.joints.items() for part in parts
    }
    parts = ("fx", "fy", "fz", "nx", "ny", "nz")
    is_open = {(names[j], parts[c]) for j, c in np.argwhere(~found.determinate)}
    assert marked == is_open
    assert all(one.remedies for one in told)


def test_freed_joints_decide_what_was_said() -> None:
    """By another way than the trial: the machine is built as the sentence says."""
    told = lw.undecided_loads(four_bar("c"))
    assert len(told) == 1
    assert told[0].remedies[1].startswith("make ")
    model = four_bar("c")
    for word in told[0].remedies[1].removeprefix("make ").split(" and "):
        name, kind = word.split()
        model = model.with_joint_type(name.strip("'"), kind)
    found = lw.indeterminacy(model, model.neutral_configuration())
    assert found.mobility == 1
    assert len(found.self_stresses) == 0


def test_bearings_decide_what_was_said() -> None:
    model = door("revolute")
    for joint in ("lower", "upper"):
        model = model.with_bearing(joint, axial=1e8)
    told = lw.undecided_loads(model)
    assert len(told) == 2
    assert all("radial and tilt of 'lower' and 'upper'" in one.text for one in told)
    for joint in ("lower", "upper"):
        model = model.with_bearing(joint, axial=1e8, radial=1e8, tilt=1e5)
    assert lw.undecided_loads(model) == []


def test_runs_say_it() -> None:
    said = [w["text"] for w in lw.simulate(door("revolute"), duration=0.01).warnings]
    assert any(text.startswith("'lower' fz and 'upper' fz hold each other") for text in said)
    locked = lw.simulate(door("revolute"), duration=0.01, drives={"lower": lw.Locked()})
    assert not any("make 'lower'" in w["text"] for w in locked.warnings)
    locked = lw.simulate(door("revolute"), duration=0.01, drives={"upper": lw.Locked()})
    assert any("'lower' fz and 'upper' fz hold each other" in w["text"] for w in locked.warnings)


def test_trees_and_open_loops() -> None:
    assert lw.undecided_loads(lw.scenes.chain(3)) == []
    with pytest.raises(lw.InputError, match="is open"):
        lw.undecided_loads(four_bar("c"), [0.5, 0.1, 0.2])


def test_joints_with_more_freedom() -> None:
    builder = lw.ModelBuilder("arm")
    for link in ("base", "upper", "hand"):
        builder.add_link(link, mass=1, com=(0.2, 0, 0), inertia=0.1 * np.eye(3))
    builder.add_joint("hinge", "revolute", "base", "upper", axis=(0, 0, 1), damping=0.5)
    builder.add_joint("slide", "prismatic", "upper", "hand", axis=(1, 0, 0), stiffness=3.0)
    model = builder.build()
    freed = model.with_joint_type("hinge", "cylindrical").with_joint_type("slide", "cylindrical")
    assert freed.joint_types == ["cylindrical", "cylindrical"]
    np.testing.assert_array_equal(freed.damping, [0, 0.5, 0, 0])
    np.testing.assert_array_equal(freed.stiffness, [0, 0, 3.0, 0])
    ball = model.with_joint_type("hinge", "spherical")
    assert ball.joint_types[0] == "spherical"
    np.testing.assert_array_equal(ball.damping, 0)
    # The same accelerations where the freedom that is new has no force.
    still = builder.build()
    q, v = np.array([0.3, 0.1]), np.array([1.0, 0.2])
    plain = lw.forward_dynamics(still, q, v)
    angle, turn = q[0], v[0]
    quaternion = [0, 0, np.sin(angle / 2), np.cos(angle / 2)]
    moved = lw.forward_dynamics(ball, [*quaternion, q[1]], [0, 0, turn, v[1]])
    assert moved[2] == pytest.approx(plain[0], rel=1e-9)
    for joint, kind, said in (
        ("slide", "spherical", "cannot become spherical"),
        ("hinge", "fixed", "cannot become fixed"),
        ("hinge", "wobbly", "joint type 'wobbly' is unknown"),
        ("elbow", "spherical", "joint 'elbow' does not exist"),
    ):
        with pytest.raises(lw.InputError, match=said):
            model.with_joint_type(joint, kind)
