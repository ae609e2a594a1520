"""URDF: what is read, and that nothing is lost or guessed on the way."""

import numpy as np
import pytest

import linkwise as lw
from linkwise.io.urdf import UrdfJoint, depth_first


def notes(model):
    return [(note.level, note.element, note.text) for note in model.notes]


def test_reads_joints_limits_and_passive_forces(arm):
    model = lw.load(arm)
    assert model.name == "arm"
    assert model.source == str(arm)
    assert model.joint_names == ["shoulder", "slide"]
    assert model.joint_types == ["revolute", "prismatic"]
    assert model.child_link_names == ["upper", "lower"]
    assert model.total_mass == pytest.approx(3.0)
    np.testing.assert_array_equal(model.lower_limit, [-1, 0])
    np.testing.assert_array_equal(model.upper_limit, [2, 0.5])
    np.testing.assert_array_equal(model.effort_limit, [30, 10])
    np.testing.assert_array_equal(model.velocity_limit, [4, 1])
    np.testing.assert_array_equal(model.damping, [0.5, 0])
    np.testing.assert_array_equal(model.friction, [0.25, 0])
    np.testing.assert_array_equal(model.gravity, [0, 0, -9.81])
    assert not [n for n in model.notes if n.level == "warning"]


def test_links_without_mass_are_joints_and_no_bodies(arm):
    text = arm.read_text()
    start = text.index("<inertial>")
    arm.write_text(text[:start] + text[text.index("</inertial>") + len("</inertial>") :])
    model = lw.load(arm)
    assert (model.n_joints, model.n_bodies) == (2, 1)
    assert lw.joint_loads(model, [0.1, 0.2], [0, 0], [0, 0]).shape == (model.n_joints, 6)
    assert model.child_link_masses.tolist() == [0, 1]


def test_gravity_is_an_argument(arm, complaint):
    np.testing.assert_array_equal(lw.load(arm, gravity=[1, 2, 3]).gravity, [1, 2, 3])
    assert "gravity" in complaint(lw.load, arm, gravity=(0, 0))
    assert "gravity" in complaint(lw.load, arm, gravity=(0, 0, float("nan")))
    assert "gravity" in complaint(lw.load, arm, gravity="down")


def test_zero_gravity_is_not_taken_for_no_gravity_given(arm):
    np.testing.assert_array_equal(lw.load(arm, gravity=(0, 0, 0)).gravity, [0, 0, 0])


def test_floating_base_adds_a_joint_with_six_degrees_of_freedom(arm):
    text = arm.read_text().replace(
        '<link name="base"/>',
        '<link name="base"><inertial><mass value="1"/>'
        '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>',
    )
    arm.write_text(text)
    model = lw.load(arm, floating_base=True)
    assert model.joint_types == ["floating", "revolute", "prismatic"]
    assert (model.nq, model.nv) == (9, 8)


def test_rotated_inertial_frame_is_honoured(arm):
    """An inertia given along axes turned by rpy is the same as one written out along link axes."""
    turned = arm.with_name("turned.urdf")
    text = arm.read_text()
    turned.write_text(
        text.replace(
            '<origin xyz="0 0 0.5" rpy="0 0 0"/>\n      <mass value="2"/>\n'
            '      <inertia ixx="0.2" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.01"/>',
            '<origin xyz="0 0 0.5" rpy="1.5707963267948966 0 0"/>\n      <mass value="2"/>\n'
            '      <inertia ixx="0.2" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.2"/>',
        )
    )
    assert turned.read_text() != text
    q, v, tau = [0.3, 0.1], [0.7, -0.2], [1.0, 2.0]
    np.testing.assert_allclose(
        lw.forward_dynamics(lw.load(turned), q, v, tau),
        lw.forward_dynamics(lw.load(arm), q, v, tau),
        rtol=1e-12,
    )


def test_missing_axis_is_x(arm):
    """The format's default axis: 1 0 0, in the joint frame."""
    missing = arm.with_name("missing.urdf")
    missing.write_text(arm.read_text().replace('<axis xyz="1 0 0"/>', ""))
    for of_model in (lw.load(arm), lw.load(missing)):
        loads = lw.joint_loads(of_model, [0.2, 0.1], [1.0, 0.5], [0.0, 3.0])
        assert loads[1, 0] == pytest.approx(3.0)


def test_axis_is_normalised_with_a_note(arm):
    long = arm.with_name("long.urdf")
    long.write_text(arm.read_text().replace('xyz="0 1 0"', 'xyz="0 3 0"'))
    model = lw.load(long)
    assert ("warning", "shoulder", "axis has length 3; only its direction is used") in notes(model)
    np.testing.assert_allclose(
        lw.forward_dynamics(model, [0.3, 0.1], [0.7, -0.2], [1.0, 2.0]),
        lw.forward_dynamics(lw.load(arm), [0.3, 0.1], [0.7, -0.2], [1.0, 2.0]),
        rtol=1e-12,
    )


@pytest.mark.parametrize(
    ("limit", "expected", "said"),
    [
        ("", (-np.inf, np.inf), "has no <limit>"),
        ('<limit effort="1" velocity="1"/>', (-np.inf, np.inf), "<limit> has no bounds"),
        ('<limit upper="2" effort="1" velocity="1"/>', (0, 2), "<limit> has no lower bound"),
        ('<limit lower="-2" effort="1" velocity="1"/>', (-2, 0), "<limit> has no upper bound"),
    ],
)
def test_incomplete_limits_are_noted(arm, limit, expected, said):
    old = '<limit lower="-1" upper="2" effort="30" velocity="4"/>'
    arm.write_text(arm.read_text().replace(old, limit))
    model = lw.load(arm)
    assert (model.lower_limit[0], model.upper_limit[0]) == expected
    (text,) = [n.text for n in model.notes if n.element == "shoulder"]
    assert text.startswith(said)


def test_what_is_ignored_is_noted(arm):
    arm.write_text(
        arm.read_text().replace(
            "</robot>",
            '<transmission name="a"/><transmission name="b"/><gazebo/><material name="red"/>'
            "<sensor:camera/></robot>",
        )
    )
    ignored = {n.element: n.text for n in lw.load(arm).notes if n.level == "info"}
    assert ignored["<transmission>"] == "2 without a motor's inertia: nothing of them acts"
    assert ignored["<gazebo>"].startswith("1 ignored")
    assert ignored["<camera>"].startswith("1 ignored")
    assert "<material>" not in ignored


def test_broken_visuals_and_missing_meshes_do_not_matter(arm):
    visual = (
        '<link name="base"><visual><geometry><mesh filename="package://no/such.dae" scale="x"/>'
        '</geometry><material name="m"><color/></material></visual></link>'
    )
    arm.write_text(arm.read_text().replace('<link name="base"/>', visual))
    assert lw.load(arm).nv == 2


def test_default_namespace_and_undeclared_prefixes_are_read(arm):
    text = arm.read_text().replace(
        '<robot name="arm">', '<robot name="arm" xmlns="http://example.org/urdf">'
    )
    arm.write_text(text.replace("</robot>", "<controller:x/></robot>"))
    assert lw.load(arm).joint_names == ["shoulder", "slide"]


def test_mimic_is_independent_with_a_warning_or_an_error_where_asked_for(arm, complaint):
    mimic = '<mimic joint="shoulder" multiplier="2" offset="0.1"/>'
    arm.write_text(arm.read_text().replace('<axis xyz="1 0 0"/>', f'<axis xyz="1 0 0"/>{mimic}'))
    model = lw.load(arm, mimic="independent")
    assert model.nv == 2
    text = "mimics joint 'shoulder': the coupling is ignored, it moves independently"
    assert ("warning", "slide", text) in notes(model)
    message = complaint(lw.load, arm, mimic="error")
    assert message == (
        ":26: joint 'slide': mimics joint 'shoulder'; couple them with mimic=\"couple\", "
        'let it move on its own with mimic="independent", or remove <mimic>'
    )


def test_mimic_as_a_coupling(arm, complaint):
    text, axis = arm.read_text(), '<axis xyz="1 0 0"/>'
    twin = lw.load(arm).with_coupling("slide_mimic", {"slide": 1, "shoulder": -2}, offset=0.1)
    mimic = '<mimic joint="shoulder" multiplier="2" offset="0.1"/>'
    arm.write_text(text.replace(axis, f"{axis}{mimic}"))
    model = lw.load(arm)
    assert model.coupling_names == ["slide_mimic"]
    assert model.hash == twin.hash
    for wrong, said in {
        mimic.replace("shoulder", "shoulde"): "mimics joint 'shoulde', which does not exist; ",
        mimic.replace("shoulder", "slide"): "mimics itself; name another joint",
        mimic.replace('"2"', '"0"'): "coupling 'slide_mimic': the factor of joint 'shoulder'",
    }.items():
        arm.write_text(text.replace(axis, f"{axis}{wrong}"))
        message = complaint(lw.load, arm)
        assert message.startswith(":26: "), message
        assert said in message, message


def test_joints_that_mimic_each_other_are_refused(arm, complaint):
    """Two equations for two joints hold both, which no file means."""
    text = arm.read_text()
    for joint, leader in (("shoulder", "slide"), ("slide", "shoulder")):
        start = text.index("<axis", text.index(f'<joint name="{joint}"'))
        text = f'{text[:start]}<mimic joint="{leader}"/>{text[start:]}'
    arm.write_text(text)
    assert complaint(lw.load, arm).endswith(
        ": joint 'shoulder': mimics itself by way of others: 'shoulder' mimics 'slide' mimics "
        "'shoulder'; let one of them mimic none"
    )
    assert lw.load(arm, mimic="independent").nv == 2


def test_unknown_options_are_refused(arm, complaint):
    assert "joint_order: unknown value 'name'" in complaint(lw.load, arm, joint_order="name")
    assert "mimic: unknown value 'x'" in complaint(lw.load, arm, mimic="x")
    assert "is not a directory" in complaint(lw.load, arm, package_dirs=["/no/such/directory"])


def edges(*pairs):
    return [UrdfJoint(name, "fixed", parent, child, {}) for name, parent, child in pairs]


def test_depth_first_order():
    joints = edges(
        ("z_tip", "b", "c"),
        ("m", "root", "d"),
        ("z_first", "root", "b"),
        ("a_late", "d", "e"),
    )
    assert [j.name for j in depth_first(joints)] == ["m", "a_late", "z_first", "z_tip"]


def test_depth_first_order_of_a_chain_deeper_than_the_recursion_limit():
    joints = edges(*((f"j{i}", f"l{i}", f"l{i + 1}") for i in reversed(range(20_000))))
    assert depth_first(joints) == joints[::-1]


def test_depth_first_order_keeps_joints_of_cycles_for_the_core_to_refuse():
    joints = edges(("out", "root", "a"), ("ab", "a", "b"), ("ba", "b", "a"), ("cd", "c", "c"))
    assert sorted(j.name for j in depth_first(joints)) == ["ab", "ba", "cd", "out"]


def test_joint_orders_of_a_loaded_model(arm):
    arm.write_text(
        arm.read_text().replace("</robot>", "")
        + """<link name="side"><inertial><mass value="1"/>
        <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
        <joint name="elbow" type="continuous"><parent link="base"/><child link="side"/>
        <axis xyz="0 0 1"/></joint></robot>"""
    )
    assert lw.load(arm).joint_names == ["shoulder", "slide", "elbow"]
    ordered = lw.load(arm, joint_order="pinocchio").joint_names
    assert ordered == ["elbow", "shoulder", "slide"]


def test_planar_joint_takes_its_axis_as_normal(arm):
    planar = (
        arm.read_text()
        .replace('type="revolute"', 'type="planar"')
        .replace('<axis xyz="0 1 0"/>', '<axis xyz="0 0 1"/>')
    )
    arm.write_text(planar)
    model = lw.load(arm)
    assert model.joint_types[0] == "planar"
    assert ("warning", "shoulder", "damping of a planar joint is ignored") in notes(model)
    # Its normal is vertical: gravity does not accelerate it.
    a = lw.forward_dynamics(model, np.zeros(4), np.zeros(4), np.zeros(4))
    np.testing.assert_allclose(a, 0, atol=1e-12)


def test_floating_joint(arm):
    arm.write_text(arm.read_text().replace('type="revolute"', 'type="floating"'))
    model = lw.load(arm)
    assert model.joint_types[0] == "floating"
    a = lw.forward_dynamics(model, model.neutral_configuration(), np.zeros(7), np.zeros(7))
    np.testing.assert_allclose(a, [0, 0, -9.81, 0, 0, 0, 0], atol=1e-12)


def test_a_link_with_two_parents_closes_a_loop(arm):
    """It hangs on the joint with more to say, as it does at zero; the other one closes the loop."""
    brace = (
        '<joint name="brace" type="revolute"><parent link="base"/><child link="lower"/>'
        '<origin xyz="0 0 1.1" rpy="0 0 1.5707963267948966"/><axis xyz="0 1 0"/></joint></robot>'
    )
    arm.write_text(arm.read_text().replace("</robot>", brace))
    model = lw.load(arm)
    assert (model.joint_names, model.loop_names) == (["shoulder", "slide"], ["brace"])
    assert (model.loop_parent_link_names, model.loop_child_link_names) == (["base"], ["lower"])
    assert lw.loop_gaps(model, [0.0, 0.0]) == pytest.approx(np.zeros((1, 2)), abs=1e-15)
    said = "closes a loop of joints 'brace', 'slide' and 'shoulder'"
    assert ("info", "brace", said) in notes(model)
