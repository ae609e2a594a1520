"""Bodies from meshes of tetrahedra, against textbooks."""

import itertools
from collections import Counter

import numpy as np
import pytest
from test_finite_elements import DENSITY, E, arm

import linkwise as lw


def block(cells, size):
    """Tetrahedra of a block, six to a brick, all turned right."""
    grids = [np.linspace(0, length, n + 1) for n, length in zip(cells, size, strict=True)]
    points = np.array(list(itertools.product(*grids)))
    _, ny, nz = (n + 1 for n in cells)
    corners = []
    for at in itertools.product(*(range(n) for n in cells)):
        for order in itertools.permutations(range(3)):
            place, four = np.array(at), []
            for step in (None, *order):
                if step is not None:
                    place = place + np.eye(3, dtype=int)[step]
                four.append(int((place[0] * ny + place[1]) * nz + place[2]))
            r = points[four]
            if np.linalg.det(r[1:] - r[0]) < 0:
                four[2], four[3] = four[3], four[2]
            corners.append(four)
    return points, np.array(corners)


def gmsh(path, points, corners, surfaces):
    """Gmsh's format 2.2; `surfaces` maps names to tests of points."""
    count = Counter(
        tuple(sorted(face)) for four in corners for face in itertools.combinations(four.tolist(), 3)
    )
    faces = [
        (tag, face)
        for face, n in count.items()
        for tag, inside in enumerate(surfaces.values(), 1)
        if n == 1 and inside(points[list(face)]).all()
    ]
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(surfaces) + 1)]
    lines += [f'2 {tag} "{name}"' for tag, name in enumerate(surfaces, 1)]
    lines += ['3 9 "part"', "$EndPhysicalNames", "$Nodes", str(len(points) + 1)]
    # Points of the geometry that no element has are left in such files.
    rows = [*points, np.array([9.0, 9.0, 9.0])]
    lines += [f"{i} {p[0]:.17g} {p[1]:.17g} {p[2]:.17g}" for i, p in enumerate(rows, 1)]
    lines += ["$EndNodes", "$Elements", str(len(faces) + len(corners))]
    cells = [(2, tag, face) for tag, face in faces] + [(4, 9, four) for four in corners]
    for i, (kind, tag, nodes) in enumerate(cells, 1):
        lines.append(f"{i} {kind} 2 {tag} {tag} " + " ".join(str(int(n) + 1) for n in nodes))
    path.write_text("\n".join([*lines, "$EndElements", ""]))


class TestMeshes:
    size = (0.5, 0.05, 0.08)
    material = {"E": E, "nu": 0.3, "density": DENSITY}  # noqa: RUF012

    @pytest.fixture
    def mesh(self, tmp_path):
        pytest.importorskip("skfem")
        pytest.importorskip("meshio")
        path = tmp_path / "block.msh"
        points, corners = block((8, 1, 1), self.size)
        length = self.size[0]
        ends = {"root": lambda r: r[:, 0] < 1e-9, "tip": lambda r: r[:, 0] > length - 1e-9}
        gmsh(path, points, corners, ends)
        return path, points, corners, ends

    handles = {"inboard": "root", "outboard": "tip"}  # noqa: RUF012

    def test_a_block_has_the_mass_and_modes_of_textbooks(self, mesh):
        body = lw.FlexibleBody.from_mesh(mesh[0], **self.material, handles=self.handles, modes=4)
        length, width, height = self.size
        m = DENSITY * length * width * height
        assert body.mass == pytest.approx(m, rel=1e-12)
        assert body.first_moment == pytest.approx([m * length / 2, 0, 0], abs=1e-12)
        J = body.mass_matrix()[3:6, 3:6]
        exact = [
            m * (width**2 + height**2) / 12,
            m * (length**2 / 3 + height**2 / 12),
            m * (length**2 / 3 + width**2 / 12),
        ]
        assert pytest.approx(np.diag(exact), abs=1e-12 * m) == J
        assert body.outboard == pytest.approx([length, 0, 0], abs=1e-12)
        # Shear, held ends and the mesh change a slender cantilever's bending by 3 %.
        slender = 3.51602 / (2 * np.pi) * np.sqrt(E / (12 * DENSITY)) / length**2
        assert body.frequencies[:2] == pytest.approx([slender * width, slender * height], rel=0.03)
        # Drawn out by its end face: E A / L, and what held sides add.
        pull = 1 / (body.outboard_shift[0] ** 2 / body.stiffness).sum()
        assert pull == pytest.approx(E * width * height / length, rel=0.03)
        assert 1 / pull < length / (E * width * height)

    def test_it_runs(self, mesh):
        body = lw.FlexibleBody.from_mesh(
            mesh[0], **self.material, handles=self.handles, modes=0, damping=0.01
        )
        run = lw.simulate(arm(body), duration=0.001)
        assert run.outcome == "converged"

    def test_what_is_wrong_is_said_in_one_line(self, mesh, tmp_path):
        path, points, corners, ends = mesh
        bad, empty = tmp_path / "bad.msh", tmp_path / "empty.msh"
        turned = corners.copy()
        turned[5, :2] = turned[5, 1::-1]
        gmsh(bad, points, turned, ends)
        empty.write_text("$MeshFormat\n")
        good = {"path": path, "handles": self.handles, **self.material}
        for change, message in (
            ({"path": bad}, "element 6 of 48 is inverted or flat"),
            ({"path": empty}, "cannot be read"),
            ({"handles": {"inboard": "rot"}}, "did you mean 'root'?"),
            ({"nu": 0.5}, "nu of a mesh is 0.5"),
            ({"E": -1.0}, "E of a mesh is -1.0"),
            ({"density": float("nan")}, "density of a mesh is nan"),
        ):
            with pytest.raises(lw.InputError) as error:
                lw.FlexibleBody.from_mesh(**(good | change))
            assert message in str(error.value)
            assert "\n" not in str(error.value)
