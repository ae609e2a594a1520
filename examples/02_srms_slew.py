"""The Space Shuttle's arm slews a payload of 100 kg: peak load of every joint.

The torques are the inverse dynamics of a known motion and are applied open loop, so the arm must
end where that motion ends. The same machine and motion as `linkwise demo`.

Run it by: python examples/02_srms_slew.py [PICTURE.svg]
"""

import sys

import numpy as np
from checked import check

import linkwise as lw

START = np.array([0.0, -0.3, 0.5, -0.2, 0.15, 0.0])
END = np.array([0.4, -0.6, 0.9, 0.2, 0.45, 0.5])
DURATION = 10.0


def motion(t):
    """Position, velocity and acceleration (n, 6) at the times t (n,)."""
    phase = 2 * np.pi * t / DURATION
    way = END - START
    q = START + np.outer(t / DURATION - np.sin(phase) / (2 * np.pi), way)
    v = np.outer((1 - np.cos(phase)) / DURATION, way)
    a = np.outer(2 * np.pi * np.sin(phase) / DURATION**2, way)
    return q, v, a


model = lw.scenes.srms(payload_mass=100.0)
times = np.linspace(0, DURATION, 501)
torques = lw.inverse_dynamics(model, *motion(times))
run = lw.simulate(
    model,
    duration=DURATION,
    every=0.01,
    drives={
        joint: lw.Torque(lw.Table(times, torques[:, model.v_slice(joint)], "cubic"))
        for joint in model.joint_names
    },
    q0=START,
    tolerance=1e-6,
)

peaks = run.peak_loads()
print("joint             force [N]   at [s]   moment [N m]   at [s]")
for joint in run.joint.values:
    p = {name: float(peaks[name].sel(joint=joint)) for name in peaks.data_vars}
    print(
        f"{joint:16}{p['force']:11.4g}{p['force_time']:9.4g}"
        f"{p['moment']:15.4g}{p['moment_time']:9.4g}"
    )

reached = run.position.isel(time=-1).values
check("largest miss of the end position", np.abs(reached - END).max(), 0.0, 1e-4, "rad")
# The load is the wrench of the motion, whatever method computed the motion.
loads = lw.inverse_dynamics_loads(model, *motion(run.time.values))
difference = np.abs(run.joint_load.values - loads).max() / np.abs(loads).max()
check("loads against inverse dynamics, relative", difference, 0.0, 1e-4)
if len(sys.argv) > 1:
    from picture import save

    found = lw.loads.quantities(run)
    panels = [
        (
            f"joint {half} [{unit}]",
            {j.replace("_", " "): found[half].sel(joint=j) for j in peaks.joint.values},
        )
        for half, unit in (("force", "N"), ("moment", "N m"))
    ]
    tips = {model.joint_names[-1]: (0.6604 + 0.5, 0, 0)}  # the payload's centre
    save(sys.argv[1], run, panels, times=(0, 2.5, 5, 7.5, 10), tips=tips)
