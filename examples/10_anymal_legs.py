"""ANYmal's trunk is held fixed and its legs swing: what its hips carry.

The hips follow a trot from rest, the knees are free but for a damper: motions that are given and
motions that are found, in one system.

Run it by: python examples/10_anymal_legs.py [PICTURE.svg]
"""

import sys

import numpy as np
from checked import check
from robots import robot

import linkwise as lw

DURATION, SWING, PACE, DAMPING, G = 3.0, 0.4, 2 * np.pi / 0.8, 0.3, 9.81  # s, rad, rad/s, N m s

anymal = lw.load(robot("anymal_b_simple_description/anymal"))
LEGS = ("LF", "RF", "LH", "RH")


def trot(side):
    """Angle, rate and acceleration of a hip: from rest into a swing, smooth to the acceleration."""

    def at(t):
        s = min(t / 1.5, 1.0)
        rise, rate, bend = (
            s**3 * (10 - 15 * s + 6 * s**2),
            30 * s**2 * (1 - s) ** 2 / 1.5,
            60 * s * (1 - s) * (1 - 2 * s) / 1.5**2,
        )
        wave, slope = np.sin(PACE * t), PACE * np.cos(PACE * t)
        size = side * SWING
        return (
            size * rise * wave,
            size * (rate * wave + rise * slope),
            size * (bend * wave + 2 * rate * slope - PACE**2 * rise * wave),
        )

    return lw.Motion(at)


def knee(t, q, v):
    return -DAMPING * v


drives = {}
for leg, side in zip(LEGS, (1, -1, -1, 1), strict=True):
    drives |= {f"{leg}_HAA": lw.Locked(), f"{leg}_HFE": trot(side), f"{leg}_KFE": knee}
# A knee hangs still where its weight has no moment: of the form A cos q + B sin q.
knees = [anymal.v_slice(f"{leg}_KFE").start for leg in LEGS]
still = np.zeros(anymal.nv)
bent = still.copy()
bent[knees] = np.pi / 2
A, B = (lw.inverse_dynamics(anymal, q, still, still)[knees] for q in (still, bent))
q0 = still.copy()
q0[knees] = np.arctan2(-A, B)
q0[knees] -= np.pi * np.round(q0[knees] / np.pi)  # hanging, not upright
run = lw.simulate(anymal, duration=DURATION, every=0.005, drives=drives, q0=q0, tolerance=1e-9)

peaks = lw.loads.summary(run)
print("joint     force [N]  axial [N]  radial [N]  tilting [N m]  torque [N m]")
for joint in anymal.joint_names:
    if joint.endswith(("HAA", "HFE")):
        row = [
            float(peaks.peak.sel(joint=joint, quantity=name))
            for name in ("force", "axial", "radial", "tilting_moment", "torque")
        ]
        print("{:8}{:11.1f}{:11.1f}{:12.1f}{:15.2f}{:14.2f}".format(joint, *row))

start = run.joint_load.isel(time=0)
legs = sum(
    float(start.sel(joint=f"{leg}_HAA", component="fz"))
    for leg in LEGS  # the hips' first axes lie along x, so that z is up
)
names = [name for name in anymal.link_names if name[:2] in LEGS]
masses = dict(zip(anymal.link_names, anymal.link_masses, strict=True))
weight = G * sum(masses[name] for name in names)
check("weight of the legs on the trunk at rest", legs, weight, 1e-9, "N")
balance = lw.loads.energy_balance(run)
lost = float(abs(balance.residual).max() / abs(balance.drive_work).max())
check("energy that does not add up, relative", lost, 0.0, 1e-5)
q, v, a = (run[name].values for name in ("position", "velocity", "acceleration"))
torque = lw.inverse_dynamics(anymal, q, v, a)
missed = np.abs(torque + DAMPING * v)[:, knees].max() / np.abs(torque).max()
check("torques of the free knees against their dampers, relative", missed, 0.0, 1e-9)

if len(sys.argv) > 1:
    from picture import save

    found = lw.loads.quantities(run)
    panels = [
        (label, {f"{leg} hip": found[name].sel(joint=f"{leg}_HFE") for leg in ("LF", "RF")})
        for name, label in (("radial", "radial force [N]"), ("torque", "torque [N m]"))
    ]
    tips = {f"{leg}_KFE": (0.1 if leg[1] == "F" else -0.1, 0, -0.32) for leg in LEGS}
    save(sys.argv[1], run, panels, times=(0, 2.4, 2.5, 2.6), tips=tips)
