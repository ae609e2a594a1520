"""Whole simulations under gravity: time against error of the end position, several accuracies."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.machine import Array, Machine, random_chain, random_states
from benchmarks.process import WorkerError
from benchmarks.race import write_case
from benchmarks.rows import Row, quartiles
from benchmarks.sessions import PYTHON, Session, Workers

TOLERANCES = tuple(10.0**-k for k in range(4, 15))
QUICK_TOLERANCES = (1e-7, 1e-9, 1e-11, 1e-13)
STEPS = (1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4)
QUICK_STEPS = (5e-3, 2e-3, 5e-4)
REPEATS, QUICK_REPEATS = 5, 2
#: Seconds that one simulation may take, and after which it is not repeated.
SLOWEST, LONG = 20.0, 2.0
#: The reference is the work of none of ours: Pinocchio's accelerations, integrated by SciPy.
REFERENCE = ("pinocchio", "SciPy DOP853", 3e-14)
#: First-order methods need a step that no time budget allows for the errors of interest.
LEFT_OUT = ("semi_implicit_euler",)


@dataclass
class Point:
    """One contestant at one setting."""

    row: Row
    session: Session
    method: str
    setting: float
    seconds: list[float] = field(default_factory=list)


def run(workers: Workers) -> list[Row]:
    chosen = [(7, 1.0)] if workers.effort.quick else [(7, 1.0), (30, 0.5)]
    rows: list[Row] = []
    for n, duration in chosen:
        workers.say(f"simulation: chain of {n} for {duration:g} s")
        rows += _compare(workers, random_chain(n), duration)
    return rows


def _compare(workers: Workers, machine: Machine, duration: float) -> list[Row]:
    rows: list[Row] = []
    with tempfile.TemporaryDirectory(prefix="linkwise-bench-") as name:
        folder = Path(name)
        write_case(machine, random_states(machine, 1), folder)
        points = _points(workers, machine, folder, rows)
        expected = _reference(workers, points, duration, folder)
        repeats = QUICK_REPEATS if workers.effort.quick else REPEATS
        for _ in range(repeats):
            for point in points:
                if sum(point.seconds) < LONG:
                    _once(workers, point, duration, expected, folder)
                if point.row.failure:
                    give_up(point, points)
    for point in points:
        _settle(point, duration)
    return rows


def _points(workers: Workers, machine: Machine, folder: Path, rows: list[Row]) -> list[Point]:
    tolerances, steps = (
        (QUICK_TOLERANCES, QUICK_STEPS) if workers.effort.quick else (TOLERANCES, STEPS)
    )
    points = []
    for engine in workers.engines:
        if not engine.installed:
            continue
        session = Session(workers, engine, PYTHON, folder)

        def row(method: str, failure: str = "", session: Session = session) -> Row:
            n, name = machine.n_bodies, session.engine.name
            made = Row("simulation", machine.name, n, name, PYTHON, method, failure=failure)
            rows.append(made)
            return made

        try:
            built = session.build()
        except WorkerError as failed:
            row("", str(failed))
            continue
        for simulator in built["simulators"]:
            method = simulator["method"]
            if method in LEFT_OUT:
                continue
            for setting in steps if simulator["fixed_step"] else tolerances:
                made = row(method)
                made.figures["step" if simulator["fixed_step"] else "tolerance"] = setting
                points.append(Point(made, session, method, setting))
    return points


def _reference(
    workers: Workers, points: Sequence[Point], duration: float, folder: Path
) -> Array | None:
    """The end position by the reference, or by the tightest tolerance of ours without Pinocchio."""
    engine, method, setting = REFERENCE
    sessions = {point.session.engine.name: point.session for point in points}
    if engine not in sessions:
        engine, method = "linkwise", "adams"
    if engine not in sessions:
        return None
    try:
        _ask(workers, sessions[engine], method, duration, setting, folder)
    except WorkerError as failed:
        workers.say(f"simulation: no reference: {failed}")
        return None
    return np.fromfile(folder / "q")


def _ask(
    workers: Workers, session: Session, method: str, duration: float, setting: float, folder: Path
) -> dict[str, float]:
    return session.ask(
        "simulate",
        method,
        repr(duration),
        repr(setting),
        str(folder / "q"),
        timeout=min(4 * workers.effort.slowest, SLOWEST),
    )


def give_up(failed: Point, points: Sequence[Point]) -> None:
    """What takes too long or fails is not asked for more: points go coarse to fine."""
    same = [p for p in points if p.session is failed.session and p.method == failed.method]
    later = same[next(k for k, p in enumerate(same) if p is failed) + 1 :]
    for point in later:
        if not point.seconds and not point.row.failure:
            point.row.failure = f"not tried, for {failed.setting:g} {failed.row.failure}"


def _once(
    workers: Workers, point: Point, duration: float, expected: Array | None, folder: Path
) -> None:
    row = point.row
    if row.failure:
        return
    try:
        answer = _ask(workers, point.session, point.method, duration, point.setting, folder)
    except WorkerError as failed:
        row.failure = str(failed)
        return
    point.seconds.append(answer["cpu"])
    row.figures["evaluations"] = answer["evaluations"]
    if expected is not None:
        row.figures["error"] = float(np.abs(np.fromfile(folder / "q") - expected).max())


def _settle(point: Point, duration: float) -> None:
    if point.seconds and not point.row.failure:
        point.row.figures["seconds"] = float(np.median(point.seconds))
        point.row.figures["seconds_spread"] = list(quartiles(point.seconds))
        point.row.figures["duration"] = duration


def time_at(rows: Sequence[Row], error: float) -> float | None:
    """Seconds for that error: between the two nearest of the points that no other one beats.

    Straight in the logarithms of time and error; None where the points do not reach that far.
    """
    found = [(r.figures["error"], r.figures["seconds"]) for r in rows if counts(r)]
    front: list[tuple[float, float]] = []  # ever smaller errors, ever longer times
    for e, seconds in sorted(found, key=lambda pair: (pair[1], pair[0])):
        if not front or e < front[-1][0]:
            front.append((e, seconds))
    tight = next((k for k, (e, _) in enumerate(front) if e <= error), None)
    if tight is None:
        return None
    if tight == 0:
        return front[0][1]
    (e0, t0), (e1, t1) = front[tight - 1], front[tight]
    part = np.log(error / e0) / np.log(e1 / e0)
    return float(t0 * (t1 / t0) ** part)


def counts(row: Row) -> bool:
    """Whether it is a point of a diagram: a time, and an error that is not zero by definition."""
    return "error" in row.figures and "seconds" in row.figures and row.figures["error"] > 0
