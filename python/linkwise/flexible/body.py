"""Elastic bodies of finite elements, as the few numbers that their motion takes."""

from __future__ import annotations

import math
import os
import zipfile
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from linkwise._core import InputError
from linkwise.base import Array
from linkwise.flexible.matrices import MOST_COORDINATES, modes_of, reduce
from linkwise.flexible.mesh import elements
from linkwise.io.complaint import file_name, shorten

#: A saved body may take this many bytes when read.
LARGEST_FILE = 2**30


@dataclass(frozen=True, eq=False)
class FlexibleBody:
    """An elastic body whose points are at ``r = r0 + sum of amplitude times shape``.

    It is clamped to its frame at the inboard handle, where the shapes vanish, and carries what is
    outboard of it on a frame at its outboard handle, which the shapes move. Vectors are in the
    axes of the body, from its inboard handle. Shapes are scaled so that an amplitude [m] is the
    largest displacement that it makes (or, of nodes that only turn, their turn times the size of
    the body), unless `from_invariants` was given others.

    Make one by `from_matrices`, `from_mesh`, `from_invariants` or `load`, and a link of it by
    ``model.with_flexible(link, body=...)``.

    Attributes:
        mass: m [kg].
        first_moment: m c (3,) [kg m].
        second_moment: int r0 r0^T (3, 3) [kg m2].
        shape_mass: C = int phi_i (3, n) [kg].
        shape_moment: N_i0 = int r0 phi_i^T (n, 3, 3) [kg m].
        shape_product: N_ij = int phi_i phi_j^T (n, n, 3, 3) [kg].
        stiffness: Of each coordinate (n,) [N/m].
        damping: Ratio of each coordinate to critical damping (n,).
        outboard: The outboard handle (3,) [m]; None: it carries nothing.
        outboard_shift: Shapes at the outboard handle (3, n).
        outboard_turn: What they turn it by (3, n) [rad/m].
        axes: The body's axes as columns, in the link's frame (3, 3).
        nodes: Nodes from the inboard handle (N, 3) [m], or None.
        shapes: Displacements of the nodes (N, 3, n), or None.
        basis: Given coordinates as columns of those of the body, (n, n) or None: see
            `from_invariants`.
        rigid_residual: Largest ``|K r|`` of a rigid motion beside what its terms add up to.
    """

    mass: float
    first_moment: Array
    second_moment: Array
    shape_mass: Array
    shape_moment: Array
    shape_product: Array
    stiffness: Array
    damping: Array
    outboard: Array | None = None
    outboard_shift: Array | None = None
    outboard_turn: Array | None = None
    axes: Array = field(default_factory=lambda: np.eye(3))
    nodes: Array | None = None
    shapes: Array | None = None
    basis: Array | None = None
    rigid_residual: float = 0.0

    def __post_init__(self) -> None:
        n = np.asarray(self.stiffness).size
        if not 1 <= n <= MOST_COORDINATES:
            raise InputError(
                f"a flexible body has {n} coordinates; give 1 to {MOST_COORDINATES}, fewer by "
                "the argument modes"
            )
        sizes = {
            "first_moment": (3,),
            "second_moment": (3, 3),
            "shape_mass": (3, n),
            "shape_moment": (n, 3, 3),
            "shape_product": (n, n, 3, 3),
            "stiffness": (n,),
            "damping": (n,),
            "axes": (3, 3),
        }
        handle = {"outboard": (3,), "outboard_shift": (3, n), "outboard_turn": (3, n)}
        given = [name for name in handle if getattr(self, name) is not None]
        if len(given) not in (0, 3):
            raise InputError(
                f"{given[0]} of a flexible body is given alone; give outboard, outboard_shift and "
                "outboard_turn, or none of them"
            )
        sizes |= {name: handle[name] for name in given}
        if self.basis is not None:
            sizes["basis"] = (n, n)
        if self.shapes is not None:
            count = 0 if self.nodes is None else len(self.nodes)
            sizes |= {"nodes": (count, 3), "shapes": (count, 3, n)}
        for name, size in sizes.items():
            object.__setattr__(self, name, _numbers(name, getattr(self, name), size))
        if not (math.isfinite(self.mass) and self.mass > 0):
            raise InputError(f"mass of a flexible body is {self.mass!r}; give kg, above 0")
        self._check()

    def _check(self) -> None:
        for name in ("stiffness", "damping"):
            if getattr(self, name).min() < 0:
                raise InputError(f"{name} of a flexible body is negative; give 0 or more")
        both = self.shape_product.transpose(1, 0, 3, 2)
        for name, a, b in (
            ("second_moment", self.second_moment, self.second_moment.T),
            ("shape_product", self.shape_product, both),
        ):
            if np.abs(a - b).max() > 1e-9 * np.abs(a).max():
                what = "N_ji = N_ij^T" if name == "shape_product" else "a symmetric matrix"
                raise InputError(f"{name} of a flexible body is not symmetric; give {what}")
        if np.abs(self.axes.T @ self.axes - np.eye(3)).max() > 1e-6 or np.linalg.det(self.axes) < 0:
            raise InputError("axes of a flexible body are no rotation; give a 3x3 rotation matrix")
        M = self.mass_matrix()
        scale = np.sqrt(np.abs(np.diag(M)))
        scale[scale == 0] = 1
        if np.linalg.eigvalsh(M / np.outer(scale, scale))[0] < -1e-9:
            raise InputError(
                "the mass matrix of a flexible body has a negative eigenvalue, so that some "
                "motion would have negative energy; correct its mass integrals"
            )

    @property
    def n(self) -> int:
        """How many coordinates it has."""
        return len(self.stiffness)

    @property
    def modal_mass(self) -> Array:
        """Of each coordinate (n,) [kg]."""
        return np.asarray(np.einsum("iiaa->i", self.shape_product))

    @property
    def frequencies(self) -> Array:
        """Clamped inboard and free elsewhere (n,) [Hz]."""
        return np.sqrt(self.stiffness / self.modal_mass) / (2 * math.pi)

    def mass_matrix(self) -> Array:
        """At rest and undeformed (6 + n, 6 + n): linear, angular, coordinates; inboard handle."""
        c = _cross(self.first_moment)
        M = np.zeros((6 + self.n, 6 + self.n))
        M[:3, :3] = self.mass * np.eye(3)
        M[3:6, :3] = c
        M[:3, 3:6] = c.T
        M[3:6, 3:6] = np.trace(self.second_moment) * np.eye(3) - self.second_moment
        M[:3, 6:] = self.shape_mass
        M[3:6, 6:] = _vee(self.shape_moment).T
        M[6:, :6] = M[:6, 6:].T
        M[6:, 6:] = np.trace(self.shape_product, axis1=2, axis2=3)
        return M

    def displacement(self, amplitudes: npt.ArrayLike) -> Array:
        """Displacements (..., N, 3) [m] of the nodes, in the body's axes.

        Args:
            amplitudes: (..., n) [m], the coordinates of joint ``LINK:1`` of a machine.

        Raises:
            InputError: The body was made without nodes.
        """
        if self.shapes is None:
            raise InputError("the flexible body has no nodes; make it from matrices or a mesh")
        given = np.asarray(amplitudes, dtype=float)
        return np.asarray(np.einsum("vxk,...k->...vx", self.shapes, given))

    def rotated(self, axes: npt.ArrayLike) -> FlexibleBody:
        """The same body whose axes are these columns (3, 3), in the link's frame."""
        return replace(self, axes=_numbers("axes", axes, (3, 3)))

    def with_damping(self, damping: float | npt.ArrayLike) -> FlexibleBody:
        """The same body with these ratios to critical damping, one or one per coordinate."""
        return replace(self, damping=np.broadcast_to(np.asarray(damping, float), (self.n,)))

    def parameters(self) -> list[float]:
        """What the core keeps of it, in the order of src/linkwise/bodies/modal.hpp."""
        n = self.n
        none = np.zeros((3, n))
        shift = none if self.outboard_shift is None else self.outboard_shift
        turn = none if self.outboard_turn is None else self.outboard_turn
        N = self.second_moment
        lower = np.tril_indices(n)
        parts: list[Any] = [
            [n, self.outboard is not None, self.mass],
            self.first_moment,
            [N[0, 0], N[0, 1], N[1, 1], N[0, 2], N[1, 2], N[2, 2]],
            self.axes,
            np.zeros(3) if self.outboard is None else self.outboard,
            self.shape_mass.T,
            self.shape_moment,
            shift.T,
            turn.T,
            self.stiffness,
            2 * self.damping * np.sqrt(self.stiffness * self.modal_mass),
            self.shape_product[lower],
        ]
        return [float(x) for part in parts for x in np.ravel(part)]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes it to a file of numpy's format npz, which `load` and scenarios read."""
        given = {name: getattr(self, name) for name in _FIELDS}
        arrays: dict[str, Any] = {name: np.asarray(x) for name, x in given.items() if x is not None}
        with Path(path).open("wb") as file:
            np.savez_compressed(file, **arrays)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> FlexibleBody:
        """Reads what `save` wrote.

        Numbers alone are read, never pickled objects, and at most 1 GiB of them.

        Raises:
            InputError: The file is none of these.
            OSError: It cannot be read.
        """
        arrays = _read_arrays(path)
        for name in ("mass", "rigid_residual"):
            if name in arrays:
                if arrays[name].size != 1:
                    _complain(path, f"{name} is no single number")
                arrays[name] = float(arrays[name].reshape(()))  # type: ignore[assignment]
        missing = [name for name in _FIELDS[:8] if name not in arrays]
        if missing:
            _complain(path, f"has no {missing[0]}")
        try:
            return cls(**arrays)  # type: ignore[arg-type]
        except InputError as error:
            raise InputError(f"{shorten(file_name(path))}: {error}") from None

    @classmethod
    def from_invariants(
        cls,
        *,
        mass: float,
        first_moment: npt.ArrayLike,
        second_moment: npt.ArrayLike,
        shape_mass: npt.ArrayLike,
        shape_moment: npt.ArrayLike,
        shape_product: npt.ArrayLike,
        stiffness: npt.ArrayLike,
        damping: float | npt.ArrayLike = 0.0,
        outboard: npt.ArrayLike | None = None,
        outboard_shift: npt.ArrayLike | None = None,
        outboard_turn: npt.ArrayLike | None = None,
    ) -> FlexibleBody:
        """A body from its mass integrals, as other programs give them (SID files).

        Args:
            mass, first_moment, second_moment, shape_mass, shape_moment, shape_product: As the
                attributes; about the inboard handle, where the shapes must vanish.
            stiffness: (n,), or a symmetric matrix (n, n). With a matrix that is not diagonal the
                body's coordinates are its modes, and amplitudes in given coordinates are
                ``basis @ coordinates``.
            damping: Ratios of the coordinates to critical damping.
            outboard, outboard_shift, outboard_turn: As the attributes.

        Raises:
            InputError: A size or a number is wrong, or some motion would have no inertia.
        """
        K = np.asarray(stiffness, dtype=float)
        n = len(K) if K.ndim else 0
        given: dict[str, Any] = {
            "shape_mass": _numbers("shape_mass", shape_mass, (3, n)),
            "shape_moment": _numbers("shape_moment", shape_moment, (n, 3, 3)),
            "shape_product": _numbers("shape_product", shape_product, (n, n, 3, 3)),
        }
        if outboard is not None and outboard_shift is not None and outboard_turn is not None:
            given["outboard_shift"] = _numbers("outboard_shift", outboard_shift, (3, n))
            given["outboard_turn"] = _numbers("outboard_turn", outboard_turn, (3, n))
        basis = None
        if K.ndim == 2 and np.count_nonzero(K - np.diag(np.diag(K))):
            K = _numbers("stiffness", K, (n, n))
            if np.abs(K - K.T).max() > 1e-9 * np.abs(K).max():
                raise InputError("stiffness of a flexible body is not symmetric; give K = K^T")
            product = given["shape_product"]
            K, basis = modes_of(K, np.trace(product, axis1=2, axis2=3))
            given = {name: _in_modes(name, x, basis) for name, x in given.items()}
        elif K.ndim == 2:
            K = np.diag(K).copy()
        return cls(
            mass=float(mass),
            first_moment=np.asarray(first_moment, float),
            second_moment=np.asarray(second_moment, float),
            stiffness=K,
            damping=np.broadcast_to(np.asarray(damping, float), (n,)),
            outboard=None if outboard is None else np.asarray(outboard, float),
            basis=basis,
            **given,
        )

    @classmethod
    def from_matrices(
        cls,
        M: Any,
        K: Any,
        nodes: npt.ArrayLike,
        handles: Mapping[str, npt.ArrayLike],
        *,
        modes: int = 10,
        damping: float | npt.ArrayLike = 0.0,
        mass: float | None = None,
        points: Mapping[str, npt.ArrayLike] | None = None,
    ) -> FlexibleBody:
        """A body from mass and stiffness matrices, reduced after Craig and Bampton [craig1968].

        Nodes of a handle move as one rigid body. The inboard handle is clamped to the body's
        frame. The coordinates are the modes, clamped there and free elsewhere, among six
        displacements of the outboard handle, exact under loads on it, and `modes` vibrations
        with both handles held.

        Args:
            M, K: (3 N, 3 N) or (6 N, 6 N), sparse or dense [kg, N/m], without supports: node by
                node x, y, z, and with six dofs the rotations about them.
            nodes: (N, 3) [m].
            handles: ``{"inboard": rows of nodes, "outboard": rows of nodes}``; without outboard
                the body carries nothing. With three dofs a handle has three nodes or more, not
                on a line.
            modes: Vibrations between the handles, 0 to 34, without outboard to 40.
            damping: Ratios of the modes to critical damping, one or one per mode.
            mass: What it should weigh [kg]; refused where M weighs more than 1 % more or less.
            points: Where a handle's frame is (3,) [m]; unless given, the mean of its nodes.

        Raises:
            InputError: The matrices are not symmetric, K resists rigid motion, a handle has no
                nodes or shares some, or another of these does not fit.
        """
        return cls(**reduce(M, K, nodes, handles, modes, damping, mass, points or {}))

    @classmethod
    def from_mesh(
        cls,
        path: str | os.PathLike[str],
        *,
        E: float,
        nu: float,
        density: float,
        handles: Mapping[str, str],
        modes: int = 10,
        damping: float | npt.ArrayLike = 0.0,
        points: Mapping[str, npt.ArrayLike] | None = None,
        scale: float = 1.0,
    ) -> FlexibleBody:
        """A body from a mesh of tetrahedra, by quadratic elements of linear elasticity.

        Needs the extra ``linkwise[fem]``.

        Args:
            path: A file that meshio reads, such as Gmsh's ``.msh``, with tetrahedra.
            E: Young's modulus [Pa].
            nu: Poisson's ratio, above -1 and below 0.5.
            density: [kg/m3].
            handles: ``{"inboard": physical surface, "outboard": physical surface}``, by the names
                in the file.
            modes, damping, points: As of `from_matrices`.
            scale: Metres per unit of the file.

        Raises:
            InputError: The file has no tetrahedra, inverted ones or no such surface, or a number
                is wrong.
            ImportError: The extra is not installed.
        """
        M, K, nodes, rows = elements(path, E, nu, density, handles, scale)
        return cls.from_matrices(M, K, nodes, rows, modes=modes, damping=damping, points=points)


_FIELDS = tuple(FlexibleBody.__dataclass_fields__)


def _in_modes(name: str, x: Array, basis: Array) -> Array:
    if name == "shape_moment":
        return np.asarray(np.einsum("iab,ik->kab", x, basis))
    if name == "shape_product":
        return np.asarray(np.einsum("ijab,ik,jl->klab", x, basis, basis))
    return np.asarray(x @ basis)


def _cross(r: Array) -> Array:
    return np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])


def _vee(A: Array) -> Array:
    """Of int r phi^T (..., 3, 3) it is int r x phi (..., 3)."""
    return np.stack(
        [A[..., 1, 2] - A[..., 2, 1], A[..., 2, 0] - A[..., 0, 2], A[..., 0, 1] - A[..., 1, 0]], -1
    )


def _numbers(name: str, given: Any, size: tuple[int, ...]) -> Array:
    try:
        out = np.array(given, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} of a flexible body is no array of numbers; give one") from None
    if out.shape != size:
        raise InputError(f"{name} of a flexible body has shape {out.shape}; give {size}")
    if not np.isfinite(out).all():
        raise InputError(f"{name} of a flexible body is not finite; give finite numbers")
    return out


def _complain(path: str | os.PathLike[str], problem: str) -> None:
    raise InputError(
        f"{shorten(file_name(path))}: {problem}, so it is no flexible body; give a file that "
        "FlexibleBody.save wrote"
    )


def _read_arrays(path: str | os.PathLike[str]) -> dict[str, Array]:
    """Each array is as long as its header says before room is made for it."""
    out: dict[str, Array] = {}
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
            if sum(member.file_size for member in members) > LARGEST_FILE or len(members) > 100:
                _complain(path, "holds more than 1 GiB")
            for member in members:
                name = member.filename.removesuffix(".npy")
                if name not in _FIELDS:
                    _complain(path, f"holds '{shorten(name)}'")
                out[name] = _read_array(archive, member, lambda what: _complain(path, what))
    except InputError:
        raise
    except (zipfile.BadZipFile, zlib.error, ValueError, EOFError, RuntimeError):
        _complain(path, "is damaged or no npz")
    return out


def _read_array(
    archive: zipfile.ZipFile, member: zipfile.ZipInfo, complain: Callable[[str], None]
) -> Array:
    name = shorten(member.filename)
    with archive.open(member) as file:
        version = np.lib.format.read_magic(file)
        if version != (1, 0):
            complain(f"{name} has another format")
        shape, fortran, dtype = np.lib.format.read_array_header_1_0(file)
        if dtype != np.float64 or len(shape) > 4:
            complain(f"{name} holds no 64-bit numbers")
        size = 8 * math.prod(shape)
        if size != member.file_size - file.tell():
            complain(f"{name} is not as long as it says")
        data = file.read(size + 1)
    if len(data) != size:
        complain(f"{name} is not as long as it says")
    return np.frombuffer(data).reshape(shape, order="F" if fortran else "C").copy()
