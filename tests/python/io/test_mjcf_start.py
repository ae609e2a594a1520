"""Where an MJCF machine starts: as the file draws it, or at one of its keyframes."""

import numpy as np
import pytest

import linkwise as lw
from helpers import mujoco_states
from linkwise.io import mjcf_state
from linkwise.view.joint_sliders import angles_of, quaternion_of

mujoco = pytest.importorskip("mujoco")

SATELLITES = """
<mujoco>
  <compiler angle="degree"/>
  <option gravity="0 0 0"/>
  <worldbody>
    <body name="box" mocap="true" pos="0 0 9"><geom size="1"/></body>
    <body name="chaser" pos="-5 1 0.5" euler="10 20 30">
      <freejoint name="chaser_free"/>
      <inertial pos="0.05 0 0.02" mass="200" diaginertia="40 45 30"/>
      <body name="boom" pos="0.6 0 0" euler="0 0 15">
        <joint name="boom_joint" axis="0 0 1" ref="40"/>
        <inertial pos="0.5 0 0" mass="8" diaginertia="0.02 0.7 0.7"/>
        <body pos="1 0 0" euler="0 90 0">
          <joint type="ball" name="tip"/>
          <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
        </body>
      </body>
    </body>
    <body name="debris" pos="3 -2 0" quat="0.5 0.5 0.5 0.5">
      <joint type="free" name="debris_free"/>
      <inertial pos="0 0 0" mass="900" diaginertia="300 500 700"/>
    </body>
  </worldbody>
  <keyframe>
    <key qpos="0 0 0 1 0 0 0 0 1 0 0 0 1 1 1 1 0 0 0"/>
    <key name="start" time="3"
         qpos="-5 1 0.5 .6 0 .8 0 0.3 0 .7071 .7071 0 3 -2 0 0.7071 0 0.7071 0"
         qvel="0.1 0 0 0 0 0.02 -0.05 1 2 3 0 0.5 0 0.1 0.2 0.3"/>
    <key name="moved" mpos="1 2 3"/>
  </keyframe>
</mujoco>
"""
SCENARIO = """
model = "satellites.xml"
[initial]
{keyframe}
[initial.velocity]
boom_joint = 0.25
[simulate]
duration = 0.01
"""


@pytest.fixture
def satellites(tmp_path):
    path = tmp_path / "satellites.xml"
    path.write_text(SATELLITES)
    return path, lw.load(path), mujoco.MjModel.from_xml_path(str(path))


def link_positions(model, q):
    """Origins of the links by name."""
    return dict(zip(model.link_names, lw.link_poses(model, q)[:, :3, 3], strict=True))


def test_runs_and_batches_start_as_drawn(satellites):
    _, model, mj_model = satellites
    data = mujoco.MjData(mj_model)
    mujoco.mj_kinematics(mj_model, data)
    run = lw.simulate(model, duration=0.01, every=0.01)
    batch = lw.simulate_batch(model, duration=0.01, every=0.01, step=0.01)
    stored = lw.Model.from_bytes(model.to_bytes())
    for q in (
        model.initial_configuration(),
        stored.initial_configuration(),
        run.position.values[0],
        batch.position.values.reshape(-1, model.nq)[0],
    ):
        np.testing.assert_allclose(
            mujoco_states.position_to_mujoco(model, mj_model, q), mj_model.qpos0, atol=1e-15
        )
        placed = link_positions(model, q)
        for name in ("box", "chaser", "boom", "debris"):
            drawn = data.xpos[mj_model.body(name).id]
            np.testing.assert_allclose(placed[name], drawn, atol=1e-12, err_msg=name)


def test_turned_start_is_noted(satellites):
    notes = {note.element: note.text for note in satellites[1].notes}
    assert "-5 1 0.5" in notes["chaser_free"]
    assert "0.5 0.5 0.5 0.5" in notes["debris_free"]
    assert "'start'" in notes["keyframe"]


def arguments(path, keyframe):
    scenario_path = path.with_name("scenario.toml")
    scenario_path.write_text(SCENARIO.format(keyframe=keyframe))
    scenario = lw.load_scenario(scenario_path)
    return scenario.simulate_arguments(scenario.load_model())


@pytest.mark.parametrize(("key", "index"), [('"start"', 1), ("0", 0), ('"0"', 0)])
def test_scenario_starts_at_a_keyframe(satellites, key, index):
    path, model, mj_model = satellites
    given = arguments(path, f"keyframe = {key}")
    data = mujoco.MjData(mj_model)
    mujoco.mj_resetDataKeyframe(mj_model, data, index)
    data.qvel[mj_model.joint("boom_joint").dofadr[0]] = 0.25
    mujoco.mj_normalizeQuat(mj_model, data.qpos)
    mujoco.mj_forward(mj_model, data)
    theirs = mjcf_state.acceleration_from_mujoco(model, mj_model, data.qpos, data.qvel, data.qacc)
    ours = lw.forward_dynamics(model, given["q0"], given["v0"])
    np.testing.assert_allclose(ours, theirs, atol=1e-12)
    placed = link_positions(model, given["q0"])
    np.testing.assert_allclose(placed["boom"], data.xpos[mj_model.body("boom").id], atol=1e-12)
    assert given["v0"][model.v_slice("boom_joint")] == 0.25


def test_named_coordinates_go_before_the_drawn_ones(satellites):
    given = arguments(satellites[0], "position.boom_joint = 0.5")
    model = satellites[1]
    np.testing.assert_allclose(given["q0"][model.q_slice("debris_free")][:3], [3, -2, 0])
    assert given["q0"][model.q_slice("boom_joint")] == 0.5


@pytest.mark.parametrize(
    ("key", "expected"),
    [
        ('"stat"', "did you mean 'start'"),
        ("7", "the keyframes are"),
        ('"moved"', "moves mocap bodies"),
    ],
)
def test_keyframe_that_cannot_be_had(satellites, key, expected):
    with pytest.raises(lw.InputError, match=expected):
        arguments(satellites[0], f"keyframe = {key}")


def test_keyframe_of_a_urdf_is_refused(arm):
    path = arm.with_name("scenario.toml")
    path.write_text(f'model = "{arm.name}"\n[initial]\nkeyframe = "a"\n[simulate]\nduration = 1')
    scenario = lw.load_scenario(path)
    with pytest.raises(lw.InputError, match="only an MJCF file has keyframes; remove it"):
        scenario.simulate_arguments(scenario.load_model())


@pytest.mark.parametrize(
    ("initial", "expected"),
    [
        ([0, 0, 0], "has 3 numbers; give its 7 coordinates"),
        ([0, 0, 0, 0, 0, 0, 2], "quaternion of length 2; give a unit quaternion"),
        ([0, 0, np.nan, 0, 0, 0, 1], "is not finite; give finite coordinates"),
    ],
)
def test_start_that_is_none_is_refused(initial, expected):
    builder = lw.ModelBuilder()
    builder.add_link("ground")
    builder.add_link("body", mass=1, inertia=np.eye(3))
    builder.add_joint("free", "floating", "ground", "body", initial=initial)
    with pytest.raises(lw.InputError, match=expected):
        builder.build()


def test_sliders_begin_at_the_start(rng):
    for angles in rng.uniform(-1.5, 1.5, (20, 3)):
        np.testing.assert_allclose(angles_of(quaternion_of(angles)), angles, atol=1e-12)
