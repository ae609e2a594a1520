"""One evaluation of robots from their URDF files; ANYmal and Talos float."""

from __future__ import annotations

from benchmarks.cases.single import wanted
from benchmarks.machine import ROBOTS, RobotMissingError, load_robot
from benchmarks.race import race
from benchmarks.rows import Row
from benchmarks.sessions import CPP, Workers


def run(workers: Workers) -> list[Row]:
    rows: list[Row] = []
    for robot in ROBOTS:
        workers.begin_family()
        workers.say(f"robots: {robot.name}")
        try:
            machine = load_robot(robot)
        except RobotMissingError as missing:
            rows.append(Row("robots", robot.name, 0, "linkwise", CPP, "", failure=str(missing)))
            continue
        states = 16 if workers.effort.quick else 64
        rows += race(workers, "robots", machine, states=states, wanted=wanted)
    return rows
