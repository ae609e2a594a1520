"""[loop.NAME] of a scenario closes a loop in any model; what is wrong with it is one line."""

import numpy as np
import pytest

import linkwise as lw
from linkwise.scenario import load_scenario

RUN = 'model = "arm.urdf"\n[simulate]\nduration = 1\n'
LOOP = """[loop.brace]
type = "revolute"
parent = "base"
child = "lower"
translation = ["100 mm", 0, 0.2]
rotation = ["90 deg", 0, 0]
child_translation = [0, 0, -0.1]
axis = [0, 1, 0]
"""


@pytest.fixture
def write(arm):
    def call(text):
        path = arm.with_name("run.toml")
        path.write_text(RUN + text)
        return path

    return call


def load(path):
    return load_scenario(path).load_model()


def test_a_loop_with_its_places(write):
    model = load(write(LOOP + 'damping = "0.5 Nms/rad"\n'))
    assert model.loop_names == ["brace"]
    assert model.loop_types == ["revolute"]
    assert model.loop_nv == [1]
    assert model.loop_parent_link_names == ["base"]
    assert model.loop_child_link_names == ["lower"]
    assert model.loop_axes == [[("revolute", (0.0, 1.0, 0.0))]]
    here, there = model.loop_placements[0]
    np.testing.assert_allclose(here[:3, 3], [0.1, 0, 0.2], atol=1e-15)
    np.testing.assert_allclose(here[:3, :3], [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-15)
    np.testing.assert_array_equal(there[:3, 3], [0, 0, -0.1])
    assert any(note.element == "brace" and "closes a loop" in note.text for note in model.notes)


def test_every_type_of_joint(write):
    for kind, nv in {
        "fixed": 0,
        "revolute": 1,
        "continuous": 1,
        "prismatic": 1,
        "helical": 1,
        "cylindrical": 2,
        "universal": 2,
        "spherical": 3,
        "planar": 3,
        "floating": 6,
    }.items():
        text = f'[loop.x]\ntype = "{kind}"\nparent = "base"\nchild = "lower"\n'
        if kind == "helical":
            text += 'pitch = "5 mm/rev"\n'
        if kind == "universal":
            text += "axes = [[1, 0, 0], [0, 1, 0]]\n"
        assert load(write(text)).loop_nv == [nv]


def test_on_a_generated_machine(tmp_path):
    path = tmp_path / "run.toml"
    path.write_text(
        "[model.chain]\nn_bodies = 3\n[simulate]\nduration = 1\n"
        '[loop.back]\ntype = "spherical"\nparent = "ground"\nchild = "link_3"\n'
    )
    assert load(path).n_loops == 1


def test_properties_of_a_loop_joint_of_the_file(arm, write):
    arm.write_text(
        arm.read_text().replace(
            "</robot>",
            '<joint name="brace" type="revolute"><parent link="base"/><child link="lower"/>'
            "</joint></robot>",
        )
    )
    plain = load(write(""))
    assert plain.loop_names == ["brace"]
    assert load(write('[joint.brace]\ndamping = "0.5 Nms/rad"\n')).hash != plain.hash


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"lower"', '"lowr"', "loop.brace.child: the model has no link 'lowr'; did you mean"),
        ('"revolute"', '"hinge"', "loop.brace.type: 'hinge' is not known; use 'fixed',"),
        ("axis = [0, 1, 0]", "axis = [0, 1]", "loop.brace.axis: has 2 numbers; give three"),
        ("axis = [0, 1, 0]", "axis = [0, 0, 0]", "loop.brace: "),
        ('"100 mm"', '"100 deg"', "loop.brace.translation.0: "),
        ("axis", "axi", "loop.brace.axi: unknown key; did you mean 'axis'?"),
        ('type = "revolute"\n', "", "loop.brace.type: is missing; add type = ..."),
        ('"revolute"', '"helical"', "loop.brace: a helical joint needs pitch; add pitch = ..."),
        ('"revolute"', '"spherical"', "loop.brace: axis has no meaning for a spherical joint; "),
        ("axis =", "pitch = 1\naxis =", "loop.brace: pitch belongs to a helical joint; remove it"),
        ("loop.brace", "loop.shoulder", "loop.shoulder: "),
        ('"lower"', '"base"', "loop.brace: "),
        ("axis =", 'damping = "1 N"\naxis =', "loop.brace.damping: "),
    ],
)
def test_what_is_wrong_is_one_line(write, complaint, old, new, said):
    message = complaint(load, write(LOOP.replace(old, new, 1)))
    assert message.startswith(f": {said}"), message


#: Three links in a plane, whose last tip a pin holds to the ground 2 m away: a four-bar.
FOUR_BAR = """
[model.chain]
n_bodies = 3
axes = [[0, 1, 0]]
length = 1
[loop.pin]
type = "revolute"
parent = "ground"
child = "link_3"
translation = [2, 0, 0]
child_translation = [0, 0, -1]
axis = [0, 1, 0]
[simulate]
duration = 0.2
[initial.position]
"""
CLOSED = 'joint_1 = "-150 deg"\njoint_2 = "60 deg"\njoint_3 = "60 deg"\n'


def run_four_bar(tmp_path, text):
    path = tmp_path / "bars.toml"
    path.write_text(FOUR_BAR + text)
    return lw.run_scenario(path)


def test_a_drive_turns_it(tmp_path):
    drive = '[drive.pin]\nkind = "torque"\nvalue = "2 N m"\n[output]\nevery = 0.05\n'
    run = run_four_bar(tmp_path, CLOSED + drive)
    torque, turned = (
        run["loop_drive_torque"],
        run["loop_position"].sel(loop_coordinate="pin").values,
    )
    assert torque.attrs["units"] == "N m"
    np.testing.assert_array_equal(torque.sel(loop_dof="pin"), 2.0)
    assert abs(turned[-1] - turned[0]) > 1e-3
    work = run["loop_drive_work"].sel(loop_dof="pin").values
    np.testing.assert_allclose(work, 2 * (turned - turned[0]), atol=1e-6)


def test_positions_that_are_given_are_held_first(tmp_path):
    run = run_four_bar(tmp_path, "joint_1 = -2.4\njoint_2 = 1\njoint_3 = 1\n")
    first = run.position.values[0]
    assert first[0] == -2.4  # the others were released, the last one first
    said = [note["text"] for note in run.warnings if note["element"] == "assembly"]
    assert "joints that were to be held had to move: joint_2, joint_3" in said[0]
    assert "'joint_3' by" in said[0]
    free = lw.simulate(run.load_model(), duration=0.1, q0=[-2.4, 1, 1])
    assert abs(free.position.values[0, 0] + 2.4) > 1e-3


def test_the_command_calls_it_wrong_input(linkwise, write):
    result = linkwise("inspect", write(LOOP.replace('"lower"', '"lowr"')))
    assert result.code == 2
    assert "loop.brace.child" in result.complaint


def test_inspect_shows_it(linkwise, write):
    found = linkwise("inspect", write(LOOP), "--json").json
    assert found["counted_mobility"] == found["nv"] - 5
    assert [loop["joint"] for loop in found["loops"]] == ["brace"]
    shift = found["loops"][0]["gap"]["shift"]
    assert shift == pytest.approx(lw.loop_gaps(load(write(LOOP)), [0.0, 0.0])[0, 0])
    assert shift > 0.1
    assert found["mobility"] is None  # the pose that is drawn does not close it
    shown = linkwise("inspect", write(LOOP)).out
    assert "Joints that close loops" in shown
    assert f"1 joint closes a loop: {found['nv']} - 5 = {found['nv'] - 5} degrees" in " ".join(
        shown.split()
    )


def test_rods_and_couplings(write):
    text = """[rod.link]
parent = "base"
child = "lower"
length = "40 cm"
child_point = [0, 0, "20 cm"]
[coupling.rack]
factors = { shoulder = 0.1, slide = -1 }
offset = 0.02
"""
    model = load(write(text))
    assert (model.loop_names, model.loop_types) == (["link"], ["rod"])
    assert model.coupling_names == ["rack"]
    np.testing.assert_array_equal(model.loop_placements[0, 1, :3, 3], [0, 0, 0.2])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[rod.x]\nparent = "base"\nchild = "lower"\n', "rod.x.length: is missing"),
        ('[rod.x]\nparent = "base"\nchild = "lower"\nlength = 0\n', "rod.x.length: is 0"),
        ('[rod.x]\nparent = "bas"\nchild = "lower"\nlength = 1\n', "rod.x.parent: the model has"),
        ("[coupling.x]\nfactors = { shoulder = 1, slid = 1 }\n", "coupling.x: "),
        ("[coupling.x]\nfactors = {}\n", "coupling.x.factors: "),
        ('[coupling.x]\nfactors = { slide = "1 m" }\n', "coupling.x.factors.slide: "),
        (
            '[coupling.x]\nfactors = { slide = 1 }\noffset = "1 m"\n',
            "coupling.x.offset: has a unit of length; give",
        ),
    ],
)
def test_what_is_wrong_with_rods_and_couplings(write, complaint, text, said):
    message = complaint(load, write(text))
    assert message.startswith(f": {said}"), message


def test_with_loop_refuses_as_the_builder_does(arm):
    model = lw.load(arm)
    with pytest.raises(lw.InputError, match="composite"):
        model.with_loop("x", "composite", "base", "lower", axes=[("revolute", (0, 0, 1))] * 2)
    with pytest.raises(lw.InputError, match=r"joint 'shoulder'.* the name is used twice"):
        model.with_loop("shoulder", "fixed", "base", "lower")


def test_it_starts_where_the_joint_that_closes_it_is(tmp_path):
    free = run_four_bar(tmp_path, CLOSED)
    pin = float(free["loop_position"].sel(loop_coordinate="pin").values[0]) + 0.2
    run = run_four_bar(tmp_path, CLOSED + f"pin = {pin}\n")
    assert run["loop_position"].sel(loop_coordinate="pin").values[0] == pytest.approx(pin)
    assert "joints that were to be held had to move: " in str(run.warnings)
    degrees = run_four_bar(tmp_path, CLOSED + f'pin = "{np.degrees(pin)} deg"\n')
    np.testing.assert_allclose(degrees.position.values, run.position.values, atol=1e-6)
    run = run_four_bar(tmp_path, CLOSED + "[initial.velocity]\npin = 1.0\n")
    assert run["loop_velocity"].sel(loop_dof="pin").values[0] == pytest.approx(1.0, rel=1e-12)
