"""The Space Shuttle's arm slews a 100 kg payload: peak load of every joint, and a plot of them.

Run it by: python examples/02_srms_slew.py [FIGURE.svg]

Same machine and motion as `linkwise demo`. The torques are the inverse dynamics of a known motion
and are applied open loop, so the arm must end where that motion ends.
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


def plot(run, path):
    import matplotlib as mpl
    from matplotlib import pyplot as plt

    # Fixed identifiers and no time stamp: the same picture gives the same file.
    mpl.rcParams |= {"svg.hashsalt": "linkwise", "svg.fonttype": "none"}
    mpl.rcParams |= {"font.sans-serif": ["DejaVu Sans"], "font.size": 9}
    figure, axes = plt.subplots(
        1, 3, figsize=(9.6, 3.0), layout="constrained", width_ratios=[1.25, 1, 1]
    )
    draw_arm(axes[0], run)
    halves = (("force", "N", ["fx", "fy", "fz"]), ("moment", "N m", ["nx", "ny", "nz"]))
    for axis, (half, unit, components) in zip(axes[1:], halves, strict=True):
        part = run.joint_load.sel(component=components).isel(time=slice(None, None, 10))
        size = np.sqrt((part**2).sum("component"))
        for joint in run.joint.values:
            line = {"label": joint.replace("_", " "), "linewidth": 1.2}
            axis.plot(part.time, size.sel(joint=joint), **line)
        axis.set(xlabel="time [s]", ylabel=f"joint {half} [{unit}]", xlim=(0, DURATION), ylim=0)
    names, labels = axes[2].get_legend_handles_labels()
    figure.legend(names, labels, loc="outside lower center", ncols=6, frameon=False)
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, metadata={"Date": None, "Creator": None})
    print(f"figure: {path}")


def draw_arm(axis, run):
    """The joints and the payload's centre in side view, at five times."""
    for k, when in enumerate(np.linspace(0, DURATION, 5)):
        q = run.position.sel(time=when, method="nearest").values
        poses = lw.body_poses(model, q)
        centre = poses[-1] @ [0.6604 + 0.5, 0, 0, 1]
        points = np.vstack([[0, 0], poses[:, [0, 2], 3], centre[[0, 2]]])
        axis.plot(*points.T, "o-", color=str(0.8 - 0.2 * k), markersize=2.5, linewidth=1.2)
        axis.plot(*points[-1], "s", color=str(0.8 - 0.2 * k), markersize=7)
    axis.set(xlabel="x [m]", ylabel="z [m]", aspect="equal", title="0, 2.5, ... 10 s")


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
    plot(run, sys.argv[1])
