"""A Stewart platform heaves: what its six legs push.

The published machine of `lw.scenes.benchmark`, its legs driven so that the platform goes up and
down. Newton's law for the platform alone gives what the heads of the legs carry. The number that a
designer wants: the largest force of a leg.

Run it by: python examples/16_stewart_platform.py [PICTURE.svg]
"""

import sys

import numpy as np
from checked import check

import linkwise as lw

HEAVE, RATE, G = 0.1, 2 * np.pi, 9.81  # m, rad/s
MASS = 100.0  # kg, of the platform

machine = lw.scenes.benchmark("stewart")
robot, names = machine.model, [f"leg_{k}" for k in range(6)]
drawn = lw.joint_poses(robot, machine.q0)
foot, head = (drawn[robot.joint_index(name), :3, 3] for name in ("foot_0", "head_0"))
across = float(np.hypot(*(head - foot)[:2]))  # of every leg, in the plan
rise = float(head[2] - foot[2])


def stroke(t):
    """Length of a leg beyond its first, its rate and acceleration, where the platform heaves."""
    z = rise + HEAVE * (1 - np.cos(RATE * t)) / 2
    dz, ddz = HEAVE * RATE * np.sin(RATE * t) / 2, HEAVE * RATE**2 * np.cos(RATE * t) / 2
    length = np.hypot(across, z)
    rate = z * dz / length
    return length - np.hypot(across, rise), rate, (dz**2 + z * ddz - rate**2) / length


drives = {name: lw.Motion(stroke) for name in names}
run = lw.simulate(robot, duration=1.0, every=0.01, q0=machine.q0, drives=drives, tolerance=1e-9)

# The platform alone: the heads push it up with m (g + a), all six alike.
t = run.time.values
acceleration = HEAVE * RATE**2 * np.cos(RATE * t) / 2
frames = np.array([lw.joint_poses(robot, q) for q in run.position.values])
one = run.joint_load.sel(joint="head_0").values[:, :3]
up = np.einsum("tij,tj->ti", frames[:, robot.joint_index("head_0"), :3, :3], one)[:, 2]
expected = MASS * (G + acceleration) / 6
check("a head pushes up, against Newton", float(abs(up - expected).max()), 0.0, 1e-5, "N")
force = run.drive_torque.sel(dof=names).values
check("legs differ by", float(np.ptp(force, axis=1).max()), 0.0, 1e-5, "N")
balance = lw.loads.energy_balance(run)
lost = float(abs(balance.residual).max() / abs(balance.drive_work).max())
check("energy that does not add up, relative", lost, 0.0, 1e-6)
when = t[abs(force).max(axis=1).argmax()]
print(f"largest force of a leg {abs(force).max():.4g} N, at {when:g} s")
if len(sys.argv) > 1:
    from picture import save

    curves = {name: run.drive_torque.sel(dof=name) for name in names}
    heads = np.sqrt((run.joint_load[..., :3] ** 2).sum("component"))
    curves_of_heads = {f"head_{k}": heads.sel(joint=f"head_{k}") for k in range(6)}
    panels = [("force of the legs [N]", curves), ("force at the heads [N]", curves_of_heads)]
    save(sys.argv[1], run, panels, times=[0.0, 0.5], tips={})
