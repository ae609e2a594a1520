"""Throughput on one core over many states of one 7-joint arm, beside the peers' evaluations."""

from __future__ import annotations

from linkwise.bench.engines.base import Offer
from linkwise.bench.machine import ROBOTS, Machine, RobotMissingError, load_robot, random_chain
from linkwise.bench.pits import Pits
from linkwise.bench.race import race
from linkwise.bench.rows import Row

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


def run(pits: Pits) -> list[Row]:
    pits.begin_family()
    rows: list[Row] = []
    for machine in machines():
        pits.say(f"batch: {STATES} states of {machine.name}")
        rows += race(pits, "batch", machine, states=STATES, wanted=wanted)
    return rows
