"""A simple pendulum let go horizontally: its position and the tension in its rod after 10 s.

Run it by: python examples/01_pendulum.py

The mass is a point, so the body has no rotational inertia at all: the articulated-body recursion
takes that, the constraint-force method refuses it by name.
"""

import numpy as np
from checked import check

import linkwise as lw

builder = lw.ModelBuilder("pendulum", gravity=(0, 0, -9.81))
builder.add_link("ground")
builder.add_link("bob", mass=1.0, com=(1, 0, 0))
# The rod lies along x at q = 0 and turns downwards about y.
builder.add_joint("hinge", "revolute", "ground", "bob", axis=(0, 1, 0))
model = builder.build()

run = lw.simulate(model, times=[2.36784194757624, 10.0], tolerance=1e-10)

# Closed form: period 4 K(sin 45 deg) sqrt(L/g), positions by Jacobi's sn.
q = run.position.sel(joint="hinge").values
check("angle after one period", q[0], 0.0, 1e-7, "rad")
check("horizontal position at 10 s", np.cos(q[1]), 0.275087462576117, 1e-7, "m")
check("height at 10 s", -np.sin(q[1]), -0.961419205099125, 1e-7, "m")

# The joint frame turns with the bob and its x axis points along the rod: the hinge pulls the bob
# towards -x with the rod's tension.
fx = run.joint_load.sel(joint="hinge", component="fx").values[1]
check("tension at 10 s", -fx, 28.29456721, 1e-6, "N")
