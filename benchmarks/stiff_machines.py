"""Evaluations of each integrator on machines from soft to stiff; the same on every machine.

    python -m benchmarks stiff_machines [-o DIR]

Counts of `adams` marked ~ are taken from the time that it covered in its first million steps.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import linkwise as lw
from benchmarks import study
from benchmarks.machine import ROBOTS, robot_file

MOST_STEPS = 1_000_000

HEAD = f"""# Stiff machines

Evaluations of the whole run, at the default tolerance. Counts marked ~ are taken from the time that
`adams` covered in its first {MOST_STEPS:,} steps.

"""

Scene = dict[str, Any]


def finger() -> lw.Model:
    """Two light links, as of a hand."""
    builder = lw.ModelBuilder("finger")
    builder.add_link("base")
    builder.add_link("near", mass=0.02, com=(0, 0, 0.02), inertia=np.diag([1e-6, 1e-6, 5e-7]))
    builder.add_link("far", mass=0.005, com=(0, 0, 0.01), inertia=np.diag([1e-8, 1e-8, 1e-9]))
    builder.add_joint("j1", "revolute", "base", "near", axis=(0, 1, 0))
    builder.add_joint("j2", "revolute", "near", "far", axis=(0, 1, 0), translation=(0, 0, 0.04))
    return builder.build()


def driven_finger(kp: float, kd: float) -> Scene:
    drives = {"j1": lw.PD(kp, kd, 0.5), "j2": lw.PD(kp, kd, -0.3)}
    return {"model": finger(), "duration": 0.5, "drives": drives}


def two_rods(**properties: float) -> lw.Model:
    builder = lw.ModelBuilder("two rods")
    builder.add_link("ground")
    builder.add_link("upper", mass=1.0, com=(0, 0, -0.5), inertia=np.diag([0.08, 0.08, 0.001]))
    builder.add_link("lower", mass=1.0, com=(0, 0, -0.5), inertia=np.diag([0.08, 0.08, 0.001]))
    builder.add_joint("first", "revolute", "ground", "upper", axis=(0, 1, 0))
    offset = (0, 0, -1)
    axis = (0, 1, 0)
    builder.add_joint(
        "second", "revolute", "upper", "lower", axis=axis, translation=offset, **properties
    )
    return builder.build()


def rods(**properties: float) -> Scene:
    return {"model": two_rods(**properties), "duration": 10.0, "q0": [1.0, 0.5]}


def stopped(stiffness: float, damping: float) -> Scene:
    limits = {"lower": -0.2, "upper": 0.2, "limit_stiffness": stiffness, "limit_damping": damping}
    return rods(**limits) | {"q0": [1.0, 0.1]}


def resting(stiffness: float) -> Scene:
    """A rod that falls onto a stop and stays there."""
    builder = lw.ModelBuilder("resting rod")
    builder.add_link("ground")
    builder.add_link("rod", mass=1.0, com=(0.5, 0, 0), inertia=np.diag([0.001, 0.08, 0.08]))
    builder.add_joint(
        "hinge",
        "revolute",
        "ground",
        "rod",
        axis=(0, 1, 0),
        lower=-3.0,
        upper=0.2,
        limit_stiffness=stiffness,
        limit_damping=1.0,
        damping=1.0,
    )
    return {"model": builder.build(), "duration": 10.0}


def panda() -> Scene:
    robot = next(robot for robot in ROBOTS if robot.name == "Panda")
    return {"model": lw.load(robot_file(robot), mimic="independent"), "duration": 10.0}


def chain(n: int, duration: float, **options: Any) -> Scene:
    return {
        "model": lw.scenes.chain(n, **options),
        "duration": duration,
        "q0": 0.3 * np.ones(n),
    }


def scenes() -> dict[str, Scene]:
    """By name; of machines alike, the softest first."""
    found = {
        "two rods, 10 s": rods(),
        "two rods, 100 s": rods() | {"duration": 100.0},
        "chain of 7, 100 s": chain(7, 100.0),
        "chain of 30, 10 s": chain(30, 10.0),
        "chain of 300, 1 s": chain(300, 1.0),
        "Panda let go, 10 s": panda(),
    }
    for kp, kd in ((1e-2, 1e-4), (1, 1e-2), (1e2, 1), (1e3, 1e1), (1e5, 1e2), (1e8, 1e6)):
        found[f"finger, kp = {kp:g}, kd = {kd:g}"] = driven_finger(kp, kd)
    for damping in (1, 1e1, 1e2, 1e3, 1e5, 1e7, 1e9):
        found[f"two rods, damping = {damping:g}"] = rods(damping=damping)
    for velocity in (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
        name = f"two rods, friction_velocity = {velocity:g}"
        found[name] = rods(friction=5.0, friction_velocity=velocity)
    for stiffness in (1e4, 1e6, 1e8):
        found[f"two rods, stops of {stiffness:g}"] = stopped(stiffness, 0.0)
    for stiffness in (1e4, 1e6, 1e8):
        found[f"two rods, stops of {stiffness:g}, damped"] = stopped(stiffness, 1.0)
    for stiffness in (1e4, 1e6, 1e8):
        found[f"rod coming to rest on a stop of {stiffness:g}"] = resting(stiffness)
    for n, damping, duration in ((30, 1e3, 10.0), (100, 1e3, 1.0), (300, 1e4, 1.0)):
        found[f"chain of {n}, damping = {damping:g}, {duration:g} s"] = chain(
            n, duration, damping=damping
        )
    return found


def simulated(scene: Scene, integrator: str, most_steps: int | None = None) -> lw.Run:
    options = {key: value for key, value in scene.items() if key not in ("model", "duration")}
    return lw.simulate(
        scene["model"],
        **options,
        times=[scene["duration"]],
        threads=1,
        record=["position"],
        on_failure="return",
        integrator=integrator,
        max_steps=most_steps,
    )


def evaluations(run: lw.Run, duration: float) -> str:
    count = run.attrs["total_evaluations"]
    if run.outcome == "too_many_steps":
        return f"~{count * duration / run.attrs['stop_time']:.1e}"
    return f"{count}" if run.outcome == "converged" else run.outcome


def main() -> None:
    parser = study.parser(__doc__)
    parser.add_argument("--only", default="", help="scenes with this in their name")
    asked = parser.parse_args()
    rows: list[dict[str, str]] = []
    for name, scene in scenes().items():
        if asked.only not in name:
            continue
        row = {"scene": name}
        for integrator in ("adams", "bdf", "auto"):
            run = simulated(scene, integrator, MOST_STEPS if integrator == "adams" else None)
            row[f"`{integrator}`"] = evaluations(run, scene["duration"])
        said = [note["text"] for note in run.warnings if note["element"] == "integrator"]
        row["`auto` says"] = said[0] if said else ""
        rows.append(row)
        study.say(" | ".join(row.values()))
    columns: dict[str, Any] = {key: lambda r, key=key: r[key] for key in rows[0]}
    study.write(asked.output, "stiff_machines", HEAD + study.table(rows, columns, left=1), rows)


if __name__ == "__main__":
    main()
