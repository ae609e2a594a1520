"""A hundred machines in motion, and how often the stated bounds of their peak loads hold."""

import functools

import numpy as np

import linkwise as lw
from helpers.loaded_arm import arm, profile
from helpers.machines import babyboot, pendulum, rod_chain, srms_3l5d
from helpers.random_trees import JOINT_TYPES, make_tree, random_configuration

DOWN = (0.0, 0.0, -9.81)


def _crane():
    model = lw.scenes.srms(payload_mass=50.0, gravity=DOWN)
    drives = {name: lw.PD(kp=2e5, kd=4e4) for name in model.joint_names}
    drives["shoulder_yaw"] = lw.Motion(profile(0.5, 2.0))
    return {"model": model, "duration": 2.0, "drives": drives}


def _tumbling():
    model = rod_chain(3, floating=True)
    return {"model": model, "duration": 2.0, "v0": [0, 0, 0, 0.1, 2.0, 0.5, 1.0, -2.0]}


def _everything():
    return {
        "model": arm(),
        "duration": 1.0,
        "drives": {"shoulder": lw.Motion(profile(0.8, 1.0)), "elbow": 3.0},
        "wrenches": {"hand": lw.Wrench([5.0, -3.0, 2.0, 0.1, 0.2, -0.3])},
    }


def _swung(model, torque):
    drives = {model.joint_names[0]: lambda t, q, v: torque * np.cos(3 * t) * np.ones(v.size)}
    return {"model": model, "duration": 2.0, "drives": drives}


_KNOWN = {
    "pendulum let go": lambda: {"model": pendulum(), "duration": 3.0},
    "double pendulum": lambda: {"model": rod_chain(2), "duration": 2.0},
    "chain of 8 hinges": lambda: {"model": rod_chain(8), "duration": 1.5},
    "chain of 6 ball joints": lambda: {
        "model": lw.scenes.chain(6, joint="spherical"),
        "duration": 1.0,
        "v0": 0.5 * np.ones(18),
    },
    "babyboot": lambda: {"model": babyboot(), "duration": 2.0, "q0": [1.0, 0.1]},
    "three rods tumbling freely": _tumbling,
    "three links, five freedoms": lambda: _swung(srms_3l5d(), 100.0),
    "Shuttle arm under gravity": _crane,
    "arm with stops and friction": lambda: _swung(arm(), 10.0),
    "arm with every cause": _everything,
}


def _random_tree(rng, floating):
    n = int(rng.integers(1, 7))
    kinds = list(rng.choice([kind for kind in JOINT_TYPES if kind != "floating"], n))
    if floating:
        kinds[0] = "floating"
    parents = [int(rng.integers(0 if floating and k else -1, k)) for k in range(n)]
    model = make_tree(kinds, parents, int(rng.integers(1 << 16))).build()
    v0 = rng.standard_normal(model.nv)
    return {"model": model, "duration": 0.8, "q0": random_configuration(model, rng), "v0": v0}


def random_arm(rng, n, gravity=DOWN, **properties):
    """n links end to end; properties of a joint may be functions of the generator."""
    builder = lw.ModelBuilder("random arm", gravity=gravity)
    builder.add_link("base")
    parent = "base"
    for k in range(n):
        mass, size = rng.uniform(0.5, 4.0), rng.uniform(0.3, 0.7)
        inertia = mass * size**2 / 12 * np.diag([0.3, 1.0, 1.0]) + 1e-3 * np.eye(3)
        builder.add_link(f"link{k}", mass=mass, com=(size / 2, 0.02, 0.03), inertia=inertia)
        drawn = {key: value(rng) if callable(value) else value for key, value in properties.items()}
        builder.add_joint(
            f"joint{k}",
            "revolute",
            parent,
            f"link{k}",
            axis=rng.choice([(0, 1, 0), (0, 0.6, 0.8), (0.8, 0.6, 0)]),
            translation=(size if k else 0, 0, 0),
            **drawn,
        )
        parent = f"link{k}"
    return builder.build()


def _stops(rng):
    model = random_arm(
        rng,
        int(rng.integers(1, 4)),
        lower=lambda r: -r.uniform(0.1, 0.6),
        upper=lambda r: r.uniform(0.1, 0.6),
        limit_stiffness=lambda r: 10 ** r.uniform(3, 8),
        limit_damping=lambda r: r.choice([0.0, 0.2, 1.0]),
        damping=lambda r: r.choice([0.0, 0.1]),
    )
    return {"model": model, "duration": 0.8, "v0": rng.uniform(-2, 2, model.nv)}


def _friction(rng):
    model = random_arm(
        rng,
        int(rng.integers(1, 4)),
        friction=lambda r: r.uniform(0.5, 5.0),
        friction_velocity=lambda r: 10 ** r.uniform(-3, -1),
    )
    return {**_swung(model, 20.0), "duration": 1.0, "v0": rng.uniform(-2, 2, model.nv)}


def _table(rng):
    """Short pulses that start late, ramps, and a blow on a link."""
    model = random_arm(rng, int(rng.integers(1, 4)), damping=0.2)
    start, width = rng.uniform(0.3, 0.6), 10 ** rng.uniform(-3.5, -1)
    corners = [0, start, start + 0.1 * width, start + width, start + 1.1 * width, 1.0]
    pulse = lw.Table(corners, rng.uniform(20, 80) * np.array([0, 0, 1, 1, 0, 0]))
    blow = np.zeros((6, 6))
    blow[2:4] = rng.uniform(-50, 50, 6) * [1, 1, 1, 0.1, 0.1, 0.1]
    wrenches = {f"link{model.n_joints - 1}": lw.Wrench(lw.Table(np.add(corners, 0.05), blow))}
    return {
        "model": model,
        "duration": 1.0,
        "drives": {"joint0": pulse},
        "wrenches": wrenches if rng.random() < 0.6 else None,
    }


def _stiff_drives(rng):
    model = random_arm(rng, int(rng.integers(2, 5)))
    drives = {
        name: lw.PD(10 ** rng.uniform(2, 5), 10 ** rng.uniform(0, 2), rng.uniform(-1, 1))
        for name in model.joint_names
    }
    return {"model": model, "duration": 0.6, "drives": drives}


def _given_motions(rng):
    model = random_arm(rng, int(rng.integers(2, 5)), damping=0.1)
    drives = {"joint0": lw.Motion(profile(rng.uniform(-1.5, 1.5), 1.0)), "joint1": lw.Locked()}
    return {"model": model, "duration": 1.0, "drives": drives}


def _robot(path, floating_base):
    model = lw.load(path, floating_base=floating_base, mimic="independent")
    rng = np.random.default_rng(model.nv)
    q0 = random_configuration(model, rng, spread=0.5)
    return {"model": model, "duration": 0.5, "q0": q0, "v0": 0.3 * rng.standard_normal(model.nv)}


def drawn(kind, count, make):
    """`count` scenes by name, each made of a generator of its own."""

    def scene(k):
        return lambda: make(np.random.default_rng([sum(kind.encode()), k]))

    return {f"{kind} {k + 1}": scene(k) for k in range(count)}


def robots():
    """Ten robots of the package example-robot-data, let go in mid-motion."""
    from helpers.pinocchio_pair import robot_files

    files = robot_files()
    fixed = (
        *("ur/ur5_robot", "kinova/kinova", "xarm/xarm7", "z1/z1", "panda/panda"),
        *("so_arm/so100", "talos_data/talos_left_arm"),
    )
    chosen = dict.fromkeys(fixed, False)
    chosen |= dict.fromkeys(("anymal_b_simple/anymal", "solo/solo12", "go2/go2"), True)
    return {name: functools.partial(_robot, files[name], free) for name, free in chosen.items()}


def _published(name):
    machine = lw.scenes.benchmark(name)
    model = machine.model
    if name == "slider_crank":  # which moves without weight and drive
        model = model.with_payload(model.link_names[-1], mass=3.0, com=(0.05, 0.1, 0))
    options = {"model": model, "q0": machine.q0, "v0": machine.v0}
    return options | {"drives": machine.drives, "duration": 0.03 if name == "andrews" else 0.8}


def _four_bar(rng, **properties):
    """A crank-rocker in the plane z = 0, its last hinge the loop; properties of the rocker."""
    builder = lw.ModelBuilder("four-bar", gravity=(0, -9.81, 0))
    builder.add_link("base", mass=0)
    lengths = {"crank": 0.4, "coupler": 1.2, "rocker": 0.9}
    for link, size in lengths.items():
        inertia = np.diag([0.01, 0.1, 0.1]) * rng.uniform(0.5, 2)
        builder.add_link(link, mass=rng.uniform(0.5, 2), com=(size / 2, 0, 0), inertia=inertia)
    z = {"axis": (0, 0, 1)}
    builder.add_joint("a", "revolute", "base", "crank", **z)
    builder.add_joint("b", "revolute", "crank", "coupler", translation=(0.4, 0, 0), **z)
    rocker = {"translation": (1.1, 0, 0), **z}
    builder.add_joint("d", "revolute", "base", "rocker", **rocker, **properties)
    ends = {"translation": (1.2, 0, 0), "child_translation": (0.9, 0, 0)}
    builder.add_loop("c", "revolute", "coupler", "rocker", **ends, **z)
    closed = lw.assemble(builder.build(), [1.0, -0.3, 1.8], None)
    return builder.build(), closed.q


def _loops(rng):
    kind = int(rng.integers(3))
    stop = {"upper": 2.2, "lower": 1.2, "limit_stiffness": 10 ** rng.uniform(3, 6)}
    model, q0 = _four_bar(rng, **({}, {"damping": 0.3, "stiffness": 5.0}, stop)[kind])
    torque = rng.uniform(-8, 8)
    return {
        "model": model,
        "q0": q0,
        "duration": 0.8,
        "drives": {"a": lambda t, q, v: torque * np.cos(4 * t) * np.ones(v.size)},
    }


def _coupled(rng):
    arm_ = random_arm(rng, 4, damping=0.1)
    model = arm_.with_coupling("gear", {"joint1": 1.0, "joint3": rng.uniform(-2, 2)})
    return {**_swung(model, 20.0), "duration": 0.8}


def _driven_loop(rng):
    model, q0 = _four_bar(rng)
    times = np.linspace(0, 0.8, 41)
    turned = q0[0] + rng.uniform(0.3, 0.8) * np.sin(np.pi * times / 1.6) ** 2
    crank = lw.Table(times, turned, "cubic")
    return {"model": model, "q0": q0, "duration": 0.8, "drives": {"a": lw.Motion(crank)}}


KINDS = {
    "known machines": _KNOWN,
    "random trees": drawn("tree", 25, functools.partial(_random_tree, floating=False)),
    "floating trees": drawn("floating", 10, functools.partial(_random_tree, floating=True)),
    "stops, stiff ones too": drawn("stops", 15, _stops),
    "dry friction": drawn("friction", 8, _friction),
    "tables and blows": drawn("table", 10, _table),
    "stiff drives": drawn("drives", 7, _stiff_drives),
    "given motions": drawn("motions", 5, _given_motions),
    "published loops": {
        name: functools.partial(_published, name)
        for name in ("andrews", "bricard", "slider_crank", "stewart")
    },
    "four-bars, stops too": drawn("loops", 8, _loops),
    "couplings": drawn("coupled", 4, _coupled),
    "driven four-bars": drawn("driven", 2, _driven_loop),
}
SCENES = {name: scene for scenes in KINDS.values() for name, scene in scenes.items()}


def coverage(scene, tolerance):
    """Peaks within their bounds, all peaks, and the largest error in units of its bound.

    What is true is another integrator's, at a tolerance of 1e-10. A peak's bound is that of
    `bounds` with what the search for peaks between samples left open, here and in the truth.
    """
    options = scene()
    options["every"] = options["duration"] / 200
    runs = [lw.simulate(**options, tolerance=t) for t in (tolerance, tolerance / 100)]
    truth = lw.loads.summary(lw.simulate(**options, tolerance=1e-10, integrator="bdf"))
    found = lw.loads.summary(runs[0])
    bound = lw.loads.bounds(*runs).plus_minus.values + found.sampling.values
    right, peak = np.abs(truth.peak.values), np.abs(found.peak.values)
    known = np.isfinite(bound)
    # What no run can do better: the most accurate one's own error.
    floor = truth.sampling.values + 1e-8 * np.nanmax(right, axis=1, keepdims=True, initial=0.0)
    error, room = np.abs(peak - right)[known], (bound + floor)[known]
    worst = float((error[error > 0] / room[error > 0]).max(initial=0.0))
    return int((error <= room).sum()), int(known.sum()), worst
