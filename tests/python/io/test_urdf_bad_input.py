"""Every defect of a URDF is one line that names file, line, element and remedy."""

import os
from io import BytesIO

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

import linkwise as lw
from helpers.arm_urdf import ARM
from helpers.load_or_complain import load_or_complain
from linkwise._core import InputError

REPLACED = [
    pytest.param(
        'type="revolute"',
        'type="revolut"',
        ":18: joint 'shoulder': unknown type 'revolut'; "
        "use one of fixed, revolute, continuous, prismatic, planar, floating",
        id="unknown joint type",
    ),
    pytest.param(
        ' type="revolute"',
        "",
        ":18: joint 'shoulder': has no type; "
        "use one of fixed, revolute, continuous, prismatic, planar, floating",
        id="no joint type",
    ),
    pytest.param(
        'xyz="0 1 0"',
        'xyz="0 0 0"',
        ":22: joint 'shoulder': axis has zero length; give a nonzero axis",
        id="zero axis",
    ),
    pytest.param(
        'xyz="0 1 0"',
        'xyz="0 1"',
        ":22: joint 'shoulder': axis: has 2 numbers instead of 3; give 3 finite numbers",
        id="short axis",
    ),
    pytest.param(
        '<axis xyz="0 1 0"/>',
        "<axis/>",
        ":22: joint 'shoulder': <axis> has no xyz; add xyz=\"...\"",
        id="axis without xyz",
    ),
    pytest.param(
        'xyz="0 0 0.1"',
        'xyz="0 nan 0.1"',
        ":21: joint 'shoulder': origin xyz: 'nan' is not a finite number; give 3 finite numbers",
        id="nan",
    ),
    pytest.param(
        'xyz="0 0 0.1"',
        'xyz="0 0 -Infinity"',
        ":21: joint 'shoulder': origin xyz: '-Infinity' is not a finite number; "
        "give 3 finite numbers",
        id="infinity",
    ),
    pytest.param(
        '<mass value="2"/>',
        '<mass value="1e400"/>',
        ":7: link 'upper': mass: '1e400' is too large for a double; give a finite number",
        id="1e400",
    ),
    pytest.param(
        '<mass value="2"/>',
        '<mass value="1_0"/>',
        ":7: link 'upper': mass: '1_0' is not a number; give a finite number",
        id="underscore",
    ),
    pytest.param(
        '<mass value="2"/>',
        '<mass value="٣"/>',
        ":7: link 'upper': mass: '٣' is not a number; give a finite number",
        id="digit of another script",
    ),
    pytest.param(
        '<mass value="2"/>',
        '<mass value=""/>',
        ":7: link 'upper': mass: a number is missing; give a finite number",
        id="empty number",
    ),
    pytest.param(
        '<mass value="2"/>',
        '<mass value="${m}"/>',
        ":7: link 'upper': mass: '${m}' is not a number; expand the xacro expression first",
        id="xacro expression",
    ),
    pytest.param(
        '<mass value="2"/>',
        '<mass value="-2"/>',
        ":7: link 'upper': mass is negative (-2); give a mass >= 0 in kg",
        id="negative mass",
    ),
    pytest.param(
        '<mass value="2"/>',
        "",
        ":5: link 'upper': <inertial> has no <mass>; add <mass value=\"...\"/> in kg",
        id="no mass",
    ),
    pytest.param(
        '<inertia ixx="0.2" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.01"/>',
        "",
        ":5: link 'upper': <inertial> has no <inertia>; "
        'add <inertia ixx="..." ixy="..." ixz="..." iyy="..." iyz="..." izz="..."/>',
        id="no inertia",
    ),
    pytest.param(
        'ixx="0.2" ixy="0"',
        'ixx="0.2"',
        ":8: link 'upper': <inertia> has no ixy; add ixy=\"...\"",
        id="incomplete inertia",
    ),
    pytest.param(
        'link name="upper"',
        'link name="base"',
        ":4: link 'base': the name is used twice (first on line 3); rename one of them",
        id="duplicate link",
    ),
    pytest.param(
        'joint name="slide"',
        'joint name="shoulder"',
        ":26: joint 'shoulder': the name is used twice (first on line 18); rename one of them",
        id="duplicate joint",
    ),
    pytest.param(
        '<link name="base"/>',
        "<link/>",
        ':3: link: has no name; add name="..."',
        id="link without a name",
    ),
    pytest.param(
        '<parent link="upper"/>',
        '<parent link="uper"/>',
        ":26: joint 'slide': parent link 'uper' does not exist; did you mean 'upper'?",
        id="unknown parent",
    ),
    pytest.param(
        '<child link="lower"/>',
        '<child link="zzz"/>',
        ":26: joint 'slide': child link 'zzz' does not exist; known: base, upper, lower",
        id="unknown child",
    ),
    pytest.param(
        '<child link="lower"/>',
        "",
        ":26: joint 'slide': has no child link; add <child link=\"...\"/>",
        id="no child",
    ),
    pytest.param(
        '<child link="lower"/>',
        '<child link="upper"/>',
        ":26: joint 'slide': link 'upper' is its parent and its child; give it two links",
        id="a link on itself",
    ),
    pytest.param(
        '<parent link="base"/>',
        '<parent link="lower"/>',
        ":18: joint 'shoulder' closes a loop of joints 'slide' and 'shoulder' that hangs on "
        "nothing; join link 'upper' to the rest",
        id="cycle",
    ),
    pytest.param(
        "</robot>",
        '<link name="loose"/></robot>',
        ":33: links 'base' and 'loose' both have no parent; "
        "a model has one root: join them with a joint",
        id="two roots",
    ),
    pytest.param(
        'lower="-1" upper="2"',
        'lower="2" upper="-1"',
        ":23: joint 'shoulder': lower limit 2 is above the upper limit -1; swap them, or "
        "leave both out where there is no limit",
        id="limits reversed",
    ),
    pytest.param(
        'effort="30"',
        'effort="-30"',
        ":23: joint 'shoulder': effort is negative (-30); give a value >= 0",
        id="negative effort",
    ),
    pytest.param(
        'damping="0.5"',
        'damping="-0.5"',
        ":24: joint 'shoulder': damping is negative (-0.5); give a value >= 0",
        id="negative damping",
    ),
    pytest.param(
        '<axis xyz="0 1 0"/>',
        '<axis xyz="0 1 0"/><axis xyz="1 0 0"/>',
        ":22: joint 'shoulder': has two <axis> elements; keep one",
        id="two axes",
    ),
    pytest.param(
        'rpy="0 0 1.5707963267948966"',
        'quat_xyzw="0 0 0 1"',
        ":29: joint 'slide': origin quat_xyzw is not supported; give the rotation as rpy",
        id="quaternion",
    ),
    pytest.param(
        "</robot>",
        '<xacro:macro name="m" xmlns:xacro="http://wiki.ros.org/xacro"/></robot>',
        ":33: element 'xacro:macro': this is a xacro file, not yet a URDF; "
        "expand it first: xacro FILE.xacro > FILE.urdf",
        id="xacro",
    ),
    pytest.param(
        "</robot>",
        '<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="/etc/hostname"/></robot>',
        ":33: element 'xi:include': including other files is not allowed; "
        "paste the content in its place",
        id="xinclude",
    ),
]


@pytest.mark.parametrize(("old", "new", "expected"), REPLACED)
def test_defect_is_named(arm, complaint, old, new, expected):
    text = arm.read_text()
    assert old in text
    arm.write_text(text.replace(old, new, 1))
    assert complaint(lw.load, arm) == expected


def test_cycle_apart_from_the_root(arm, complaint):
    arm.write_text(
        arm.read_text().replace(
            "</robot>",
            """<link name="a"/><link name="b"/>
            <joint name="ab" type="revolute"><parent link="a"/><child link="b"/></joint>
            <joint name="ba" type="revolute"><parent link="b"/><child link="a"/></joint></robot>""",
        )
    )
    assert complaint(lw.load, arm) == (
        ":35: joint 'ba' closes a loop of joints 'ab' and 'ba' that hangs on nothing; "
        "join link 'a' to the rest"
    )


def test_negative_principal_inertia(arm, complaint):
    arm.write_text(arm.read_text().replace('izz="0.01"', 'izz="-0.01"', 1))
    assert complaint(lw.load, arm) == (
        ":8: link 'upper': inertia has a negative principal moment (-0.01 kg m2); "
        "give a positive semidefinite inertia about the centre of mass"
    )


def test_rounding_noise_is_no_negative_inertia(arm):
    """Printed by CAD programs for point masses: of iCub's links, for instance."""
    old = 'ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.01"'
    new = 'ixx="0" ixy="1e-20" ixz="0" iyy="0" iyz="0" izz="0"'
    assert old in arm.read_text()
    arm.write_text(arm.read_text().replace(old, new))
    assert lw.load(arm).nv == 2


def test_negative_inertia_of_a_welded_link_counts_in_the_sum(arm):
    welded = """<link name="antenna"><inertial><mass value="1e-6"/>
      <inertia ixx="{0}" ixy="0" ixz="0" iyy="1e-8" iyz="0" izz="1e-8"/></inertial></link>
      <joint name="weld" type="fixed"><parent link="lower"/><child link="antenna"/></joint>
      </robot>"""
    text = arm.read_text()
    arm.write_text(text.replace("</robot>", welded.format("-3e-8")))
    assert lw.load(arm).nv == 2
    arm.write_text(text.replace("</robot>", welded.format("-3")))
    with pytest.raises(InputError, match=r"^[^\n]*arm.urdf:34: link 'antenna': .*negative.*; give"):
        lw.load(arm)


def test_indefinite_inertia_with_positive_diagonal(arm, complaint):
    arm.write_text(arm.read_text().replace('ixy="0"', 'ixy="0.3"', 1))
    message = complaint(lw.load, arm)
    assert "link 'upper'" in message
    assert "negative" in message


def test_massless_leaf_on_a_moving_joint(arm):
    text = arm.read_text()
    start = text.index("<inertial>", text.index('"lower"'))
    end = text.index("</inertial>", start) + len("</inertial>")
    arm.write_text(text[:start] + text[end:])
    model = lw.load(arm)
    with pytest.raises(InputError, match=r"^link 'lower' of [^\n]*arm\.urdf[^\n]*; [^\n]*$"):
        lw.forward_dynamics(model, model.neutral_configuration(), [0.0] * model.nv)


BOMB = """<?xml version="1.0"?>
<!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">
<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">]>
<robot name="&c;"><link name="base"/></robot>"""
EXTERNAL = """<?xml version="1.0"?>
<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/hostname">]>
<robot name="r"><link name="&x;"/></robot>"""
REMOTE_DTD = """<?xml version="1.0"?>

<!DOCTYPE robot SYSTEM "http://example.org/robot.dtd"><robot name="r"><link name="a"/></robot>"""


@pytest.mark.parametrize(
    ("text", "line"), [(BOMB, 2), (EXTERNAL, 2), (REMOTE_DTD, 3)], ids=["bomb", "external", "dtd"]
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_entities_are_refused_before_they_are_read(tmp_path, complaint, text, line, encoding):
    path = tmp_path / "robot.urdf"
    path.write_bytes(text.encode(encoding))
    assert complaint(lw.load, path) == (
        f":{line}: DOCTYPE: document type and entity definitions are not allowed in a model file; "
        "delete the <!DOCTYPE ...> and write the entities out"
    )


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (
            b"",
            ":1: model file: is not XML (no element found: the file is empty); "
            "give a URDF, MJCF or SDF file",
        ),
        (
            b"hello",
            ":1: model file: is not XML (syntax error); give a URDF, MJCF or SDF file",
        ),
        (
            b"\x00\x01\x02",
            ":1: model file: is not XML (it holds the control character U+0000); "
            "delete this character",
        ),
        (
            b"<robot><link>\n</robot>",
            ":2: model file: is not XML (<link> of line 1 is closed by </robot>); "
            "write </link> where it ends",
        ),
        (
            b"<scene/>",
            ":1: element 'scene': is the root of neither a URDF, an MJCF nor an SDF; "
            "give a file whose root element is <robot>, <mujoco> or <sdf>",
        ),
        (
            b'<robot name="r"/>',
            ":1: robot: has no links; give a complete URDF "
            "(if it comes from xacro, expand it first)",
        ),
    ],
)
def test_not_a_model(tmp_path, complaint, content, expected):
    path = tmp_path / "robot.urdf"
    path.write_bytes(content)
    assert complaint(lw.load, path) == expected


def test_too_deep(tmp_path, complaint):
    path = tmp_path / "robot.urdf"
    path.write_text("<robot>" * 100_000)
    assert "is not XML (Excessive depth" in complaint(lw.load, path)


def test_missing_file_and_directory(tmp_path, arm, complaint):
    expected = ": model file: no such file; check the path (did you mean 'arm.urdf'?)"
    assert complaint(lw.load, tmp_path / "amr.urdf") == expected
    folder = tmp_path / "robots"
    expected = f": model file: no such file; check the path (there is no directory '{folder}')"
    assert complaint(lw.load, folder / "arm.urdf") == expected
    folder.mkdir()
    expected = ": model file: is a directory; give the path of a file in it"
    assert complaint(lw.load, folder) == expected


def test_a_pipe_is_not_waited_for(tmp_path, complaint):
    path = tmp_path / "robot.urdf"
    os.mkfifo(path)
    expected = ": model file: is not a regular file; give the path of a file"
    assert complaint(lw.load, path) == expected


def test_too_large(tmp_path, complaint):
    path = tmp_path / "robot.urdf"
    with path.open("wb") as file:
        file.truncate(2**40)  # a sparse file: takes no space
    assert ": model file: is larger than 32 MiB; build very large models" in complaint(
        lw.load, path
    )


@pytest.mark.parametrize("name", ["run.toml", "robot.xacro", "drive.csv"])
def test_other_kinds_of_file(tmp_path, complaint, name):
    path = tmp_path / name
    path.write_text("")
    assert complaint(lw.load, path).startswith(": model file: is not a model; it looks like")


def test_names_with_control_characters_stay_on_one_line(arm, complaint):
    arm.write_text(arm.read_text().replace('type="revolute"', 'type="a&#10;b&#13;&#9;c"'))
    assert "unknown type 'a b c'; " in complaint(lw.load, arm)


TOKENS = st.sampled_from(
    [
        "0",
        "1",
        "-1",
        "nan",
        "1e400",
        "",
        "x",
        "0 0 0",
        "1 0 0",
        "fixed",
        "base",
        "upper",
        "<",
        "&",
        '"',
    ]
)


@given(st.integers(0, 60), TOKENS)
def test_any_attribute_may_be_garbage(tmp_path_factory, position, token):
    """A model or one line, never another exception."""
    root = etree.parse(BytesIO(ARM.encode())).getroot()
    places = [(element, key) for element in root.iter(etree.Element) for key in element.attrib]
    element, key = places[position % len(places)]
    element.set(key, token)
    load_or_complain(tmp_path_factory.getbasetemp(), "fuzz.urdf", etree.tostring(root))


@given(st.integers(0, 1400), st.integers(0, 40), st.binary(max_size=4))
def test_any_bytes_may_be_damaged(tmp_path_factory, start, length, new):
    data = ARM.encode()
    load_or_complain(
        tmp_path_factory.getbasetemp(), "fuzz.urdf", data[:start] + new + data[start + length :]
    )
