"""A scissor lift of six stages: what its cylinder pushes, and its pins carry.

The cylinder pulls the sliding foot. By virtual work, with bars of length L at the angle a against
the floor, it needs F = (n W + n^2 w) cot a for a load W and n stages of two bars of weight w. The
number that a designer wants: this force, and how it grows towards the bottom.

Run it by: python examples/17_scissor_lift.py [PICTURE.svg]
"""

import sys

import numpy as np
from checked import check

import linkwise as lw

STAGES, LENGTH, BAR, LOAD = 6, 1.2, 8.0, 500.0  # -, m, kg, kg
ANGLE, G = 0.4, 9.81  # rad
AXIS = (0, -1, 0)

moment = BAR * LENGTH**2 / 12
inertia = np.diag([0.01 * moment, moment, moment])
builder = lw.ModelBuilder("scissor_lift")
builder.add_link("ground")
builder.add_link("foot", mass=1.0, inertia=0.01 * np.eye(3))
builder.add_joint("cylinder", "prismatic", "ground", "foot", axis=(1, 0, 0))
for k in range(STAGES):
    # Bar a has its frame at its lower end, on the left; bar b in the middle, on the pin of the two.
    builder.add_link(f"a{k}", mass=BAR, com=(LENGTH / 2, 0, 0), inertia=inertia)
    builder.add_link(f"b{k}", mass=BAR, inertia=inertia)
    below, end = (f"b{k - 1}", (LENGTH / 2, 0, 0)) if k else ("ground", (0, 0, 0))
    builder.add_joint(f"left{k}", "revolute", below, f"a{k}", translation=end, axis=AXIS)
    half = {"translation": (LENGTH / 2, 0, 0), "axis": AXIS}
    builder.add_joint(f"middle{k}", "revolute", f"a{k}", f"b{k}", **half)
    other, place = (f"a{k - 1}", (LENGTH, 0, 0)) if k else ("foot", (0, 0, 0))
    ends = {"translation": place, "child_translation": (-LENGTH / 2, 0, 0)}
    builder.add_loop(f"right{k}", "revolute", other, f"b{k}", axis=AXIS, **ends)
bare = builder.build()
# The platform rests on the two upper ends, half of the load on each.
lift = bare.with_payload(f"a{STAGES - 1}", mass=LOAD / 2, com=(LENGTH, 0, 0), name="load_a")
lift = lift.with_payload(f"b{STAGES - 1}", mass=LOAD / 2, com=(LENGTH / 2, 0, 0), name="load_b")


def start(angle):
    """Coordinates of the joints where the bars lean by this angle."""
    q = np.zeros(lift.nq)
    for name, value in (("left", 2 * angle - np.pi), ("middle", np.pi - 2 * angle)):
        for k in range(STAGES):
            q[lift.q_slice(f"{name}{k}")] = value
    q[lift.q_slice("left0")] = angle
    q[lift.q_slice("cylinder")] = LENGTH * np.cos(angle)
    return q


found = []
angles = np.linspace(0.15, 1.2, 15)
for angle in angles:
    held = lw.simulate(
        lift,
        duration=0.01,
        every=0.01,
        q0=start(angle),
        drives={"cylinder": lw.Locked()},
        assemble="exact",
    )
    found.append(float(held.drive_torque.sel(dof="cylinder")[0]))
expected = -(STAGES * LOAD * G + STAGES**2 * BAR * G) / np.tan(angles)
off = float(abs(np.array(found) / expected - 1).max())
check("cylinder against the closed form, relative", off, 0.0, 1e-9)
for angle in (0.15, 0.4, 1.2):
    force = -(STAGES * LOAD * G + STAGES**2 * BAR * G) / np.tan(angle)
    height = STAGES * LENGTH * np.sin(angle)
    print(f"raised to {height:.3g} m the cylinder pulls {abs(force) / 1e3:.4g} kN")

falling = lw.simulate(
    lift,
    duration=0.3,
    every=0.005,
    q0=start(ANGLE),
    drives={"cylinder": -1.02 * (STAGES * LOAD * G + STAGES**2 * BAR * G) / np.tan(ANGLE)},
)
heights = [
    lw.link_poses(lift, q)[lift.link_names.index(f"a{STAGES - 1}")] for q in falling.position.values
]
level = [float((pose @ (LENGTH, 0, 0, 1))[2]) for pose in heights]
check("loops stay closed", float(lw.loop_gaps(lift, falling.position.values).max()), 0, 1e-12, "m")
pins = np.sqrt((held.joint_load[0, 1:, :3] ** 2).sum("component"))
print(
    f"at the top its most loaded pin, {pins.joint[int(pins.argmax())].item()}, carries "
    f"{float(pins.max()) / 1e3:.4g} kN"
)
print(f"2 % more lifts the load by {1e3 * (level[-1] - level[0]):.3g} mm in 0.3 s")
if len(sys.argv) > 1:
    from picture import save

    sizes = np.sqrt((falling.joint_load[..., :3] ** 2).sum("component")) / 1e3
    names = ("left0", "right0", f"left{STAGES - 1}", f"right{STAGES - 1}")
    curves = {name: sizes.sel(joint=name) for name in names}
    tips = {f"middle{STAGES - 1}": (LENGTH / 2, 0, 0)}
    save(sys.argv[1], falling, [("force on pins [kN]", curves)], times=[0.0, 0.3], tips=tips)
