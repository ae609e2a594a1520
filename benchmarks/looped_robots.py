"""Closed loops: one evaluation beside the open tree and Pinocchio, rows of loops, whole motions.

    python -m benchmarks looped_robots [-o DIR]

Pinocchio states loops as points that coincide (CONTACT_3D): ball joints, or hinges where all is
planar. Both sides are timed from Python; a call of Pinocchio's costs a microsecond of that.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np

import linkwise as lw
from benchmarks import exudyn_rows, study, timing
from benchmarks.machine import Array
from linkwise.scenes import benchmark
from linkwise.scenes.benchmark import Benchmark

#: Machines of a few loops, and how long they move for their states [s].
MACHINES = {
    "Stewart platform": ("stewart", {}, 0.3),
    "biped, closed ankles": ("biped", {}, 0.2),
    "Andrews' mechanism": ("andrews", {}, 0.01),
    "six four-bars": ("four_bars", {"n": 6}, 0.5),
    "slider-crank": ("slider_crank", {}, 0.5),
}
ROWS = (10, 100, 1000, 10_000)
STATES, TURNS = 40, 25
#: The end of the first rod of forty four-bars at 10 s [m].
FORTY = (0.1805122267, 0.9835727406)


def states_of(machine: Benchmark, duration: float) -> tuple[Array, Array]:
    """Positions and rates along a motion."""
    run = lw.simulate(
        machine.model,
        q0=machine.q0,
        v0=machine.v0,
        drives=machine.drives,
        times=np.linspace(0, duration, STATES),
        record=["position", "velocity"],
        tolerance=1e-10,
    )
    return run.position.values, run.velocity.values


def without_loops(model: lw.Model) -> lw.Model:
    """The tree, its loops left open."""
    builder = lw.ModelBuilder("tree", gravity=tuple(model.gravity))
    masses = dict(zip(model.link_names, model.link_masses, strict=True))
    centers = dict(zip(model.link_names, model.link_centers_of_mass, strict=True))
    inertias = dict(zip(model.link_names, model.link_inertias, strict=True))
    for name in model.link_names:
        if masses[name] > 0:
            builder.add_link(
                name, mass=masses[name], com=tuple(centers[name]), inertia=inertias[name]
            )
        else:
            builder.add_link(name)
    for j, place in enumerate(placements(model)):
        axes = [axis for _, axis in model.joint_axes[j]]
        given: dict[str, Any] = {}
        if len(axes) == 1:
            given = {"axis": axes[0]}
        elif len(axes) == 2:
            given = {"axes": axes}
        builder.add_joint(
            model.joint_names[j],
            model.joint_types[j],
            model.parent_link_names[j],
            model.child_link_names[j],
            translation=tuple(place[:3, 3]),
            rotation=place[:3, :3],
            **given,
        )
    return builder.build()


def placements(model: lw.Model) -> list[Array]:
    """Of each joint in its parent joint's frame, at zero."""
    poses = lw.joint_poses(model, model.neutral_configuration())
    parents = model.joint_parents
    return [
        pose if parents[j] < 0 else np.linalg.inv(poses[parents[j]]) @ pose
        for j, pose in enumerate(poses)
    ]


def ours(model: lw.Model, q: Array, v: Array) -> Callable[[], float]:
    """The best evaluation of one turn [s]."""
    method = lw.DynamicsMethod(model, threads=1)
    times = np.arange(len(q), dtype=float)
    return lambda: float(np.median(method.follow(times, q, v)["seconds"]))


class Pinocchio:
    """constraintDynamics of one machine."""

    def __init__(self, model: lw.Model) -> None:
        pin: Any = import_module("pinocchio")
        self.pin, self.model = pin, pin.Model()
        self.model.gravity.linear = np.array(model.gravity)
        index = {name: k for k, name in enumerate(model.link_names)}
        ids: dict[str, int] = {}
        for j, place in enumerate(placements(model)):
            parent = ids.get(model.parent_link_names[j], 0)
            at = pin.SE3(place[:3, :3], place[:3, 3])
            name = model.joint_names[j]
            axes = [(kind, np.array(axis)) for kind, axis in model.joint_axes[j]]
            if model.joint_types[j] == "spherical":
                parent = self.model.addJoint(parent, pin.JointModelSpherical(), at, name)
            elif model.joint_types[j] == "floating":
                parent = self.model.addJoint(parent, pin.JointModelFreeFlyer(), at, name)
                axes = []
            for k, (kind, axis) in enumerate(axes):
                letter = "R" if kind == "revolute" else "P"
                aligned = "XYZ"[int(np.argmax(np.abs(axis)))]
                made = getattr(pin, f"JointModel{letter}{aligned}")()
                assert np.isclose(axis.max(), 1)
                parent = self.model.addJoint(parent, made, at, f"{name}_{k}")
                at = pin.SE3.Identity()
            link = model.child_link_names[j]
            ids[link] = parent
            k = index[link]
            inertia = pin.Inertia(
                float(model.link_masses[k]),
                np.array(model.link_centers_of_mass[k]),
                np.array(model.link_inertias[k]),
            )
            self.model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
        self.contacts = pin.StdVec_RigidConstraintModel()
        for k, (in_parent, in_child) in enumerate(model.loop_placements):
            ends = []
            for link, place in (
                (model.loop_parent_link_names[k], in_parent),
                (model.loop_child_link_names[k], in_child),
            ):
                ends += [ids.get(link, 0), pin.SE3(place[:3, :3], place[:3, 3])]
            self.contacts.append(
                pin.RigidConstraintModel(
                    pin.ContactType.CONTACT_3D, self.model, *ends, pin.ReferenceFrame.LOCAL
                )
            )
        self.data = self.model.createData()
        self.at = pin.StdVec_RigidConstraintData()
        for contact in self.contacts:
            self.at.append(contact.createData())
        self.settings = pin.ProximalSettings(1e-12, 1e-10, 5)
        pin.initConstraintDynamics(self.model, self.data, self.contacts, self.at)

    def __call__(self, q: Array, v: Array, tau: Array) -> Array:
        return np.array(
            self.pin.constraintDynamics(
                self.model, self.data, q, v, tau, self.contacts, self.at, self.settings
            )
        )

    def turn(self, q: Array, v: Array) -> Callable[[], float]:
        tau = np.zeros(v.shape[1])

        def one() -> float:
            call, args = self.pin.constraintDynamics, (self.contacts, self.at, self.settings)

            def all_states() -> None:
                for k in range(len(q)):
                    call(self.model, self.data, q[k], v[k], tau, *args)

            return timing.timed(all_states)[1].seconds / len(q)

        return one


def best(turns: list[Callable[[], float]]) -> list[float]:
    """Least of each, taking turns."""
    found = np.array([[turn() for turn in turns] for _ in range(TURNS)])
    return [float(x) for x in found.min(axis=0)]


def of_machine(name: str) -> dict[str, Any]:
    scene, options, duration = MACHINES[name]
    machine = benchmark(scene, **options)
    model = machine.model
    q, v = states_of(machine, duration)
    tree = without_loops(model)
    pinocchio = Pinocchio(model)
    tau = np.zeros(model.nv)
    mine = np.array([lw.forward_dynamics(model, a, b, tau) for a, b in zip(q, v, strict=True)])
    theirs = np.array([pinocchio(a, b, tau) for a, b in zip(q, v, strict=True)])
    closed, opened, other = best([ours(model, q, v), ours(tree, q, v), pinocchio.turn(q, v)])
    return {
        "machine": name,
        "loops": model.n_loops,
        "closed": closed,
        "open": opened,
        "pinocchio": other,
        "apart": float(np.abs(mine - theirs).max() / np.abs(mine).max()),
    }


def of_row(n: int) -> dict[str, Any]:
    machine = benchmark("four_bars", n=n)
    count = max(3, 2000 // n)
    turn = ours(
        machine.model,
        np.repeat(np.asarray(machine.q0)[None], count, 0),
        np.repeat(np.asarray(machine.v0)[None], count, 0),
    )
    return {"loops": n, "closed": min(turn() for _ in range(5))}


def our_motion(tolerance: float) -> dict[str, Any]:
    machine = benchmark("four_bars", n=40)
    run, taken = timing.timed(
        lambda: lw.simulate(
            machine.model,
            q0=machine.q0,
            v0=machine.v0,
            times=[10.0],
            record=["position"],
            tolerance=tolerance,
            threads=1,
        )
    )
    pose = lw.joint_poses(machine.model, run.position.values[-1])[0]
    end = (pose @ np.array([0, 1, 0, 1]))[:2]
    error = float(np.linalg.norm(end - FORTY))
    setting = f"tolerance {tolerance:g}"
    return {"engine": "linkwise", "setting": setting, "seconds": taken.cpu, "error": error}


def their_motion(step: float) -> dict[str, Any]:
    """MuJoCo, whose constraints are springs: as stiff as the step takes."""
    mujoco: Any = import_module("mujoco")
    inertial = '<inertial pos="{}" mass="1" fullinertia="{}"/>'
    hinge = '<joint axis="0 0 1"/>'
    upright = inertial.format("0 0.5 0", "0.0841667 0.00166667 0.0841667 0 0 0")
    lying = inertial.format("0.5 0 0", "0.00166667 0.0841667 0.0841667 0 0 0")
    bodies, equalities = "", ""
    for i in range(41):
        inner = f'<body name="bar{i}" pos="0 1 0">{lying}{hinge}</body>' if i < 40 else ""
        bodies += f'<body name="rod{i}" pos="{i} 0 0">{upright}{hinge}{inner}</body>'
        if i < 40:
            equalities += f'<connect body1="bar{i}" body2="rod{i + 1}" anchor="1 0 0"/>'
    text = (
        f'<mujoco><option timestep="{step}" gravity="0 -9.81 0" integrator="RK4" tolerance="1e-14" '
        f'iterations="200"/><default><equality solref="{2 * step} 1" solimp="0.9999 0.9999 0.001"/>'
        f"</default><worldbody>{bodies}</worldbody><equality>{equalities}</equality></mujoco>"
    )
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    machine = benchmark("four_bars", n=40)
    order = [machine.model.joint_names.index(n) for i in range(41) for n in _pair(i)]
    data.qpos[:] = np.asarray(machine.q0)[order]
    data.qvel[:] = np.asarray(machine.v0)[order]
    _, taken = timing.timed(lambda: mujoco.mj_step(model, data, nstep=round(10 / step)))
    angle = data.qpos[0]
    error = float(np.linalg.norm(np.array([-np.sin(angle), np.cos(angle)]) - FORTY))
    return {
        "engine": f"MuJoCo {mujoco.__version__}",
        "setting": f"step {step:g} s",
        "seconds": taken.cpu,
        "error": error,
    }


def exudyns_motion(step: float) -> dict[str, Any]:
    end, taken = exudyn_rows.motion(40, step)
    return {
        "engine": f"Exudyn {exudyn_rows.version()}",
        "setting": f"step {step:g} s",
        "seconds": taken.cpu,
        "error": float(np.linalg.norm(np.subtract(end, FORTY))),
    }


def exudyns_motions() -> list[dict[str, Any]]:
    """An optional peer: `pip install exudyn`."""
    if find_spec("exudyn") is None:
        print("Exudyn is not installed and left out: pip install exudyn", file=sys.stderr)
        return []
    return [exudyns_motion(step) for step in (5e-3, 1e-3, 5e-4)]


def _pair(i: int) -> list[str]:
    return [f"A{i}", f"B{i}"] if i < 40 else [f"A{i}"]


def main() -> None:
    options = study.parser(__doc__).parse_args()
    machines = [of_machine(name) for name in MACHINES]
    rows = [of_row(n) for n in ROWS]
    motions = [our_motion(tolerance) for tolerance in (1e-6, 1e-7, 1e-8, 1e-9)]
    motions += [their_motion(step) for step in (1e-2, 1e-3, 2e-4)]
    motions += exudyns_motions()
    text = "\n\n".join(
        [
            "# Robots with loops",
            "One evaluation, accelerations, no loads [µs]. The closed machine's includes the check "
            "that its state closes the loops.",
            study.table(
                machines,
                {
                    "machine": lambda r: r["machine"],
                    "loops": lambda r: r["loops"],
                    "linkwise": lambda r: f"{1e6 * r['closed']:.1f}",
                    "the tree without closures": lambda r: f"{1e6 * r['open']:.1f}",
                    "ratio": lambda r: f"{r['closed'] / r['open']:.1f}",
                    "Pinocchio": lambda r: f"{1e6 * r['pinocchio']:.1f}",
                    "Pinocchio / linkwise": lambda r: f"{r['pinocchio'] / r['closed']:.1f}",
                    "accelerations apart": lambda r: f"{r['apart']:.0e}",
                },
            ),
            "Rows of four-bars, one evaluation.",
            study.table(
                rows,
                {
                    "loops": lambda r: f"{r['loops']:,}",
                    "ms": lambda r: f"{1e3 * r['closed']:.3f}",
                    "µs per loop": lambda r: f"{1e6 * r['closed'] / r['loops']:.2f}",
                },
            ),
            "Forty four-bars, 10 s, through the singular positions: the end of the first rod.",
            study.table(
                motions,
                {
                    "engine": lambda r: r["engine"],
                    "setting": lambda r: r["setting"],
                    "s of the processor": lambda r: f"{r['seconds']:.2f}",
                    "error [m]": lambda r: f"{r['error']:.0e}",
                },
                left=2,
            ),
        ]
    )
    study.write(options.output, "looped_robots", text, [*machines, *rows, *motions])
