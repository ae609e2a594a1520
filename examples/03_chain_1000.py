"""A chain of 1000 rods let go horizontally: forward dynamics by two methods, then a second of fall.

Run it by: python examples/03_chain_1000.py

Far from its hinge a long chain does not know of it yet and falls freely: the tip by g t^2 / 2.
"""

import time

import numpy as np
from checked import check

import linkwise as lw

N, G = 1000, 9.81
# Hangs along -z at q = 0; a quarter turn of the first joint lays it down.
model = lw.scenes.chain(N, axes="parallel", gravity=(0, 0, -G))
q0 = np.zeros(model.nq)
q0[0] = np.pi / 2

rng = np.random.default_rng(1)
q, v = rng.uniform(-1, 1, (2, model.nq))
recursion = lw.forward_dynamics(model, q, v)
constraint = lw.forward_dynamics(model, q, v, method="constraint_force", full=True)
scale = np.abs(recursion).max()
difference = np.abs(constraint.acceleration - recursion).max() / scale
check("articulated_body against constraint_force, relative", difference, 0.0, 1e-6)

started = time.perf_counter()
run = lw.simulate(
    model, times=[0.5, 1.0], q0=q0, tolerance=1e-8, quantities=["position", "energy", "statistics"]
)
spent = time.perf_counter() - started

end = run.position.isel(time=-1).values
tip = lw.body_poses(model, end)[-1] @ [0, 0, -1.0, 1]  # the far end of the last rod
check("height of the tip after 1 s", tip[2], -G / 2, 1e-6, "m")
energy = run.kinetic_energy + run.potential_energy
drift = float(energy[-1] - lw.potential_energy(model, q0)) / float(run.kinetic_energy[-1])
check("energy drift, of the kinetic energy", drift, 0.0, 1e-7)
evaluations = int(run.evaluations[-1])
print(f"{evaluations} evaluations in {spent:.2f} s, {spent / evaluations / N * 1e9:.0f} ns a body")
