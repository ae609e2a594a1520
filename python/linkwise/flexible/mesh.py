"""Mass and stiffness of a mesh of tetrahedra, by scikit-fem and meshio."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from linkwise._core import InputError
from linkwise.base import Array
from linkwise.flexible.readers import LARGEST_FILE
from linkwise.io.complaint import file_name, near, shorten


def elements(
    path: str | os.PathLike[str],
    E: float,
    nu: float,
    density: float,
    handles: Mapping[str, str],
    scale: float,
) -> tuple[Any, Any, Array, dict[str, npt.NDArray[np.int64]]]:
    """M, K, nodes and rows of the handles; see `FlexibleBody.from_mesh`.

    Quadratic shape functions on elements with straight edges; of tetrahedra with ten nodes the
    corners are taken.
    """
    try:
        import meshio
        import skfem
        from skfem.models.elasticity import lame_parameters, linear_elasticity
    except ImportError as error:
        raise ImportError(
            "meshes take the packages scikit-fem and meshio; pip install 'linkwise[fem]'"
        ) from error
    for name, value, right in (
        ("E", E, E > 0),
        ("nu", nu, -1 < nu < 0.5),
        ("density", density, density > 0),
        ("scale", scale, scale > 0),
    ):
        if not (right and math.isfinite(value)):
            wanted = "a number above -1 and below 0.5" if name == "nu" else "a number above 0"
            raise InputError(f"{name} of a mesh is {value!r}; give {wanted}")
    if Path(path).stat().st_size > LARGEST_FILE:
        _complain(path, "is larger than 1 GiB", "give a coarser mesh")
    try:
        mesh = meshio.read(path)
    except (
        meshio.ReadError,
        ValueError,
        KeyError,
        IndexError,
        AssertionError,
        SystemExit,
    ) as error:
        _complain(path, f"cannot be read ({shorten(error)})", "give a mesh that meshio reads")
    corners, points = _tetrahedra(path, mesh)
    points = points * scale
    surfaces = {handle: _surface(path, mesh, name) for handle, name in handles.items()}
    used, corners = np.unique(corners, return_inverse=True)
    corners = corners.reshape(-1, 4)
    part = skfem.MeshTet(points[used].T, corners.T.astype(np.int64))
    basis = skfem.Basis(part, skfem.ElementVector(skfem.ElementTetP2()), intorder=4)
    K = linear_elasticity(*lame_parameters(E, nu)).assemble(basis)

    def inertia(u: Any, v: Any, _: Any) -> Any:
        return density * (u[0] * v[0] + u[1] * v[1] + u[2] * v[2])

    M = skfem.BilinearForm(inertia).assemble(basis)
    order = np.concatenate([basis.nodal_dofs.T.ravel(), basis.edge_dofs.T.ravel()])
    nodes = basis.doflocs[:, order[::3]].T
    place = np.full(len(points), -1)
    place[used] = np.arange(len(used))
    rows = {
        handle: _nodes_of_faces(path, handles[handle], place[faces], part.edges, len(used))
        for handle, faces in surfaces.items()
    }
    return M[order][:, order], K[order][:, order], nodes, rows


def _complain(path: str | os.PathLike[str], problem: str, remedy: str) -> NoReturn:
    raise InputError(f"{shorten(file_name(path))}: {problem}; {remedy}")


def _tetrahedra(path: str | os.PathLike[str], mesh: Any) -> tuple[npt.NDArray[np.int64], Array]:
    blocks = [cells.data[:, :4] for cells in mesh.cells if cells.type in ("tetra", "tetra10")]
    others = {c.type for c in mesh.cells if c.dim == 3 and c.type not in ("tetra", "tetra10")}
    if others or not blocks:
        has = f"has elements of type {shorten(min(others))}" if others else "has no tetrahedra"
        _complain(path, has, "give a mesh of tetrahedra")
    corners = np.concatenate(blocks)
    points = np.asarray(mesh.points, dtype=float)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        _complain(path, "has points that are no finite x, y, z", "correct them")
    if corners.min() < 0 or corners.max() >= len(points):
        _complain(path, "has elements with points that are not there", "correct them")
    r = points[corners]
    edges = r[:, 1:] - r[:, :1]
    volume = np.linalg.det(edges)
    size = np.linalg.norm(edges, axis=2).max(axis=1) ** 3
    bad = np.flatnonzero(~(volume > 1e-9 * size))
    if bad.size:
        _complain(
            path,
            f"element {int(bad[0]) + 1} of {len(corners)} is inverted or flat, and {bad.size} are",
            "mesh it again",
        )
    return corners.astype(np.int64), points


def _surface(path: str | os.PathLike[str], mesh: Any, name: str) -> npt.NDArray[np.int64]:
    """Corners (faces, 3) of the triangles of a physical surface."""
    known = {n: int(tag) for n, (tag, dim) in mesh.field_data.items() if int(dim) == 2}
    if name not in known:
        _complain(
            path, f"has no physical surface '{shorten(name)}'", near(name, known, "there are")
        )
    tags = mesh.cell_data.get("gmsh:physical", [None] * len(mesh.cells))
    faces = [
        cells.data[tag == known[name], :3]
        for cells, tag in zip(mesh.cells, tags, strict=True)
        if cells.type in ("triangle", "triangle6") and tag is not None
    ]
    found = np.concatenate(faces) if faces else np.zeros((0, 3), dtype=np.int64)
    if not len(found):
        _complain(path, f"physical surface '{shorten(name)}' has no triangles", "give one that has")
    return found.astype(np.int64)


def _nodes_of_faces(
    path: str | os.PathLike[str],
    name: str,
    faces: npt.NDArray[np.int64],
    edges: npt.NDArray[np.int64],
    n_corners: int,
) -> npt.NDArray[np.int64]:
    """Rows of the corners of faces, and of the middles of their edges."""
    if (faces < 0).any():
        _complain(path, f"surface '{shorten(name)}' is not on the tetrahedra", "mesh it with them")
    sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [0, 2]]]), axis=1)
    ends = np.sort(edges, axis=0)
    wanted = sides[:, 0] * n_corners + sides[:, 1]
    middles = np.flatnonzero(np.isin(ends[0] * n_corners + ends[1], wanted))
    return np.concatenate([np.unique(faces), n_corners + middles])
