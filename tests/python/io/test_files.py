"""Mesh references are resolved locally or not at all."""

import pytest

from linkwise.io.files import resolve_mesh


@pytest.fixture
def tree(tmp_path):
    """workspace/arm_pkg/{urdf/arm.urdf, meshes/link.stl}, workspace/other/arm_pkg/meshes/x.stl"""
    for name in ("ws/arm_pkg/urdf/arm.urdf", "ws/arm_pkg/meshes/link.stl", "other/pkg/x.stl"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    return tmp_path


def test_packages_above_the_model_and_in_given_directories(tree):
    urdf = tree / "ws/arm_pkg/urdf/arm.urdf"
    mesh = tree / "ws/arm_pkg/meshes/link.stl"
    assert resolve_mesh("package://arm_pkg/meshes/link.stl", urdf) == mesh
    assert resolve_mesh("../meshes/link.stl", urdf).samefile(mesh)
    assert resolve_mesh(f"file://{mesh}", urdf) == mesh
    other = tree / "other/pkg/x.stl"
    assert resolve_mesh("package://pkg/x.stl", urdf) is None
    assert resolve_mesh("package://pkg/x.stl", urdf, [tree / "other"]) == other
    assert resolve_mesh("package://pkg/x.stl", urdf, [tree / "other/pkg"]) == other


@pytest.mark.parametrize(
    "uri",
    [
        "http://example.org/link.stl",
        "https://example.org/link.stl",
        "model://arm_pkg/meshes/link.stl",
        "package://arm_pkg/../arm_pkg/meshes/link.stl",
        "package://arm_pkg",
        "no_such.stl",
    ],
)
def test_nothing_is_fetched_or_guessed(tree, uri):
    assert resolve_mesh(uri, tree / "ws/arm_pkg/urdf/arm.urdf") is None
