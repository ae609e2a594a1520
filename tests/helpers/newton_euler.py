"""A slow, independent inverse dynamics: Newton and Euler in world axes, every joint taken apart.

Each joint is a stack of steps with massless bodies between them; a step has a transform T(q) and
axes S that are constant in its child frame, V_relative = S v. It shares no code and no formulation
(body frames, recursion, projections) with the library, and it is the slow twin of all its methods.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

X, Y, Z = np.eye(3)


@dataclass
class Step:
    nq: int
    S: Any  # 6 x nv, linear first, child frame
    transform: Any  # q -> (R, p), child to parent


def turn(axis, pitch=0.0):
    axis = np.asarray(axis)
    return Step(
        1,
        np.r_[pitch * axis, axis][:, None],
        lambda q: (Rotation.from_rotvec(q[0] * axis).as_matrix(), q[0] * pitch * axis),
    )


def slide(axis):
    axis = np.asarray(axis)
    return Step(1, np.r_[axis, 0 * axis][:, None], lambda q: (np.eye(3), q[0] * axis))


def plane(axis):
    """Coordinates x, y, angle in a frame whose z is the joint axis; rates in the child frame."""
    R0 = align_z(axis)

    def transform(q):
        R = R0 @ Rotation.from_rotvec(q[2] * Z).as_matrix() @ R0.T
        return R, R0 @ np.array([q[0], q[1], 0.0])

    S = np.zeros((6, 3))
    S[:3, 0], S[:3, 1], S[3:, 2] = R0[:, 0], R0[:, 1], R0[:, 2]
    return Step(3, S, transform)


def align_z(axis):
    """Rotation that takes z onto `axis`: the shortest, after a half turn about x if z < 0."""
    axis = np.asarray(axis, float)
    if axis[2] < 0:
        flip = np.diag([1.0, -1.0, -1.0])
        return flip @ align_z(flip @ axis)
    rotation, _ = Rotation.align_vectors(axis[None], Z[None])
    return rotation.as_matrix()


def steps_of(joint):
    axis, axes = joint.options.get("axis"), joint.options.get("axes")
    match joint.type:
        case "revolute" | "continuous":
            return [turn(axis)]
        case "prismatic":
            return [slide(axis)]
        case "helical":
            return [turn(axis, joint.options["pitch"])]
        case "cylindrical":
            return [slide(axis), turn(axis)]
        case "universal":
            return [turn(axes[0]), turn(axes[1])]
        case "composite":
            return [{"revolute": turn, "prismatic": slide}[kind](a) for kind, a in axes]
        case "planar":
            return [plane(axis)]
        case "spherical":
            return [Step(4, np.eye(6)[:, 3:], lambda q: (Rotation.from_quat(q).as_matrix(), 0 * X))]
        case "floating":
            return [Step(7, np.eye(6), lambda q: (Rotation.from_quat(q[3:]).as_matrix(), q[:3]))]
    raise AssertionError(joint.type)


@dataclass
class Motion:
    """Pose, velocity and acceleration of a frame: world axes, of the frame's origin."""

    R: np.ndarray
    p: np.ndarray
    v: np.ndarray
    w: np.ndarray
    a: np.ndarray
    dw: np.ndarray

    def moved_by(self, R, r, vl=0 * X, wl=0 * X, dvl=0 * X, dwl=0 * X):
        """Frame at rotation R, offset r in this one, moving relative to it (child components)."""
        r, R = self.R @ r, self.R @ R
        v_rel, w_rel = R @ vl, R @ wl
        dv_rel, dw_rel = R @ dvl + np.cross(w_rel, v_rel), R @ dwl
        w, dw = self.w, self.dw
        return Motion(
            R,
            self.p + r,
            self.v + np.cross(w, r) + v_rel,
            w + w_rel,
            self.a
            + np.cross(dw, r)
            + np.cross(w, np.cross(w, r))
            + 2 * np.cross(w, v_rel)
            + dv_rel,
            dw + dw_rel + np.cross(w, w_rel),
        )


def newton_euler(tree, model, q, v, a):
    """Generalised forces (nv,), joint loads {joint: 6} in child frames, and body motions."""
    ground = Motion(np.eye(3), 0 * X, 0 * X, 0 * X, 0 * X, 0 * X)
    motions, frames = [], []
    for joint in tree.joints:
        parent = motions[joint.parent] if joint.parent >= 0 else ground
        frame = parent.moved_by(joint.rotation, joint.translation)
        iq, iv = model.q_slice(joint.name).start, model.v_slice(joint.name).start
        stack = []
        for step in steps_of(joint):
            n = step.S.shape[1]
            V, A = step.S @ v[iv : iv + n], step.S @ a[iv : iv + n]
            R, r = step.transform(q[iq : iq + step.nq])
            frame = frame.moved_by(R, r, V[:3], V[3:], A[:3], A[3:])
            stack.append((iv, step.S, frame))
            iq, iv = iq + step.nq, iv + n
        motions.append(frame)
        frames.append(stack)
    tau, loads = np.zeros(model.nv), {}
    force = [np.zeros(3) for _ in tree.joints]
    moment = [np.zeros(3) for _ in tree.joints]  # about the world origin
    for k in range(len(tree.joints) - 1, -1, -1):
        joint, m = tree.joints[k], motions[k]
        com = m.moved_by(np.eye(3), joint.com)
        inertia = m.R @ joint.inertia @ m.R.T
        f = joint.mass * (com.a - tree.gravity)
        force[k] += f
        moment[k] += np.cross(com.p, f) + inertia @ m.dw + np.cross(m.w, inertia @ m.w)
        if joint.parent >= 0:
            force[joint.parent] += force[k]
            moment[joint.parent] += moment[k]
        loads[joint.name] = np.r_[m.R.T @ force[k], m.R.T @ (moment[k] - np.cross(m.p, force[k]))]
        for iv, S, frame in frames[k]:
            about = frame.R.T @ (moment[k] - np.cross(frame.p, force[k]))
            tau[iv : iv + S.shape[1]] = S.T @ np.r_[frame.R.T @ force[k], about]
    return tau, loads, dict(zip((j.name for j in tree.joints), motions, strict=True))
