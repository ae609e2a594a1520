"""Mass and stiffness from files of finite element programs."""

import itertools

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sparse
from test_finite_elements import frame_matrices

import linkwise as lw


class TestReaders:
    def labels(self):
        return 10 * np.arange(1, 14)

    def write(self, tmp_path, form, triangle=True):
        """The matrices of the rod as programs write them."""
        M, K, _ = frame_matrices()
        rng = np.random.default_rng(0)
        out = []
        for name, A in (("mass", M), ("stiffness", K)):
            part = sparse.tril(A).tocoo() if triangle else A.tocoo()
            path = tmp_path / f"{name}.mtx"
            if form == "market":
                scipy.io.mmwrite(path, part if not triangle else A, symmetry="general")
            elif form == "abaqus":
                order = rng.permutation(part.nnz)
                lines = [
                    f"{10 * (i // 6 + 1)},{i % 6 + 1}, {10 * (j // 6 + 1)},{j % 6 + 1}, {x:.16e}"
                    for i, j, x in zip(
                        part.row[order], part.col[order], part.data[order], strict=True
                    )
                ]
                path.write_text("\n".join(["** a comment", *lines]) + "\n")
            else:
                lines = [
                    f"{i + 1} {j + 1} {x:.16e}"
                    for i, j, x in zip(part.row, part.col, part.data, strict=True)
                ]
                path.write_text("\n".join(lines) + "\n")
            out.append(path)
        return out

    @pytest.mark.parametrize("form", ["market", "abaqus", "calculix"])
    @pytest.mark.parametrize("triangle", [True, False])
    def test_they_give_the_matrices_back(self, tmp_path, form, triangle):
        M, K, _ = frame_matrices()
        mass, stiffness = self.write(tmp_path, form, triangle)
        dofs = None
        if form == "calculix":
            dofs = tmp_path / "rod.dof"
            dofs.write_text("".join(f"{10 * (i // 6 + 1)}.{i % 6 + 1}\n" for i in range(78)))
        found = lw.flexible.read_matrices(mass, stiffness, dofs=dofs)
        for one, other in ((found.M, M), (found.K, K)):
            assert abs(one - other).max() <= 1e-15 * abs(other).max()
        if form != "market":
            assert found.labels.tolist() == self.labels().tolist()
            assert found.rows([10, 130]).tolist() == [0, 12]
            with pytest.raises(lw.InputError, match="node 15 is not in"):
                found.rows([15])

    @pytest.mark.parametrize("kind", ["RUA", "RSA"])
    def test_harwell_boeing(self, tmp_path, kind):
        """RUA is written by scipy; RSA, one triangle, as other programs do."""
        M, K, _ = frame_matrices()
        paths = [tmp_path / "mass.hb", tmp_path / "stiffness.hb"]
        for path, A in zip(paths, (M, K), strict=True):
            if kind == "RUA":
                scipy.io.hb_write(path, sparse.csc_matrix(A))
                continue
            low = sparse.tril(A).tocsc()
            low.sort_indices()
            parts = []
            for values, form, per_line in (
                (low.indptr + 1, "{:10d}", 8),
                (low.indices + 1, "{:10d}", 8),
                (low.data, "{:25.16E}", 3),
            ):
                text = [form.format(x) for x in values]
                rows = range(0, len(text), per_line)
                parts.append(["".join(text[k : k + per_line]) for k in rows])
            count = [sum(map(len, parts)), *map(len, parts), 0]
            head = [
                f"{'stiffness':<72}{'key':<8}",
                "".join(f"{c:14d}" for c in count),
                f"{kind:<14}" + "".join(f"{c:14d}" for c in (*low.shape, low.nnz, 0)),
                f"{'(8I10)':<16}{'(8I10)':<16}{'(1P,3E25.16)':<20}{'':<20}",
            ]
            path.write_text("\n".join([*head, *itertools.chain(*parts), ""]))
        found = lw.flexible.read_matrices(*paths)
        for one, other in ((found.M, M), (found.K, K)):
            assert abs(one - other).max() <= 1e-12 * abs(other).max()
        with pytest.raises(lw.InputError, match="have no numbers of nodes"):
            found.rows([1])

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ("", "is empty"),
            ("1,1, 1,1, 5\n1,1, 1,1, 5\n", "has an entry twice"),
            ("1,1, 1,1, 5\n1,2, 1,2, 5\n", "node 1 has dofs 1, 2"),
            ("1,7, 1,7, 5\n", "has dof 7"),
            ("1,1, 1,2, 5\n1,2, 1,1, 6\n", "entries on both sides that differ"),
            ("1.5,1, 1,1, 5\n", "no whole numbers"),
            ("1 1 nan\n", "empty or not finite"),
            ("1 99999999999 1.0\n", "give 10000000 rows or fewer"),
            ("1 2\n", "has 2 numbers in a line"),
            ("one two three\n", "is no table of numbers"),
            ("%%MatrixMarket matrix coordinate real general\n3 3 5\n1 1 1\n", "is damaged"),
            ("%%MatrixMarket matrix coordinate real general\n9 9 999999999\n1 1 1\n", "entries"),
            ("%%MatrixMarket matrix array real general\n1 1\n1\n", "is array, real"),
        ],
    )
    def test_damaged_files_are_refused_in_one_line(self, tmp_path, text, message):
        path = tmp_path / "a.mtx"
        path.write_text(text)
        with pytest.raises(lw.InputError) as error:
            lw.flexible.read_matrices(path, path)
        assert message in str(error.value)
        assert "\n" not in str(error.value)

    def test_damaged_harwell_boeing_is_refused(self, tmp_path):
        path = tmp_path / "a.hb"
        scipy.io.hb_write(path, sparse.csc_matrix(np.diag([1.0, 2.0, 3.0])))
        good = path.read_text()
        for bad, message in (
            (good[: len(good) // 2], "is damaged"),
            (good.replace("RUA", "CUA"), "is of type CUA"),
            ("x\n" * 9, "is damaged"),
            ("", "is damaged"),
        ):
            path.write_text(bad)
            with pytest.raises(lw.InputError, match=message):
                lw.flexible.read_matrices(path, path)

    def test_wrong_dofs_are_named(self, tmp_path):
        path, dofs = tmp_path / "a.sti", tmp_path / "a.dof"
        path.write_text("1 1 1.0\n2 2 1.0\n3 3 1.0\n")
        for text, message in (
            ("1.1\n1.2\n1.3\n1.4\n", "has 4 dofs, the matrices 3 rows"),
            ("1.1\n1.2\n2.3\n", "node 1 has dofs 1, 2"),
            ("1.1\nx\n", "line 2 is 'x'"),
        ):
            dofs.write_text(text)
            with pytest.raises(lw.InputError, match=message):
                lw.flexible.read_matrices(path, path, dofs=dofs)
