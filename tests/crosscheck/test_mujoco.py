"""MJCF models against MuJoCo's unconstrained accelerations (contacts off), at random states.

MuJoCo's free joint has its linear velocity in the world frame and the angular one in the body's;
ours has both in the body frame. Its quaternions are w, x, y, z.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import linkwise as lw
from helpers.compare import assert_close
from helpers.methods import METHODS
from helpers.random_trees import random_configuration

mujoco = pytest.importorskip("mujoco")

MODELS = sorted((Path(__file__).parents[1] / "data" / "mjcf").glob("*.xml"))
STATES = 20


class Reference:
    """MuJoCo's accelerations at our coordinates."""

    def __init__(self, path, model):
        self.model, self.mj = model, mujoco.MjModel.from_xml_path(str(path))
        self.data = mujoco.MjData(self.mj)

    def joints(self):
        """(q slice, v slice, MuJoCo's q and v addresses, kind) of every MuJoCo joint."""
        for j in range(self.mj.njnt):
            kind = mujoco.mjtJoint(self.mj.jnt_type[j])
            name = mujoco.mj_id2name(self.mj, mujoco.mjtObj.mjOBJ_JOINT, j)
            at = self.model.q_slice(name), self.model.v_slice(name)
            yield *at, self.mj.jnt_qposadr[j], self.mj.jnt_dofadr[j], kind

    def acceleration(self, q, v, tau):
        data, kinds = self.data, mujoco.mjtJoint
        for iq, iv, jq, jv, kind in self.joints():
            n = iv.stop - iv.start
            data.qvel[jv : jv + n], data.qfrc_applied[jv : jv + n] = v[iv], tau[iv]
            if kind in (kinds.mjJNT_FREE, kinds.mjJNT_BALL):
                position, quaternion = np.split(q[iq], [iq.stop - iq.start - 4])
                data.qpos[jq : jq + n + 1] = np.r_[position, np.roll(quaternion, 1)]
            else:
                data.qpos[jq] = q[iq.start]
            if kind == kinds.mjJNT_FREE:
                R = Rotation.from_quat(quaternion)
                data.qvel[jv : jv + 3] = R.apply(v[iv][:3])
                data.qfrc_applied[jv : jv + 3] = R.apply(tau[iv][:3])
        mujoco.mj_forward(self.mj, data)
        out = np.empty(self.model.nv)
        for iq, iv, _, jv, kind in self.joints():
            n = iv.stop - iv.start
            out[iv] = data.qacc[jv : jv + n]
            if kind == kinds.mjJNT_FREE:  # d(R^T v)/dt = R^T dv/dt - w x (R^T v)
                linear = Rotation.from_quat(q[iq][3:]).inv().apply(out[iv][:3])
                out[iv.start : iv.start + 3] = linear - np.cross(v[iv][3:], v[iv][:3])
        return out


def test_there_are_models_of_every_joint_type():
    kinds = {k for p in MODELS for k in mujoco.MjModel.from_xml_path(str(p)).jnt_type}
    assert len(MODELS) >= 5
    assert kinds == {0, 1, 2, 3}  # free, ball, slide, hinge


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
@pytest.mark.parametrize("method", METHODS)
def test_accelerations(path, method, rng):
    model = lw.load(path)
    reference = Reference(path, model)
    assert model.nv == reference.mj.nv
    q = random_configuration(model, rng, (STATES,))
    v, tau = rng.standard_normal((2, STATES, model.nv))
    expected = [reference.acceleration(*state) for state in zip(q, v, tau, strict=True)]
    ours = lw.forward_dynamics(model, q, v, tau, method=method, passive=True)
    assert_close(ours, expected, 1e-9, what=path.stem)
