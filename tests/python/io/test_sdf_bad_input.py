"""Every defect of an SDF is one line that names file, line, element and remedy."""

from io import BytesIO

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

import linkwise as lw
from helpers.load_or_complain import load_or_complain
from helpers.press_sdf import PRESS

WRONG = [
    ('version="1.9"', 'version="1.4"', ":2: sdf: version '1.4' is not read; convert it"),
    ('version="1.9"', "", ":2: sdf: version '' is not read; "),
    ("</sdf>", "<model name='n'/></sdf>", ":2: sdf: holds 2 models; give a file with one <model>"),
    ("<plugin", "<include/><plugin", "element 'include': includes are not fetched; "),
    ("<plugin", "<model/><plugin", "model '': has no name; "),
    ("<plugin", "<model name='crank'/><plugin", "model 'crank': the name is used twice; "),
    (
        "<plugin",
        "<model name='n'><link name='l'><pose relative_to='crank'/></link></model><plugin",
        "link 'n::l': names the frame 'n::crank', which does not exist; ",
    ),
    (
        "<plugin",
        "<model name='n' placement_frame='f'><link name='l'/>"
        "<frame name='f'><pose relative_to='world'/></frame></model><plugin",
        "model 'n': its placement_frame is placed in the world; ",
    ),
    ("<pose>0 0 1 0 0 0</pose>", "<static>true</static>", "model 'press': is static, so nothing"),
    ('<link name="rod">', "<link>", ":19: link: has no name; add name="),
    ('<link name="rod">', '<link name="crank">', ":19: link 'crank': the name is used twice; "),
    ('<link name="rod">', '<link name="world">', ":19: link 'world': has a name that the format"),
    ("<mass>0.36</mass>", "", "link 'crank': <inertial> has no <mass>; add <mass>...</mass>"),
    ("<mass>0.36</mass>", "<mass>x</mass>", "link 'crank': mass: 'x' is not a number; give a"),
    ("<mass>0.36</mass>", "<mass>nan</mass>", "link 'crank': mass: 'nan' is not a finite number"),
    ("<mass>0.36</mass>", "<mass>-1</mass>", ":15: link 'crank': mass is negative (-1); give a"),
    ("<ixx>1</ixx>", "", "link 'bed': <inertia> has no <ixx>; add <ixx>...</ixx>"),
    ("0.15 0 0 0 0 0", "0.15 0 0", "link 'rod': pose: has 3 numbers instead of 6; give 6 finite"),
    ('relative_to="crank">0.15', 'relative_to="rod">0.15', "its pose is relative to itself; "),
    ('relative_to="crank">0.15', 'relative_to="crnk">0.15', "the frame 'crnk', which does not"),
    ('attached_to="bed"', 'attached_to="bd"', "names the frame 'bd', which does not exist; did"),
    ('type="prismatic"', 'type="gearbox"', "joint 'guide': has no <gearbox_reference_body>; name"),
    ('type="prismatic"', 'type="revolute2"', "joint 'guide': has no <axis>; add <axis> with"),
    ('type="prismatic"', 'type="piston"', "joint 'guide': type 'piston' is not read; use one of"),
    ('type="prismatic"', "", "joint 'guide': has no type; use one of fixed, revolute"),
    ('type="prismatic"', 'type="screw"', "joint 'guide': has no <screw_thread_pitch>; give"),
    ('type="prismatic"', 'type="universal"', "joint 'guide': has no <axis>; add <axis>"),
    ("<child>rod</child>", "", "joint 'knee': has no child; add <child>LINK</child>"),
    ("<child>rod</child>", "<child>rd</child>", "joint 'knee': child 'rd' does not exist; did you"),
    ("<child>rod</child>", "<child>crank</child>", "link 'crank' is its parent and its child; "),
    ("<xyz>1 0 0</xyz>", "<xyz>0 0 0</xyz>", "joint 'guide': axis has zero length; give a"),
    ("<xyz>1 0 0</xyz>", "<xyz>1 0</xyz>", "joint 'guide': axis: has 2 numbers instead of 3; "),
    ("<lower>-0.4</lower>", "<lower>0.4</lower>", "joint 'guide': "),
    ("<damping>0.5</damping>", "<damping>-1</damping>", "joint 'drive': damping"),
    ('degrees="true"', 'rotation_format="x"', "frame 'pin': unknown rotation_format 'x'; use"),
    ('expressed_in="pin"', 'expressed_in="pn"', "the frame 'pn', which does not exist; did you"),
    ("<inertial>", "<inertial auto='true'>", "<inertial auto> asks for computed inertia; write"),
]


@pytest.mark.parametrize(("old", "new", "said"), WRONG)
def test_one_line(tmp_path, complaint, old, new, said):
    path = tmp_path / "press.sdf"
    assert old in PRESS
    path.write_text(PRESS.replace(old, new, 1))
    message = complaint(lw.load, path)
    assert said in message, message


def test_the_thread_pitch_of_gazebo_classic_is_refused(tmp_path, complaint):
    path = tmp_path / "press.sdf"
    path.write_text(
        PRESS.replace('type="prismatic">', 'type="screw"><thread_pitch>-628</thread_pitch>')
    )
    assert "<thread_pitch> means different things to different programs" in complaint(lw.load, path)


def test_floating_base_is_the_files_business(tmp_path, complaint):
    path = tmp_path / "press.sdf"
    path.write_text(PRESS)
    message = complaint(lw.load, path, floating_base=True)
    assert message.startswith(": floating_base: the file says itself which bodies float; ")


TOKENS = st.sampled_from(
    ["0", "1", "-1", "nan", "1e400", "", "x", "0 0 0", "1 0 0", "0 0 0 0 0 0",
     "1e300 0 0 1e300 0 0",
     "fixed", "ball", "world", "__model__", "bed", "rod", "wrist", "true", "quat_xyzw"]
)  # fmt: skip


@given(st.integers(0, 200), TOKENS)
def test_any_text_or_attribute_may_be_garbage(tmp_path_factory, position, token):
    """A model or one line, never another exception."""
    root = etree.parse(BytesIO(PRESS.encode())).getroot()
    elements = list(root.iter(etree.Element))
    places = [(element, key) for element in elements for key in (*element.attrib, None)]
    element, key = places[position % len(places)]
    if key is None:
        element.text = token
    else:
        element.set(key, token)
    load_or_complain(tmp_path_factory.getbasetemp(), "fuzz.sdf", etree.tostring(root))


@given(st.integers(0, 100), st.integers(0, 100))
def test_any_element_may_stand_anywhere(tmp_path_factory, which, where):
    root = etree.parse(BytesIO(PRESS.encode())).getroot()
    elements = list(root.iter(etree.Element))[1:]
    moved, place = elements[which % len(elements)], elements[where % len(elements)]
    if moved not in place.iterancestors() and moved is not place:
        place.append(moved)
    load_or_complain(tmp_path_factory.getbasetemp(), "fuzz.sdf", etree.tostring(root))


@given(st.integers(0, len(PRESS)), st.integers(0, 40), st.binary(max_size=4))
def test_any_bytes_may_be_damaged(tmp_path_factory, start, length, new):
    data = PRESS.encode()
    load_or_complain(
        tmp_path_factory.getbasetemp(), "fuzz.sdf", data[:start] + new + data[start + length :]
    )
