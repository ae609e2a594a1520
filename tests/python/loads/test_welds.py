"""Loads of fixed joints whose links are merged, and of all joints at frames of any link."""

import numpy as np
import pytest

import linkwise as lw

# A wrist, a force-torque sensor modelled as a frame without mass, a gripper and a camera behind it.
WRIST = """<robot name="sensor_wrist">
  <link name="forearm"><inertial><mass value="3"/>
    <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial></link>
  <joint name="wrist" type="revolute"><origin xyz="0 0 0.5"/><parent link="forearm"/>
    <child link="wrist_link"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="40" velocity="3"/></joint>
  <link name="wrist_link"><inertial><origin xyz="0 0 0.03"/><mass value="1"/>
    <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial></link>
  <joint name="FT_sensor" type="fixed"><origin xyz="0 0 0.06" rpy="0 0 0.7853981633974483"/>
    <parent link="wrist_link"/><child link="FT_sensor_link"/></joint>
  <link name="FT_sensor_link"/>
  <joint name="gripper_mount" type="fixed"><origin xyz="0 0 0.02"/><parent link="FT_sensor_link"/>
    <child link="gripper_base"/></joint>
  <link name="gripper_base"><inertial><origin xyz="0 0 0.05"/><mass value="0.8"/>
    <inertia ixx="0.0009" ixy="0" ixz="0" iyy="0.0009" iyz="0" izz="0.0004"/></inertial></link>
  <joint name="camera_mount" type="fixed"><origin xyz="0.07 0 0.01"/>
    <parent link="FT_sensor_link"/><child link="camera"/></joint>
  <link name="camera"><inertial><mass value="0.2"/>
    <inertia ixx="0.0001" ixy="0" ixz="0" iyy="0.0001" iyz="0" izz="0.0001"/></inertial></link>
</robot>"""


def crane(*, keep_fixed=False):
    """Two arms with askew welds before, between and behind their joints, one on the ground."""
    rng = np.random.default_rng(5)
    builder = lw.ModelBuilder("crane", gravity=(1.0, -2.0, -9.0))

    def link(name, mass=True):
        root = rng.normal(size=(3, 3)) * 0.1
        inertia = root @ root.T if mass else None
        com = rng.normal(size=3) * 0.3 if mass else None
        builder.add_link(name, mass=rng.uniform(1, 2) if mass else 0, com=com, inertia=inertia)

    def join(name, kind, parent, child, **more):
        turn = lw.Frame("any", axes=rng.normal(size=3)).axes
        builder.add_joint(
            name, kind, parent, child, translation=rng.normal(size=3), rotation=turn, **more
        )

    link("floor")
    link("plate")
    join("bolts", "fixed", "floor", "plate")
    link("boom")
    join("slew", "revolute", "plate", "boom", axis=(0, 0.6, 0.8), damping=0.5)
    link("bracket")
    join("clamp", "fixed", "boom", "bracket")
    link("cell", mass=False)
    join("screws", "fixed", "bracket", "cell")
    link("jib")
    join("luff", "spherical", "cell", "jib")
    link("hook")
    join("rope", "prismatic", "bracket", "hook", axis=(1, 0, 0), armature=0.3)
    link("eye")
    join("pin", "fixed", "hook", "eye")
    return builder.build(keep_fixed=keep_fixed)


def moved(model, wrenches, **more):
    rng = np.random.default_rng(9)
    return lw.simulate(
        model,
        duration=0.5,
        every=0.05,
        v0=rng.normal(size=model.nv),
        drives={"slew": 3.0},
        wrenches=wrenches,
        tolerance=1e-9,
        **more,
    )


SIDE = lw.Frame("bracket", (0.1, 0.2, 0.3), (0.4, 0.5, 0.6))
PUSHES = {
    "beyond alone": {"eye": lambda t: [3 * t, 1, 0, 0, 0.2, 0]},
    "constant beyond": {
        "eye": lw.Wrench([1, 2, 3, 0.1, 0.2, 0.3], "frame"),
        "hook": lambda t: [3 * t, 1, 0, 0, 0.2, 0],
        SIDE: lw.Wrench([3, 2, 1, 0.3, 0.2, 0.1], "world"),
        "boom": lambda t: [0, 1 + t, 0, 0, 0.2, 0],
    },
    "constant before": {
        "eye": lw.Wrench(lw.Table([0, 1], [[1] * 6, [2] * 6])),
        "hook": [3, 2, 1, 0.3, 0.2, 0.1],
        SIDE: lw.Wrench(lambda t: [0, 1 + t, 0, 0, 0.2, 0], "world"),
        "boom": lw.Wrench([1, 2, 3, 0.1, 0.2, 0.3], "frame"),
    },
}


@pytest.mark.parametrize("push", PUSHES)
def test_a_merged_joint_has_the_load_that_it_has_when_it_is_kept(push):
    """The recursion with the weld as a joint is the other computation."""
    merged, kept = moved(crane(), PUSHES[push]), moved(crane(keep_fixed=True), PUSHES[push])
    names = [name for name, _, _ in merged.load_model().welds]
    assert names == ["bolts", "clamp", "screws", "pin"]
    for name in names:
        np.testing.assert_allclose(
            lw.loads.in_frame(merged, "child", joint=name),
            kept.joint_load.sel(joint=name),
            rtol=0,
            atol=1e-7 * abs(kept.joint_load).max().item(),
            err_msg=name,
        )


def test_loads_of_welds_and_what_is_between_them_add_up():
    """clamp = bracket's own + screws + rope, all at one frame."""
    model = crane()
    run = moved(model, {"cell": [1, 2, 3, 4, 5, 6]})
    at = lw.Frame("bracket", (0.1, 0.2, 0.3), (0.4, 0.5, 0.6))
    load = lw.loads.in_frame(run, at, joint=["clamp", "screws", "rope"])
    own = load.sel(joint="clamp") - load.sel(joint="screws") - load.sel(joint="rope")
    index = model.link_names.index("bracket")
    center = model.link_centers_of_mass[index]
    q, v, a = (run[name].values for name in ("position", "velocity", "acceleration"))
    moving = lw.Frame("bracket", center)
    linear = lw.frame_acceleration(model, q, v, a, moving)[:, :3] - model.gravity
    axes = lw.frame_pose(model, q, at)[:, :3, :3]
    expected = model.link_masses[index] * np.einsum("tki,tk->ti", axes, linear)
    np.testing.assert_allclose(own[:, :3], expected, rtol=0, atol=1e-9)


@pytest.fixture(scope="module")
def wrist():
    return lw.simulate(
        lw.load(WRIST), duration=0.1, every=0.05, drives={"wrist": lw.drives.Locked()}
    )


def test_a_force_torque_sensor_holds_what_is_beyond_it(wrist):
    load = lw.loads.in_frame(wrist, "child", joint="FT_sensor")
    expected = [0, 0, 9.81, 0, -0.07 * 0.2 * 9.81, 0]
    np.testing.assert_allclose(load, [expected] * 3, rtol=0, atol=1e-12)
    assert load.dims == ("time", "component")
    assert load.attrs["point"] == "joint point: the origin of the joint frame"


def test_a_link_names_axes_and_point(wrist):
    """At the camera the sensor's force has no arm to the camera's own weight."""
    load = lw.loads.in_frame(wrist, "camera", joint="FT_sensor")[0]
    np.testing.assert_allclose(load, [0, 0, 9.81, 0, 0.07 * 0.8 * 9.81, 0], rtol=0, atol=1e-12)
    assert load.attrs["frame"] == "frame of link 'camera'"
    assert load.attrs["point"] == "the frame's origin"
    both = lw.loads.in_frame(wrist, "camera", joint=["wrist", "FT_sensor"])
    np.testing.assert_array_equal(both.sel(joint="FT_sensor")[0], load)
    np.testing.assert_allclose(both.sel(joint="wrist")[0, 2], 2 * 9.81)
    same = lw.loads.in_frame(wrist, lw.Frame("forearm", (0.07 / 2**0.5, 0.07 / 2**0.5, 0.57)))
    whole = lw.loads.in_frame(wrist, "camera", joint="wrist")
    np.testing.assert_allclose(
        np.linalg.norm(same.values[:, 0, 3:], axis=-1), np.linalg.norm(whole[:, 3:], axis=-1)
    )


def test_an_array_is_moved_as_a_run_is(wrist):
    model, q = wrist.load_model(), wrist.position.values
    found = lw.loads.in_frame(wrist.joint_load.values, "camera", joint="wrist", model=model, q=q)
    np.testing.assert_array_equal(found, lw.loads.in_frame(wrist, "camera", joint="wrist"))
    one = lw.loads.in_frame(wrist.joint_load.values[0], "parent", model=model, q=q[0])
    np.testing.assert_array_equal(one, lw.loads.in_frame(wrist, "parent").values[0])


def leg():
    builder = lw.ModelBuilder("leg")
    builder.add_link("hip")
    builder.add_link("shank", mass=2, com=(0, 0, -0.2), inertia=0.1 * np.eye(3))
    builder.add_link("foot")
    builder.add_joint("knee", "revolute", "hip", "shank", axis=(0, 1, 0))
    builder.add_joint("ankle", "fixed", "shank", "foot", translation=(0.1, 0, -0.5))
    return builder.build()


@pytest.mark.parametrize("name", ["foot", "shank"])
def test_nothing_but_a_wrench_beyond_a_weld(name):
    """A sensor before a foot without mass feels the ground's push alone, and none on the shank."""
    push = np.array([1.0, 2, 30, 0.1, 0.2, 0.3])
    run = lw.simulate(leg(), duration=0.2, every=0.1, wrenches={name: lw.Wrench(push, "frame")})
    load = lw.loads.in_frame(run, "child", joint="ankle")
    expected = -push if name == "foot" else 0 * push
    np.testing.assert_allclose(load, [expected] * 3, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda run: lw.loads.in_frame(run, "child", joint="anle"), "joint 'anle' does not exist"),
        (lambda run: lw.loads.in_frame(run, "foto"), r"a Frame or a link \(did you mean 'foot'"),
        (
            lambda run: lw.loads.in_frame(run, "child", joint="ankle"),
            r"both sides of it \('shank' and 'foot'\).*simulate without those on one side",
        ),
        (lambda run: lw.loads.in_frame(run, joint=[]), "no name is given"),
        (lambda run: lw.loads.in_frame(np.zeros((1, 6))), "give model and q"),
        (
            lambda run: lw.loads.in_frame(np.zeros((2, 6)), model=leg(), q=[0]),
            r"loads: shape \(2, 6\)",
        ),
        (
            lambda run: lw.loads.in_frame(np.zeros((1, 6)), joint="ankle", model=leg(), q=[0]),
            "give a run, or load the model with keep_fixed",
        ),
    ],
)
def test_what_cannot_be_told_is_refused(call, message):
    changing = {"foot": lambda t: [t] * 6, "shank": lambda t: [1] * 6}
    run = lw.simulate(leg(), duration=0.1, every=0.1, wrenches=changing)
    with pytest.raises(lw.InputError, match=message) as error:
        call(run)
    assert "\n" not in str(error.value)
