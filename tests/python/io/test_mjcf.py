"""MJCF: the machine that MuJoCo compiles, its state vectors, and what is refused or left out."""

import sys

import numpy as np
import pytest

import linkwise as lw
from helpers import mujoco_states
from linkwise.io import mjcf, mjcf_state

mujoco = pytest.importorskip("mujoco")

MACHINE = """
<mujoco>
  <option gravity="0.5 -1 -9" timestep="0.001"><flag contact="disable"/></option>
  <compiler angle="radian"/>
  <worldbody>
    <body name="stand" pos="0.1 0.2 0.3" euler="0.4 0.5 0.6">
      <geom type="box" size="0.1 0.1 0.1"/>
      <body name="arm" pos="0.3 -0.1 0.2" quat="0.8 0.2 -0.4 0.4">
        <joint name="a1" type="hinge" axis="1 2 3" pos="0.1 0.2 -0.1" ref="0.7" range="-1 2"
               springref="0.2" stiffness="3" damping="0.4" armature="0.05"/>
        <joint name="a2" type="slide" axis="0 1 1" pos="0.3 0 0" ref="-0.2" springref="0.1"
               stiffness="7" damping="0.1"/>
        <joint name="a3" type="hinge" axis="1 0 0" pos="-0.2 0.1 0.05"/>
        <inertial mass="2" pos="0.1 0 0.2" fullinertia="0.3 0.4 0.5 0.01 -0.02 0.03"/>
        <body name="tip" pos="0.5 0.1 0">
          <joint name="b" type="ball" pos="0.05 -0.05 0.1" damping="0.2" armature="0.01"/>
          <geom type="capsule" size="0.05 0.2" euler="0.1 0.7 0"/>
          <body name="flag" pos="0 0 0.3"><geom size="0.02"/></body>
        </body>
      </body>
    </body>
    <body name="drone" pos="1 2 3" euler="0.3 -0.2 0.9">
      <freejoint name="free"/>
      <geom type="box" size="0.2 0.1 0.05" pos="0.02 0.01 0"/>
      <body pos="0 0 0.1"><joint type="hinge" axis="0 0 1"/>
        <geom type="box" size="0.1 0.01 0.01" pos="0.05 0 0"/></body>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture
def write(tmp_path):
    def call(text, name="machine.xml"):
        path = tmp_path / name
        path.write_text(text)
        return path

    return call


@pytest.fixture
def machine(write):
    """Path, our model, MuJoCo's."""
    path = write(MACHINE)
    return path, lw.load(path), mujoco.MjModel.from_xml_path(str(path))


def random_state(mj_model, rng):
    qpos = mj_model.qpos0 + rng.standard_normal(mj_model.nq)
    mujoco.mj_normalizeQuat(mj_model, qpos)
    return qpos, rng.standard_normal(mj_model.nv)


def test_names_types_and_gravity(machine):
    path, model, _ = machine
    assert model.name == "machine"
    assert model.source == str(path)
    assert model.joint_names == ["a1", "a2", "a3", "b", "free", "joint5"]
    assert model.joint_types == [
        "revolute",
        "prismatic",
        "revolute",
        "spherical",
        "floating",
        "revolute",
    ]
    assert {"stand", "arm", "tip", "flag", "drone", "body6"} < set(model.link_names)
    np.testing.assert_array_equal(model.gravity, [0.5, -1, -9])
    np.testing.assert_array_equal(lw.load(path, gravity=(0, 0, 0)).gravity, [0, 0, 0])


def test_properties_count_from_the_pose_in_the_file(machine):
    _, model, _ = machine
    v = model.v_slice("a1")
    np.testing.assert_allclose(model.lower_limit[v], [-1.7])
    np.testing.assert_allclose(model.upper_limit[v], [1.3])
    np.testing.assert_allclose(model.rest_position[v], [-0.5])
    np.testing.assert_allclose(model.stiffness[v], [3])
    np.testing.assert_allclose(model.damping[v], [0.4])
    np.testing.assert_allclose(model.armature[v], [0.05])
    np.testing.assert_allclose(model.damping[model.v_slice("b")], [0.2] * 3)


@pytest.mark.parametrize("method", ["articulated_body", "composite_rigid_body", "constraint_force"])
def test_accelerations_are_mujocos(machine, rng, method):
    _, model, mj_model = machine
    data = mujoco.MjData(mj_model)
    for _ in range(10):
        data.qpos, data.qvel = random_state(mj_model, rng)
        mujoco.mj_forward(mj_model, data)
        ours = lw.forward_dynamics(
            model,
            mjcf_state.position_from_mujoco(model, mj_model, data.qpos),
            mjcf_state.velocity_from_mujoco(model, mj_model, data.qpos, data.qvel),
            np.zeros(model.nv),
            method=method,
            passive=True,
        )
        expected = mjcf_state.acceleration_from_mujoco(
            model, mj_model, data.qpos, data.qvel, data.qacc
        )
        np.testing.assert_allclose(ours, expected, rtol=1e-9, atol=1e-9)


def test_bodies_are_where_mujoco_puts_them(machine, rng):
    """Our link frames lie at the last joint's anchor, along the axes of the MJCF body."""
    _, model, mj_model = machine
    data = mujoco.MjData(mj_model)
    data.qpos, data.qvel = random_state(mj_model, rng)
    mujoco.mj_forward(mj_model, data)
    q = mjcf_state.position_from_mujoco(model, mj_model, data.qpos)
    poses = dict(zip(model.link_names, np.asarray(lw.link_poses(model, q)), strict=True))
    for body in range(1, mj_model.nbody):
        name = mj_model.body(body).name or f"body{body}"
        R = data.xmat[body].reshape(3, 3)
        joints = range(
            mj_model.body_jntadr[body], mj_model.body_jntadr[body] + mj_model.body_jntnum[body]
        )
        anchor = mj_model.jnt_pos[joints[-1]] if joints else np.zeros(3)
        np.testing.assert_allclose(poses[name][:3, :3], R, atol=1e-12)
        np.testing.assert_allclose(poses[name][:3, 3], data.xpos[body] + R @ anchor, atol=1e-12)


def test_states_convert_there_and_back(machine, rng):
    _, model, mj_model = machine
    qpos, qvel = random_state(mj_model, rng)
    q = mjcf_state.position_from_mujoco(model, mj_model, qpos)
    v = mjcf_state.velocity_from_mujoco(model, mj_model, qpos, qvel)
    assert q.shape == (model.nq,)
    np.testing.assert_allclose(
        mujoco_states.position_to_mujoco(model, mj_model, q), qpos, rtol=1e-15
    )
    back = mujoco_states.velocity_to_mujoco(model, mj_model, qpos, v)
    np.testing.assert_allclose(back, qvel, rtol=1e-12, atol=1e-15)
    with pytest.raises(lw.InputError, match=r"qpos: expected shape \(15,\), given shape \(3,\)"):
        mjcf_state.position_from_mujoco(model, mj_model, [0, 0, 0])


def test_quaternion_orders():
    wxyz = np.array([[1.0, 2, 3, 4], [5, 6, 7, 8]])
    xyzw = mjcf_state.xyzw_from_wxyz(wxyz)
    np.testing.assert_array_equal(xyzw, [[2, 3, 4, 1], [6, 7, 8, 5]])
    np.testing.assert_array_equal(mujoco_states.wxyz_from_xyzw(xyzw), wxyz)


def test_what_is_left_out_is_said(write):
    model = lw.load(
        write(
            """<mujoco><option density="1"/><worldbody>
            <geom type="plane" size="1 1 1"/>
            <body name="a" pos="0 0 1"><joint name="ja" type="hinge" ref="30" range="-10 40"/>
              <geom size="0.1"/><site name="s"/>
              <body name="b" pos="0 0 1"><joint name="jb" type="ball" stiffness="1" range="0 20"/>
              <geom size="0.1"/></body></body>
            <body name="c" mocap="true"/>
            </worldbody>
            <equality><weld body1="a" body2="b"/></equality>
            <tendon><fixed name="t"><joint joint="ja" coef="1"/></fixed></tendon>
            <actuator><motor joint="ja"/></actuator>
            <sensor><accelerometer site="s"/></sensor></mujoco>"""
        ),
        equality="ignore",
    )
    notes = {(n.level, n.element): n.text for n in model.notes}
    assert notes["warning", "contact"] == "3 geoms that can touch: contacts are ignored"
    assert notes["warning", "equality"].startswith("1 equality constraints ignored, as")
    assert notes["warning", "tendon"].startswith("1 tendon")
    assert notes["warning", "actuator"].startswith("1 actuator")
    assert notes["warning", "mocap"].startswith("1 mocap")
    assert notes["warning", "option"].startswith("density and viscosity")
    assert notes["warning", "jb"] == "its cone limit is ignored"
    assert "ref, 0.523599" in notes["info", "ja"]
    assert notes["info", "sensor"] == "1 ignored"
    assert notes["info", "range"].startswith("2 joint ranges")
    assert "its spring is ignored: springs need a hinge or slide joint" in [
        n.text for n in model.notes if n.element == "jb"
    ]


def test_disabled_passive_forces_and_gravity_stay_disabled(write):
    text = MACHINE.replace(
        '<flag contact="disable"/>',
        '<flag contact="disable" gravity="disable" spring="disable" damper="disable"/>',
    )
    model = lw.load(write(text))
    np.testing.assert_array_equal(model.gravity, [0, 0, 0])
    assert not model.stiffness.any()
    assert not model.damping.any()


BODY = (
    '<mujoco><worldbody><body name="a"{}><joint axis="{}"/><geom size="{}"/></body>{}'
    "</worldbody></mujoco>"
)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            BODY.format("", "0 0 0", "0.1", ""),
            ": model file: MuJoCo refuses it: Error: axis too small in joint Element name '', id 0",
        ),
        (
            BODY.format("", "0 0 1", "1e400", ""),
            ": model file: MuJoCo refuses it: XML Error: number",
        ),
        (
            BODY.format("", "0 0 1", "0.1", "<foo/>"),
            ": model file: MuJoCo refuses it: XML Error: Sche",
        ),
        (
            BODY.format(' pos="0 nan 0"', "0 0 1", "0.1", ""),
            ": body 'a': pos is not finite; give finite numbers",
        ),
        (
            BODY.format("", '0 0 1"/><joint pos="0 0 inf', "0.1", ""),
            ": link 'a': centre of mass is not finite; give three finite numbers in m",
        ),
        (
            '<!DOCTYPE mujoco [<!ENTITY x "y">]><mujoco model="&x;"/>',
            ":1: DOCTYPE: document type and entity definitions are not allowed in a model file; ",
        ),
    ],
)
@pytest.mark.filterwarnings("error")
def test_defect_is_named(write, complaint, capfd, monkeypatch, tmp_path, text, expected):
    monkeypatch.chdir(tmp_path)
    path = write(text)
    assert complaint(lw.load, path).startswith(expected)
    # MuJoCo's own warnings go neither to the screen nor to a file.
    assert capfd.readouterr() == ("", "")
    assert sorted(tmp_path.iterdir()) == [path]


LARGE = [
    (
        '<worldbody><replicate count="1000"><replicate count="1000"><body><geom size="1"/></body>'
        "</replicate></replicate></worldbody>",
        ":1: element 'mujoco': has more than 20000 elements once all are replicated; build very ",
    ),
    (
        '<worldbody><flexcomp name="f" type="grid" count="300 300 300"/></worldbody>',
        ":1: element 'mujoco': has more than 20000 elements",
    ),
    (
        '<asset><texture name="t" type="2d" builtin="flat" width="90000" height="90000"/></asset>',
        ":2: element 'texture': brings what the file orders by counts to more than 134217728 ",
    ),
    (
        '<default><texture width="20000" height="2"/></default><asset><texture builtin="flat"/>'
        "</asset>",
        ":2: element 'texture': brings what the file orders",
    ),
    (
        '<asset><hfield name="h" nrow="100000" ncol="100000" size="1 1 1 1"/></asset>',
        ":2: element 'hfield': brings what the file orders",
    ),
    (
        '<custom><numeric name="n" size="2000000000"/></custom>',
        ":2: element 'numeric': brings what the file orders",
    ),
    ('<size nuser_body="100000000"/>', ":2: element 'size': nuser_body is larger than 1000; leave"),
    (
        '<asset><mesh name="m" file="/dev/zero"/></asset>',
        ":2: element 'mesh': file '/dev/zero' is not a regular file; give a file",
    ),
    (
        '<asset><texture name="t" type="2d" file="bomb.png"/></asset>',
        ":2: element 'texture': brings what the file orders",
    ),
    (
        '<asset><mesh name="m" file="heavy.stl"/></asset>',
        ":2: element 'mesh': file 'heavy.stl' brings the meshes and pictures to more than 256 MiB",
    ),
]


@pytest.mark.parametrize(("text", "expected"), LARGE)
def test_what_would_read_elsewhere_or_exhaust_the_memory_is_refused(
    write, complaint, tmp_path, monkeypatch, text, expected
):
    def compile_it(path):
        raise AssertionError("reached MuJoCo's compiler")

    monkeypatch.setattr("linkwise.io.mjcf.compile_mjcf", compile_it)
    header = b"\x89PNG\r\n\x1a\n" + bytes([0, 0, 0, 13]) + b"IHDR"
    (tmp_path / "bomb.png").write_bytes(header + (100_000).to_bytes(4, "big") * 2)
    with open(tmp_path / "heavy.stl", "wb") as sparse:
        sparse.truncate(2**29)
    assert complaint(lw.load, write(f"<mujoco>\n{text}</mujoco>")).startswith(expected)


def test_replicated_bodies_within_bounds_are_read(write):
    ring = '<replicate count="8" euler="0 0 45"><body pos="1 0 0"><joint/><geom size="0.1"/></body>'
    model = lw.load(write(f"<mujoco><worldbody>{ring}</replicate></worldbody></mujoco>"))
    assert model.n_joints == 8


def test_floating_base_is_the_files_business(write, complaint):
    message = complaint(lw.load, write(MACHINE), floating_base=True)
    assert message.startswith(": floating_base: the file says itself which bodies float; ")


def test_missing_extra_is_one_line(write, complaint, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    assert complaint(lw.load, write(MACHINE)) == (
        ": model file: MJCF needs the package mujoco; pip install 'linkwise[mjcf]'"
    )


def test_a_reader_that_broke_is_told_and_does_not_wait_for_ever(monkeypatch):
    """MuJoCo keeps a lock where its own message fails, as it may where a geom's type is %s.

    The failure is played, because it depends on what happens to be in memory.
    """
    body = "<mujoco><worldbody><body><joint/><geom size='1'/></body></worldbody></mujoco>"
    monkeypatch.setattr(mjcf, "_broken_by", [])

    class Broken:
        @staticmethod
        def from_xml_string(text):
            raise ValueError("Caught an unknown exception!")

    with monkeypatch.context() as played:
        played.setattr(mujoco, "MjModel", Broken)
        with pytest.raises(lw.InputError, match="MuJoCo refuses it"):
            lw.load(body)
    with pytest.raises(lw.InputError, match="start a new process"):
        lw.load(body)
    monkeypatch.setattr(mjcf, "_broken_by", [])
    assert lw.load(body).nv == 1
