"""A chain of 1000 rods is let go: held out straight from its upper end, it falls and swings.

Far from its hinge a long chain does not know of it yet and falls freely: the tip by g t^2 / 2 in
the first second. Each joint carries what is outboard of it and has begun to swing.

Run it by: python examples/03_chain_1000.py [PICTURE.svg]
"""

import sys

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

run = lw.simulate(
    model, times=[0.5, 1.0], q0=q0, tolerance=1e-8, record=["position", "energy", "statistics"]
)

end = run.position.isel(time=-1).values
tip = lw.joint_poses(model, end)[-1] @ [0, 0, -1.0, 1]  # the far end of the last rod
check("height of the tip after 1 s", tip[2], -G / 2, 1e-6, "m")
energy = run.kinetic_energy + run.potential_energy
drift = float(energy[-1] - lw.potential_energy(model, q0)) / float(run.kinetic_energy[-1])
check("energy drift, of the kinetic energy", drift, 0.0, 1e-7)
print(f"{int(run.evaluations[-1])} evaluations")

if len(sys.argv) > 1:
    from picture import save

    kept = ["position", "joint_load"]
    fall = lw.simulate(model, duration=12.0, every=0.05, q0=q0, tolerance=1e-6, record=kept)
    force = lw.loads.quantities(fall).force / 1e3
    shown = ("joint_1", "joint_250", "joint_500", "joint_750")
    curves = {name: force.sel(joint=name) for name in shown}
    tips = {f"joint_{N}": (0, 0, -1.0)}
    save(sys.argv[1], fall, [("joint force [kN]", curves)], times=(0, 3, 6, 9, 12), tips=tips)
