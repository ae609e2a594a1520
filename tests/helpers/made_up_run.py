"""A small model and made-up chunks, so that recording is tested without simulating."""

import numpy as np

import linkwise as lw


def small_model():
    builder = lw.ModelBuilder("arm", source="arm.urdf")
    builder.add_link("base")
    for k, parent in enumerate(("base", "upper", "fore")):
        child = ("upper", "fore", "hand")[k]
        builder.add_link(child, mass=1.0, inertia=np.eye(3))
        builder.add_joint(("shoulder", "elbow", "wrist")[k], "revolute", parent, child)
    return builder.build()


def make_chunk(times, n_joints=3):
    """Values that tell their time and joint: every number is different."""
    t = np.asarray(times, float)
    joints = t[:, None] + 1000.0 * np.arange(n_joints)
    return {
        "time": t,
        "position": joints,
        "velocity": joints + 0.1,
        "acceleration": joints + 0.2,
        "drive_torque": joints + 0.3,
        "joint_load": joints[:, :, None] + 0.01 * np.arange(6),
        "drive_work": joints + 0.35,
        "external_work": t + 0.36,
        "dissipated_energy": t + 0.37,
        "kinetic_energy": t + 0.4,
        "potential_energy": t + 0.5,
        "steps": (10 * t).astype(int),
        "evaluations": (20 * t).astype(int),
        "iterations": (30 * t).astype(int),
        "step_size": t + 0.6,
        "order": np.full(t.size, 5),
        "outcome": "converged",
    }
