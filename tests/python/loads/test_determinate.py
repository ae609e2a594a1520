"""Whether rigid bodies determine what is made of joint loads: in other axes, along axes, by cause,
counted, and where joints of loops are held."""

import itertools

import numpy as np
import pytest

import linkwise as lw
from helpers.looped_machines import PLANAR, four_bar

pytestmark = pytest.mark.filterwarnings("ignore::linkwise.ModelWarning")
X, Y, Z = np.eye(3)


def rotation(rng):
    matrix, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return matrix * np.sign(np.linalg.det(matrix))


def skewed(cut="c", **more):
    """A four-bar none of whose joint frames has an axis along the hinges."""
    rng = np.random.default_rng(3)
    return four_bar(cut, frames={name: rotation(rng) for name in "abcd"}, **more)


@pytest.fixture(scope="module")
def run():
    return lw.simulate(skewed(), duration=0.4, every=0.02)


@pytest.fixture(scope="module")
def straight():
    return lw.simulate(four_bar("c"), duration=0.4, every=0.02)


def test_in_other_axes_the_open_directions_are_looked_at(run):
    """In the joints' frames every component is open; in the world's the plane is determined."""
    assert not run.determinate.values.any()
    world = lw.loads.in_frame(run, "world")
    np.testing.assert_array_equal(world.determinate, np.tile(PLANAR, (4, 1)))
    aside = lw.Frame("base", axes=np.deg2rad([0, 0, 30]))
    np.testing.assert_array_equal(
        lw.loads.in_frame(run, aside).determinate, np.tile(PLANAR, (4, 1))
    )
    tilted = lw.Frame("base", axes=np.deg2rad([30, 0, 0]))
    expected = np.tile(np.array([1, 0, 0, 0, 0, 0], dtype=bool), (4, 1))
    np.testing.assert_array_equal(lw.loads.in_frame(run, tilted).determinate, expected)
    one = lw.loads.in_frame(run, "world", joint="c")
    np.testing.assert_array_equal(one.determinate, PLANAR)


def test_the_own_frame_keeps_what_the_run_says(run, straight):
    for made in (run, straight):
        own = lw.loads.in_frame(made, "child")
        np.testing.assert_array_equal(own.determinate, made.determinate)


def test_open_forces_open_moments_about_points_aside():
    """Both hinges of a door hold it across their line: about it no moment is open, beside it is."""
    builder = lw.ModelBuilder("door")
    builder.add_link("wall", mass=0)
    builder.add_link("door", mass=20, com=(0.4, 0, 1), inertia=np.diag([6.0, 8.0, 1.1]))
    builder.add_joint("low", "revolute", "wall", "door", axis=Z)
    high = {"translation": (0, 0, 2), "child_translation": (0, 0, 2)}
    builder.add_loop("high", "revolute", "wall", "door", axis=Z, **high)
    door = lw.simulate(builder.build(), duration=0.2)
    about = lw.loads.in_frame(door, "world", point=(0, 0, 0.5))
    np.testing.assert_array_equal(about.determinate[:, 5], [True, True])
    beside = lw.loads.in_frame(door, "world", point=(1, 0, 0))
    assert not beside.determinate.values.any()


def test_trees_have_no_marks():
    tree = lw.simulate(lw.scenes.chain(3), duration=0.1)
    assert "determinate" not in lw.loads.in_frame(tree, "world").coords
    assert "determinate" not in lw.loads.quantities(tree).coords
    assert "determinate" not in lw.loads.split_at_peaks(tree)


def test_along_an_axis_that_is_askew_in_its_frame(run, straight):
    """The radial force and the torque lie in the plane, however the joint frames are turned."""
    for made in (run, straight):
        known = lw.loads.quantities(made)["determinate"].all("joint")
        names = {str(name) for name in known["quantity"].values[known.values]}
        assert names == {"radial", "torque", "drive_power"}
        summary = lw.loads.summary(made).determinate
        np.testing.assert_array_equal(summary.all("joint"), known)


def test_without_all_positions_it_is_open_as_soon_as_a_part_is():
    few = lw.simulate(skewed(), duration=0.1, joints=["b"], record=["joint_load"])
    assert not lw.loads.summary(few).determinate.values.any()


@pytest.mark.parametrize("made", ["cycles", "load_duration", "spectrum"])
def test_what_is_counted_tells_of_its_signal(made, run, straight):
    count = getattr(lw.loads, made)
    for k, component in enumerate(("fx", "fy", "fz", "nx", "ny", "nz")):
        assert bool(count(straight, "c", component)["determinate"]) == PLANAR[k]
        assert not bool(count(run, "c", component)["determinate"])
    for both, known in (("radial", True), ("axial", False), ("force", False)):
        assert bool(count(straight, "c", both)["determinate"]) is known
        assert bool(count(run, "c", both)["determinate"]) is known


def test_shares_of_loads_tell_of_them(straight):
    by_cause = lw.loads.split(straight)
    np.testing.assert_array_equal(by_cause["determinate"], straight.determinate)
    assert not lw.loads.split_at_peaks(straight)["determinate"].values.any()


def test_members_have_their_own_marks():
    many = lw.simulate_batch(
        four_bar("c"), step=1e-3, duration=0.02, q0=np.zeros((2, 3)), record=["joint_load"]
    )
    many["determinate"][1] = True
    found = lw.loads.damage_equivalent(many)
    np.testing.assert_array_equal(found["determinate"][0], np.tile(PLANAR, (4, 1)))
    assert found["determinate"][1].values.all()


@pytest.mark.parametrize("second", [lw.Locked(), lw.Motion(lambda t: (0.0, 0.0, 0.0))])
def test_held_joints_of_loops_count_as_those_of_the_tree(second):
    """Two held hinges fight each other, wherever the loop is cut; one does not."""
    masks = {}
    for cut, held in itertools.product("cd", "cd"):
        model = four_bar(cut)
        one = lw.simulate(model, duration=0.01, drives={held: second})
        np.testing.assert_array_equal(one.determinate, np.tile(PLANAR, (4, 1)))
        both = lw.simulate(model, duration=0.01, drives={"a": lw.Locked(), held: second})
        masks[cut, held] = both.determinate.sel(joint=list("abcd")).values
        free = {"c": "bd", "d": "bc"}[held]
        assert not both.determinate.sel(joint=["a", held]).values.any()
        for name in free:  # hinges that are free carry no torque, whoever fights
            assert both.determinate.sel(joint=name).values.tolist() == [False] * 5 + [True]
        world = lw.loads.in_frame(both, "world").determinate
        np.testing.assert_array_equal(world, both.determinate)
    for held in "cd":
        np.testing.assert_array_equal(masks["c", held], masks["d", held])


def welded(*, keep_fixed, reverse):
    """A four-bar whose coupler ends in a plate that is screwed to it; loops close at the plate."""
    builder = lw.ModelBuilder("welded", gravity=(0.3, -9.0, 1.0))
    builder.add_link("base", mass=0)
    for name in ("crank", "coupler", "plate", "rocker"):
        builder.add_link(name, mass=1.5, com=(0.2, 0.1, 0.05), inertia=np.diag([0.1, 0.2, 0.15]))
    builder.add_joint("a", "revolute", "base", "crank", axis=Z)
    builder.add_joint("b", "revolute", "crank", "coupler", axis=Z, translation=(0.2, 0.5, 0))
    builder.add_joint(
        "screws",
        "fixed",
        "coupler",
        "plate",
        translation=(0.6, 0.2, 0.1),
        rotation=rotation(np.random.default_rng(4)),
    )
    builder.add_joint("d", "universal", "base", "rocker", axes=(Z, X), translation=(1.3, -0.1, 0))
    model = builder.build(keep_fixed=keep_fixed)
    at = lw.frame_pose(model, np.zeros(model.nq), "plate")
    point = np.linalg.inv(at) @ (1.1, 0.9, 0, 1)
    ends = [("plate", point[:3]), ("rocker", np.array((1.1, 0.9, 0)) - (1.3, -0.1, 0))]
    (parent, here), (child, there) = ends[::-1] if reverse else ends
    return model.with_loop(
        "c", "spherical", parent, child, translation=here, child_translation=there
    )


@pytest.mark.parametrize("reverse", [False, True])
def test_merged_joints_carry_what_joints_of_loops_ask_for(reverse):
    """The recursion with the weld as a joint is the other computation."""
    merged, kept = (
        lw.simulate(
            welded(keep_fixed=keep_fixed, reverse=reverse), duration=0.3, every=0.05, tolerance=1e-9
        )
        for keep_fixed in (False, True)
    )
    assert [name for name, _, _ in merged.load_model().welds] == ["screws"]
    assert merged.determinate.values.all()
    found = lw.loads.in_frame(merged, "child", joint="screws")
    expected = kept.joint_load.sel(joint="screws")
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * np.abs(expected).max().item())
    assert found["determinate"].values.all()
