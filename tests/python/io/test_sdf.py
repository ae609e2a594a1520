"""SDF: what its elements become, against the same machine built by hand or read from a URDF."""

from importlib import metadata

import numpy as np
import pytest

import linkwise as lw
from helpers.arm_urdf import ARM
from helpers.closing_frames import closing_frames
from helpers.press_sdf import PRESS

MASS = "<mass>2</mass><inertia><ixx>0.2</ixx><iyy>0.2</iyy><izz>0.01</izz></inertia>"
LINK = f"<inertial>{MASS}</inertial>"


def sdf(inside, version="1.9", before=""):
    return f'<sdf version="{version}">{before}<model name="m">{inside}</model></sdf>'


def one_joint(kind, inside="", pose=""):
    return sdf(
        f'<link name="a">{LINK}</link><link name="b"><pose>0 0 1 0 0 0</pose>{LINK}</link>'
        '<joint name="w" type="fixed"><parent>world</parent><child>a</child></joint>'
        f'<joint name="j" type="{kind}">{pose}<parent>a</parent><child>b</child>{inside}</joint>'
    )


def pose_of(model, link, q=None):
    q = model.initial_configuration() if q is None else q
    return lw.link_poses(model, q)[model.link_names.index(link)]


def test_press():
    model = lw.load(PRESS)
    assert model.name == "press"
    assert model.joint_names == ["drive", "knee", "guide"]
    assert (model.loop_names, model.loop_types) == (["wrist"], ["revolute"])
    assert model.loop_parent_link_names == ["rod"]
    assert model.loop_child_link_names == ["slider"]
    assert model.total_mass == pytest.approx(0.58)
    np.testing.assert_allclose(pose_of(model, "crank")[:3, 3], [0, 0, 1], atol=1e-15)
    np.testing.assert_allclose(pose_of(model, "slider")[:3, 3], [0.45, 0, 1], atol=1e-15)
    np.testing.assert_allclose(pose_of(model, "rod")[:3, 2], [0, -1, 0], atol=1e-15)
    here, there = closing_frames(model, model.initial_configuration())[0]
    np.testing.assert_allclose(here, there, atol=1e-15)
    assert np.isinf(model.velocity_limit[0])
    assert (model.effort_limit[0], model.damping[0], model.friction[0]) == (30, 0.5, 0.25)
    assert (model.lower_limit[2], model.upper_limit[2]) == (-0.4, 0.1)
    assert np.isinf(model.lower_limit[0])


def test_the_same_arm_as_a_urdf():
    """Poses and inertia at random states."""
    arm = lw.load(
        sdf(
            '<link name="base"/><joint name="ground" type="fixed"><parent>world</parent>'
            "<child>base</child></joint>"
            '<link name="upper"><pose>0 0 0.1 0 0 0</pose><inertial><pose>0 0 0.5 0 0 0</pose>'
            f"{MASS}</inertial></link>"
            '<link name="lower"><pose relative_to="upper">0 0 1 0 0 1.5707963267948966</pose>'
            "<inertial><pose>0 0 0.3 0 0 0</pose><mass>1</mass><inertia><ixx>0.1</ixx>"
            "<iyy>0.1</iyy><izz>0.01</izz></inertia></inertial></link>"
            '<joint name="shoulder" type="revolute"><parent>base</parent><child>upper</child>'
            "<axis><xyz>0 1 0</xyz></axis></joint>"
            '<joint name="slide" type="prismatic"><parent>upper</parent><child>lower</child>'
            "<axis><xyz>1 0 0</xyz></axis></joint>"
        ).replace('<link name="base"/>', f'<link name="base">{LINK}</link>')
    )
    twin = lw.load(ARM)
    for q in np.random.default_rng(0).normal(size=(5, 2)):
        for link in ("upper", "lower"):
            np.testing.assert_allclose(pose_of(arm, link, q), pose_of(twin, link, q), atol=1e-14)
        np.testing.assert_allclose(lw.mass_matrix(arm, q), lw.mass_matrix(twin, q), rtol=1e-13)


@pytest.mark.parametrize(
    ("kind", "inside", "here", "nv"),
    [
        ("revolute", "<axis><xyz>0 0 1</xyz></axis>", "revolute", 1),
        ("continuous", "<axis><xyz>0 0 1</xyz></axis>", "continuous", 1),
        ("prismatic", "<axis><xyz>0 0 1</xyz></axis>", "prismatic", 1),
        (
            "screw",
            "<axis><xyz>0 0 1</xyz></axis><screw_thread_pitch>0.01</screw_thread_pitch>",
            "helical",
            1,
        ),
        (
            "universal",
            "<axis><xyz>1 0 0</xyz></axis><axis2><xyz>0 1 0</xyz></axis2>",
            "universal",
            2,
        ),
        ("ball", "", "spherical", 3),
    ],
)
def test_types_of_joints(kind, inside, here, nv):
    model = lw.load(one_joint(kind, inside))
    assert (model.joint_types, model.nv) == ([here], nv)


def test_a_screw_advances_by_its_pitch_a_turn():
    inside = "<axis><xyz>0 0 1</xyz></axis><screw_thread_pitch>0.01</screw_thread_pitch>"
    model = lw.load(one_joint("screw", inside))
    assert pose_of(model, "b", [2 * np.pi])[2, 3] == pytest.approx(1.01, abs=1e-15)


def test_a_joint_beside_its_child():
    """Its pose counts from the child, whose frame comes to lie there; mass and motion stay."""
    model = lw.load(
        one_joint(
            "revolute",
            "<axis><xyz>0 1 0</xyz></axis>",
            "<pose>0.5 0 0 0 0 1.5707963267948966</pose>",
        )
    )
    np.testing.assert_allclose(pose_of(model, "b")[:3, 3], [0.5, 0, 1], atol=1e-15)
    np.testing.assert_allclose(pose_of(model, "b")[:3, 1], [-1, 0, 0], atol=1e-15)
    center = pose_of(model, "b") @ [*model.link_centers_of_mass[model.link_names.index("b")], 1]
    np.testing.assert_allclose(center[:3], [0, 0, 1], atol=1e-15)
    # About world -x through (0.5, 0, 1), on which its centre does not move along x.
    turned = pose_of(model, "b", [np.pi / 2]) @ [
        *model.link_centers_of_mass[model.link_names.index("b")],
        1,
    ]
    np.testing.assert_allclose(turned[:3], [0, 0, 1], atol=1e-15)


def test_axes_may_be_expressed_in_another_frame():
    text = one_joint("revolute", '<axis><xyz expressed_in="__model__">1 0 0</xyz></axis>').replace(
        "0 0 1 0 0 0", "0 0 1 0 0 1.5707963267948966"
    )
    ((_, axis),) = lw.load(text).joint_axes[0]
    np.testing.assert_allclose(axis, [0, -1, 0], atol=1e-15)


def test_of_the_parent_model_in_old_versions():
    inside = "<axis><xyz>1 0 0</xyz><use_parent_model_frame>true</use_parent_model_frame></axis>"
    text = one_joint("revolute", inside).replace('version="1.9"', 'version="1.6"')
    text = text.replace("0 0 1 0 0 0", "0 0 1 0 0 1.5707963267948966")
    ((_, axis),) = lw.load(text).joint_axes[0]
    np.testing.assert_allclose(axis, [0, -1, 0], atol=1e-15)


def test_rotations_in_degrees_and_quaternions():
    link = '<link name="a"><pose {}>1 2 3 {}</pose>' + LINK + "</link>"
    half = np.sqrt(0.5)
    for how, rotation in (
        ('degrees="true"', "0 0 90"),
        ('rotation_format="quat_xyzw"', f"0 0 {half!r} {half!r}"),
    ):
        model = lw.load(sdf(link.format(how, rotation.replace("np.float64(", "").replace(")", ""))))
        expected = [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]
        np.testing.assert_allclose(pose_of(model, "a"), expected, atol=1e-15)


def test_what_is_not_joined_to_the_world_floats_where_it_is_drawn():
    link = f'<link name="a"><pose>0 2 0 0.3 -0.2 2.9</pose>{LINK}</link>'
    model = lw.load(sdf(f"<pose>1 0 0 0 0 0</pose>{link}"))
    assert (model.joint_names, model.nv) == (["a_free"], 6)
    placed = pose_of(model, "a")
    np.testing.assert_allclose(placed[:3, 3], [1, 2, 0], atol=1e-15)
    twin = lw.load(one_joint("fixed").replace("0 0 1 0 0 0", "0 0 0 0.3 -0.2 2.9"))
    np.testing.assert_allclose(placed[:3, :3], pose_of(twin, "b")[:3, :3], atol=1e-14)
    assert any("floats" in note.text for note in model.notes)


def test_gravity_of_the_world():
    world = (
        '<sdf version="1.7"><world name="w"><gravity>0 0 -1.6</gravity><light name="l"/>'
        f'<model name="m"><link name="a">{LINK}</link></model></world></sdf>'
    )
    assert lw.load(world).gravity[2] == -1.6
    assert lw.load(world, gravity=(0, 0, 0)).gravity[2] == 0
    assert lw.load(sdf(f'<link name="a">{LINK}</link>')).gravity[2] == -9.81


def test_a_link_without_inertial_weighs_what_the_format_says():
    with pytest.warns(lw.ModelWarning, match="1 kg and 1 kg m2"):
        assert lw.load(sdf('<link name="a"/>')).total_mass == 1


def test_joints_between_frames():
    text = sdf(
        f'<link name="a">{LINK}</link><link name="b">{LINK}</link>'
        '<frame name="f" attached_to="a"><pose>0 0 2 0 0 0</pose></frame>'
        '<frame name="g" attached_to="f"><pose>1 0 0 0 0 0</pose></frame>'
        '<joint name="w" type="fixed"><parent>world</parent><child>a</child></joint>'
        '<joint name="j" type="revolute"><pose relative_to="g"/><parent>g</parent><child>b</child>'
        "<axis><xyz>0 0 1</xyz></axis></joint>"
    )
    model = lw.load(text)
    assert model.parent_link_names == ["a"]
    np.testing.assert_allclose(pose_of(model, "b")[:3, 3], [1, 0, 2], atol=1e-15)


def test_mimic():
    inside = '<axis><xyz>0 0 1</xyz><mimic joint="x"><multiplier>2</multiplier></mimic></axis>'
    with pytest.raises(lw.InputError, match="mimics joint 'x'"):
        lw.load(one_joint("revolute", inside), mimic="error")
    with pytest.raises(lw.InputError, match="mimics joint 'x', which does not exist"):
        lw.load(one_joint("revolute", inside))
    with pytest.warns(lw.ModelWarning, match="mimics joint 'x'"):
        lw.load(one_joint("revolute", inside), mimic="independent")


def test_mimic_as_a_coupling():
    """follower = multiplier (leader - reference) + offset."""
    mimic = (
        '<mimic joint="knee"><multiplier>2</multiplier><offset>0.5</offset>'
        "<reference>0.1</reference></mimic>"
    )
    twin = lw.load(PRESS).with_coupling("drive_mimic", {"drive": 1, "knee": -2}, offset=0.3)
    model = lw.load(PRESS.replace("<dynamics>", f"{mimic}<dynamics>"))
    assert model.hash == twin.hash


def test_joints_that_mimic_each_other_are_refused():
    text = PRESS
    for joint, leader in (("drive", "knee"), ("knee", "drive")):
        end = text.index("</axis>", text.index(f'<joint name="{joint}"'))
        text = f'{text[:end]}<mimic joint="{leader}"/>{text[end:]}'
    with pytest.raises(lw.InputError, match="mimics itself by way of others"):
        lw.load(text)


def test_what_is_ignored_is_counted_or_warned_of():
    with pytest.warns(lw.ModelWarning):
        model = lw.load(PRESS.replace("<plugin", "<damping>3</damping><plugin"))
    texts = [note.text for note in model.notes]
    assert any("unknown element <damping> in <model> is not read (line" in text for text in texts)
    assert any(note.element == "<visual> of a link" for note in model.notes)


def test_springs():
    inside = (
        "<axis><xyz>0 0 1</xyz><dynamics><spring_stiffness>7</spring_stiffness>"
        "<spring_reference>0.5</spring_reference></dynamics></axis>"
    )
    model = lw.load(one_joint("revolute", inside))
    assert (model.stiffness[0], model.rest_position[0]) == (7, 0.5)


def test_a_chain_of_frames_as_long_as_a_file_may_hold():
    frames = "".join(
        f'<frame name="f{i}"><pose relative_to="f{i + 1}">1 0 0 0 0 0</pose></frame>'
        for i in range(20_000)
    )
    text = sdf(
        f'{frames}<frame name="f20000"/><link name="a"><pose relative_to="f0"/>{LINK}</link>'
    )
    assert pose_of(lw.load(text), "a")[0, 3] == 20_000


def test_a_row_of_five_thousand_links_is_read():
    links = "".join(f'<link name="l{i}">{LINK}</link>' for i in range(5000))
    joints = "".join(
        f'<joint name="j{i}" type="revolute"><parent>{f"l{i - 1}" if i else "world"}</parent>'
        f"<child>l{i}</child><axis><xyz>0 0 1</xyz></axis></joint>"
        for i in range(5000)
    )
    assert lw.load(sdf(links + joints)).n_joints == 5000


def shafts(ratio, first="housing shaft 0 0 1", second="housing wheel 0 0 1", axes="0 0 1 0 0 1"):
    """A housing, two shafts in it, and a gearbox from the first to the second."""
    axis, axis2 = axes[: len(axes) // 2], axes[len(axes) // 2 :]
    links = "".join(
        f'<link name="{name}"><pose>{x} 0 0 0 0 0</pose>{LINK}</link>'
        for x, name in enumerate(("housing", "shaft", "wheel"))
    )
    joints = "".join(
        f'<joint name="turn_{name}" type="revolute"><parent>{parent}</parent><child>{child}</child>'
        f"<axis><xyz>{xyz}</xyz></axis></joint>"
        for name, (parent, child, xyz) in zip(
            ("shaft", "wheel"), (line.split(maxsplit=2) for line in (first, second)), strict=True
        )
    )
    return sdf(
        f'{links}<joint name="w" type="fixed"><parent>world</parent><child>housing</child></joint>'
        f'{joints}<joint name="gears" type="gearbox"><parent>shaft</parent><child>wheel</child>'
        "<gearbox_reference_body>housing</gearbox_reference_body>"
        f"<gearbox_ratio>{ratio}</gearbox_ratio>"
        f"<axis><xyz>{axis}</xyz></axis><axis2><xyz>{axis2}</xyz></axis2></joint>"
    )


@pytest.mark.parametrize(
    ("changed", "sign"),
    [({}, -1), ({"second": "housing wheel 0 0 -1"}, 1), ({"axes": "0 0 1 0 0 -1"}, 1)],
)
def test_a_gearbox_turns_its_child_by_minus_its_ratio(changed, sign):
    """theta_2 = -ratio theta_1; under a torque T on the first shaft I a = T / (1 + ratio^2)."""
    model = lw.load(shafts(0.25, **changed), gravity=(0, 0, 0))
    assert (model.coupling_names, model.n_loops, model.nv) == (["gears"], 0, 2)
    found = lw.forward_dynamics(model, [0, 0], [0, 0], [3, 0])
    expected = 3 / (0.01 * (1 + 0.25**2))
    np.testing.assert_allclose(found, [expected, sign * 0.25 * expected], rtol=1e-12)


def test_a_gearbox_without_a_joint_for_its_shaft_is_refused():
    with pytest.raises(
        lw.InputError, match="no revolute joint about its axis2 joins 'housing' and"
    ):
        lw.load(shafts(2, axes="0 0 1 0 1 0"))
    with pytest.raises(lw.InputError, match="has no <gearbox_reference_body>; name the link"):
        lw.load(shafts(2).replace("gearbox_reference_body", "gearbox_body"))


def test_revolute2_is_two_hinges_in_series():
    """The first turns what the second turns in, as two joints in a row would."""
    inside = "<axis><xyz>0 0 1</xyz></axis><axis2><xyz>0.6 0.8 0</xyz></axis2>"
    model = lw.load(one_joint("revolute2", inside))
    half = f'<link name="h"><pose>0 0 1 0 0 0</pose><inertial>{MASS}</inertial></link>'
    row = one_joint("revolute", "<axis><xyz>0.6 0.8 0</xyz></axis>").replace(
        "<parent>a</parent>", "<parent>h</parent>"
    )
    row = row.replace(
        '<joint name="j"',
        f'{half}<joint name="i" type="revolute"><parent>a</parent><child>h</child>'
        '<axis><xyz>0 0 1</xyz></axis></joint><joint name="j"',
    )
    for q in np.random.default_rng(3).normal(size=(3, 2)):
        expected = pose_of(lw.load(row), "b", q)
        np.testing.assert_allclose(pose_of(model, "b", q), expected, atol=1e-14)


CASSIE = sorted(
    str(file.locate())
    for file in metadata.files("example-robot-data") or []
    if file.suffix == ".sdf" and "cassie" in file.name
)


@pytest.mark.filterwarnings("ignore::linkwise.ModelWarning")
@pytest.mark.parametrize("path", CASSIE)
def test_cassie_stands_on_closed_loops(path):
    """Its loops are closed as drawn, and gearboxes tie ten motors to their joints."""
    model = lw.load(path)
    loops, gears = (6, 10) if path.endswith("cassie.sdf") else (4, 0)
    assert (model.n_loops, len(model.coupling_names)) == (loops, gears)
    gaps = lw.loop_gaps(model, model.initial_configuration())
    np.testing.assert_allclose(gaps, 0, atol=1e-14)
    q, v = model.initial_configuration(), np.zeros(model.nv)
    fall = lw.forward_dynamics(model, q, v)
    # In free fall nothing inside accelerates, except what springs and gravity's frame ask for.
    np.testing.assert_allclose(np.linalg.norm(fall), 9.81, rtol=1e-9)


@pytest.mark.filterwarnings("ignore::linkwise.ModelWarning")
def test_loops_that_hold_by_rounded_angles_say_so():
    """Its links are turned by 1.5708, so that hinges which should be parallel are 4e-6 off."""
    model = lw.load(next(path for path in CASSIE if path.endswith("cassie.sdf")))
    with pytest.raises(lw.SimulationError, match="but for the digits of the file"):
        lw.simulate(model, duration=0.2)
    v0 = 0.1 * np.cos(np.arange(model.nv))
    with pytest.raises(lw.InputError, match="no rates near those of the start"):
        lw.simulate(model, duration=0.2, v0=v0)


def test_there_are_files_of_cassie():
    assert len(CASSIE) >= 3
