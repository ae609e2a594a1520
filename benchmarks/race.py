"""Contestants that take turns on one machine."""

from __future__ import annotations

import hashlib
import itertools
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import coordinates
from benchmarks.engines.base import Offer
from benchmarks.machine import Array, Machine, States, random_states, write_machine
from benchmarks.process import WorkerError
from benchmarks.rows import Row, best, compare, settle
from benchmarks.sessions import CPP, PYTHON, Effort, Session, Workers

#: Relative to the largest acceleration of a state. Methods that factor the mass matrices of long
#: chains lose half of the digits or more: a matter of accuracy, not of another model.
AGREEMENT = 1e-4
REFERENCE = "articulated_body"

#: (engine, arena, what its worker offers) -> whether it takes part
Wanted = Callable[[str, str, Offer], bool]


@dataclass
class Entry:
    """A contestant, and how many turns it has."""

    row: Row
    session: Session
    systems: int
    wall: bool  # whether time is that of the clock on the wall
    calls: int = 0
    rounds: int = 0


def write_case(machine: Machine, states: States, folder: Path) -> None:
    """Everything that workers read. Peers with other coordinates convert them there."""
    write_machine(machine, folder)
    for engine in ("linkwise", "pinocchio"):
        states.write(folder / f"{engine}.states")


def race(
    workers: Workers,
    case: str,
    machine: Machine,
    *,
    states: int,
    wanted: Wanted,
    engines: Sequence[str] | None = None,
    arenas: Sequence[str] = (PYTHON, CPP),
    threads: bool = False,
) -> list[Row]:
    """One row for every contestant that is wanted, and for every failure."""
    rows: list[Row] = []
    with tempfile.TemporaryDirectory(prefix="linkwise-bench-") as name:
        folder = Path(name)
        drawn = random_states(machine, states)
        write_case(machine, drawn, folder)
        sessions: list[Session] = []
        entries: list[Entry] = []
        for engine in workers.engines:
            if engine.name != "linkwise" and not machine.bodies:
                continue
            if engines is not None and engine.name not in engines:
                continue
            for arena in (a for a in workers.arenas(engine) if a in arenas):
                session = Session(workers, engine, arena, folder, threads)
                sessions.append(session)
                entries += _enter(case, machine, session, rows, wanted)
        running = list(_that_agree(workers, machine, drawn, entries, folder))
        take_turns(workers.effort, running)
        for entry in running:
            if entry.row.measured and not entry.row.failure:
                _weigh(entry)
        for session in sessions:
            session.clear()
    for row in rows:
        if row.failure:
            workers.say(f"{row.machine}: {row.engine} ({row.arena}) {row.method} {row.failure}")
    for arena in (CPP, PYTHON):
        here = [row for row in rows if row.arena == arena]
        compare(here, ours(here))
    return rows


def ours(rows: list[Row]) -> Row | None:
    """What a user gets without asking for more."""
    mine = [row for row in rows if row.engine == "linkwise" and row.threads == 1]
    return best(r for r in mine if r.method == "auto") or best(mine)


def _enter(
    case: str, machine: Machine, session: Session, rows: list[Row], wanted: Wanted
) -> Iterator[Entry]:
    n = machine.n_bodies

    def row(method: str, **more: Any) -> Row:
        rows.append(Row(case, machine.name, n, session.engine.name, session.arena, method, **more))
        return rows[-1]

    if reason := session.too_big(n) or _unprepared(session, rows):
        row("", failure=reason)
        return
    try:
        built = session.build()
        session.weigh(n)
    except WorkerError as failed:
        session.failed(n)
        row("", failure=str(failed))
        return
    for offer in (Offer(**described) for described in built["contestants"]):
        if wanted(session.engine.name, session.arena, offer):
            made = row(offer.method, threads=offer.threads, loads=offer.loads)
            yield Entry(made, session, offer.systems, session.threads)


def _unprepared(session: Session, rows: list[Row]) -> str:
    """Why an engine's Python side could not write what its C++ side loads, or nothing."""
    if session.arena == PYTHON or not session.engine.prepared:
        return ""
    mine = (row for row in rows if row.engine == session.engine.name and row.arena == PYTHON)
    return next((row.failure for row in mine if not row.method), "")


def _that_agree(
    workers: Workers, machine: Machine, states: States, entries: list[Entry], folder: Path
) -> Iterator[Entry]:
    """Wrong answers are not timed."""
    found: dict[int, Array] = {}
    for k, entry in enumerate(entries):
        try:
            found[k] = _accelerations(workers.effort, machine, states, entry, folder)
        except WorkerError as failed:
            entry.row.failure = str(failed)
    chosen = [k for k in found if entries[k].row.method == REFERENCE] or list(found)
    if not chosen:
        return
    expected, judge = found[chosen[0]], entries[chosen[0]].row
    scale = np.abs(expected).max(axis=1)
    for k, values in found.items():
        error = float((np.abs(values - expected).max(axis=1) / scale).max())
        row = entries[k].row
        row.figures["deviation"] = error
        row.figures["digest"] = hashlib.sha256(values.tobytes()).hexdigest()[:16]
        if error <= AGREEMENT:
            yield entries[k]
        else:
            row.failure = (
                f"accelerations differ by {error:.1e} from those of {judge.engine} {judge.method}"
            )


def _accelerations(
    effort: Effort, machine: Machine, states: States, entry: Entry, folder: Path
) -> Array:
    file = folder / "accelerations"
    entry.session.ask("check", entry.row.method, str(file), timeout=effort.build)
    values = np.fromfile(file).reshape(states.count, -1)
    if entry.row.engine == "mujoco" and entry.row.arena == CPP and machine.floating:
        return coordinates.from_mujoco(states, values)
    return values


def _weigh(entry: Entry) -> None:
    """Memory of everything that the engine holds for this machine."""
    held = entry.session.held()
    entry.row.figures["bytes_per_body"] = held / entry.row.n_bodies
    entry.row.figures["build_seconds"] = entry.session.build_seconds


def take_turns(effort: Effort, entries: list[Entry]) -> None:
    for entry in entries:
        _calibrate(entry, effort)
    for turn in itertools.count():
        running = [entry for entry in entries if turn < entry.rounds]
        if not running:
            break
        for entry in running:
            _one_turn(entry, effort)
    for entry in entries:
        settle(entry.row)


def _seconds(entry: Entry, calls: int, timeout: float) -> float:
    """Of the processor where one thread works: on a busy machine others have it in between."""
    answer = entry.session.ask("time", entry.row.method, str(calls), timeout=timeout)
    return float(answer["seconds" if entry.wall else "cpu"])


def _calibrate(entry: Entry, effort: Effort) -> None:
    """How many calls make a turn, and how many turns the patience allows; warms up on the way."""
    calls, seconds = 1, 0.0
    try:
        while True:
            seconds = _seconds(entry, calls, effort.slowest)
            if seconds >= effort.turn / 4:
                break
            calls *= 4
    except WorkerError as failed:
        entry.row.failure = str(failed)
        return
    entry.calls = max(1, round(effort.turn * calls / seconds))
    affordable = int(effort.patience * calls / (seconds * entry.calls))
    entry.rounds = min(effort.rounds, max(effort.fewest_rounds, affordable))


def _one_turn(entry: Entry, effort: Effort) -> None:
    row = entry.row
    try:
        seconds = _seconds(entry, entry.calls, 10 * effort.slowest)
    except WorkerError as failed:
        row.failure = str(failed)
        entry.rounds = 0
        return
    row.samples.append(1e9 * seconds / (entry.calls * entry.systems * row.n_bodies))
