"""Forty machines to catch bounds out: short contacts, late blows, reversals, spin, stiffness.

As `bound_scenes`, whose arms and count they share.
"""

import numpy as np

import linkwise as lw
from helpers.bound_scenes import drawn, random_arm
from helpers.loaded_arm import profile

DOWN = (0.0, 0.0, -9.81)


def _slider(mass, **properties):
    """A block on a rail with a pendulum that hangs on it."""
    builder = lw.ModelBuilder("slider", gravity=DOWN)
    builder.add_link("rail")
    builder.add_link("block", mass=mass, com=(0.05, 0.02, 0.1), inertia=0.1 * mass * np.eye(3))
    builder.add_link("bob", mass=0.3 * mass, com=(0, 0.01, -0.4), inertia=0.02 * mass * np.eye(3))
    builder.add_joint("slide", "prismatic", "rail", "block", axis=(1, 0, 0.1), **properties)
    builder.add_joint("pivot", "revolute", "block", "bob", axis=(0, 1, 0))
    return builder.build()


def _short_contacts(rng):
    """One contact far shorter than a sample, at a time that no sample knows."""
    model = _slider(
        rng.uniform(0.5, 5),
        upper=0.3,
        lower=-10.0,
        limit_stiffness=10 ** rng.uniform(5, 9.5),
        limit_damping=rng.choice([0.0, 0.0, 0.3]),
    )
    speed = rng.uniform(0.5, 3)
    return {"model": model, "duration": 0.3 / speed * rng.uniform(1.02, 1.6), "v0": [speed, 1.0]}


def _ends_in_contact(rng):
    """The run ends while a stop is pressed, before or after its peak."""
    model = _slider(1.0, upper=0.1, lower=-1.0, limit_stiffness=10 ** rng.uniform(3, 5))
    contact = np.pi / np.sqrt(model.dof_property("limit_stiffness")[0] / 1.3)
    return {"model": model, "duration": 0.05 + contact * rng.uniform(0.1, 0.8), "v0": [2.0, 0.0]}


def _damped_stops(rng):
    """Stops whose damping takes more than their spring, two joints at once."""
    model = random_arm(
        rng,
        2,
        lower=lambda r: -r.uniform(0.02, 0.2),
        upper=lambda r: r.uniform(0.02, 0.2),
        limit_stiffness=lambda r: 10 ** r.uniform(2, 6),
        limit_damping=lambda r: r.choice([2.0, 5.0, 20.0]),
    )
    return {"model": model, "duration": 0.7, "v0": rng.uniform(-6, 6, model.nv)}


def _reversals(rng):
    """A torque about as large as the friction: joints stick, creep and turn back many times."""
    model = random_arm(rng, 2, friction=4.0, friction_velocity=lambda r: 10 ** r.uniform(-4, -2))
    size, rate = rng.uniform(3, 25), rng.uniform(10, 40)
    drives = {"joint1": lambda t, q, v: np.array([size * np.sin(rate * t)])}
    return {"model": model, "duration": 0.6, "drives": drives}


def _late_blows(rng):
    """Nothing happens, then one blow of a millisecond or less."""
    model = random_arm(rng, int(rng.integers(1, 4)), gravity=(0, 0, 0))
    start, width = rng.uniform(0.5, 0.9), 10 ** rng.uniform(-4.5, -2.5)
    corners = start + width * np.array([0, 0.2, 0.5, 0.9, 1.0])
    force = np.zeros((5, 6))
    force[1:4, :3] = rng.uniform(-300, 300, (3, 3))
    blow = lw.Wrench(lw.Table(corners, force, rng.choice(["linear", "cubic"])))
    return {"model": model, "duration": 1.0, "wrenches": {f"link{model.n_joints - 1}": blow}}


def _kinked_motions(rng):
    """Given motions between which free joints hit stops; one from a cubic table, one a profile."""
    model = random_arm(
        rng, 4, lower=-0.3, upper=0.3, limit_stiffness=lambda r: 10 ** r.uniform(3, 6)
    )
    times = np.linspace(0, 0.8, 41)
    bent = rng.uniform(-4, 4) * np.maximum(times - rng.uniform(0.2, 0.6), 0) ** 3
    table = lw.Table(times, 0.1 * np.sin(rng.uniform(5, 15) * times) + bent, "cubic")
    drives = {"joint0": lw.Motion(table), "joint2": lw.Motion(profile(0.25, 0.8))}
    return {"model": model, "duration": 0.8, "drives": drives}


def _spinning(rng):
    """A floating body that spins fast about its middle axis, with arms that are flung out."""
    builder = lw.ModelBuilder("spinning")
    builder.add_link("hub", mass=4.0, com=(0.01, 0, 0.02), inertia=np.diag([0.2, 0.35, 0.5]))
    builder.set_floating_base()
    for k in range(2):
        builder.add_link(f"arm{k}", mass=0.5, com=(0.3, 0, 0), inertia=0.01 * np.eye(3))
        kind = rng.choice(["revolute", "spherical"])
        spring = {"stiffness": float(rng.choice([0.0, 5.0]))} if kind == "revolute" else {}
        at = (0.2 - 0.4 * k, 0.1, 0)
        builder.add_joint(f"hinge{k}", kind, "hub", f"arm{k}", translation=at, **spring)
    model = builder.build()
    v0 = 0.1 * rng.standard_normal(model.nv)
    v0[3:6] = [0.01, rng.uniform(10, 60), 0.01]
    return {"model": model, "duration": 0.5, "v0": v0}


def _stiff_targets(rng):
    """Stiff drives whose targets jump, on light links and heavy ones."""
    model = random_arm(rng, 3, armature=lambda r: r.choice([0.0, 1e-3]))
    jump = rng.uniform(0.1, 0.4)
    target = lw.Table([0, jump, jump + 1e-4, 0.5], [0, 0, rng.uniform(-0.5, 0.5), 0.3])
    gains = 10 ** rng.uniform(3, 7, 3)
    drives = {
        name: lw.PD(kp, 0.02 * kp * rng.uniform(0.01, 1), target)
        for name, kp in zip(model.joint_names, gains, strict=True)
    }
    return {"model": model, "duration": 0.5, "drives": drives}


KINDS = {
    "short contacts": drawn("contact", 6, _short_contacts),
    "ends in contact": drawn("pressed", 4, _ends_in_contact),
    "stops that damp": drawn("damped", 5, _damped_stops),
    "friction reversals": drawn("reversal", 5, _reversals),
    "late blows": drawn("blow", 5, _late_blows),
    "kinked motions": drawn("kink", 5, _kinked_motions),
    "spinning": drawn("spin", 5, _spinning),
    "stiff targets": drawn("target", 5, _stiff_targets),
}
