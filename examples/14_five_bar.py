"""A five-bar robot holds a tool: what its two motors must give in every place.

Both motors turn on the ground, the forearms meet at the tool. By virtual work the torques are the
slope of the weights' heights, from plain trigonometry. The number that a designer wants: the
largest torque.

Run it by: python examples/14_five_bar.py [PICTURE.svg]
"""

import sys

import numpy as np
from checked import check

import linkwise as lw

APART, UPPER, FORE = 0.2, 0.25, 0.35  # m
UPPER_MASS, FORE_MASS, TOOL = 1.2, 0.8, 5.0  # kg
AXIS, G = (0, -1, 0), 9.81
MOVE, DURATION = (0.5, 0.9), 2.0  # rad that the left and the right motor turn, in s


def bar(mass, length):
    moment = mass * length**2 / 12
    return {
        "mass": mass,
        "com": (length / 2, 0, 0),
        "inertia": np.diag([0.01 * moment, moment, moment]),
    }


builder = lw.ModelBuilder("five_bar")
builder.add_link("ground")
for side, x in (("left", -APART / 2), ("right", APART / 2)):
    builder.add_link(f"{side}_upper", **bar(UPPER_MASS, UPPER))
    builder.add_link(f"{side}_fore", **bar(FORE_MASS, FORE))
    shoulder = {"translation": (x, 0, 0), "axis": AXIS}
    builder.add_joint(f"{side}_motor", "revolute", "ground", f"{side}_upper", **shoulder)
    elbow = {"translation": (UPPER, 0, 0), "axis": AXIS}
    builder.add_joint(f"{side}_elbow", "revolute", f"{side}_upper", f"{side}_fore", **elbow)
ends = {"translation": (FORE, 0, 0), "child_translation": (FORE, 0, 0), "axis": AXIS}
builder.add_loop("tip", "revolute", "left_fore", "right_fore", **ends)
robot = builder.build().with_payload("left_fore", mass=TOOL, com=(FORE, 0, 0))


def points(left, right):
    """Elbows and tool for the motors' angles: the forearms' circles meet above."""
    elbows = [
        np.array([x + UPPER * np.cos(a), UPPER * np.sin(a)])
        for x, a in ((-APART / 2, left), (APART / 2, right))
    ]
    between = elbows[1] - elbows[0]
    up = np.sqrt(FORE**2 - between @ between / 4)
    normal = np.array([-between[1], between[0]]) / np.hypot(*between)
    return *elbows, (elbows[0] + elbows[1]) / 2 + up * normal


def weight_times_height(left, right):
    one, two, tool = points(left, right)
    bars = UPPER_MASS * (one[1] + two[1]) / 2 + FORE_MASS * (one[1] + two[1] + 2 * tool[1]) / 2
    return G * (bars + TOOL * tool[1])


def torques(left, right, step=1e-6):
    """Slopes of the potential energy."""
    ahead = [weight_times_height(left + a, right + b) for a, b in ((step, 0), (0, step))]
    behind = [weight_times_height(left - a, right - b) for a, b in ((step, 0), (0, step))]
    return (np.array(ahead) - behind) / (2 * step)


START = np.array([2.1, 1.0])
start = lw.assemble(robot, [START[0], -1.2, START[1], 1.2], hold=["left_motor", "right_motor"]).q
held = {"left_motor": lw.Locked(), "right_motor": lw.Locked()}
still = lw.simulate(robot, duration=0.01, every=0.01, q0=start, drives=held)
for side, expected in zip(("left", "right"), torques(*START), strict=True):
    found = float(still.drive_torque.sel(dof=f"{side}_motor")[0])
    check(f"{side} motor holds", found, expected, 1e-6, "N m")


def swing(first, by):
    """There and back, at rest at both ends: angle, rate, acceleration."""
    rate = 2 * np.pi / DURATION

    def at(t):
        return (
            first + by * (1 - np.cos(rate * t)) / 2,
            by * rate * np.sin(rate * t) / 2,
            by * rate**2 * np.cos(rate * t) / 2,
        )

    return lw.Motion(at)


drives = {
    f"{side}_motor": swing(first, by)
    for side, first, by in zip(("left", "right"), START, MOVE, strict=True)
}
run = lw.simulate(robot, duration=DURATION, every=0.01, q0=start, drives=drives, tolerance=1e-8)
tool = run.position.values[:, [0, 2]]
fore = run.position.values[:, :2].sum(axis=1)
reached = np.array([points(*angles)[2] for angles in tool])
found = np.stack([np.cos(fore), np.sin(fore)], 1) * FORE
found += [points(*angles)[0] for angles in tool]
check("tool off its place", float(abs(found - reached).max()), 0.0, 1e-9, "m")
balance = lw.loads.energy_balance(run)
lost = float(abs(balance.residual).max() / abs(balance.drive_work).max())
check("energy that does not add up, relative", lost, 0.0, 1e-6)
largest = {side: float(abs(run.drive_torque.sel(dof=side)).max()) for side in drives}
print("largest torque " + ", ".join(f"{side} {value:.4g} N m" for side, value in largest.items()))
print(f"largest force on the tip {float(run.peak_loads().force.sel(joint='tip')):.4g} N")
if len(sys.argv) > 1:
    from picture import save

    torque = {str(side): run.drive_torque.sel(dof=side) for side in drives}
    force = np.sqrt((run.joint_load[..., :3] ** 2).sum("component"))
    panels = [("motor torque [N m]", torque), ("force [N]", {"tip": force.sel(joint="tip")})]
    save(sys.argv[1], run, panels, times=[0.0, 0.5, 1.0], tips={})
