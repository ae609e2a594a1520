"""What is aimed at, and how far a run is from it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from benchmarks.cases.simulation import time_at
from benchmarks.machine import ROBOTS
from benchmarks.rows import Row, best
from benchmarks.sessions import CPP, PYTHON

ERRORS = (1e-6, 1e-8, 1e-10)
AUTO_MARGIN = 1.2


@dataclass(frozen=True)
class Target:
    work: str
    aim: float
    unit: str
    measured: float | None
    at_least: bool = True  # else at most
    note: str = ""

    @property
    def reached(self) -> bool | None:
        if self.measured is None:
            return None
        return self.measured >= self.aim if self.at_least else self.measured <= self.aim


NO_LOADS = "auto, no loads"


def targets(rows: Sequence[Row]) -> list[Target]:
    """Ours always with the loads of all joints, but for the one aim that says otherwise."""
    whole = [row for row in rows if row.method != NO_LOADS]
    made: list[Target] = []
    for group in _GROUPS:
        made += group(rows if group is _from_python else whole)
    return made


def _pick(rows: Iterable[Row], **wanted: object) -> list[Row]:
    return [r for r in rows if all(getattr(r, key) == value for key, value in wanted.items())]


def _one(rows: Iterable[Row], **wanted: object) -> Row | None:
    return best(_pick(rows, **wanted))


def _quotient(upper: Row | None, lower: Row | None) -> float | None:
    if upper is None or lower is None or not upper.ns_per_body or not lower.ns_per_body:
        return None
    return upper.ns_per_body / lower.ns_per_body


def _single(rows: Sequence[Row]) -> list[Target]:
    made = []
    for method, aim in (("articulated_body", 3.5), ("constraint_force + thomas", 2.2)):
        for n in (7, 30):
            here = _pick(rows, case="single", arena=CPP, n_bodies=n)
            ratio = _quotient(_one(here, engine="pinocchio"), _one(here, method=method))
            work = f"one system, one core, N = {n}, {method}"
            made.append(Target(work, aim, "times Pinocchio's speed", ratio))
    peer = _one(rows, case="single", arena=CPP, n_bodies=300, engine="pinocchio")
    for n, aim in ((300, 8.0), (3000, 10.0)):
        mine = _one(rows, case="single", arena=CPP, n_bodies=n, engine="linkwise")
        made.append(
            Target(
                f"one chain of {n}, one core, ns per body against Pinocchio's at 300",
                aim,
                "times",
                _quotient(peer, mine),
                note=f"by {mine.method}" if mine else "",
            )
        )
    thousand = _pick(rows, case="single", n_bodies=1000)
    peers = [r for r in thousand if r.engine in ("dart", "drake")]
    mine = _one(thousand, engine="linkwise", arena=CPP) or _one(thousand, engine="linkwise")
    work = "one chain of 1,000, one core, against the best of DART and Drake"
    return [*made, Target(work, 40.0, "times", _quotient(best(peers), mine))]


def _batch(rows: Sequence[Row]) -> list[Target]:
    made = []
    for machine in dict.fromkeys(row.machine for row in rows if row.case == "batch"):
        here = _pick(rows, case="batch", arena=CPP, machine=machine)
        ratio = _quotient(_one(here, engine="pinocchio"), _one(here, engine="linkwise"))
        work = f"batch of 7-joint arms ({machine}), one core, loads included"
        made.append(Target(work, 16.0, "times Pinocchio's speed", ratio))
    return made


def _robots(rows: Sequence[Row]) -> list[Target]:
    made = []
    for robot in ROBOTS:
        here = _pick(rows, case="robots", arena=CPP, machine=robot.name)
        if not here:
            continue
        ratio = _quotient(_one(here, engine="pinocchio"), _one(here, method="auto"))
        note = next((row.failure for row in here if not row.method), "")
        made.append(Target(robot.name, 2.5, "times Pinocchio's speed", ratio, note=note))
    return made


def _threads(rows: Sequence[Row]) -> list[Target]:
    two = [r for r in rows if r.case == "threads" and r.threads == 2 and r.n_bodies >= 1000]
    two = [r for r in two if r.arena == CPP] or two
    made = []
    for row in two:
        same = row.figures.get("same_bits")
        note = {True: "same bits", False: "other bits", None: ""}[same]
        speedup = row.figures.get("speedup")
        work = f"two threads on one chain of {row.n_bodies:,}"
        made.append(Target(work, 1.8, "times one thread's speed", speedup, note=note))
    if not made:
        reason = next((r.failure for r in rows if r.case == "threads" and r.failure), "")
        work = "two threads on one chain, N >= 1,000"
        made.append(Target(work, 1.8, "times one thread's speed", None, note=reason))
    return made


def _memory(rows: Sequence[Row]) -> list[Target]:
    mine = _pick(rows, case="memory", engine="linkwise")
    short, made = _one(mine, n_bodies=1000), []
    for n in (100_000, 1_000_000):
        row = _one(mine, n_bodies=n)
        held = row.figures.get("bytes_per_body") if row else None
        made += [
            Target(
                f"a chain of {n:,}, ns per body",
                1.3,
                "times those at 1,000",
                _quotient(row, short),
                at_least=False,
            ),
            Target(f"a chain of {n:,}, memory", 2000.0, "bytes per body", held, at_least=False),
        ]
    return made


def _from_python(rows: Sequence[Row]) -> list[Target]:
    made = []
    for method, what in (
        (NO_LOADS, "accelerations"),
        ("auto", "accelerations, loads and a report"),
    ):
        here = _pick(rows, case="single", n_bodies=7, engine="linkwise", method=method)
        python, cpp = _one(here, arena=PYTHON), _one(here, arena=CPP)
        more = None
        if python and cpp and python.ns_per_body and cpp.ns_per_body:
            more = (python.ns_per_body - cpp.ns_per_body) * 7 / 1000
        work = f"{what} of a 7-joint arm from Python, above the C++ call"
        made.append(Target(work, 1.5, "us", more, at_least=False))
    return made


def _simulation(rows: Sequence[Row]) -> list[Target]:
    made = []
    for machine in dict.fromkeys(row.machine for row in rows if row.case == "simulation"):
        here = _pick(rows, case="simulation", machine=machine)
        for error in ERRORS:
            mine = fastest(here, error, ours=True)
            peer = fastest(here, error, ours=False)
            made.append(
                Target(
                    f"whole simulation of a {machine} to an error of {error:.0e} rad",
                    5.0,
                    "times the best peer's speed",
                    peer[1] / mine[1] if mine and peer else None,
                    note=f"{mine[0]} against {peer[0]}" if mine and peer else "",
                )
            )
    return made


def fastest(rows: Sequence[Row], error: float, *, ours: bool) -> tuple[str, float] | None:
    """The integrator that needs the least time for that error, and its seconds."""
    methods: dict[str, list[Row]] = {}
    for row in rows:
        if (row.engine == "linkwise") == ours:
            methods.setdefault(f"{row.engine} {row.method}", []).append(row)
    times = {name: time_at(group, error) for name, group in methods.items()}
    known = {name: seconds for name, seconds in times.items() if seconds is not None}
    return min(known.items(), key=lambda item: item[1]) if known else None


def _auto(rows: Sequence[Row]) -> list[Target]:
    """The automatic choice against the best of the others, at its worst over all machines."""
    worst: tuple[float, str] | None = None
    mine = [r for r in rows if r.case in ("single", "robots") and r.arena == CPP and r.measured]
    mine = [r for r in mine if r.engine == "linkwise" and r.threads == 1]
    for machine in dict.fromkeys(row.machine for row in mine):
        here = _pick(mine, machine=machine)
        ratio = _quotient(_one(here, method="auto"), best(here))
        if ratio is not None and (worst is None or ratio > worst[0]):
            worst = ratio, machine
    return [
        Target(
            'method "auto", at its worst',
            AUTO_MARGIN,
            "times the best method's time",
            worst[0] if worst else None,
            at_least=False,
            note=f"on {worst[1]}" if worst else "",
        )
    ]


def _iterations(_rows: Sequence[Row]) -> list[Target]:
    work = "J-CG iterations on the paper's arm at 1e-7, planar and spatial"
    return [Target(work, 5.0, "", None, at_least=False, note="`linkwise paper` counts them")]


_GROUPS: tuple[Callable[[Sequence[Row]], list[Target]], ...] = (
    _single,
    _batch,
    _robots,
    _threads,
    _memory,
    _from_python,
    _simulation,
    _auto,
    _iterations,
)
