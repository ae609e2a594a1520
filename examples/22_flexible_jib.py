"""A crane whose jib bends hoists 1.5 t: bending and stress along the jib.

The hoist starts and stops within 0.3 s, and the load bounces on the jib, a box of steel,
12 m long. Before that the jib hangs as the handbook says.

Run it by: python examples/22_flexible_jib.py [PICTURE.svg]
"""

import sys

import numpy as np
from checked import check

import linkwise as lw

REACH, MASS, E, DENSITY, g = 12.0, 1500.0, 210e9, 7850.0, 9.81  # m, kg, Pa, kg/m3, m/s2
SPEED, START, STOP, RAMP, DURATION = 0.5, 0.5, 4.5, 0.3, 8.0  # m/s, s
SECTION = lw.Section.box(width=0.30, height=0.40, wall=0.010)

builder = lw.ModelBuilder("crane")
builder.add_link("tower")
builder.add_link("jib")
builder.add_link("load", mass=MASS, inertia=np.diag([300.0, 300.0, 300.0]))
builder.add_joint("root", "fixed", "tower", "jib", translation=(0, 0, 15))
builder.add_link("rope")
builder.add_joint("sheave", "revolute", "jib", "rope", translation=(REACH, 0, 0), axis=(0, 1, 0))
builder.add_joint("hoist", "prismatic", "rope", "load", axis=(0, 0, 1))
builder.make_flexible(
    "jib",
    section=SECTION,
    E=E,
    G=80e9,
    density=DENSITY,
    damping=0.05,
    interior_modes=1,
    stretches=False,
)
crane = builder.build()
own, sheave, hoist = (crane.q_slice(joint) for joint in ("jib:1", "sheave", "hoist"))

# At rest the springs of the jib's coordinates hold the weight, and the rope is upright.
rest, q0 = np.zeros(crane.nv), np.zeros(crane.nq)
q0[hoist] = -8.0
stiffness = crane.dof_property("stiffness")[crane.v_slice("jib:1")]
for _ in range(20):
    weight = lw.inverse_dynamics(crane, q0, rest, rest)
    q0[own] = -weight[crane.v_slice("jib:1")] / stiffness
    end = lw.link_poses(crane, q0)[crane.link_names.index("jib:end")]
    q0[sheave] = np.arcsin(end[2, 0])


def ramp(start):
    """From 0 to 1 within RAMP seconds, smoothly."""
    share = np.clip((times - start) / RAMP, 0, 1)
    return share - np.sin(2 * np.pi * share) / (2 * np.pi)


times = np.linspace(0, DURATION, 1601)
rate = SPEED * (ramp(START) - ramp(STOP))
height = -8.0 + np.append(0, np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(times)))
run = lw.simulate(
    crane,
    duration=DURATION,
    every=0.005,
    drives={"hoist": lw.Motion(lw.Table(times, height, "cubic"))},
    q0=q0,
    tolerance=1e-6,
)

inside = lw.loads.section_loads(run, "jib", 13)
summary = lw.loads.section_summary(run, "jib", 13)
print("inside the jib            peak        at x [m]   at [s]")
for name in ("fz", "ny", "stress"):
    one = summary.sel(quantity=name)
    unit = str(one.quantity_units.values)
    print(
        f"{name:8}{float(one.peak):20.5g} {unit:4}{float(one.peak_x):10.1f}"
        f"{float(one.peak_time):11.3f}"
    )
use = lw.loads.section_margins(summary, lw.loads.SectionRating(stress=235e6))
print(f"of 235 MPa it uses {100 * float(use.use[0]):.1f} %")

line, EI = DENSITY * SECTION.area * g, E * SECTION.Iy
bends = lw.loads.section_deflections(run, "jib", 13)
sag = MASS * g * REACH**3 / (3 * EI) + line * REACH**4 / (8 * EI)
check("sag at rest", -float(bends.deflection[0, -1, 2]), sag, 1e-6 * sag, "m")
x = inside.x.values
moment = MASS * g * (REACH - x) + line * (REACH - x) ** 2 / 2
found = -inside.section_load[0].sel(component="ny").values
check("moments along it at rest, difference", abs(found - moment).max(), 0.0, 1e-3 * moment[0])
stress = moment[0] * 0.20 / SECTION.Iy
check("stress at rest", float(inside.highest_stress[0, 0]) / 1e6, stress / 1e6, 0.1, "MPa")
shares = lw.loads.section_split(run, "jib", 13)
off = float(abs(shares.sum("cause") - inside.section_load).max())
check("shares by cause add up", off, 0.0, 1e-9 * moment[0], "N m")
if len(sys.argv) > 1:
    from picture import save

    root = shares.sel(component="ny")[:, :, 0] / -1e3
    panels = [
        ("bending at the root [kN m]", {str(c): root.sel(cause=c) for c in root.cause.values}),
        (
            "highest stress [MPa]",
            {f"{x[k]:g} m": inside.highest_stress[:, k] / 1e6 for k in (0, 4, 8)},
        ),
    ]
    save(sys.argv[1], run, panels, times=(0.5, 2, 4.5), tips={"hoist": (0, 0, 0)})
