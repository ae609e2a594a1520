"""What MuJoCo's force and torque sensors read, at welds whose links are merged and at any site."""

import numpy as np
import pytest

import linkwise as lw
from linkwise.io.mjcf_state import position_from_mujoco, velocity_from_mujoco

mujoco = pytest.importorskip("mujoco")

# An arm with a sensor body welded to its last link and a peg welded to that; sites stand askew.
ARM = """<mujoco model="peg_arm">
  <compiler angle="degree"/>
  <option gravity="0 0 -9.81"/>
  <worldbody>
    <body name="link1" pos="0 0 0.3" euler="0 30 10">
      <joint name="j1" axis="0 1 0" pos="0.01 0 -0.02" damping="0.2" armature="0.03"/>
      <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.03" mass="2"/>
      <body name="link2" pos="0.3 0 0" euler="20 0 0">
        <joint name="j2" type="ball"/>
        <geom type="box" size="0.1 0.02 0.03" pos="0.1 0 0" mass="1"/>
        <site name="elbow" pos="0.03 0.02 0.01" euler="10 -20 30"/>
        <body name="sensor_body" pos="0.2 0 0" euler="0 0 45">
          <geom type="sphere" size="0.02" mass="0.05"/>
          <site name="cell" pos="0.01 0 0.02" euler="30 0 -40"/>
          <body name="peg" pos="0 0 0.05">
            <geom type="cylinder" size="0.01 0.05" pos="0.03 0 0" mass="0.4"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <sensor>
    <force site="cell"/><torque site="cell"/><force site="elbow"/><torque site="elbow"/>
  </sensor>
</mujoco>"""


@pytest.mark.parametrize("seed", range(5))
def test_sensors_at_sites(seed):
    model = lw.load(ARM)
    assert model.joint_names == ["j1", "j2"]
    theirs = mujoco.MjModel.from_xml_string(ARM)
    data = mujoco.MjData(theirs)
    rng = np.random.default_rng(seed)
    mujoco.mj_integratePos(theirs, data.qpos, rng.normal(size=theirs.nv), 0.5)
    data.qvel[:] = rng.normal(size=theirs.nv)
    mujoco.mj_forward(theirs, data)
    q = position_from_mujoco(model, theirs, data.qpos)
    v = velocity_from_mujoco(model, theirs, data.qpos, data.qvel)
    run = lw.simulate(model, duration=1e-3, every=1e-3, q0=q, v0=v)
    for k, (link, joint) in enumerate({"sensor_body": "sensor_body_weld", "link2": "j2"}.items()):
        site = theirs.site(("cell", "elbow")[k])
        w, x, y, z = site.quat
        at = lw.Frame(link, site.pos, (x, y, z, w))
        expected = data.sensordata[6 * k : 6 * k + 6]
        found = lw.loads.in_frame(run, at, joint=joint)[0]
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10 * np.abs(expected).max())
