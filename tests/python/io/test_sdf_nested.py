"""SDF: models in models, several models in a world, static ones, and the frames among them."""

import numpy as np
import pytest

import linkwise as lw

INERTIAL = (
    "<inertial><pose>0.1 0 0.2 0 0 0</pose><mass>2</mass><inertia><ixx>0.2</ixx><iyy>0.2</iyy>"
    "<izz>0.01</izz></inertia></inertial>"
)
AXIS = "<axis><xyz>0 1 0</xyz></axis>"
ARM = f"""
<link name="upper"><pose>0 0 0.5 0.1 0 0</pose>{INERTIAL}</link>
<link name="lower"><pose relative_to="upper">0.3 0 0 0 0.2 0</pose>{INERTIAL}</link>
<joint name="elbow" type="revolute"><parent>upper</parent><child>lower</child>{AXIS}</joint>
<frame name="flange" attached_to="lower"><pose>0 0 0.4 0 0 0</pose></frame>
"""


def sdf(inside, name="m", attributes=""):
    return f'<sdf version="1.10"><model name="{name}" {attributes}>{inside}</model></sdf>'


def world(inside):
    return f'<sdf version="1.10"><world name="hall">{inside}</world></sdf>'


def poses(model):
    found = lw.link_poses(model, model.initial_configuration())
    return dict(zip(model.link_names, np.asarray(found), strict=True))


def moved(x, y, z):
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def test_a_model_in_a_model_is_the_same_written_flat():
    base = f'<link name="base">{INERTIAL}</link>'
    mount = (
        '<joint name="mount" type="revolute"><parent>base</parent><child>{}</child>'
        f"{AXIS}</joint>"
    )
    nested = sdf(
        f'{base}<model name="arm"><pose>1 0 0 0 0 0</pose>{ARM}</model>'
        + mount.format("arm::upper")
    )
    for name in ("upper", "lower", "elbow", "flange"):
        flat_arm = locals().get("flat_arm", ARM).replace(f">{name}<", f">arm::{name}<")
        flat_arm = flat_arm.replace(f'"{name}"', f'"arm::{name}"')
    flat_arm = flat_arm.replace("<pose>0 0 0.5 ", "<pose>1 0 0.5 ")
    flat = sdf(base + flat_arm + mount.format("arm::upper"))
    model = lw.load(nested)
    assert model.joint_names == ["base_free", "mount", "arm::elbow"]
    assert model.hash == lw.load(flat).hash


def test_frames_of_models_are_named_from_outside_and_inside():
    link = '<link name="tool"><pose relative_to="{}">0 0 1 0 0 0</pose>' + INERTIAL + "</link>"
    arm = f'<model name="arm"><pose>1 2 3 0 0 0</pose>{ARM}</model>'
    for reference, at in (
        ("arm", (1, 2, 4)),
        ("arm::__model__", (1, 2, 4)),
        ("__model__", (0, 0, 1)),
    ):
        model = lw.load(sdf(link.format(reference) + arm))
        np.testing.assert_allclose(poses(model)["tool"], moved(*at), atol=1e-15)
    flange = poses(lw.load(sdf(link.format("arm::flange") + arm)))
    np.testing.assert_allclose(flange["tool"], flange["arm::lower"] @ moved(0, 0, 1.4), atol=1e-15)


@pytest.mark.parametrize("inside", [False, True])
def test_a_placement_frame_is_what_the_pose_places(inside):
    """The flange is drawn at (1, 2, 3), and the links keep their places against it."""
    pose = "<pose>1 2 3 0 0 0.3</pose>"
    alone = poses(lw.load(sdf(ARM)))
    flange = alone["lower"] @ moved(0, 0, 0.4)
    text = (
        sdf(f'<model name="arm" placement_frame="flange">{pose}{ARM}</model>')
        if inside
        else sdf(pose + ARM, attributes='placement_frame="flange"')
    )
    placed = moved(1, 2, 3)
    placed[:2, :2] = [[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]]
    prefix = "arm::" if inside else ""
    for link, at in poses(lw.load(text)).items():
        if link != "world":
            own = alone[link.removeprefix(prefix)]
            np.testing.assert_allclose(at, placed @ np.linalg.inv(flange) @ own, atol=1e-14)


@pytest.mark.parametrize(
    ("attribute", "link"), [("", "upper"), ('canonical_link="lower"', "lower")]
)
def test_the_canonical_link_carries_the_frame_of_a_model(attribute, link):
    tip = f'<link name="tip">{INERTIAL}</link><joint name="wrist" type="revolute">'
    tip += f"<parent>arm</parent><child>tip</child>{AXIS}</joint>"
    model = lw.load(sdf(f'<model name="arm" {attribute}>{ARM}</model>{tip}'))
    parents = dict(zip(model.joint_names, model.parent_link_names, strict=True))
    assert parents["wrist"] == f"arm::{link}"
    np.testing.assert_allclose(poses(model)["tip"], np.eye(4), atol=1e-15)


def test_a_world_with_one_machine_and_static_ground_is_the_machine():
    ground = '<model name="ground_plane"><static>true</static><link name="link"/></model>'
    arm = f'<model name="arm">{ARM}</model>'
    alone = lw.load(sdf(ARM, name="arm"))
    assert lw.load(world(arm)).hash == alone.hash
    model = lw.load(world(ground + arm))
    assert (model.name, model.link_names) == ("arm", alone.link_names)
    q = np.random.default_rng(1).normal(size=model.nq)
    np.testing.assert_array_equal(lw.mass_matrix(model, q), lw.mass_matrix(alone, q))
    assert any("parts of the world" in note.text for note in model.notes)


def test_models_of_a_world_are_joined_by_its_joints():
    """A four-bar: two arms in a world, each on the ground, whose ends a joint of the world ties."""
    at = '<pose relative_to="a::lower"/>'
    text = world(
        f'<model name="a">{ARM}</model>'
        f'<model name="wall"><static>1</static><link name="w"/></model>'
        f'<model name="b"><link name="bar"><pose>0 1 0 0 0 0</pose>{INERTIAL}</link></model>'
        f'<joint name="shoulder" type="revolute"><parent>wall::w</parent><child>a::upper</child>'
        f"{AXIS}</joint>"
        f'<joint name="pivot" type="revolute"><parent>world</parent><child>b</child>{AXIS}</joint>'
        f'<joint name="tie" type="ball">{at}<parent>a::lower</parent><child>b</child></joint>'
    )
    model = lw.load(text)
    assert model.name == "hall"
    assert set(model.joint_names) | set(model.loop_names) == {
        "a::elbow",
        "shoulder",
        "pivot",
        "tie",
    }
    assert model.loop_types == ["spherical"]
    np.testing.assert_allclose(lw.loop_gaps(model, model.initial_configuration()), 0, atol=1e-12)
