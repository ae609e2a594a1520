"""How far loop joints are from being closed, against the frames of both of their links."""

import numpy as np
import pytest

import linkwise as lw
from helpers.closing_frames import closing_frames

TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


def two_links(kind, **options):
    """Two free links that a loop joint of this type joins, its frames turned on both."""
    builder = lw.ModelBuilder("pair")
    builder.add_link("ground")
    for name in ("a", "b"):
        builder.add_link(name, mass=1.0, inertia=np.eye(3))
        builder.add_joint(f"free_{name}", "floating", "ground", name)
    builder.add_loop(
        "l",
        kind,
        "a",
        "b",
        translation=(0.1, 0.2, 0.3),
        rotation=TURN,
        child_translation=(-0.3, 0.1, 0),
        child_rotation=TURN.T,
        **options,
    )
    return builder.build()


def random_state(seed):
    rng = np.random.default_rng(seed)
    q = rng.normal(size=14)
    for k in (3, 10):
        q[k : k + 4] /= np.linalg.norm(q[k : k + 4])
    return q


def between(model, q):
    """Shift and rotation of the child's frame in the parent's."""
    here, there = closing_frames(model, q)[0]
    pose = np.linalg.inv(here) @ there
    return pose[:3, 3], pose[:3, :3]


def angle_of(rotation):
    return np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1))


@pytest.mark.parametrize("seed", range(5))
def test_fixed_and_spherical(seed):
    q = random_state(seed)
    shift, rotation = between(two_links("fixed"), q)
    gap = lw.loop_gaps(two_links("fixed"), q)
    np.testing.assert_allclose(gap, [[np.linalg.norm(shift), angle_of(rotation)]], rtol=1e-10)
    gap = lw.loop_gaps(two_links("spherical"), q)
    np.testing.assert_allclose(gap, [[np.linalg.norm(shift), 0]], rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("seed", range(5))
def test_one_axis(seed):
    q, z = random_state(seed), np.array([0.0, 0, 1])
    shift, rotation = between(two_links("revolute", axis=z), q)
    tilt = np.arccos(rotation[2, 2])
    gap = lw.loop_gaps(two_links("revolute", axis=z), q)
    np.testing.assert_allclose(gap, [[np.linalg.norm(shift), tilt]], rtol=1e-10)
    gap = lw.loop_gaps(two_links("prismatic", axis=z), q)
    beside = rotation.T @ [shift[0], shift[1], 0]  # across the axis as the child has it
    np.testing.assert_allclose(gap, [[np.hypot(*beside[:2]), angle_of(rotation)]], rtol=1e-10)
    assert not lw.loop_gaps(two_links("floating"), q).any()


def test_rods_and_leading_axes():
    model = two_links("spherical").with_rod(
        "r", "a", "b", length=0.5, point=(0, 0, 1), child_point=(1, 0, 0)
    )
    q = np.stack([random_state(seed) for seed in range(4)]).reshape(2, 2, 14)
    gaps = lw.loop_gaps(model, q)
    assert gaps.shape == (2, 2, 2, 2)
    poses = lw.link_poses(model, q[1, 0])
    a, b = (poses[model.link_names.index(name)] for name in "ab")
    length = np.linalg.norm((a @ [0, 0, 1, 1] - b @ [1, 0, 0, 1])[:3])
    np.testing.assert_allclose(gaps[1, 0, 1], [abs(length - 0.5), 0], rtol=1e-12, atol=1e-15)
    assert (model.loop_types, model.loop_nv) == (["spherical", "rod"], [3, 5])


def test_without_loops_there_are_none():
    assert lw.loop_gaps(lw.scenes.chain(2), [0.0, 0.0]).shape == (0, 2)


@pytest.mark.parametrize("name", ["four_bars", "andrews", "bricard", "slider_crank", "stewart"])
def test_published_machines_start_closed(name):
    found = lw.scenes.benchmark(name)
    np.testing.assert_allclose(lw.loop_gaps(found.model, found.q0), 0, atol=1e-12)
