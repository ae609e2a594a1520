"""A blade of 8 m is spun up to 4 rad/s: how far its tip lags, and the loads inside it.

The blade of Kane, Ryan and Banerjee [kane1987] shows whether a beam stiffens as it spins: one that
bends without stretching lags by 0.53375 m, and without the stiffening it would fold up.

Run it by: python examples/23_blade.py [PICTURE.svg]
"""

import sys

import numpy as np
from checked import check

import linkwise as lw

LENGTH, SPEED, RISE, DURATION = 8.0, 4.0, 15.0, 20.0  # m, rad/s, s, s
EI, LINE, E = 566.6, 0.2019, 70e9  # N m2, kg/m, Pa
# The published blade's sections have no inertia; here their radius of gyration is 0.9 mm.
SECTION = lw.Section(area=1e-2, Iy=EI / E, Iz=EI / E, J=2 * EI / E)

builder = lw.ModelBuilder("blade", gravity=(0, 0, 0))
builder.add_link("hub")
builder.add_link("blade", mass=LINE * LENGTH)
builder.add_joint("root", "revolute", "hub", "blade", axis=(0, 0, 1))
builder.make_flexible(
    "blade",
    section=SECTION,
    E=E,
    G=26e9,
    end=(LENGTH, 0, 0),
    bodies=2,
    interior_modes=0,
    stretches=False,
)
model = builder.build()

a = 2 * np.pi / RISE
times = np.linspace(0, DURATION, 2001)
s = np.minimum(times, RISE)
angle = SPEED / RISE * (s**2 / 2 + (np.cos(a * s) - 1) / a**2) + SPEED * (times - s)
spin = lw.Motion(lw.Table(times, angle, "cubic"))
run = lw.simulate(model, duration=DURATION, every=0.01, drives={"root": spin}, tolerance=1e-6)

bends = lw.loads.section_deflections(run, "blade", 9)
lag = bends.deflection[:, -1, 1].values
print(f"the tip lags most at {float(bends.time[lag.argmin()]):.3f} s")
check("largest lag", -lag.min(), 0.53375, 2e-3, "m")

inside = lw.loads.section_loads(run, "blade", 9)
summary = lw.loads.section_summary(run, "blade", 9)
print("inside the blade     peak        at x [m]   at [s]")
for name in ("fx", "fy", "nz"):
    one = summary.sel(quantity=name)
    print(f"{name:8}{float(one.peak):17.4g}{float(one.peak_x):12.1f}{float(one.peak_time):11.2f}")
# At full speed it is pulled straight: m' w^2 (L^2 - x^2) / 2 of tension, tension is negative.
x = inside.x.values
pull = LINE * SPEED**2 * (LENGTH**2 - x**2) / 2
last = -inside.section_load.sel(component="fx", time=slice(RISE + 1, None)).values.mean(axis=0)
check("pull at the root at full speed", last[0], pull[0], 2e-3 * pull[0], "N")
check("pull along it, largest difference", abs(last - pull).max(), 0.0, 2e-3 * pull[0], "N")
if len(sys.argv) > 1:
    from picture import save

    bending = inside.section_load.sel(component="nz")
    tension = -inside.section_load.sel(component="fx")
    panels = [
        ("lag of the tip [m]", {"lag": -lag}),
        ("bending nz [N m]", {f"{x[k]:g} m": bending[:, k] for k in (0, 4)}),
        ("tension [N]", {f"{x[k]:g} m": tension[:, k] for k in (0, 4)}),
    ]
    save(sys.argv[1], run, panels, times=(5, 5.5, 6, 6.5, 7), tips={}, view="xy")
