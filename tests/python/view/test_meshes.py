"""Mesh files that hold what cannot be drawn: left out with a line, never a traceback."""

import struct
from xml.sax.saxutils import quoteattr

import numpy as np
import pytest

from linkwise.view.meshes import load_mesh

pytest.importorskip("trimesh")

CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
BODY = (
    '<link name="arm"><inertial><mass value="1"/>'
    '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    '<joint name="j" type="continuous"><parent link="base"/><child link="arm"/></joint>'
)


def stl(corner, count=1):
    triangle = struct.pack("<12fH", 0, 0, 1, *np.ravel([[corner, 0, 0], *CORNERS[1:]]), 0)
    return b"\0" * 80 + struct.pack("<I", count) + triangle


def text_stl(corner):
    corners = "".join(f"vertex {x} {y} {z}\n" for x, y, z in [[corner, 0, 0], *CORNERS[1:]])
    return f"solid\nfacet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\nendsolid\n"


def obj(corner, faces="f 1 2 3\n"):
    return f"v {corner} 0 0\nv 1 0 0\nv 0 1 0\n{faces}"


def off(corner, last=2):
    return f"OFF\n3 1 0\n{corner} 0 0\n1 0 0\n0 1 0\n3 0 1 {last}\n"


BAD = {
    "nan.stl": stl(float("nan")),
    "inf.stl": stl(float("inf")),
    "far.stl": stl(1e30),
    "many.stl": stl(0, count=4_000_000_000),
    "short.stl": stl(0)[:100],
    "empty.stl": b"",
    "nan_text.stl": text_stl("nan"),
    "nan.obj": obj("nan"),
    "inf.obj": obj("-inf"),
    "far.obj": obj("1e300"),
    "index.obj": obj("0", "f 1 2 9\n"),
    "nan.off": off("nan"),
    "index.off": off("0", last=77),
    "noise.glb": b"glTF" + bytes(range(100)),
    "noise.dae": b"<COLLADA>" + bytes(range(32, 100)),
}
GOOD = {"a.stl": stl(0), "text.stl": text_stl(0), "a.obj": obj("0"), "a.off": off("0")}


def write(folder, files):
    for name, content in files.items():
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())


@pytest.mark.parametrize("name", GOOD)
def test_meshes_that_can_be_drawn(tmp_path, name):
    write(tmp_path, GOOD)
    mesh = load_mesh(tmp_path / name, None)
    assert len(mesh.faces) == 1
    np.testing.assert_array_equal(np.sort(mesh.vertices, axis=0), np.sort(CORNERS, axis=0))


@pytest.mark.parametrize("name", BAD)
def test_meshes_that_cannot_be_drawn(tmp_path, name):
    write(tmp_path, BAD)
    assert load_mesh(tmp_path / name, None) is None


def test_each_is_left_out_with_a_line(linkwise, tmp_path):
    pytest.importorskip("viser")
    write(tmp_path, BAD | GOOD)
    missing = ["x" * 5000 + ".stl", "../" * 3000 + "y.stl", "a.stl/inside.stl", "\u0085.stl"]
    visuals = "".join(
        f"<visual><geometry><mesh filename={quoteattr(name)}/></geometry></visual>"
        for name in [*BAD, *GOOD, *missing]
    )
    robot = f'<robot name="r"><link name="base">{visuals}</link>{BODY}</robot>'
    (tmp_path / "robot.urdf").write_text(robot, encoding="utf-8")
    assert linkwise("inspect", "robot.urdf").code == 0
    shown = linkwise("view", "robot.urdf", "--export", "out.html")
    assert shown.code == 0
    lines = shown.err.splitlines()
    assert lines[0].startswith("linkwise: 4 meshes are not on this disk (the first is 'xxx")
    assert max(map(len, lines)) < 200
    assert sorted(lines[1:]) == sorted(
        f"linkwise: mesh '{name}' cannot be read and is left out" for name in BAD
    )


@pytest.mark.parametrize(
    "geometry",
    [
        '<mesh filename="a.stl" scale="1e308 1 1"/>',
        '<sphere radius="1e308"/>',
        '<box size="nan 1 1"/>',
        '<cylinder radius="1" length="inf"/>',
    ],
)
def test_shapes_of_no_size_that_can_be_drawn_are_left_out(linkwise, tmp_path, geometry):
    pytest.importorskip("viser")
    write(tmp_path, GOOD)
    visual = f"<visual><geometry>{geometry}</geometry></visual>"
    far = '<visual><origin xyz="1e300 0 0"/><geometry><sphere radius="1"/></geometry></visual>'
    robot = f'<robot name="r"><link name="base">{visual}{far}</link>{BODY}</robot>'
    (tmp_path / "robot.urdf").write_text(robot)
    shown = linkwise("view", "robot.urdf", "--export", "out.html")
    assert (shown.code, shown.err) == (0, "")
