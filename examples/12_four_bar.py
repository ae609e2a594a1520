"""A four-bar is cranked at a constant speed: where its rocker goes, and what its pins carry.

The angles are Freudenstein's closed form, and the motor's torque is the power that the links take
up. The number that a designer wants: the largest force on the pin that closes the loop.

Run it by: python examples/12_four_bar.py [PICTURE.svg]
"""

import sys

import numpy as np
from checked import check

import linkwise as lw

CRANK, COUPLER, ROCKER, BASE = 0.1, 0.3, 0.25, 0.3  # m
MASSES = {"crank": 1.0, "coupler": 2.0, "rocker": 1.5}  # kg
SPEED = 10.0  # rad/s
AXIS = (0, -1, 0)  # angles count from x towards z

builder = lw.ModelBuilder("four_bar")
builder.add_link("ground")
for name, length in (("crank", CRANK), ("coupler", COUPLER), ("rocker", ROCKER)):
    mass = MASSES[name]
    moment = mass * length**2 / 12
    inertia = np.diag([0.01 * moment, moment, moment])
    builder.add_link(name, mass=mass, com=(length / 2, 0, 0), inertia=inertia)
builder.add_joint("motor", "revolute", "ground", "crank", axis=AXIS)
builder.add_joint("knee", "revolute", "crank", "coupler", translation=(CRANK, 0, 0), axis=AXIS)
builder.add_joint("pivot", "revolute", "ground", "rocker", translation=(BASE, 0, 0), axis=AXIS)
ends = {"translation": (COUPLER, 0, 0), "child_translation": (ROCKER, 0, 0)}
builder.add_loop("pin", "revolute", "coupler", "rocker", axis=AXIS, **ends)
machine = builder.build()


def rocker_angle(crank):
    """The two circles about the crank's end and the pivot meet above the base."""
    end = CRANK * np.array([np.cos(crank), np.sin(crank)])
    across = np.array([BASE, 0.0]) - end
    distance = np.hypot(*across)
    along = (COUPLER**2 - ROCKER**2 + distance**2) / (2 * distance)
    up = np.sqrt(COUPLER**2 - along**2)
    x, z = end + (along * across + up * np.array([-across[1], across[0]])) / distance
    return np.arctan2(z, x - BASE)


start = lw.assemble(machine, [0.0, 0.9, 1.9], hold=["motor"]).q
turning = lw.assemble(machine, start, [SPEED, 0, 0], hold=["motor"]).v
turn = lw.Motion(lambda t: (start[0] + SPEED * t, SPEED, 0.0))
options = {"q0": start, "v0": turning, "drives": {"motor": turn}, "tolerance": 1e-9}
run = lw.simulate(machine, duration=2 * np.pi / SPEED, every=1e-3, **options)

rocker = run.position.sel(coordinate="pivot").values
expected = np.array([rocker_angle(SPEED * t) for t in run.time.values])
check("rocker against the closed form", float(abs(rocker - expected).max()), 0.0, 1e-8, "rad")
gaps = lw.loop_gaps(machine, run.position.values)
check("the loop is open by", float(gaps.max()), 0.0, 1e-12, "m")
balance = lw.loads.energy_balance(run)
lost = float(abs(balance.residual).max() / abs(balance.drive_work).max())
check("energy that does not add up, relative", lost, 0.0, 1e-6)
peaks = run.peak_loads()
print(f"largest motor torque {float(abs(run.drive_torque.sel(dof='motor')).max()):.4g} N m")
for joint in ("motor", "knee", "pivot", "pin"):
    print(f"largest force on the {joint:6}{float(peaks.force.sel(joint=joint)):8.4g} N")
if len(sys.argv) > 1:
    from picture import save

    forces = np.sqrt((run.joint_load[..., :3] ** 2).sum("component"))
    curves = {str(joint): forces.sel(joint=joint) for joint in forces.joint.values}
    torque = {"motor": run.drive_torque.sel(dof="motor")}
    panels = [("force [N]", curves), ("motor torque [N m]", torque)]
    save(sys.argv[1], run, panels, times=[0.0, 0.15, 0.3, 0.45], tips={})
