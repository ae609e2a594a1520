"""A robot file and a torque table: where the machine goes and what its joints carry.

Run it by: python examples/04_urdf_torque_table.py

The hoist is simple enough to be done by hand. Its tables are zigzags of acceleration with the peak
A, and a zigzag over 2 s moves a joint that starts at rest by A s^2 / 2 and leaves it at rest again.
"""

from pathlib import Path

from checked import check

import linkwise as lw

DATA = Path(__file__).parent / "data"
ARM_MASS, ARM_CENTRE, ARM_INERTIA = 4.0, 0.5, 0.2
G = 9.81

model = lw.load(DATA / "hoist.urdf")
run = lw.simulate(
    model,
    duration=2.0,
    every=0.01,
    drives={
        joint: lw.Torque(lw.Table.from_csv(DATA / "hoist.csv", joint))
        for joint in model.joint_names
    },
    tolerance=1e-10,
)

end = run.position.isel(time=-1)
lift = 40.0 / 16.0  # peak of force minus weight, over the whole mass
turn = 6.0 / (ARM_INERTIA + ARM_MASS * ARM_CENTRE**2)
check("carriage lifted by", end.sel(joint="carriage").item(), lift / 2, 1e-7, "m")
check("arm turned by", end.sel(joint="arm").item(), turn / 2, 1e-7, "rad")

# Half way both accelerations pass through zero and the arm turns at A s / 2. What the carriage
# does to the arm, in the frame that turns with the arm (x along it):
load = run.joint_load.sel(joint="arm").sel(time=1.0, method="nearest")
speed = turn / 2
fx, fz, ny = (load.sel(component=c).item() for c in ("fx", "fz", "ny"))
check("pull inwards, -m c w^2", fx, -ARM_MASS * ARM_CENTRE * speed**2, 1e-6, "N")
check("carries the weight, m g", fz, ARM_MASS * G, 1e-6, "N")
check("and its overhang, -m g c", ny, -ARM_MASS * G * ARM_CENTRE, 1e-6, "N m")
