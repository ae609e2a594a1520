"""A delta robot holds a load: what its motors and its rods carry.

Three arms, and six massless rods that keep the platform level. In the middle of its room all arms
share the load alike, and rods and motors follow from one triangle. The number that a designer
wants: the force in a rod.

Run it by: python examples/15_delta_robot.py [PICTURE.svg]
"""

import sys

import numpy as np
from checked import check

import linkwise as lw

BASE, PLATFORM, ARM, ROD, GAP = 0.20, 0.05, 0.25, 0.55, 0.04  # m; gap: half of a pair's distance
ARM_MASS, LOAD, ANGLE = 0.5, 3.0, 0.35  # kg, kg, rad below the horizon
G = 9.81

builder = lw.ModelBuilder("delta")
builder.add_link("ground")
builder.add_link("platform", mass=LOAD, inertia=1e-3 * np.diag([1.0, 1.0, 2.0]))
moment = ARM_MASS * ARM**2 / 12
builder_inertia = np.diag([0.01 * moment, moment, moment])
elbow = np.array([BASE + ARM * np.cos(ANGLE), -ARM * np.sin(ANGLE)])  # outwards, up
inwards = elbow[0] - PLATFORM
DEPTH = elbow[1] - np.sqrt(ROD**2 - inwards**2)  # of the platform
builder.add_joint("float", "floating", "ground", "platform", initial=(0, 0, DEPTH, 0, 0, 0, 1))
for k in range(3):
    turn = 2 * np.pi * k / 3
    c, s = np.cos(turn), np.sin(turn)
    turned = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    middle = {"mass": ARM_MASS, "com": (ARM / 2, 0, 0), "inertia": builder_inertia}
    builder.add_link(f"arm_{k}", **middle)
    shoulder = {"translation": turned @ (BASE, 0, 0), "rotation": turned, "axis": (0, 1, 0)}
    builder.add_joint(f"motor_{k}", "revolute", "ground", f"arm_{k}", initial=ANGLE, **shoulder)
    for side in (-1, 1):
        ends = {"point": (ARM, side * GAP, 0), "child_point": turned @ (PLATFORM, side * GAP, 0)}
        builder.add_rod(f"rod_{k}{'ab'[side > 0]}", f"arm_{k}", "platform", length=ROD, **ends)
robot = builder.build()

held = {f"motor_{k}": lw.Locked() for k in range(3)}
still = lw.simulate(robot, duration=0.01, every=0.01, drives=held)
tilt = np.arcsin(inwards / ROD)  # of the rods against the vertical
tension = LOAD * G / (6 * np.cos(tilt))
rods = [name for name in robot.loop_names if name.startswith("rod")]
forces = np.sqrt((still.joint_load.sel(joint=rods)[0, :, :3] ** 2).sum("component"))
check("force in a rod", float(forces.max()), tension, 1e-8, "N")
check("the least of six", float(forces.min()), tension, 1e-8, "N")
# Along the arm and across it; the pair pulls inwards and down.
pull = 2 * tension * np.array([-np.sin(tilt), -np.cos(tilt)])
lever = ARM * np.array([np.cos(ANGLE), -np.sin(ANGLE)])
by_hand = lever[0] * pull[1] - lever[1] * pull[0] - ARM_MASS * G * lever[0] / 2
for k in range(3):
    found = float(still.drive_torque.sel(dof=f"motor_{k}")[0])
    check(f"motor {k} holds", found, by_hand, 1e-8, "N m")

free = lw.simulate(robot, duration=0.2, every=0.002, drives={"motor_0": lw.Locked()})
level = free.position.values[:, 3:7]
check("the platform turns by", float(abs(level[:, :3]).max()), 0.0, 1e-9)
print(f"a rod carries {tension:.4g} N, a motor holds {abs(by_hand):.4g} N m")
if len(sys.argv) > 1:
    from picture import save

    sizes = np.sqrt((free.joint_load.sel(joint=rods)[..., :3] ** 2).sum("component"))
    curves = {name: sizes.sel(joint=name) for name in rods}
    save(sys.argv[1], free, [("force in the rods [N]", curves)], times=[0.0, 0.1, 0.2], tips={})
