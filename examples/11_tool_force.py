"""A leg that pushes against the ground with its foot, a frame without mass welded to the shank.

Run it by: python examples/11_tool_force.py

The torques that hold it still, by a simulation and by the foot's Jacobian; and what a force-torque
sensor reads that sits between shank and foot.
"""

import numpy as np
from checked import check

import linkwise as lw

builder = lw.ModelBuilder("leg")
builder.add_link("base")
builder.add_link("thigh", mass=1.5, com=(0, 0.02, -0.15), inertia=np.diag([0.01, 0.01, 0.002]))
builder.add_link("shank", mass=0.6, com=(0, 0, -0.12), inertia=np.diag([0.004, 0.004, 0.0005]))
builder.add_link("foot")
roll = lw.Frame("base", axes=(0.1, 0, 0)).axes
turned = lw.Frame("shank", axes=(0, 0.5, 0.2)).axes
builder.add_joint(
    "hip", "revolute", "base", "thigh", translation=(0.2, 0.1, 0), rotation=roll, axis=(0, 1, 0)
)
builder.add_joint("knee", "revolute", "thigh", "shank", translation=(0, 0.08, -0.3), axis=(0, 1, 0))
builder.add_joint("ankle", "fixed", "shank", "foot", translation=(0.01, 0, -0.25), rotation=turned)
model = builder.build()

pose, push = np.array([0.7, -1.3]), np.array([0, 0, 100.0, 0, 0, 0])
still = {"hip": lw.drives.Locked(), "knee": lw.drives.Locked()}
run = lw.simulate(model, duration=0.1, q0=pose, drives=still, wrenches={"foot": push})
holding = run.drive_torque.values[0]

# Pinocchio 3: rnea at rest less J^T f, f at the foot's frame.
check("hip torque", holding[0], -2.21332941, 1e-7, "N m")
check("knee torque", holding[1], 14.46992686, 1e-7, "N m")

J = lw.frame_jacobian(model, pose, "foot")
by_jacobian = lw.inverse_dynamics(model, pose, None, None) - J.T @ push
check("knee torque by the Jacobian", by_jacobian[1], holding[1], 1e-12, "N m")

# The same point, stated on the shank; components along the world's axes.
sole = lw.Frame("shank", origin=(0.01, 0, -0.25))
again = lw.simulate(model, duration=0.1, q0=pose, drives=still, wrenches={sole: push})
check("knee torque, point on the shank", again.drive_torque.values[0][1], holding[1], 1e-12, "N m")

# Nothing but the push is beyond the ankle: the shank holds the foot against it.
reading = lw.loads.in_frame(run, "world", joint="ankle")
check("sensor in the ankle", reading.sel(component="fz").values[0], -100.0, 1e-12, "N")
