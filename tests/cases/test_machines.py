"""Machines that users of other engines reported on, small, with the right value of each."""

import subprocess
import sys

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import linkwise as lw
from linkwise.io import mjcf_state

G = 9.81


def body(name, mass, moments, com=(0, 0, 0)):
    xx, yy, zz = moments
    return (
        f'<link name="{name}"><inertial><origin xyz="{com[0]} {com[1]} {com[2]}"/>'
        f'<mass value="{mass}"/><inertia ixx="{xx}" ixy="0" ixz="0" iyy="{yy}" iyz="0" izz="{zz}"/>'
        "</inertial></link>"
    )


def joint(name, kind, parent, child, rest=""):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f"{rest}</joint>"
    )


def test_a_force_torque_sensor_without_mass_has_the_load_of_what_it_carries():
    """0.8 kg of gripper over the sensor, 0.2 kg of camera 70 mm to its side, at rest."""
    urdf = (
        '<robot name="wrist"><link name="forearm"/><link name="sensor"/>'
        + body("hand", 1, (1e-3, 1e-3, 1e-3), (0, 0, 0.03))
        + body("gripper", 0.8, (9e-4, 9e-4, 4e-4), (0, 0, 0.05))
        + body("camera", 0.2, (1e-4, 1e-4, 1e-4))
        + joint("wrist", "revolute", "forearm", "hand", '<axis xyz="0 1 0"/>'
                '<limit lower="-2" upper="2" effort="40" velocity="3"/>')
        + joint("FT_sensor", "fixed", "hand", "sensor", '<origin xyz="0 0 .06" rpy="0 0 0.785"/>')
        + joint("mount", "fixed", "sensor", "gripper", '<origin xyz="0 0 0.02"/>')
        + joint("bracket", "fixed", "sensor", "camera", '<origin xyz="0.07 0 0.01"/>')
        + "</robot>"
    )  # fmt: skip
    model = lw.load(urdf, keep_fixed=True)
    run = lw.simulate(model, duration=0.1, drives={"wrist": lw.Locked()})
    load = run.joint_load.sel(joint="FT_sensor").values[-1]
    assert load == pytest.approx([0, 0, 1.0 * G, 0, -0.07 * 0.2 * G, 0], abs=1e-9)


DOOR = (
    '<robot name="door"><link name="frame"/>'
    + body("leaf", 20, (0.4, 1.1, 1.1), (0.4, 0, 0))
    + joint("hinge", "continuous", "frame", "leaf", '<axis xyz="0 0 1"/>{}')
    + "</robot>"
)


def test_a_damper_written_as_an_element_brakes():
    """20 kg at 0.4 m, 4.3 kg m2 about the hinge, 100 N m s/rad, 2 rad/s."""
    with pytest.warns(lw.ModelWarning, match="gives damping as an element"):
        door = lw.load(DOOR.format("<dynamics><damping>100</damping></dynamics>"))
    run = lw.simulate(door, duration=1, v0=[2.0])
    rate = 2 * np.exp(-100 / 4.3 * run.time.values)
    assert run.velocity.values[:, 0] == pytest.approx(rate, abs=1e-4)
    slowing = 100 * 2 / 4.3
    force = 20 * np.hypot(np.hypot(0.4 * slowing, 0.4 * 2**2), G)
    assert float(run.peak_loads().force[0]) == pytest.approx(force, rel=1e-6)
    assert float(run.peak_loads().force[0]) == pytest.approx(421.9, abs=0.05)


def test_the_reaction_of_a_pendulum_is_what_its_pin_carries():
    """The pin's torque is that of the drive, once, and the force is the centripetal one and the
    weight."""
    urdf = (
        '<robot name="pendulum"><link name="post"/>'
        + body("bob", 6, (0.1, 0.1, 0.1), (0, 0, -1))
        + joint("pin", "continuous", "post", "bob", '<axis xyz="1 0 0"/>')
        + "</robot>"
    )
    model = lw.load(urdf)
    q, w, torque = 0.7, 1.9, 2.0
    a = (torque - 6 * G * np.sin(q)) / 6.1
    expected = [0, 6 * (a + G * np.sin(q)), 6 * (w**2 + G * np.cos(q)), torque, 0, 0]
    assert lw.joint_loads(model, [q], [w], [torque])[0] == pytest.approx(expected, abs=1e-9)


def test_a_bob_on_a_crank_of_given_motion():
    """A pendulum on a rotor that reaches 20 rad/s in 1 s, against its own equation of motion."""
    urdf = (
        '<robot name="mixer"><link name="frame"/>'
        + body("rotor", 3, (0.01, 0.01, 0.02), (0.02, 0, 0))
        + body("bob", 0.4, (1e-3, 1e-3, 1e-4), (0, 0, -0.15))
        + joint("shaft", "continuous", "frame", "rotor", '<axis xyz="0 0 1"/>')
        + joint("pin", "continuous", "rotor", "bob", '<origin xyz="0.2 0 0"/><axis xyz="0 1 0"/>'
                '<dynamics damping="0.02"/>')
        + "</robot>"
    )  # fmt: skip

    def shaft(t):
        s = min(t, 1.0)
        angle = 20 * (2.5 * s**4 - 3 * s**5 + s**6) + 20 * max(t - 1.0, 0.0)
        return angle, 20 * (10 * s**3 - 15 * s**4 + 6 * s**5), 600 * (s**2 - 2 * s**3 + s**4)

    drive = lw.Motion(shaft, breakpoints=[1.0])
    model = lw.load(urdf)
    run = lw.simulate(model, duration=5, every=0.05, drives={"shaft": drive}, tolerance=1e-8)
    m, length, R, across, along = 0.4, 0.15, 0.2, 1e-3, 1e-4

    def bob(t, y):
        rate = shaft(t)[1]
        out = m * (R - length * np.sin(y[0])) * -length * np.cos(y[0])
        out += (across - along) * np.sin(y[0]) * np.cos(y[0])
        torque = rate**2 * out - m * G * length * np.sin(y[0]) - 0.02 * y[1]
        return [y[1], torque / (across + m * length**2)]

    exact = solve_ivp(bob, (0, 5), [0, 0], rtol=1e-10, atol=1e-12, t_eval=run.time.values).y[0]
    assert run.position.sel(joint="pin").values == pytest.approx(exact, abs=1e-6)
    radial = np.hypot(*run.joint_load.sel(joint="shaft").values[-1, :2])
    steady = 20**2 * (3 * 0.02 + m * (R - length * np.sin(exact[-1])))
    assert radial == pytest.approx(steady, rel=1e-3)  # the bob still creeps


def test_a_wheel_turns_its_floating_base_the_other_way():
    """190 kg on air, a wheel of 0.047 kg m2 driven by 0.5 N m for 4 s, while the base slides."""
    urdf = (
        '<robot name="floater"><link name="hall"/>'
        + body("base", 190, (25, 25, 12))
        + body("wheel", 4, (0.024, 0.024, 0.047))
        + joint("floor", "planar", "hall", "base", '<origin xyz="0 0 .1" rpy="0 0 0.7"/>'
                '<axis xyz="0 0 1"/>')
        + joint("motor", "continuous", "base", "wheel", '<origin xyz="0 0 .8"/><axis xyz="0 0 1"/>')
        + "</robot>"
    )  # fmt: skip
    model = lw.load(urdf)
    v0 = [0.3, 0.1, 0, 0]
    run = lw.simulate(model, duration=4, v0=v0, drives={"motor": 0.5}, tolerance=1e-9)
    x, y, turn, wheel = run.position.values[-1]
    assert [x, y] == pytest.approx([1.2, 0.4], abs=1e-8)
    assert turn == pytest.approx(-0.5 * 4**2 / 2 / 12, rel=1e-8)
    assert wheel == pytest.approx(0.5 * 4**2 / 2 * (1 / 0.047 + 1 / 12), rel=1e-8)
    assert run.joint_load.sel(joint="floor").values[-1, 2] == pytest.approx(194 * G)


ROW_BY_ROW = '<inertia ixx="4" ixy="0.1" ixz="0.2" iyy="0.1" iyz="5" izz="0.3"/>'


def test_an_inertia_written_row_by_row_is_refused_by_name():
    urdf = f'<robot name="r"><link name="base"><inertial><mass value="3"/>{ROW_BY_ROW}</inertial>'
    with pytest.raises(lw.InputError, match="link 'base': inertia has a negative principal moment"):
        lw.load(f"{urdf}</link></robot>")


def test_a_name_in_square_brackets_is_shown_as_it_is(tmp_path):
    path = tmp_path / "odd.urdf"
    path.write_text(
        '<robot name="odd"><link name="base"/>'
        + body("a[red]", 1, (1, 1, 1))
        + joint("j[red]", "continuous", "base", "a[red]", '<axis xyz="0 0 1"/>')
        + "</robot>"
    )
    command = [sys.executable, "-m", "linkwise", "inspect", str(path)]
    assert "j[red]" in subprocess.run(command, capture_output=True, text=True, check=True).stdout


ARM = """<mujoco><option gravity="0 0 -9.81"/><worldbody>
  <body name="upper" pos="0 0 0.3" euler="0 30 10" {0}>
    <joint name="shoulder" axis="0 1 0" pos="0.01 0 -0.02" damping="0.2" armature="0.03"/>
    <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.03" mass="2"/>
    <body name="lower" pos="0.3 0 0" euler="20 0 0">
      <joint name="elbow" type="ball" pos="0 0.02 0"/>
      <geom type="box" size="0.1 0.02 0.03" pos="0.1 0 0" mass="1"/><site name="e" pos="0 0.02 0"/>
      <body name="sensor" pos="0.2 0 0" euler="0 0 45">
        <geom type="sphere" size="0.02" mass="0.05"/><site name="s"/>
        <body name="peg" pos="0 0 0.05">
          <geom type="cylinder" size="0.01 0.05" pos="0.03 0 0" mass="0.4"/></body>
      </body></body></body></worldbody>
  <sensor><force site="s"/><torque site="s"/><force site="e"/><torque site="e"/></sensor>
</mujoco>"""


def test_a_site_sensor_of_mujoco_is_the_load_of_its_weld():
    mujoco = pytest.importorskip("mujoco")
    text = ARM.format("")
    model = lw.load(text, keep_fixed=True)
    theirs = mujoco.MjModel.from_xml_string(text)
    data, rng = mujoco.MjData(theirs), np.random.default_rng(2)
    mujoco.mj_integratePos(theirs, data.qpos, rng.normal(size=theirs.nv), 0.5)
    data.qvel[:] = rng.normal(size=theirs.nv)
    mujoco.mj_forward(theirs, data)
    q = mjcf_state.position_from_mujoco(model, theirs, data.qpos)
    v = mjcf_state.velocity_from_mujoco(model, theirs, data.qpos, data.qvel)
    loads = lw.joint_loads(model, q, v, passive=True)
    weld, elbow = (loads[model.joint_index(name)] for name in ("sensor_weld", "elbow"))
    assert [*weld, *elbow] == pytest.approx(data.sensordata, abs=1e-12)


def test_the_rotor_of_an_actuator_is_in_the_mass_matrix():
    """A 1 m capsule about its end as MuJoCo has it, and 0.4 kg m2 of the actuator."""
    mujoco = pytest.importorskip("mujoco")
    text = (
        '<mujoco><worldbody><body><joint name="h" axis="0 1 0"/><geom type="capsule" '
        'fromto="0 0 0 0 0 -1" size="0.05"/></body></worldbody><actuator>'
        '<position joint="h" kp="50" kv="5" armature="0.4"/></actuator></mujoco>'
    )
    theirs = mujoco.MjModel.from_xml_string(text)
    data, full = mujoco.MjData(theirs), np.zeros((1, 1))
    mujoco.mj_forward(theirs, data)
    mujoco.mj_fullM(theirs, data, full)
    assert lw.mass_matrix(lw.load(text), [0.0]) == pytest.approx(full)
    assert full[0, 0] == pytest.approx(3.295, abs=1e-3)


def test_gravity_compensation_that_is_ignored_is_said_with_the_loads():
    pytest.importorskip("mujoco")
    with pytest.warns(lw.ModelWarning, match="gravity compensation"):
        model = lw.load(ARM.format('gravcomp="1"'))
    run = lw.simulate(model, duration=0.01)
    assert any("gravity compensation" in entry["text"] for entry in run.warnings)


def test_two_satellites_start_where_they_are_drawn_and_tumble_as_euler_says():
    pytest.importorskip("mujoco")
    text = (
        '<mujoco><option gravity="0 0 0"/><worldbody><body name="chaser" pos="-5 1 0.5" '
        'euler="10 20 30"><freejoint name="c"/><inertial pos="0.05 0 0.02" mass="200" '
        'diaginertia="40 45 30"/></body><body name="debris" pos="3 -2 0" quat=".5 .5 .5 .5">'
        '<freejoint name="d"/><inertial pos="0 0 0" mass="900" diaginertia="300 500 700"/></body>'
        "</worldbody></mujoco>"
    )
    model = lw.load(text)
    v0 = np.zeros(12)
    rate = v0[9:12] = [0.1, 0.2, 0.3]
    run = lw.simulate(model, duration=20, v0=v0, tolerance=1e-8)
    first = run.position.values[0]
    assert first[:3] == pytest.approx([-5, 1, 0.5])
    assert first[7:] == pytest.approx([3, -2, 0, 0.5, 0.5, 0.5, 0.5])
    moments = np.array([300, 500, 700])
    euler = solve_ivp(
        lambda t, w: -np.cross(w, moments * w) / moments, (0, 20), rate, rtol=1e-10, atol=1e-12
    )
    assert run.velocity.values[-1, 9:] == pytest.approx(euler.y[:, -1], abs=1e-6)
