"""The constraint forces of a slewing arm by every linear solver: same motion, different work.

Run it by: python examples/06_solvers.py

Iterations are means per evaluation of the equations of motion, each started from the cubic through
the last four solutions. The machine is a stand-in for the arm of [sharf1993]: three rods, five
degrees of freedom, 13 unknown constraint forces. The motion is its spatial manoeuvre, its torques
are applied open loop.
"""

import numpy as np
from checked import check

import linkwise as lw

START = np.array([0.2, -0.3, 0.5, -0.2, 0.15])
END = np.array([1.0, -0.8, 1.2, 0.5, 0.6])
DURATION = 10.0

model = lw.scenes.srms_3l5d()
times = np.linspace(0, DURATION, 501)
phase = 2 * np.pi * times / DURATION
way = END - START
torques = lw.inverse_dynamics(
    model,
    START + np.outer(times / DURATION - np.sin(phase) / (2 * np.pi), way),
    np.outer((1 - np.cos(phase)) / DURATION, way),
    np.outer(2 * np.pi * np.sin(phase) / DURATION**2, way),
)
check("shoulder torque at 2.5 s", torques[125, 0], 1434.36, 5e-3, "N m")  # known independently
drives = {
    joint: lw.Torque(lw.Table(times, torques[:, model.v_slice(joint)], "cubic"))
    for joint in model.joint_names
}

print("solver                               iterations   evaluations   miss [rad]")
worst = 0.0
for solver in lw.solvers():
    run = lw.simulate(
        model,
        times=[DURATION],
        drives=drives,
        q0=START,
        tolerance=1e-6,
        numerics=lw.Numerics(method="constraint_force", solver=solver["name"]),
        record=["position", "statistics"],
    )
    miss = np.abs(run.position.values[-1] - END).max()
    evaluations, iterations = int(run.evaluations[-1]), int(run.iterations[-1])
    mean = f"{iterations / evaluations:.1f}" if solver["kind"] == "iterative" else "direct"
    print(f"{solver['name']:36}{mean:>11}{evaluations:14}{miss:13.1e}")
    worst = max(worst, miss)
check("largest miss of the end position", worst, 0.0, 1e-3, "rad")
