"""A small arm that loads its joints in every way, a smooth motion for it, and a run of both."""

import numpy as np

import linkwise as lw


def arm(**options):
    """Three links with damping, a spring, friction, a stop and an armature."""
    builder = lw.ModelBuilder("arm", **options)
    builder.add_link("base")
    builder.add_link("upper", mass=4.0, com=(0.1, 0.02, -0.3), inertia=np.diag([0.2, 0.3, 0.1]))
    builder.add_link("fore", mass=2.0, com=(0.0, 0.05, -0.2), inertia=np.diag([0.1, 0.12, 0.05]))
    builder.add_link("hand", mass=1.0, com=(0.05, 0.0, -0.1), inertia=np.diag([0.02, 0.02, 0.01]))
    builder.add_joint("shoulder", "revolute", "base", "upper", axis=(0, 1, 0), damping=0.4)
    builder.add_joint(
        "elbow",
        "revolute",
        "upper",
        "fore",
        axis=(1, 0, 0),
        translation=(0, 0, -0.6),
        stiffness=8.0,
        armature=0.05,
    )
    builder.add_joint(
        "wrist",
        "revolute",
        "fore",
        "hand",
        axis=(0, 0.6, 0.8),
        translation=(0, 0.1, -0.4),
        friction=0.1,
        lower=-0.2,
        upper=0.2,
        limit_stiffness=50.0,
    )
    return builder.build()


def profile(end, duration, rows=201):
    """A smooth motion from zero to `end`, as a table."""
    times = np.linspace(0, duration, rows)
    phase = 2 * np.pi * times / duration
    return lw.Table(times, end * (times / duration - np.sin(phase) / (2 * np.pi)), "cubic")


def swing(**options):
    """A run with every cause: a given motion, a torque, a wrench, damping, spring and stop."""
    return lw.simulate(
        arm(),
        duration=1.0,
        every=0.01,
        drives={"shoulder": lw.Motion(profile(0.8, 1.0)), "elbow": 3.0},
        wrenches={"hand": lw.Wrench([5.0, -3.0, 2.0, 0.1, 0.2, -0.3])},
        q0=[0, 0.3, 0.25],
        **options,
    )
