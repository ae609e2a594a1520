"""A slider-crank press: what torque the crank needs, and what its pins carry.

At the angle a of the crank a force F on the slider takes the torque F r (sin a + r sin a cos a /
sqrt(l^2 - r^2 sin^2 a)). In motion the slider's acceleration has a closed form too. The number
that a designer wants: the torque where the press force acts.

Run it by: python examples/18_press.py [PICTURE.svg]
"""

import sys

import numpy as np
from checked import check

import linkwise as lw

CRANK, ROD = 0.1, 0.4  # m
CRANK_MASS, ROD_MASS, SLIDER_MASS = 20.0, 15.0, 60.0  # kg
PRESS, SPEED = 200e3, 2 * np.pi * 2  # N, rad/s
Z = (0, 0, 1)


def bar(mass, length):
    moment = mass * length**2 / 12
    inertia = np.diag([0.01 * moment, moment, moment])
    return {"mass": mass, "com": (length / 2, 0, 0), "inertia": inertia}


builder = lw.ModelBuilder("press", gravity=(0, 0, 0))
builder.add_link("frame")
builder.add_link("crank", mass=CRANK_MASS, inertia=0.1 * np.eye(3))
builder.add_link("rod", **bar(ROD_MASS, ROD))
builder.add_link("slider", mass=SLIDER_MASS, inertia=0.5 * np.eye(3))
builder.add_joint("main_bearing", "revolute", "frame", "crank", axis=Z)
builder.add_joint("crank_pin", "revolute", "crank", "rod", translation=(CRANK, 0, 0), axis=Z)
builder.add_joint("guide", "prismatic", "frame", "slider", axis=(1, 0, 0))
ends = {"translation": (ROD, 0, 0)}
builder.add_loop("wrist", "revolute", "rod", "slider", axis=Z, **ends)
press = builder.build()


def pose(angle):
    """All coordinates for the crank's angle."""
    swing = -np.arcsin(CRANK * np.sin(angle) / ROD)
    return [angle, swing - angle, CRANK * np.cos(angle) + ROD * np.cos(swing)]


def torque(angle):
    root = np.sqrt(ROD**2 - (CRANK * np.sin(angle)) ** 2)
    return PRESS * CRANK * np.sin(angle) * (1 + CRANK * np.cos(angle) / root)


for degrees in (30, 60, 90):
    still = lw.simulate(
        press,
        duration=0.01,
        every=0.01,
        q0=pose(np.radians(degrees)),
        drives={"main_bearing": lw.Locked()},
        wrenches={"slider": [-PRESS, 0, 0, 0, 0, 0]},
        assemble="exact",
    )
    found = -float(still.drive_torque.sel(dof="main_bearing")[0])
    check(f"crank at {degrees} deg holds", found, torque(np.radians(degrees)), 1e-6, "N m")
    swing = np.arcsin(CRANK * np.sin(np.radians(degrees)) / ROD)
    along = float(still.peak_loads().force.sel(joint="crank_pin"))
    check("and the crank pin carries", along, float(PRESS / np.cos(swing)), 1e-6, "N")

turn = lw.Motion(lambda t: (SPEED * t, SPEED, 0.0))
rates = lw.assemble(press, pose(0), [SPEED, 0, 0], hold=["main_bearing"]).v
run = lw.simulate(
    press,
    duration=0.5,
    every=1e-3,
    q0=pose(0),
    v0=rates,
    drives={"main_bearing": turn},
    tolerance=1e-9,
)
a = SPEED * run.time.values
sine, root = CRANK * np.sin(a), np.sqrt(ROD**2 - (CRANK * np.sin(a)) ** 2)
slope = sine * CRANK * np.cos(a) / root
bend = (CRANK**2 * np.cos(2 * a) + slope**2) / root
expected = -(SPEED**2) * (CRANK * np.cos(a) + bend)
found = run.acceleration.sel(dof="guide").values
largest = float(abs(expected).max())
check("slider, relative", float(abs(found - expected).max() / largest), 0.0, 1e-7)
print(f"at {SPEED / 2 / np.pi:g} turns/s the slider's inertia takes {SLIDER_MASS * largest:.4g} N")
print(f"the press force takes {torque(np.pi / 2):.5g} N m at 90 deg")
if len(sys.argv) > 1:
    from picture import save

    forces = np.sqrt((run.joint_load[..., :3] ** 2).sum("component")) / 1e3
    curves = {str(joint): forces.sel(joint=joint) for joint in forces.joint.values}
    needed = {"drive": run.drive_torque.sel(dof="main_bearing")}
    panels = [("force [kN]", curves), ("drive torque [N m]", needed)]
    save(sys.argv[1], run, panels, times=[0.0, 0.1, 0.2], tips={}, view="xy")
