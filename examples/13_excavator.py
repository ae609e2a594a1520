"""An excavator digs: what its cylinders push and its pins carry.

Boom and stick are held by cylinders, each a barrel and a rod that close a loop. The cylinders are
locked while the bucket digs harder and harder; their forces follow from moments about the pins by
hand. The number that a designer wants: the force of the boom cylinder.

Run it by: python examples/13_excavator.py [PICTURE.svg]
"""

import sys

import numpy as np
from checked import check

import linkwise as lw

BOOM, STICK = 5.5, 2.9  # m, from pin to pin
BOOM_MASS, STICK_MASS = 1800.0, 900.0  # kg, the bucket with the stick
DIGGING = np.array([-90e3, 0.0, -60e3])  # N at the bucket's teeth
RAISED, FOLDED = 0.5, -1.2  # rad: boom above the ground, stick against the boom
# Places of the pins, m: x along the link (x ahead and z up on the ground).
FOOT, HEAD = np.array([0.6, 0, -0.8]), np.array([2.4, 0, 0.35])  # boom cylinder, boom
TAIL, HORN = np.array([2.0, 0, 0.9]), np.array([-0.8, 0, 0.35])  # stick cylinder: boom, stick
AXIS = (0, -1, 0)


def rotated(angle, point):
    """Turned from x towards z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * point[0] - s * point[2], point[1], s * point[0] + c * point[2]])


builder = lw.ModelBuilder("excavator")
builder.add_link("machine")
for name, length, mass in (("boom", BOOM, BOOM_MASS), ("stick", STICK, STICK_MASS)):
    moment = mass * length**2 / 12
    inertia = np.diag([0.05 * moment, moment, moment])
    builder.add_link(name, mass=mass, com=(length / 2, 0, 0), inertia=inertia)
builder.add_joint("boom_pin", "revolute", "machine", "boom", axis=AXIS)
elbow = {"translation": (BOOM, 0, 0), "axis": AXIS}
builder.add_joint("stick_pin", "revolute", "boom", "stick", **elbow)
cylinders = {
    "boom": ("machine", "boom", FOOT, HEAD, FOOT, rotated(RAISED, HEAD)),
    "stick": (
        "boom",
        "stick",
        TAIL,
        HORN,
        TAIL,
        np.array([BOOM, 0, 0]) + rotated(FOLDED, HORN),
    ),
}
for name, (below, above, tail, head, here, there) in cylinders.items():
    length = float(np.linalg.norm(there - here))
    angle = float(np.arctan2(there[2] - here[2], there[0] - here[0]))
    thin = 1e-3 * np.eye(3)  # kg m2: cylinders weigh next to nothing beside what they push
    builder.add_link(f"{name}_barrel", mass=1e-3, inertia=thin)
    builder.add_link(f"{name}_rod", mass=1e-3, inertia=thin)
    turned = np.array(
        [[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]]
    )
    placed = {"translation": tail, "rotation": turned, "axis": AXIS}
    builder.add_joint(f"{name}_foot", "revolute", below, f"{name}_barrel", **placed)
    stroke = {"translation": (length, 0, 0), "axis": (1, 0, 0)}
    builder.add_joint(f"{name}_cylinder", "prismatic", f"{name}_barrel", f"{name}_rod", **stroke)
    builder.add_loop(
        f"{name}_head", "revolute", f"{name}_rod", above, child_translation=head, axis=AXIS
    )
machine = builder.build()

pose = np.zeros(machine.nq)
pose[machine.q_slice("boom_pin")], pose[machine.q_slice("stick_pin")] = RAISED, FOLDED
teeth_frame = lw.Frame("stick", (STICK, 0, 0))
run = lw.simulate(
    machine,
    duration=1.0,
    every=0.05,
    q0=lw.assemble(machine, pose, hold=["boom_pin", "stick_pin"]).q,
    drives={"boom_cylinder": lw.Locked(), "stick_cylinder": lw.Locked()},
    wrenches={teeth_frame: lw.Wrench(lambda t: [*(t * DIGGING), 0, 0, 0])},  # all of it at 1 s
)

# By hand, in the plane: moments about a pin, of weights and digging, over the cylinder's lever.
boom_end = rotated(RAISED, np.array([BOOM, 0, 0]))
teeth = boom_end + rotated(RAISED + FOLDED, np.array([STICK, 0, 0]))
boom_middle, stick_middle = boom_end / 2, (boom_end + teeth) / 2
down = np.array([0, 0, -9.81])


def about(pin, *pulls):
    """Moment about a pin, from x towards z, of (point, force) pairs."""
    arms = [np.subtract(point, pin) for point, _ in pulls]
    return sum(a[0] * f[2] - a[2] * f[0] for a, (_, f) in zip(arms, pulls, strict=True))


def push(pin, foot, head, *pulls):
    """Force of a cylinder, along the line from its foot to its head, that balances the pulls."""
    along = (head - foot) / np.linalg.norm(head - foot)
    return -about(pin, *pulls) / about(pin, (head, along)), along


beyond_elbow = [(stick_middle, STICK_MASS * down), (teeth, DIGGING)]
tail, horn = rotated(RAISED, TAIL), boom_end + rotated(RAISED + FOLDED, HORN)
stick_push, stick_along = push(boom_end, tail, horn, *beyond_elbow)
boom_push, boom_along = push(
    np.zeros(3), FOOT, rotated(RAISED, HEAD), (boom_middle, BOOM_MASS * down), *beyond_elbow
)
on_stick_pin = STICK_MASS * down + DIGGING + stick_push * stick_along
on_boom_pin = (BOOM_MASS + STICK_MASS) * down + DIGGING + boom_push * boom_along

force = run.drive_torque.isel(time=-1)
check("stick cylinder", float(force.sel(dof="stick_cylinder")), stick_push, 0.5, "N")
check("boom cylinder", float(force.sel(dof="boom_cylinder")), boom_push, 0.5, "N")
forces = np.sqrt((run.joint_load[..., :3] ** 2).sum("component"))
sizes = forces.isel(time=-1)
for joint, expected in (("stick_pin", on_stick_pin), ("boom_pin", on_boom_pin)):
    check(joint, float(sizes.sel(joint=joint)), float(np.linalg.norm(expected)), 0.5, "N")
print(
    f"of the heads of the cylinders {float(sizes.sel(joint='boom_head')):.5g} N and "
    f"{float(sizes.sel(joint='stick_head')):.5g} N"
)
if len(sys.argv) > 1:
    from picture import save

    pushes = {name: run.drive_torque.sel(dof=f"{name}_cylinder") / 1e3 for name in cylinders}
    pins = {name: forces.sel(joint=name) / 1e3 for name in ("boom_pin", "stick_pin", "boom_head")}
    panels = [("push of the cylinders [kN]", pushes), ("force on pins [kN]", pins)]
    save(sys.argv[1], run, panels, times=[0.0], tips={"stick_pin": (STICK, 0, 0)})
