"""One evaluation of robots from their URDF files; ANYmal and Talos float."""

from __future__ import annotations

from linkwise.bench.cases.single import wanted
from linkwise.bench.machine import ROBOTS, RobotMissingError, load_robot
from linkwise.bench.pits import CPP, Pits
from linkwise.bench.race import race
from linkwise.bench.rows import Row


def run(pits: Pits) -> list[Row]:
    rows: list[Row] = []
    for robot in ROBOTS:
        pits.begin_family()
        pits.say(f"robots: {robot.name}")
        try:
            machine = load_robot(robot)
        except RobotMissingError as missing:
            rows.append(Row("robots", robot.name, 0, "linkwise", CPP, "", failure=str(missing)))
            continue
        states = 16 if pits.effort.quick else 64
        rows += race(pits, "robots", machine, states=states, wanted=wanted)
    return rows
