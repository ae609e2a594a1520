"""Mass and stiffness matrices from files of finite element programs."""

from __future__ import annotations

import os
import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn, TextIO

import numpy as np
import numpy.typing as npt
import scipy.io
import scipy.sparse as sparse

from linkwise._core import InputError
from linkwise.base import Array
from linkwise.io.complaint import file_name, shorten

#: Files may have this many bytes.
LARGEST_FILE = 2**30
#: Rows of a matrix, at most: a file of one line must not ask for more memory than it is worth.
_MOST_ROWS = 10_000_000
_HARWELL_BOEING = (".hb", ".rb", ".rsa", ".rua")


@dataclass(frozen=True, eq=False)
class FiniteElementMatrices:
    """Mass and stiffness in the order of nodes, as `FlexibleBody.from_matrices` takes them.

    Attributes:
        M, K: (3 N, 3 N) or (6 N, 6 N), sparse.
        labels: Numbers of the nodes in the program (N,), in the order of the rows; None where the
            files do not say them.
    """

    M: Any
    K: Any
    labels: npt.NDArray[np.int64] | None

    def rows(self, labels: npt.ArrayLike) -> npt.NDArray[np.int64]:
        """Rows of nodes with these numbers, for handles and coordinates.

        Raises:
            InputError: A node is not there, or the files have no numbers.
        """
        if self.labels is None:
            raise InputError("the matrices have no numbers of nodes; give rows instead")
        wanted = np.atleast_1d(np.asarray(labels))
        at = np.minimum(np.searchsorted(self.labels, wanted), len(self.labels) - 1)
        if missing := wanted[self.labels[at] != wanted].tolist():
            raise InputError(f"node {missing[0]} is not in the matrices; give nodes that are")
        return at


def read_matrices(
    mass: str | os.PathLike[str],
    stiffness: str | os.PathLike[str],
    *,
    dofs: str | os.PathLike[str] | None = None,
) -> FiniteElementMatrices:
    """Reads a mass and a stiffness matrix.

    ======================================  =====================================================
    files                                   written by
    ======================================  =====================================================
    ``.mtx``, Matrix Market                 many programs
    ``.hb``, ``.rb``, ``.rsa``, ``.rua``    Harwell-Boeing: Ansys ``HBMAT``
    ``.mtx``, five numbers in a line        Abaqus ``*MATRIX GENERATE`` and ``*MATRIX OUTPUT,
                                            FORMAT=MATRIX INPUT``: node, dof, node, dof, entry
    ``.mas``, ``.sti`` with ``dofs=`` .dof  CalculiX ``*FREQUENCY, SOLVER=MATRIXSTORAGE``: row,
                                            column, entry; the dof file has ``node.dof`` of rows
    ======================================  =====================================================

    One triangle of a symmetric matrix is mirrored. Files without numbers of nodes must have the
    rows node by node.

    Args:
        mass, stiffness: The files.
        dofs: CalculiX's file of dofs, ``node.dof`` in the order of the rows.

    Raises:
        InputError: A file is damaged or larger than 1 GiB, or a node has not all of its dofs: 1 to
            3, or 1 to 6.
        OSError: It cannot be read.
    """
    given = _read_dofs(dofs) if dofs is not None else None
    M, of_M = _read(mass)
    K, of_K = _read(stiffness)
    if (of_M is None) != (of_K is None):
        _complain(mass, "has other numbers of nodes than the stiffness", "give two files of a kind")
    if of_M is not None and of_K is not None:
        both = np.union1d(of_M, of_K)
        M, K = (
            _placed(A, np.searchsorted(both, of_A), len(both)) for A, of_A in ((M, of_M), (K, of_K))
        )
        given = np.stack([both // 16, both % 16], axis=1)
    if M.shape != K.shape:
        _complain(mass, f"has shape {M.shape}, the stiffness {K.shape}", "give two of one part")
    if given is None:
        return FiniteElementMatrices(M, K, None)
    if len(given) != M.shape[0]:
        n = M.shape[0]
        _complain(dofs or mass, f"has {len(given)} dofs, the matrices {n} rows", "give its own")
    order = np.lexsort((given[:, 1], given[:, 0]))
    labels = _labels(given[order], dofs or mass)
    return FiniteElementMatrices(M[order][:, order], K[order][:, order], labels)


def _labels(dofs: npt.NDArray[np.int64], path: str | os.PathLike[str]) -> npt.NDArray[np.int64]:
    labels, first, count = np.unique(dofs[:, 0], return_index=True, return_counts=True)
    per_node = int(count[0])
    for node, start, n in zip(labels, first, count, strict=True):
        own = dofs[start : start + n, 1].tolist()
        if n != per_node or own != list(range(1, per_node + 1)) or per_node not in (3, 6):
            has = ", ".join(map(str, own))
            _complain(
                path,
                f"node {node} has dofs {shorten(has)}",
                "give all nodes 1 to 3, or all 1 to 6, without supports and constraints",
            )
    return labels


def _placed(A: Any, at: npt.NDArray[np.int64], n: int) -> Any:
    A = A.tocoo()
    return sparse.csr_matrix((A.data, (at[A.row], at[A.col])), shape=(n, n))


def _complain(path: str | os.PathLike[str], problem: str, remedy: str) -> NoReturn:
    raise InputError(f"{shorten(file_name(path))}: {problem}; {remedy}")


def _check_size(path: str | os.PathLike[str]) -> None:
    if Path(path).stat().st_size > LARGEST_FILE:
        _complain(path, "is larger than 1 GiB", "give a coarser mesh")


def _read(path: str | os.PathLike[str]) -> tuple[Any, npt.NDArray[np.int64] | None]:
    """The whole matrix, and of each row 16 node + dof, where the file says these."""
    _check_size(path)
    with Path(path).open("rb") as file:
        start = file.read(14)
    if start.lower() == b"%%matrixmarket":
        return _read_market(path), None
    if Path(path).suffix.lower() in _HARWELL_BOEING:
        return _read_harwell_boeing(path), None
    table = _read_table(path)
    if table.shape[1] == 5:
        dofs = _whole(path, table[:, :4])
        if dofs[:, 1::2].max() > 6:
            _complain(path, f"has dof {dofs[:, 1::2].max()}", "give a model of displacements alone")
        row, column = 16 * dofs[:, 0] + dofs[:, 1], 16 * dofs[:, 2] + dofs[:, 3]
        names = np.union1d(row, column)
        row, column = np.searchsorted(names, row), np.searchsorted(names, column)
        return _symmetric(path, row, column, table[:, 4], len(names)), names
    if table.shape[1] == 3:
        place = _whole(path, table[:, :2]) - 1
        n = int(place.max()) + 1
        if n > _MOST_ROWS:
            _complain(path, f"has row {n}", f"give {_MOST_ROWS} rows or fewer")
        return _symmetric(path, place[:, 0], place[:, 1], table[:, 2], n), None
    _complain(path, f"has {table.shape[1]} numbers in a line", "give a file with 3 or 5")


def _read_table(path: str | os.PathLike[str]) -> Array:
    try:
        with Path(path).open(encoding="ascii") as file:
            lines = (line.replace(",", " ") for line in file)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # an empty file is refused below
                table = np.loadtxt(lines, dtype=float, comments="*", ndmin=2)
    except (ValueError, UnicodeError) as error:
        _complain(path, f"is no table of numbers ({shorten(error)})", "give a text file of entries")
    if not table.size or not np.isfinite(table).all():
        _complain(path, "is empty or not finite", "give finite entries")
    return table


def _whole(path: str | os.PathLike[str], given: Array) -> npt.NDArray[np.int64]:
    if (given != np.floor(given)).any() or given.min() < 1 or given.max() > 2**53:
        _complain(path, "has nodes, dofs or rows that are no whole numbers from 1", "correct them")
    return given.astype(np.int64)


def _symmetric(
    path: str | os.PathLike[str],
    row: npt.NDArray[np.int64],
    column: npt.NDArray[np.int64],
    entry: Array,
    n: int,
) -> Any:
    """Of all entries, or of those of one triangle."""
    place = row * n + column
    if len(np.unique(place)) < len(place):
        _complain(path, "has an entry twice", "give each once")
    A = sparse.csr_matrix((entry, (row, column)), shape=(n, n))
    lower, upper = sparse.tril(A, -1), sparse.triu(A, 1)
    if lower.nnz and upper.nnz:
        if abs(A - A.T).max() > 1e-9 * abs(A).max():
            _complain(path, "has entries on both sides that differ", "give a symmetric matrix")
        return A
    return (A + (lower + upper).T).tocsr()


def _read_market(path: str | os.PathLike[str]) -> Any:
    try:
        rows, columns, entries, form, field, _ = scipy.io.mminfo(path)
        if max(rows, columns) > _MOST_ROWS or form != "coordinate" or field == "complex":
            _complain(path, f"is {form}, {field}, {rows} by {columns}", "give a sparse, real one")
        if entries > Path(path).stat().st_size:
            _complain(path, f"says {entries} entries, more than it has", "correct it")
        A = sparse.coo_matrix(scipy.io.mmread(path))
    except (ValueError, OverflowError, TypeError, IndexError) as error:
        if isinstance(error, InputError):
            raise
        _complain(path, f"is damaged ({shorten(error)})", "write it again")
    if A.shape[0] != A.shape[1]:
        _complain(path, f"has shape {A.shape}", "give a square matrix")
    return _symmetric(path, A.row.astype(np.int64), A.col.astype(np.int64), A.data, A.shape[0])


def _read_harwell_boeing(path: str | os.PathLike[str]) -> Any:
    """Columns of fixed width: pointers, row indices, entries [duff1992]."""
    with Path(path).open(encoding="ascii", errors="replace") as file:
        head = [file.readline() for _ in range(4)]
        kind = head[2][:3].upper()
        if len(kind) == 3 and kind.isalpha() and kind not in ("RSA", "RUA"):
            _complain(path, f"is of type {kind}", "give a real, assembled matrix, RSA or RUA")
        try:
            lines = [int(head[1][14 * k : 14 * k + 14]) for k in (1, 2, 3)]
            rows, columns, entries = (int(head[2][14 * k : 14 * k + 14]) for k in (1, 2, 3))
            if int(head[1][56:70].strip() or 0):
                file.readline()  # describes right-hand sides, which are left
            widths = [_width(head[3][a:b]) for a, b in ((0, 16), (16, 32), (32, 52))]
            longest = Path(path).stat().st_size
            if not (0 < rows == columns <= _MOST_ROWS and 0 < min(lines) <= max(lines) <= longest):
                raise ValueError("not square")
            counts = (columns + 1, entries, entries)
            pointer, index, entry = (
                _fixed(file, *each) for each in zip(lines, widths, counts, strict=True)
            )
            start, row = _whole(path, pointer) - 1, _whole(path, index) - 1
            if start[0] or start[-1] != entries or (np.diff(start) < 0).any() or row.max() >= rows:
                raise ValueError("its pointers lead nowhere")
        except (ValueError, IndexError) as error:
            if isinstance(error, InputError):
                raise
            _complain(path, f"is damaged ({shorten(error)})", "write it again")
    return _symmetric(path, row, np.repeat(np.arange(columns), np.diff(start)), entry, rows)


def _width(form: str) -> int:
    """Of one number in a Fortran format such as (1P,3E25.16)."""
    found = re.fullmatch(r"\s*\((?:1P,?)?\d*[IEDFG](\d{1,3})(?:\.\d+)?(?:E\d+)?\)\s*", form.upper())
    if not found:
        raise ValueError(f"format {form.strip()}")
    return int(found[1])


def _fixed(file: TextIO, n_lines: int, width: int, count: int) -> Array:
    """Numbers of a width, which need no space between them; some programs write others, with
    spaces."""
    lines = [file.readline().rstrip().upper().replace("D", "E") for _ in range(n_lines)]
    words = " ".join(lines).split()
    if len(words) != count:
        words = [line[at : at + width] for line in lines for at in range(0, len(line), width)]
    if len(words) != count:
        raise ValueError("other numbers of entries than it says")
    out = np.array([float(word) for word in words])
    if not np.isfinite(out).all():
        raise ValueError("not finite")
    return out


def _read_dofs(path: str | os.PathLike[str]) -> npt.NDArray[np.int64]:
    _check_size(path)
    out = []
    with Path(path).open(encoding="ascii", errors="replace") as file:
        for number, line in enumerate(file, 1):
            if not line.strip():
                continue
            node, _, dof = line.strip().partition(".")
            if not (node.isdigit() and dof.isdigit() and len(node) < 16 and 1 <= int(dof) <= 6):
                _complain(path, f"line {number} is '{shorten(line)}'", "give lines node.dof")
            out.append((int(node), int(dof)))
    if not out:
        _complain(path, "is empty", "give lines node.dof")
    return np.array(out, dtype=np.int64)
