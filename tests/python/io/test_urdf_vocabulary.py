"""Elements and attributes of a URDF that no reader expects: read, refused, or a warning."""

import numpy as np
import pytest

import linkwise as lw

DOOR = """<robot name="door" xmlns:drake="http://drake.mit.edu">
  <link name="frame"/>
  <link name="leaf">
    <inertial>
      <origin xyz="0.4 0 0" rpy="0 0 0.3"/>
      <mass value="20"/>
      <inertia ixx="0.4" ixy="0" ixz="0" iyy="1.1" iyz="0" izz="1.1"/>
    </inertial>
  </link>
  <joint name="hinge" type="revolute">
    <parent link="frame"/>
    <child link="leaf"/>
    <origin xyz="0 0 1" rpy="0 0.2 0"/>
    <axis xyz="0 1 1"/>
    <limit effort="50" velocity="4" lower="-0.1" upper="1.9"/>
    <dynamics damping="100" friction="2"/>
  </joint>
</robot>
"""


@pytest.fixture
def door(tmp_path):
    """Loads the door with one piece of it written another way."""

    def call(old="", new=""):
        assert old in DOOR
        path = tmp_path / "door.urdf"
        path.write_text(DOOR.replace(old, new))
        return lw.load(path)

    return call


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('damping="100" friction="2"/>', "friction='2'><damping>100</damping></dynamics>"),
        (
            'damping="100" friction="2"/>',
            '>\n<damping value="100"/><friction> 2 </friction></dynamics>',
        ),
        ('lower="-0.1" upper="1.9"/>', "><lower>-0.1</lower><upper>1.9</upper></limit>"),
        ('<mass value="20"/>', "<mass>20</mass>"),
        ('<mass value="20"/>', "<mass><value>20</value></mass>"),
        ('<axis xyz="0 1 1"/>', "<axis><xyz>0 1 1</xyz></axis>"),
        ('<origin xyz="0 0 1" rpy="0 0.2 0"/>', "<origin xyz='0 0 1'><rpy>0 0.2 0</rpy></origin>"),
        ('izz="1.1"/>', "><izz>1.1</izz></inertia>"),
    ],
)
def test_elements_that_stand_for_attributes_are_read(door, old, new):
    meant, written = door(), door(old, new)
    q, v = [0.3], [1.5]
    np.testing.assert_array_equal(
        lw.forward_dynamics(written, q, v, passive=True),
        lw.forward_dynamics(meant, q, v, passive=True),
    )
    np.testing.assert_array_equal(lw.link_poses(written, q), lw.link_poses(meant, q))
    for limit in ("lower", "upper", "effort", "velocity"):
        assert written.dof_property(limit) == meant.dof_property(limit)


def test_damping_written_as_an_element_damps(tmp_path):
    """One joint about a fixed axis without gravity: u = u0 exp(-damping t / I)."""
    path = tmp_path / "door.urdf"
    old = '<dynamics damping="100" friction="2"/>'
    path.write_text(DOOR.replace(old, "<dynamics><damping>100</damping></dynamics>"))
    model = lw.load(path, gravity=(0, 0, 0))
    run = lw.simulate(model, duration=0.05, every=0.05, v0=[2.0], tolerance=1e-9)
    axis = np.array([0, 1, 1]) / np.sqrt(2)
    turned = np.array([[np.cos(0.3), -np.sin(0.3), 0], [np.sin(0.3), np.cos(0.3), 0], [0, 0, 1]])
    central = turned @ np.diag([0.4, 1.1, 1.1]) @ turned.T
    arm = np.array([0.4, 0, 0])
    inertia = axis @ central @ axis + 20 * (arm @ arm - (arm @ axis) ** 2)
    expected = 2 * np.exp(-100 * 0.05 / inertia)
    np.testing.assert_allclose(run.velocity.values[-1, 0], expected, rtol=1e-7)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (
            "friction=",
            "spring_stiffness='7' friction=",
            "attribute 'spring_stiffness' of <dynamics>",
        ),
        ("damping=", "dampng=", "did you mean 'damping'"),
        ('ixy="0"', 'ixy="0" iyx="0"', "did you mean 'ixy'"),
        ('rpy="0 0.2 0"', 'rot="1 0 0 0"', "attribute 'rot' of <origin>"),
        ('<mass value="20"/>', '<mass value="20" units="g"/>', "'units' of <mass>"),
        ('iyz="0"', 'iyz="0" izy="1"', "'izy' of <inertia>"),
        ('<axis xyz="0 1 1"/>', '<axis xyz="0 1 1"><frame>b</frame></axis>', "<frame> in <axis>"),
        ("<dynamics damping", "<spring k='5'/><dynamics damping", "element <spring> is not read"),
        ("<inertial>", '<inertial mass="5">', "'mass' of <inertial>"),
        ('<mass value="20"/>', "<mass>20</mass>", "<mass> gives value as text"),
        ("<inertial>", "<Inertial/><inertial>", "did you mean 'inertial'"),
        ("</robot>", '<loop_joint name="l" type="fixed"/></robot>', "write [loop.NAME] instead"),
        (
            "</robot>",
            "<drake:linear_spring_damper/></robot>",
            "<drake:linear_spring_damper> is not read; it acts on the machine",
        ),
        ("<dynamics", '<drake:screw_thread_pitch value="1"/><dynamics', "a helical joint"),
        ("<dynamics", '<gear_ratio value="50"/><dynamics', "gear_ratio with motor_inertia"),
        ("<inertial>", '<box_inertia mass="5"/><inertial>', "element <box_inertia> is not read"),
        ("</robot>", '<frame name="tool"/></robot>', "element <frame> is not read"),
        (
            "</robot>",
            '<gazebo reference="hinge"><springStiffness>5</springStiffness></gazebo></robot>',
            "<springStiffness> of <gazebo>",
        ),
        (
            "</robot>",
            '<gazebo><joint name="loop"><parent>leaf</parent></joint></gazebo></robot>',
            "<joint> of <gazebo>",
        ),
        (
            "</robot>",
            '<gazebo reference="leaf"><turnGravityOff>true</turnGravityOff></gazebo></robot>',
            "<turnGravityOff> of <gazebo>",
        ),
    ],
)
def test_what_is_not_read_is_a_warning_with_its_line(door, old, new, expected):
    warnings = [note.text for note in door(old, new).notes if note.level == "warning"]
    found = [text for text in warnings if expected in text]
    assert len(found) == 1, warnings
    assert "(line " in found[0]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('<mass value="20"/>', '<insert_block name="m"/><mass value="20"/>', "expand it first"),
        ('<origin xyz="0 0 1" rpy="0 0.2 0"/>', '<insert_block name="o"/>', "expand it first"),
        ("</robot>", "<gazebo><xacro:arm/></gazebo></robot>", "expand it first"),
        ("<axis", '<xacro:insert_block name="a"/><axis', "expand it first"),
        (
            "</robot>",
            '<x:arm xmlns:x="http://www.ros.org/wiki/xacro" side="l"/></robot>',
            "'x:arm': this is a xacro file",
        ),
        ("</robot>", '<include filename="arm.xacro"/></robot>', "expand it first"),
        ('link="leaf"', 'link="${side}_leaf"', "expand the xacro expression first"),
        (
            "</robot>",
            '<drake:joint name="j" type="ball"><parent link="leaf"/><child link="x"/></drake:joint>'
            "</robot>",
            "<drake:joint> 'j' of type ball is an extension",
        ),
        ("</inertial>", "<drake:inertia/></inertial>", "<drake:inertia> is an extension"),
        ("<dynamics", "<damping>5</damping><dynamics", "move it into the <dynamics>"),
        ("<inertial>", '<mass value="2"/><inertial>', "move it into the <inertial>"),
        ("</robot>", '<dynamics damping="1"/></robot>', "move it into the <joint>"),
        ('<parent link="frame"/>', '<parent link="frame"/><inertial/>', "into the <link>"),
        (
            "</robot>",
            '<group><link name="x"><inertial/></link></group></robot>',
            "put links and joints directly into <robot>",
        ),
        ('<axis xyz="0 1 1"/>', "<axis>0 1 1</axis>", "write it as an attribute"),
        (
            'damping="100" friction="2"/>',
            'damping="100"><damping>5</damping></dynamics>',
            "gives damping twice",
        ),
    ],
)
def test_what_the_machine_needs_is_refused_with_its_line(door, old, new, expected):
    with pytest.raises(lw.InputError, match=r"door\.urdf:\d+: ") as caught:
        door(old, new)
    assert expected in str(caught.value)


def test_other_vocabularies_without_dynamics_are_counted(door):
    model = door("</robot>", "<drake:capsule/><sensor/><transmission/></robot>")
    assert {note.level for note in model.notes} <= {"info", "merge"} | {
        note.level for note in door().notes
    }
    assert any(note.element == "<capsule>" for note in model.notes)


def test_a_type_in_capitals_is_told_apart(door):
    with pytest.raises(lw.InputError, match="unknown type 'Revolute'; did you mean 'revolute'"):
        door('type="revolute"', 'type="Revolute"')


def test_a_mass_as_text_and_as_attribute_is_refused(door):
    with pytest.raises(lw.InputError, match="holds the text '21'"):
        door('<mass value="20"/>', '<mass value="20">21</mass>')


@pytest.mark.parametrize(
    ("mass", "moments", "hint"),
    [
        ("0.85", ("313692", "320080", "465064"), "1 g mm2 = 1e-9"),  # g mm2
        ("20", ("400000", "1100000", "1100000"), "1 kg mm2 = 1e-6"),  # kg mm2
        ("0.01", ("1", "1", "1"), "by default"),
        ("20", ("0.4", "1.1", "1.1"), None),
    ],
)
def test_inertia_in_another_unit_is_hinted_at(door, mass, moments, hint):
    new = '<mass value="{}"/><inertia ixx="{}" ixy="0" ixz="0" iyy="{}" iyz="0" izz="{}"/>'
    old = DOOR[DOOR.index("<mass") : DOOR.index("    </inertial>")]
    notes = [n for n in door(old, new.format(mass, *moments)).notes if "radius of" in n.text]
    assert [n.element for n in notes] == (["leaf"] if hint else [])
    assert hint is None or hint in notes[0].text


def test_a_centre_of_mass_in_another_unit_is_hinted_at(door):
    """400 mm written as 400, in a machine whose joint is 1 m from the ground."""
    assert not [n for n in door().notes if "centre of mass" in n.text]
    notes = [n for n in door('xyz="0.4 0 0"', 'xyz="400 0 0"').notes if "centre of" in n.text]
    assert [(n.level, n.element) for n in notes] == [("warning", "leaf")]
    assert "400 m from the link's frame" in notes[0].text
    assert "1 mm = 0.001 m" in notes[0].text


def in_sdf(moment):
    return (
        '<sdf version="1.9"><model name="m"><link name="a"/><link name="b"><pose>0 0 .5 0 0 0'
        f"</pose><inertial><mass>0.2</mass><inertia><ixx>{moment}</ixx><iyy>{moment}</iyy>"
        f"<izz>{moment}</izz></inertia></inertial></link>"
        '<joint name="w" type="fixed"><parent>world</parent><child>a</child></joint>'
        '<joint name="j" type="revolute"><parent>a</parent><child>b</child>'
        "<axis><xyz>0 1 0</xyz></axis></joint></model></sdf>"
    )


def in_mjcf(moment, geom=""):
    return (
        '<mujoco><worldbody><body name="a"><inertial pos="0 0 0" mass="1" '
        'diaginertia="0.01 0.01 0.01"/><joint axis="0 1 0"/><body name="b" pos="0 0 .5">'
        f'<inertial pos="0 0 0" mass=".2" diaginertia="{moment} {moment} {moment}"/>'
        f'<joint axis="0 1 0"/>{geom}</body></body></worldbody></mujoco>'
    )


@pytest.mark.parametrize("written", [in_sdf, in_mjcf])
def test_inertia_in_another_unit_is_hinted_at_in_every_format(written):
    if written is in_mjcf:
        pytest.importorskip("mujoco")
    hints = [n for n in lw.load(written(200)).notes if "radius of gyration" in n.text]
    assert [(n.level, n.element) for n in hints] == [("warning", "b")]
    assert not [n for n in lw.load(written(2e-4)).notes if "radius of gyration" in n.text]


def test_a_geom_of_its_size_explains_an_inertia():
    """A light sheet 40 m wide beside joints half a metre apart."""
    pytest.importorskip("mujoco")
    sheet = '<geom type="box" size="20 20 .01" contype="0" conaffinity="0"/>'
    assert not [n for n in lw.load(in_mjcf(26, sheet)).notes if "radius of" in n.text]
