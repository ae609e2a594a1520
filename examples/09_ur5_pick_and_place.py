"""A UR5 picks up 5 kg and puts it down again: what the bearings of its joints carry.

Every joint follows a given motion, so the drive torques are results. The arm goes down empty and
comes back with the part in its hand: two runs of two machines, with the torques that the robot's
file allows as ratings.

Run it by: python examples/09_ur5_pick_and_place.py [PICTURE.svg]
"""

import sys

import numpy as np
from checked import check
from robots import robot

import linkwise as lw

HOME = np.array([0.0, -1.6, 1.6, -1.57, -1.57, 0.0])
PICK = np.array([0.7, -0.9, 1.7, -2.37, -1.57, 0.7])
PLACE = np.array([-0.8, -1.0, 1.8, -2.37, -1.57, -0.8])
MOVE, G, MASS = 1.5, 9.81, 5.0  # seconds a move, m/s2, kg

empty = lw.load(robot("ur_description/ur5_robot"))
loaded = empty.with_payload("wrist_3_link", mass=MASS, com=(0, 0.15, 0), inertia=np.eye(3) * 0.02)


def drives(model, ways):
    """Motions through these positions: rest at each, smooth to the acceleration."""

    def motion(joint):
        def at(t):
            leg = min(int(t / MOVE), len(ways) - 2)
            s, way = t / MOVE - leg, ways[leg + 1][joint] - ways[leg][joint]
            rise = s**3 * (10 - 15 * s + 6 * s**2)
            rate = 30 * s**2 * (1 - s) ** 2 / MOVE
            bend = 60 * s * (1 - s) * (1 - 2 * s) / MOVE**2
            return ways[leg][joint] + way * rise, way * rate, way * bend

        return lw.Motion(at)

    return {name: motion(k) for k, name in enumerate(model.joint_names)}


options = {"every": 0.005, "tolerance": 1e-8}
fetch = lw.simulate(empty, duration=MOVE, drives=drives(empty, [HOME, PICK]), **options)
carry = lw.simulate(
    loaded, duration=2 * MOVE, drives=drives(loaded, [PICK, HOME, PLACE]), **options
)

peaks = lw.loads.summary(carry)
ratings = {
    joint: lw.loads.Rating(torque=float(limit))
    for joint, limit in zip(loaded.joint_names, loaded.effort_limit, strict=True)
}
use = lw.loads.margins(peaks, ratings).use.sel(quantity="torque")
names = ("axial", "radial", "tilting_moment", "torque")
print("joint               axial [N]  radial [N]  tilting [N m]  torque [N m]  of its rating")
for joint in loaded.joint_names:
    row = [float(peaks.peak.sel(joint=joint, quantity=name)) for name in names]
    row = [round(value, 2) + 0.0 for value in row]  # no minus zero
    share = 100 * float(use.sel(joint=joint))
    print(
        f"{joint:20}{row[0]:9.1f}{row[1]:12.1f}{row[2]:15.2f}{row[3]:14.2f}{share:13.0f} %".rstrip()
    )

weight = G * loaded.total_mass
start = carry.joint_load.sel(joint="shoulder_pan_joint").isel(time=0)
check("weight on the first joint at rest", float(start.sel(component="fz")), weight, 1e-9, "N")
gained = carry.joint_load.isel(time=0) - fetch.joint_load.isel(time=-1)
force = np.linalg.norm(gained.sel(component=["fx", "fy", "fz"]).values, axis=1)
check("what the part adds to every joint, farthest", np.abs(force - G * MASS).max(), 0, 1e-9, "N")
q, v, a = (carry[name].values for name in ("position", "velocity", "acceleration"))
exact = lw.inverse_dynamics_loads(loaded, q, v, a)
wrong = np.abs(carry.joint_load.values - exact).max() / np.abs(exact).max()
check("loads against inverse dynamics, relative", wrong, 0.0, 1e-12)
energy = lw.loads.energy_balance(carry)
lost = float(abs(energy.residual).max() / abs(energy.drive_work).max())
check("energy that does not add up, relative", lost, 0.0, 1e-6)

if len(sys.argv) > 1:
    from picture import save

    found = lw.loads.quantities(carry)
    panels = [
        (label, {j.removesuffix("_joint"): found[name].sel(joint=j) for j in found.joint.values})
        for name, label in (
            ("radial", "radial force [N]"),
            ("tilting_moment", "tilting moment [N m]"),
        )
    ]
    tips = {"wrist_3_joint": (0, 0.15, 0)}
    save(sys.argv[1], carry, panels, times=(0, 0.75, 1.5, 2.25, 3), tips=tips)
