"""Throughput on one core over many states of one 7-joint arm, beside the peers' evaluations."""

from __future__ import annotations

from benchmarks.engines.base import Offer
from benchmarks.machine import ROBOTS, Machine, RobotMissingError, load_robot, random_chain
from benchmarks.race import race
from benchmarks.rows import Row
from benchmarks.sessions import Workers

STATES = 1024


def machines() -> list[Machine]:
    found = [random_chain(7)]
    for robot in ROBOTS:
        if robot.name in ("iiwa", "xArm7"):
            try:
                found.append(load_robot(robot))
            except RobotMissingError:
                continue  # named as missing by the case `robots`
    return found


def wanted(engine: str, _arena: str, offer: Offer) -> bool:
    return engine != "linkwise" or offer.method == "batch"


def run(workers: Workers) -> list[Row]:
    workers.begin_family()
    rows: list[Row] = []
    for machine in machines():
        workers.say(f"batch: {STATES} states of {machine.name}")
        rows += race(workers, "batch", machine, states=STATES, wanted=wanted)
    return rows
