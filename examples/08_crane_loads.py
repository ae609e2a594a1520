"""A tower crane slews and its load swings: what the slewing ring carries, by cause, and how surely.

The slewing motion is given, the rope swings freely; the ring's drive torque is a result.

Run it by: python examples/08_crane_loads.py [PICTURE.svg [REPORT.html]]
"""

import sys

import numpy as np
from checked import check

import linkwise as lw

REACH, ROPE, MASS = 20.0, 12.0, 1500.0  # m, m, kg
QUARTER, DURATION = np.pi / 2, 12.0  # slewed in the first 8 s

builder = lw.ModelBuilder("crane")
builder.add_link("tower")
builder.add_link("jib", mass=3000.0, com=(6.0, 0, 0), inertia=np.diag([500.0, 1.5e5, 1.5e5]))
builder.add_link("load", mass=MASS, com=(0, 0, -ROPE), inertia=np.diag([300.0, 300.0, 300.0]))
builder.add_joint("ring", "revolute", "tower", "jib", axis=(0, 0, 1))
builder.add_joint(
    "rope", "universal", "jib", "load", translation=(REACH, 0, 0), axes=[(1, 0, 0), (0, 1, 0)]
)
crane = builder.build()


def slew(t):
    """Angle, rate and acceleration: a quarter turn in 8 s, smooth to the acceleration."""
    s = min(t / 8.0, 1.0)
    wave = 2 * np.pi * s
    angle = QUARTER * (s - np.sin(wave) / (2 * np.pi))
    moving = t < 8.0
    rate = QUARTER * (1 - np.cos(wave)) / 8.0 if moving else 0.0
    return angle, rate, QUARTER * 2 * np.pi * np.sin(wave) / 64.0 if moving else 0.0


options = {"duration": DURATION, "every": 0.005, "drives": {"ring": lw.Motion(slew)}}
run = lw.simulate(crane, **options, tolerance=1e-7)
tighter = lw.simulate(crane, **options, tolerance=1e-9)

peaks, bounds = lw.loads.summary(run), lw.loads.bounds(run, tighter)
print("slewing ring       peak    plus-minus      at [s]")
for name in ("axial", "radial", "tilting_moment", "torque"):
    at = {"joint": "ring", "quantity": name}
    peak, when = float(peaks.peak.sel(at)), float(peaks.peak_time.sel(at))
    print(f"{name:16}{peak:9.4g}{float(bounds.plus_minus.sel(at)):14.1e}{when:12.3f}")

weight = 9.81 * (3000.0 + MASS)
at_rest = run.joint_load.sel(joint="ring").isel(time=0)
check("axial force at rest", float(at_rest.sel(component="fz")), weight, 1e-6 * weight, "N")
moment = -9.81 * (3000.0 * 6.0 + MASS * REACH)
check("tilting moment at rest", float(at_rest.sel(component="ny")), moment, 1e-6 * weight, "N m")
shares = lw.loads.split(run)
difference = float(abs(shares.sum("cause") - run.joint_load).max())
check("shares by cause add up", difference, 0.0, 1e-9 * abs(moment), "N m")
balance = lw.loads.energy_balance(run)
lost = float(abs(balance.residual).max() / abs(balance.drive_work).max())
check("energy that does not add up, relative", lost, 0.0, 1e-5)
worst = float((bounds.plus_minus / abs(peaks.peak)).sel(quantity="force").max())
check("largest bound of a force, relative", worst, 0.0, 1e-4)
if len(sys.argv) > 1:
    from picture import save

    ring = lw.loads.quantities(run).sel(joint="ring") / 1e3
    by_cause = {
        str(cause): shares.sel(joint="ring", component="ny", cause=cause) / 1e3
        for cause in shares.cause.values
    }
    panels = [
        (
            "moment of the ring [kN m]",
            {"tilting": ring.tilting_moment, "torque": ring.torque},
        ),
        ("ny by cause [kN m]", by_cause),
    ]
    tips = {"rope": (0, 0, -ROPE)}
    save(sys.argv[1], run, panels, times=(0, 3, 6, 9, 12), tips=tips, view="xy")
if len(sys.argv) > 2:
    from linkwise.plot import write_report

    found = {"summary": peaks, "bounds": bounds, "margins": None}
    print("report:", write_report(run, sys.argv[2], found))
