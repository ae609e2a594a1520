"""Craig and Bampton's reduction of mass and stiffness matrices to a flexible body."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.linalg
import scipy.sparse as sparse
from scipy.sparse.linalg import ArpackError, ArpackNoConvergence, eigsh, splu

from linkwise._core import InputError
from linkwise.base import Array
from linkwise.io.complaint import near, shorten

#: Coordinates that a body can have (src/linkwise/spatial/elastic_port.hpp).
MOST_COORDINATES = 40
#: Of what terms of K r add up to, how much a rigid motion r may leave.
_RIGID = 1e-6
_SYMMETRIC = 1e-9
_HANDLES = ("inboard", "outboard")
#: Up to this many dofs between the handles the dense solver finds the modes.
_DENSE = 400


def reduce(
    M: Any,
    K: Any,
    nodes: npt.ArrayLike,
    handles: Mapping[str, npt.ArrayLike],
    modes: int,
    damping: float | npt.ArrayLike,
    mass: float | None,
    points: Mapping[str, npt.ArrayLike],
) -> dict[str, Any]:
    """The attributes of a `FlexibleBody`; see its `from_matrices`."""
    r = np.array(nodes, dtype=float)
    if r.ndim != 2 or r.shape[1] != 3 or not len(r) or not np.isfinite(r).all():
        raise InputError(f"nodes have shape {r.shape}; give finite coordinates (N, 3) in m")
    rows = _rows_of_handles(handles, len(r))
    system = _System(_matrix("M", M, len(r)), _matrix("K", K, len(r)), r)
    at = {name: _point(name, points, r[rows[name]]) for name in rows}
    for name in points:
        if name not in rows:
            raise InputError(f"points has '{shorten(name)}'; {near(name, rows, 'the handles are')}")
    most = MOST_COORDINATES - (6 if "outboard" in rows else 0)
    if not isinstance(modes, int | np.integer) or not 0 <= modes <= most:
        raise InputError(
            f"modes is {shorten(modes)}; give the number of vibrations between the handles, 0 to "
            f"{most}"
        )
    system.r = r - at["inboard"]
    residual = system.rigid_residual()
    system.check_mass(mass)
    shapes, turn = _shapes(system, rows, at, int(modes))
    return _body(system, shapes, turn, at, damping, residual)


#: How far nodes of a handle are off a line, over its length, that rounding in a file can explain.
_ON_A_LINE = 1e-4


@dataclass
class _System:
    M: Any  # csr
    K: Any
    r: Array  # of the nodes, from the inboard handle

    @property
    def per_node(self) -> int:
        return int(self.M.shape[0]) // len(self.r)

    def dofs(self, rows: Array) -> Array:
        return (self.per_node * rows[:, None] + np.arange(self.per_node)).ravel()

    def rigid(self, about: Array | None = None, rows: Array | None = None) -> Array:
        """Displacements (dofs, 6) of a rigid motion: linear, angular about a point."""
        r = self.r if rows is None else self.r[rows]
        r = r - (0 if about is None else about)
        out = np.zeros((len(r), self.per_node, 6))
        out[:, :3, :3] = np.eye(3)
        x, y, z = r.T
        out[:, 0, 4], out[:, 0, 5] = z, -y  # turn x r
        out[:, 1, 3], out[:, 1, 5] = -z, x
        out[:, 2, 3], out[:, 2, 4] = y, -x
        if self.per_node == 6:
            out[:, 3:, 3:] = np.eye(3)
        return out.reshape(-1, 6)

    def rigid_residual(self) -> float:
        rigid = self.rigid(self.r.mean(axis=0))
        terms = np.asarray(abs(self.K) @ np.abs(rigid)).max(axis=0)
        left = np.abs(np.asarray(self.K @ rigid)).max(axis=0)
        worst = float((left / np.where(terms > 0, terms, 1)).max())
        if worst > _RIGID:
            raise InputError(
                f"K resists rigid motion: |K r| is {worst:.2g} of its terms, more than {_RIGID:g}; "
                "give K without supports, and nodes in the order of its rows"
            )
        return worst

    def check_mass(self, stated: float | None) -> None:
        rigid = self.rigid()[:, :3]
        weighs = np.asarray(rigid.T @ (self.M @ rigid))
        m = weighs[0, 0]
        if not m > 0 or np.abs(weighs - m * np.eye(3)).max() > 1e-6 * abs(m):
            along = ", ".join(f"{x:.6g}" for x in np.diag(weighs))
            raise InputError(
                f"M weighs {along} kg along x, y, z; give the mass of all translations, the same "
                "along each axis"
            )
        if stated is not None and not abs(m - stated) <= 0.01 * stated:
            raise InputError(
                f"M weighs {m:.6g} kg, and mass says {stated:.6g}; correct the units or one of them"
            )


def _matrix(name: str, given: Any, n_nodes: int) -> Any:
    try:
        A = sparse.csr_matrix(given, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} is no matrix of numbers; give a sparse or dense one") from None
    if A.shape not in ((3 * n_nodes, 3 * n_nodes), (6 * n_nodes, 6 * n_nodes)):
        raise InputError(
            f"{name} has shape {A.shape}, with {n_nodes} nodes; give three or six rows per node"
        )
    if not np.isfinite(A.data).all():
        raise InputError(f"{name} is not finite; give finite numbers")
    largest = abs(A).max() if A.nnz else 0.0
    if not largest > 0:
        raise InputError(f"{name} is zero; give the matrix of the whole part")
    off = abs(A - A.T).max()
    if off > _SYMMETRIC * largest:
        raise InputError(
            f"{name} is not symmetric, by {off / largest:.2g} of its largest entry; where a file "
            "holds one triangle, mirror it"
        )
    return 0.5 * (A + A.T)


def _rows_of_handles(handles: Mapping[str, npt.ArrayLike], n_nodes: int) -> dict[str, Array]:
    if not isinstance(handles, Mapping) or "inboard" not in handles:
        raise InputError('handles has no "inboard"; give {"inboard": rows, "outboard": rows}')
    out: dict[str, Array] = {}
    for name, given in handles.items():
        if name not in _HANDLES:
            raise InputError(
                f"handle '{shorten(name)}' is one more than a body can have; give inboard and "
                "outboard, and model the part in two where it carries more"
            )
        rows = np.asarray(given)
        if rows.ndim != 1 or not rows.size:
            raise InputError(f"handle '{name}' has no nodes; give rows of nodes")
        if rows.dtype.kind not in "iu" or rows.min() < 0 or rows.max() >= n_nodes:
            raise InputError(
                f"handle '{name}' has nodes that are not there; give rows of nodes, 0 to "
                f"{n_nodes - 1}"
            )
        out[name] = np.unique(rows)
    shared = np.intersect1d(out["inboard"], out.get("outboard", []))
    if shared.size:
        raise InputError(f"node {int(shared[0])} is in both handles; let it be in one")
    return out


def _point(name: str, points: Mapping[str, npt.ArrayLike], r: Array) -> Array:
    if name not in points:
        return np.asarray(r.mean(axis=0))
    at = np.asarray(points[name], dtype=float)
    if at.shape != (3,) or not np.isfinite(at).all():
        raise InputError(f"point of handle '{name}' has shape {at.shape}; give (3,) in m")
    return at


def _shapes(
    system: _System, rows: dict[str, Array], at: dict[str, Array], modes: int
) -> tuple[Array, bool]:
    """Columns of displacements (dofs, 6 + modes), the first six of the outboard handle."""
    held = {name: system.dofs(x) for name, x in rows.items()}
    for name, x in rows.items():
        spread = np.linalg.svd(system.r[x] - system.r[x].mean(axis=0), compute_uv=False)
        if system.per_node == 3 and (len(x) < 3 or spread[1] <= _ON_A_LINE * spread[0]):
            raise InputError(
                f"nodes of handle '{name}' are on a line, which does not say how it turns; give "
                "three or more that are not"
            )
    free = np.setdiff1d(np.arange(system.M.shape[0]), np.concatenate(list(held.values())))
    if modes > max(len(free) - 1, 0) or (not modes and "outboard" not in rows):
        raise InputError(
            f"modes is {modes}, with {len(free)} dofs between the handles; give "
            + ("more" if modes == 0 else "fewer")
        )
    K = system.K[free][:, free].tocsc()
    shapes = np.zeros((system.M.shape[0], (6 if "outboard" in rows else 0) + modes))
    try:
        factor = splu(K) if len(free) else None
    except RuntimeError:
        raise InputError(
            "K is singular with its handles held: a part of the mesh is loose; connect it, or "
            "leave it out"
        ) from None
    first = 0
    if "outboard" in rows:
        out = held["outboard"]
        moves = system.rigid(at["outboard"] - at["inboard"], rows["outboard"])
        shapes[out, :6] = moves
        if factor is not None:
            shapes[free, :6] = -factor.solve(np.asarray(system.K[free][:, out] @ moves))
        first = 6
    if modes:
        shapes[free, first:] = _vibrations(K, system.M[free][:, free].tocsc(), modes)
    return shapes, "outboard" in rows


def _vibrations(K: Any, M: Any, modes: int) -> Array:
    """The lowest modes of K phi = omega^2 M phi, as columns."""
    n = K.shape[0]
    if n <= _DENSE or modes >= n - 1:
        # omega^-2 of M phi: rotations may have no mass.
        values, vectors = scipy.linalg.eigh(M.toarray(), K.toarray())
        if not values[n - modes] > 1e-14 * values[-1]:
            raise InputError(f"modes is {modes}, more than the masses make; give fewer")
        return np.asarray(vectors[:, ::-1][:, :modes] / np.sqrt(values[::-1][:modes]))
    try:
        start = np.random.default_rng(0).normal(size=n)
        _, vectors = eigsh(K, k=modes, M=M, sigma=0.0, which="LM", v0=M @ start)
    except (ArpackError, ArpackNoConvergence):
        raise InputError("the modes between the handles are not found; give fewer modes") from None
    return np.asarray(vectors)


def _body(
    system: _System,
    shapes: Array,
    carries: bool,
    at: dict[str, Array],
    damping: float | npt.ArrayLike,
    residual: float,
) -> dict[str, Any]:
    Kr, Mr = (shapes.T @ np.asarray(A @ shapes) for A in (system.K, system.M))
    stiffness, V = modes_of(0.5 * (Kr + Kr.T), 0.5 * (Mr + Mr.T))
    shapes = shapes @ V
    phi = shapes.reshape(len(system.r), system.per_node, -1)[:, :3, :]
    largest = _amplitudes(system, shapes)
    V, shapes, phi = V / largest, shapes / largest, phi / largest
    n = len(largest)
    ratios = np.asarray(damping, dtype=float)
    if ratios.shape not in ((), (n,)) or not (np.isfinite(ratios).all() and (ratios >= 0).all()):
        raise InputError(
            f"damping is no ratio of 0 or more; give one, or one for each of {n} modes"
        )
    return {
        "stiffness": stiffness / largest**2,
        "damping": np.broadcast_to(ratios, (n,)),
        "outboard": at["outboard"] - at["inboard"] if carries else None,
        "outboard_shift": V[:3] if carries else None,
        "outboard_turn": V[3:6] if carries else None,
        "nodes": system.r,
        "shapes": phi,
        "rigid_residual": residual,
    } | _integrals(system, shapes, phi)


def _amplitudes(system: _System, shapes: Array) -> Array:
    """Of each shape its largest displacement, with its sign. Where nodes only turn, as those of a
    straight rod that twists, the largest turn times the size of the part."""
    n = shapes.shape[1]
    moves = shapes.reshape(len(system.r), system.per_node, n)

    def peak(x: Array) -> Array:
        x = x.reshape(-1, n)
        return np.asarray(np.take_along_axis(x, np.abs(x).argmax(axis=0)[None], axis=0)[0])

    shift = peak(moves[:, :3])
    if system.per_node == 3:
        return shift
    turn = np.abs(system.r).max() * peak(moves[:, 3:])
    return np.where(np.abs(shift) > 1e-6 * np.abs(turn), shift, turn)


def _integrals(system: _System, shapes: Array, phi: Array) -> dict[str, Any]:
    """Mass integrals of the field that nodes and shapes span [zwolfer2021].

    With three dofs per node and consistent mass, M is mu times 1 for each pair of nodes, and they
    are exact. Otherwise mu is the mean of the three axes, and what M says at rest, all of the mass
    matrix, is put in its place; how that changes with deformation is then by mu.
    """
    n, per_node = phi.shape[2], system.per_node
    mu = sum(system.M[k::per_node, k::per_node] for k in range(3)) / 3
    flat = phi.reshape(len(system.r), 3 * n)
    mu_phi = np.asarray(mu @ flat)
    moment = (system.r.T @ mu_phi).reshape(3, 3, n).transpose(2, 0, 1)
    product = (flat.T @ mu_phi).reshape(3, n, 3, n).transpose(1, 3, 0, 2)
    rigid = system.rigid()
    of_rigid = np.asarray(system.M @ rigid)
    J = rigid.T @ of_rigid
    side = of_rigid.T @ shapes
    skew = J[3:, :3] - J[:3, 3:]  # 2 m c~
    mc = np.array([skew[2, 1], skew[0, 2], skew[1, 0]]) / 2
    inertia = 0.5 * (J[3:, 3:] + J[3:, 3:].T)
    vee = np.stack(
        [
            moment[:, 1, 2] - moment[:, 2, 1],
            moment[:, 2, 0] - moment[:, 0, 2],
            moment[:, 0, 1] - moment[:, 1, 0],
        ]
    )
    off = 0.5 * (side[3:] - vee)
    for k, (a, b) in enumerate(((1, 2), (2, 0), (0, 1))):
        moment[:, a, b] += off[k]
        moment[:, b, a] -= off[k]
    exact = shapes.T @ np.asarray(system.M @ shapes)
    traces = np.trace(product, axis1=2, axis2=3)
    product = product + ((exact - traces) / 3)[:, :, None, None] * np.eye(3)
    return {
        "mass": float(J[0, 0]),
        "first_moment": mc,
        "second_moment": np.trace(inertia) / 2 * np.eye(3) - inertia,
        "shape_mass": side[:3],
        "shape_moment": moment,
        "shape_product": 0.5 * (product + product.transpose(1, 0, 3, 2)),
    }


def modes_of(K: Array, M: Array) -> tuple[Array, Array]:
    """Eigenvalues times the mass of each mode, which is 1, and the modes as columns."""
    scale = 1 / np.sqrt(np.maximum(np.diag(M), np.finfo(float).tiny))
    try:
        values, vectors = scipy.linalg.eigh(K * np.outer(scale, scale), M * np.outer(scale, scale))
    except np.linalg.LinAlgError:
        raise InputError(
            "shapes of the flexible body are linearly dependent, or move no mass; give fewer "
            "modes, or mass to all nodes"
        ) from None
    if values[0] < -1e-9 * max(values[-1], 1e-300):
        raise InputError("stiffness of a flexible body has a negative eigenvalue; correct K")
    return np.maximum(values, 0), scale[:, None] * vectors
