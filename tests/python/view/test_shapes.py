"""Boxes with a link's inertia, meshes that are closed, frames as quaternions."""

import numpy as np
import pytest

from linkwise.view.shapes import (
    equivalent_boxes,
    quaternions,
    turning_z_to,
    unit_arc,
    unit_arrow,
    unit_box,
    unit_cylinder,
    unit_sphere,
)


def random_rotation(rng):
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    Q *= np.sign(np.diag(R))
    return Q * np.linalg.det(Q)


def rotation_of(quaternion):
    w, x, y, z = quaternion
    v = np.array([x, y, z])
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * cross + 2 * (np.outer(v, v) - v @ v * np.eye(3))


def test_box_has_the_inertia_it_was_made_from(rng):
    edges, mass = np.array([0.3, 1.2, 0.7]), 5.0
    R = random_rotation(rng)
    squares = edges**2
    inertia = R @ np.diag(mass * (squares.sum() - squares) / 12) @ R.T
    found = equivalent_boxes(np.array([mass]), inertia[None])
    assert np.sort(found.edges[0]) == pytest.approx(np.sort(edges), rel=1e-12)
    axes = found.axes[0]
    assert np.linalg.det(axes) == pytest.approx(1)
    again = axes @ np.diag(mass * ((found.edges[0] ** 2).sum() - found.edges[0] ** 2) / 12) @ axes.T
    assert again == pytest.approx(inertia, abs=1e-12)


def test_links_without_extent_get_no_box():
    found = equivalent_boxes(np.array([0.0, 2.0]), np.zeros((2, 3, 3)))
    assert np.all(found.edges == 0)


def test_thin_rod_keeps_a_visible_thickness():
    found = equivalent_boxes(np.array([1.0]), np.diag([1.0, 1.0, 0.0])[None])
    assert found.edges[0].max() == pytest.approx(np.sqrt(12))
    assert found.edges[0].min() == pytest.approx(0.02 * np.sqrt(12))


@pytest.mark.parametrize("make", [unit_box, unit_cylinder, unit_sphere, unit_arrow, unit_arc])
def test_meshes_are_closed_and_face_outwards(make):
    mesh = make()
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert normals.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
    volume = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert volume > 0


def test_unit_meshes_have_their_sizes():
    for mesh in (unit_box(), unit_cylinder()):
        assert np.ptp(mesh.vertices[:, 2]) == pytest.approx(1)
        assert mesh.vertices[:, 2].max() == pytest.approx(0.5)
    assert np.linalg.norm(unit_sphere().vertices, axis=1) == pytest.approx(1.0)
    assert unit_arrow().vertices[:, 2].min() == 0
    assert unit_arrow().vertices[:, 2].max() == 1


def test_arc_turns_right_handed_about_z():
    rings = unit_arc(sides=6).vertices.reshape(-1, 6, 3).mean(axis=1)
    angle = np.unwrap(np.arctan2(rings[:, 1], rings[:, 0]))
    assert np.all(np.diff(angle) >= -1e-12)
    assert angle[-1] - angle[0] == pytest.approx(1.5 * np.pi)


def test_quaternions_of_rotations(rng):
    turns = [random_rotation(rng) for _ in range(50)]
    turns += [np.eye(3), np.diag([1.0, -1, -1]), np.diag([-1.0, 1, -1]), np.diag([-1.0, -1, 1])]
    for R, quaternion in zip(turns, quaternions(np.array(turns)), strict=True):
        assert rotation_of(quaternion) == pytest.approx(R, abs=1e-12)


def test_z_is_turned_to_any_direction(rng):
    directions = rng.normal(size=(50, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions = np.concatenate([directions, [[0, 0, 1], [0, 0, -1], [1, 0, 0]]])
    for direction, quaternion in zip(directions, turning_z_to(directions), strict=True):
        assert rotation_of(quaternion)[:, 2] == pytest.approx(direction, abs=1e-7)
