"""A URDF read by linkwise and by Pinocchio, with states and results mapped by joint name."""

from importlib import metadata
from pathlib import Path

import numpy as np
import pinocchio as pin

import linkwise as lw


def robot_files():
    """{short name: path} of every URDF that example-robot-data ships."""
    files = metadata.files("example-robot-data") or []
    paths = sorted(Path(str(f.locate())) for f in files if f.suffix == ".urdf")
    return {f"{p.parents[1].name.removesuffix('_description')}/{p.stem}": p for p in paths}


class Pair:
    """Our model, Pinocchio's, and the maps between their coordinates and joint orders."""

    def __init__(self, path, *, floating_base):
        root = (pin.JointModelFreeFlyer(),) if floating_base else ()
        self.pin = pin.buildModelFromUrdf(str(path), *root)
        self.data = self.pin.createData()
        self.model = lw.load(path, floating_base=floating_base, mimic="independent")
        names = list(self.model.joint_names)
        self.ids = [self.pin.getJointId(name) for name in names]
        assert max(self.ids, default=0) < self.pin.njoints, "a joint is unknown to Pinocchio"
        self.dofs = np.concatenate(
            [np.arange(self.pin.nv)[slice_v(self.pin.joints[i])] for i in self.ids] or [[]]
        ).astype(int)

    def pin_configuration(self, q):
        """Our coordinates as Pinocchio's: a continuous joint's angle as its cosine and sine."""
        out = pin.neutral(self.pin)
        for name, i in zip(self.model.joint_names, self.ids, strict=True):
            x, joint = q[self.model.q_slice(name)], self.pin.joints[i]
            turns = joint.nq == 2 and joint.nv == 1
            out[joint.idx_q : joint.idx_q + joint.nq] = [np.cos(x[0]), np.sin(x[0])] if turns else x
        return out

    def to_pin(self, v):
        out = np.empty(self.pin.nv)
        out[self.dofs] = v
        return out

    def from_pin(self, v):
        return np.asarray(v)[self.dofs]

    def wrenches(self):
        """data.f, the wrench of the inboard on the outboard body, joint frame, linear first."""
        return np.array([self.data.f[i].vector for i in self.ids]).reshape(-1, 6)


def slice_v(joint):
    return slice(joint.idx_v, joint.idx_v + joint.nv)
