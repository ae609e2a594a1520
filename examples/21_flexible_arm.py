"""The Shuttle's arm slews 5 t with booms that bend: its loads and settling beside a rigid arm's.

The joints of both arms follow the same given motion, in 20 s, and hold still afterwards. The booms
are tubes of 0.33 m with walls of 3 mm, of 110 GPa and 4 % of critical damping: made up, to be about
as stiff as such booms are. Afterwards the rigid arm carries nothing. The other one goes on
ringing, at the lowest frequency of the linearised machine.

Run it by: python examples/21_flexible_arm.py [PICTURE.svg]
"""

import sys

import numpy as np
from checked import check

import linkwise as lw

START = np.array([0.0, -0.3, 0.5, -0.2, 0.15, 0.0])
END = np.array([0.4, -0.6, 0.9, 0.2, 0.45, 0.5])
SLEW, DURATION = 20.0, 32.0
BOOMS = {"shoulder_pitch_link": "upper boom", "elbow_pitch_link": "lower boom"}


times = np.linspace(0, DURATION, 641)
share = np.minimum(times / SLEW, 1.0)
way = share - np.sin(2 * np.pi * share) / (2 * np.pi)

rigid = lw.scenes.srms(payload_mass=5000.0)
joints = rigid.joint_names
flexible = rigid
for link in BOOMS:
    flexible = flexible.with_flexible(
        link,
        section=lw.Section.tube(0.33, 0.003),
        E=110e9,
        G=40e9,
        damping=0.04,
        interior_modes=0,
        stretches=False,
    )

runs = {}
for name, model in (("rigid", rigid), ("flexible", flexible)):
    q0 = np.array(model.neutral_configuration())
    q0[[model.q_slice(joint).start for joint in joints]] = START
    drives = {
        joint: lw.Motion(lw.Table(times, START[k] + (END[k] - START[k]) * way, "cubic"))
        for k, joint in enumerate(joints)
    }
    runs[name] = lw.simulate(
        model, duration=DURATION, every=0.02, drives=drives, q0=q0, tolerance=1e-6
    )

print("largest                 shoulder moment [N m]   in the slew   afterwards")
for name, run in runs.items():
    moment = lw.loads.quantities(run).moment.sel(joint="shoulder_yaw")
    during, after = moment.sel(time=slice(0, SLEW)), moment.sel(time=slice(SLEW, None))
    print(f"{name:>16}{'':30}{float(during.max()):12.4g}{float(after.max()):13.4g}")
run = runs["flexible"]
for link, boom in BOOMS.items():
    inside = lw.loads.section_summary(run, link, 9)
    stress, bend = inside.sel(quantity="stress"), lw.loads.section_deflections(run, link, 2)
    off = np.linalg.norm(bend.deflection.values[:, -1], axis=1).max()
    print(
        f"{boom}: stress {abs(float(stress.peak)) / 1e6:.3f} MPa at {float(stress.peak_x):.2f} m "
        f"and {float(stress.peak_time):.2f} s, end bent by {1e3 * off:.2f} mm"
    )

# Held joints: K phi = omega^2 M phi in the coordinates of the booms, and their motion in phi.
rest = run.dataset.sel(time=slice(SLEW + 0.1, None))
q = rest.position.values[-1]
own = np.concatenate([np.arange(flexible.nv)[flexible.v_slice(f"{link}:1")] for link in BOOMS])
M = lw.mass_matrix(flexible, q)[np.ix_(own, own)]
squares, modes = np.linalg.eig(np.linalg.solve(M, np.diag(flexible.dof_property("stiffness")[own])))
slowest = np.argmin(squares.real)
along = modes[:, slowest].real @ M
z, rate, acceleration = (
    values[:, own] @ along
    for values in (rest.position.values, rest.velocity.values, rest.acceleration.values)
)
found = np.linalg.lstsq(np.column_stack([z, rate]), -acceleration, rcond=None)[0][0]
hertz = np.sqrt(squares.real[slowest]) / (2 * np.pi)
check("ringing afterwards", np.sqrt(found) / (2 * np.pi), hertz, 0.01 * hertz, "Hz")

inside = lw.loads.section_loads(run, "shoulder_pitch_link", 9).section_load
first = np.linalg.norm(inside[:, 0, 3:], axis=1)
joint = lw.loads.quantities(run).moment.sel(joint="shoulder_pitch").values
largest = float(joint.max())
check("boom's first section and its joint", abs(first - joint).max(), 0.0, 1e-9 * largest, "N m")
balance = lw.loads.energy_balance(run)
lost = float(abs(balance.residual).max() / abs(balance.drive_work).max())
check("energy that does not add up, relative", lost, 0.0, 1e-4)
if len(sys.argv) > 1:
    from picture import save

    moments = {
        name: lw.loads.quantities(one).moment.sel(joint="shoulder_yaw") / 1e3
        for name, one in runs.items()
    }
    bends = {
        boom: 1e3
        * np.linalg.norm(lw.loads.section_deflections(run, link, 2).deflection[:, 1], axis=1)
        for link, boom in BOOMS.items()
    }
    panels = [("shoulder moment [kN m]", moments), ("end of boom bent by [mm]", bends)]
    tips = {joints[-1]: (0.6604 + 0.5, 0, 0)}  # the payload's centre
    save(sys.argv[1], run, panels, times=(0, 5, 10, 15, 20), tips=tips)
