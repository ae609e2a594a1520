"""Shapes of links: the box with a link's inertia, unit meshes, and frames as viser wants them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from linkwise.base import Array

_THINNEST = 0.02  # of the longest edge: a link without thickness would not be seen


class Mesh(NamedTuple):
    """Vertices (n, 3) and triangles (m, 3), counterclockwise seen from outside."""

    vertices: Array
    faces: npt.NDArray[np.int64]


class Boxes(NamedTuple):
    """Edges (n, 3) [m] and axes (n, 3, 3) of one box per link; edges 0 where a link has none."""

    edges: Array
    axes: Array


def equivalent_boxes(masses: Array, inertias: Array) -> Boxes:
    """The uniform boxes with these masses (n,) and central inertias (n, 3, 3).

    A box with edges a, b, c has the principal inertia m (b^2 + c^2) / 12 about a, so that
    a^2 = 6 (I_b + I_c - I_a) / m.
    """
    principal, axes = np.linalg.eigh(inertias)
    axes[np.linalg.det(axes) < 0, :, 0] *= -1
    heavy = masses > 0
    squares = 6 * (principal.sum(axis=1, keepdims=True) - 2 * principal)
    squares = np.divide(
        squares, masses[:, None], out=np.zeros_like(principal), where=heavy[:, None]
    )
    edges = np.sqrt(np.maximum(squares, 0.0))
    return Boxes(np.maximum(edges, _THINNEST * edges.max(axis=1, keepdims=True)), axes)


def unit_box() -> Mesh:
    """Edges of 1 around the origin; every side has its own corners, so that edges look sharp."""
    square = np.array([[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]) / 2
    sides = [np.roll(square * [1, 1, sign], k, axis=1) for k in range(3) for sign in (1, -1)]
    faces = [
        np.array([[0, 1, 2], [0, 2, 3]])[:, :: 1 if side % 2 == 0 else -1] + 4 * side
        for side in range(6)
    ]
    return Mesh(np.concatenate(sides), np.concatenate(faces))


def turned(profile: npt.ArrayLike, sides: int) -> Mesh:
    """The surface that a profile of (radius, height) rows, upwards, makes when turned about z."""
    rows = np.asarray(profile, dtype=float)
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    vertices = np.concatenate(
        [np.column_stack([radius * ring, np.full(sides, height)]) for radius, height in rows]
    )
    return Mesh(vertices, _bands(len(rows), sides))


def _bands(rings: int, sides: int) -> npt.NDArray[np.int64]:
    """Triangles between neighbouring rings of `sides` vertices each."""
    here = np.arange(sides)
    after = (here + 1) % sides
    faces = []
    for low in range(0, (rings - 1) * sides, sides):
        high = low + sides
        faces.append(np.column_stack([low + here, low + after, high + after]))
        faces.append(np.column_stack([low + here, high + after, high + here]))
    return np.concatenate(faces)


def unit_cylinder(sides: int = 24) -> Mesh:
    """Radius 1 and length 1 along z around the origin, with lids that look flat."""
    half = 0.5
    return turned([(0, -half), (1, -half), (1, -half), (1, half), (1, half), (0, half)], sides)


def unit_sphere(sides: int = 16) -> Mesh:
    latitude = np.linspace(-np.pi / 2, np.pi / 2, sides // 2 + 1)
    return turned(np.column_stack([np.cos(latitude), np.sin(latitude)]), sides)


def unit_arrow(sides: int = 10) -> Mesh:
    """From the origin to z = 1."""
    return turned([(0, 0), (0.022, 0), (0.022, 0.78), (0.065, 0.78), (0, 1)], sides)


def dashed_arrow(sides: int = 10) -> Mesh:
    """As `unit_arrow`, with gaps in its shaft."""
    ends = np.linspace(0, 0.78, 6)
    dashes = [
        turned([(0, low), (0.022, low), (0.022, low + 0.095), (0, low + 0.095)], sides)
        for low in ends[:-1]
    ]
    return joined([*dashes, turned([(0, 0.78), (0.065, 0.78), (0, 1)], sides)])


def joined(meshes: list[Mesh]) -> Mesh:
    """All of them as one."""
    counts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [mesh.faces + first for mesh, first in zip(meshes, counts[:-1], strict=True)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def dashed_arc(sides: int = 6, pieces: int = 28) -> Mesh:
    """As `unit_arc`, with gaps: every other one of its pieces but for the head."""
    whole = unit_arc(sides, pieces)
    band = len(whole.faces) // (pieces + 1)
    at = np.arange(len(whole.faces)) // band
    return Mesh(whole.vertices, whole.faces[(at % 4 < 2) | (at >= pieces)])


def unit_arc(sides: int = 6, pieces: int = 28) -> Mesh:
    """Three quarters of a circle of radius 0.5 about z, with a head: a right-handed moment."""
    turn = 1.5 * np.pi
    angle = np.concatenate([np.linspace(0, 0.85 * turn, pieces), [0.85 * turn, turn]])
    thick = np.concatenate([[0], np.full(pieces - 1, 0.018), [0.06, 0]])
    around = 2 * np.pi * np.arange(sides) / sides
    outward = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    upward = np.array([0.0, 0.0, 1.0])
    spokes = (
        np.cos(around)[None, :, None] * outward[:, None] - np.sin(around)[None, :, None] * upward
    )
    vertices = 0.5 * outward[:, None] + thick[:, None, None] * spokes
    return Mesh(vertices.reshape(-1, 3), _bands(len(angle), sides))


def quaternions(rotations: Array) -> Array:
    """Rotation matrices (..., 3, 3) as unit quaternions (..., 4), scalar first.

    Of the four formulas the one with the largest divisor is taken, matrix by matrix.
    """
    R = rotations
    trace = np.trace(R, axis1=-2, axis2=-1)
    four_squares = np.stack([1 + trace, *(1 - trace + 2 * R[..., k, k] for k in range(3))], axis=-1)
    best = np.argmax(four_squares, axis=-1)
    a = R[..., 2, 1] - R[..., 1, 2]
    b = R[..., 0, 2] - R[..., 2, 0]
    c = R[..., 1, 0] - R[..., 0, 1]
    xy, xz, yz = (R[..., i, j] + R[..., j, i] for i, j in ((0, 1), (0, 2), (1, 2)))
    w2, x2, y2, z2 = np.moveaxis(four_squares, -1, 0)
    rows = np.stack(
        [
            np.stack(row, axis=-1)
            for row in ((w2, a, b, c), (a, x2, xy, xz), (b, xy, y2, yz), (c, xz, yz, z2))
        ],
        axis=-2,
    )
    chosen = np.take_along_axis(rows, best[..., None, None], axis=-2)[..., 0, :]
    return np.asarray(chosen / np.linalg.norm(chosen, axis=-1, keepdims=True))


def turning_z_to(directions: Array) -> Array:
    """Quaternions (n, 4) that turn z into the unit vectors (n, 3) by the shortest way."""
    x, y, z = directions.T
    out = np.stack([1 + z, -y, x, np.zeros_like(z)], axis=1)
    out[z < -1 + 1e-9] = (0, 1, 0, 0)
    return np.asarray(out / np.linalg.norm(out, axis=1, keepdims=True))
