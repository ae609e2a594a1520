"""A door on two hinges: which of their loads a rigid body decides, and which it does not.

Each hinge is a pin with some play against tilting, a ball joint. Both hold the door's weight, and
how they share it depends on how they were fitted: no number is right, and the run says so (dashed
and in brackets). The horizontal force on a hinge is a couple's: weight times half the width over
the distance of the hinges. Say how stiff the hinges are, and how thick a shim is below one of them,
and the vertical forces are decided as well: shares by stiffness, and what presses the hinges
together.

Run it by: python examples/19_door.py [PICTURE.svg]
"""

import sys

import numpy as np
from checked import check

import linkwise as lw

MASS, WIDTH, HEIGHT, G = 40.0, 0.9, 2.0, 9.81  # kg, m, m
LOW, HIGH = 0.25, 1.75  # m, heights of the hinges

builder = lw.ModelBuilder("door")
builder.add_link("wall")
inertia = MASS / 12 * np.diag([HEIGHT**2, WIDTH**2 + HEIGHT**2, WIDTH**2])
center = (WIDTH / 2, 0, HEIGHT / 2 - LOW)
builder.add_link("door", mass=MASS, com=center, inertia=inertia)
builder.add_joint("lower", "spherical", "wall", "door", translation=(0, 0, LOW), damping=5)
ends = {"translation": (0, 0, HIGH), "child_translation": (0, 0, HIGH - LOW)}
builder.add_loop("upper", "spherical", "wall", "door", **ends)
door = builder.build()

run = lw.simulate(door, duration=2.0, every=0.01, v0=[0, 0, 3.0], tolerance=1e-9)
for warning in run.warnings:
    print(f"warning: {warning['text']}")

known = lw.indeterminacy(door, door.initial_configuration()).determinate
for joint, row in zip((*door.joint_names, *door.loop_names), known, strict=True):
    check(f"{joint}: fx, fy are determined", float(row[:2].sum()), 2, 0)
    check(f"{joint}: fz is not", float(row[2]), 0, 0)
still = lw.simulate(door, duration=0.01, every=0.01).joint_load.isel(time=0)
couple = MASS * G * WIDTH / 2 / (HIGH - LOW)
check(
    "pull on the upper hinge", float(still.sel(joint="upper", component="fx")), -couple, 1e-9, "N"
)
check("push on the lower hinge", float(still.sel(joint="lower", component="fx")), couple, 1e-9, "N")
check("both together, vertical", float(still.sel(component="fz").sum()), MASS * G, 1e-9, "N")

LOWER, UPPER, SHIM = 3e6, 1e6, 100e-6  # N/m, N/m, m: sheet metal
up = {"axis": (0, 0, 1)}
hung = door.with_bearing("lower", axial=LOWER, **up).with_bearing("upper", axial=UPPER, **up)
shimmed = hung.with_bearing("lower", axial=LOWER, offset=SHIM, **up)
options = {"duration": 2.0, "every": 0.01, "v0": [0, 0, 3.0], "tolerance": 1e-9}
with_bearings, with_shim = (lw.simulate(model, **options) for model in (hung, shimmed))
for joint, stiffness, sign in (("lower", LOWER, 1), ("upper", UPPER, -1)):
    at = {"joint": joint, "component": "fz", "time": 0}
    share = MASS * G * stiffness / (LOWER + UPPER)
    check(f"{joint}, by stiffness", float(with_bearings.joint_load.sel(at)), share, 1e-9, "N")
    pressed = share + sign * SHIM / (1 / LOWER + 1 / UPPER)
    check(f"{joint}, with the shim", float(with_shim.joint_load.sel(at)), pressed, 1e-9, "N")
    decided = with_bearings.by_bearings.sel(joint=joint).values
    check(f"{joint}: bearings decide fz alone", float(decided.sum() * decided[2]), 1, 0)
if len(sys.argv) > 1:
    from picture import save

    sideways = np.sqrt((run.joint_load[..., :2] ** 2).sum("component"))
    level = {joint: sideways.sel(joint=joint) for joint in ("lower", "upper")}
    upright = {}
    for joint in ("lower", "upper"):
        at = {"joint": joint, "component": "fz"}
        upright[f"({joint}, rigid)"] = run.joint_load.sel(at)
        upright[f"{joint}, by stiffness"] = with_bearings.joint_load.sel(at)
        upright[f"{joint}, shimmed"] = with_shim.joint_load.sel(at)
    panels = [("horizontal force [N]", level), ("vertical force [N]", upright)]
    tips = {"lower": (WIDTH, 0, 0)}
    save(sys.argv[1], run, panels, times=[0.0, 0.3, 2.0], tips=tips, view="xy")
