"""A run as Markdown: what was measured, what was aimed at, under which conditions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from benchmarks.cases.simulation import time_at
from benchmarks.cases.table import CASES
from benchmarks.rows import Row, best
from benchmarks.sessions import CPP
from benchmarks.targets import ERRORS, Target, fastest

NAMES = {
    "linkwise": "linkwise",
    "pinocchio": "Pinocchio",
    "mujoco": "MuJoCo",
    "dart": "DART",
    "drake": "Drake",
}


def significant(value: float, digits: int = 3) -> str:
    """1,234 and 0.0123: so many digits, never an exponent for what can be read without."""
    if value == 0:
        return "0"
    if abs(value) >= 10 ** (digits - 1):
        return f"{value:,.0f}"
    return f"{value:.{digits}g}" if abs(value) >= 1e-3 else f"{value:.1e}"


def table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    right = "|".join(["---", *["---:"] * (len(headings) - 1)])
    lines = ["| " + " | ".join(headings) + " |", f"|{right}|"]
    lines += ["| " + " | ".join(cells) + " |" for cells in rows]
    return "\n".join(lines)


def cell(row: Row | None) -> str:
    """Nanoseconds a body, half the quartiles' distance, time relative to ours."""
    if row is None:
        return ""
    if row.ns_per_body is None:
        return "failed"
    text = significant(row.ns_per_body)
    if row.spread:
        text += f" ± {50 * (row.spread[1] - row.spread[0]) / row.ns_per_body:.0f} %"
    return text + (f" ({significant(row.ratio, 2)})" if row.ratio is not None else "")


def _label(row: Row) -> str:
    loads = ", loads" if row.loads else ""
    name = NAMES.get(row.engine, row.engine)
    return f"{name} {row.method}{loads} [{row.arena}]" if row.method else name


def by_machine(rows: Sequence[Row]) -> str:
    """Contestants down, machines across; the C++ side first."""
    machines = list(dict.fromkeys(row.machine for row in rows if row.method))
    cells: dict[tuple[bool, str], dict[str, Row]] = {}
    for row in rows:
        if row.method:
            cells.setdefault((row.arena != CPP, _label(row)), {})[row.machine] = row
    ordered = sorted(cells, key=lambda key: key[0])
    lines = [
        [label, *(cell(cells[where, label].get(machine)) for machine in machines)]
        for where, label in ordered
    ]
    return table(["ns per body", *machines], lines)


def failures(rows: Sequence[Row]) -> str:
    """What is missing or failed, each reason once."""
    reasons: dict[tuple[str, str], list[str]] = {}
    for row in rows:
        if row.failure:
            machines = reasons.setdefault((_label(row), row.failure), [])
            if row.machine not in machines:
                machines.append(row.machine)
    return "\n".join(
        f"- {label}: {', '.join(filter(None, machines)) + ': ' if any(machines) else ''}{reason}"
        for (label, reason), machines in reasons.items()
    )


def _memory(rows: Sequence[Row]) -> str:
    lines = [
        [
            f"{row.n_bodies:,}",
            _label(row),
            cell(row),
            significant(row.figures["bytes_per_body"]) if row.measured else "failed",
            f"{row.figures['build_seconds']:.2f}" if row.measured else "",
        ]
        for row in rows
        if row.method
    ]
    return table(["bodies", "", "ns per body", "bytes per body", "built in s"], lines)


def _threads(rows: Sequence[Row]) -> str:
    bits = {True: "the same", False: "others", None: ""}
    lines = [
        [
            row.machine,
            f"{row.method} [{row.arena}]",
            cell(row),
            f"{row.figures['speedup']:.2f}" if "speedup" in row.figures else "",
            bits[row.figures.get("same_bits")],
        ]
        for row in rows
        if row.method
    ]
    return table(["machine", "", "ns per body", "speed", "bits"], lines)


def _simulation(rows: Sequence[Row]) -> str:
    parts = []
    for machine in dict.fromkeys(row.machine for row in rows):
        here = [row for row in rows if row.machine == machine and row.method]
        if not here:
            continue
        duration = next((r.figures["duration"] for r in here if "duration" in r.figures), 0.0)
        mine = {error: fastest(here, error, ours=True) for error in ERRORS}
        lines = []
        for label in dict.fromkeys(_label(row) for row in here):
            group = [row for row in here if _label(row) == label]
            cells = [_time_cell(time_at(group, e), mine[e]) for e in ERRORS]
            reached = [r.figures["error"] for r in group if "error" in r.figures]
            lines.append([label, *cells, f"{min(reached):.1e}" if reached else ""])
        headings = [f"ms for {error:.0e} rad" for error in ERRORS]
        parts.append(f"A {machine} for {duration:g} s:\n")
        parts.append(table(["", *headings, "smallest error"], lines) + "\n")
    return "\n".join(parts)


def _time_cell(seconds: float | None, mine: tuple[str, float] | None) -> str:
    if seconds is None:
        return "not reached"
    text = significant(1e3 * seconds)
    return text + (f" ({significant(seconds / mine[1], 2)})" if mine else "")


def target_table(targets: Sequence[Target]) -> str:
    words = {True: "reached", False: "**not reached**", None: "not measured"}
    lines = []
    for t in targets:
        sign = "≥" if t.at_least else "≤"
        found = "" if t.measured is None else significant(t.measured)
        lines.append([t.work, f"{sign} {t.aim:g} {t.unit}", found, words[t.reached], t.note])
    return table(["work", "aim", "measured", "", ""], lines)


def _conditions(found: dict[str, Any]) -> str:
    packages = ", ".join(f"{k} {v}" for k, v in found["packages"].items() if v)
    load = found["load_average"]
    busy = f", load average {load[0]:.1f}" if load else ""
    lines = [
        f"- {found['processor']}, {found['cores']} cores{busy}; {found['system']}",
        f"- linkwise {found['linkwise']}{at_commit(found)} (CPU target {found['cpu_target']}), "
        f"Python {found['python']}, {packages}",
    ]
    lines += [f"- {NAMES[name]}, C++: `{flags}`" for name, flags in found["flags"].items()]
    if found["no_cpp"]:
        lines.append(f"- no C++ side: {found['no_cpp']}")
    if found["missing"]:
        lines.append("- not installed: " + ", ".join(NAMES[name] for name in found["missing"]))
    return "\n".join(lines)


def at_commit(found: dict[str, Any]) -> str:
    return f" at {found['commit']}" if found.get("commit") else ""


_TABLES = {"memory": _memory, "threads": _threads, "simulation": _simulation}
_LEGEND = (
    "Processor time of one thread (of several: time of the clock); medians of turns taken in "
    "rotation within one run; ± half the distance of their quartiles; in "
    "brackets the time relative to linkwise's `auto` (batch: `batch`) from the same side, C++ or "
    "Python. Ours always finds the joint loads, peers where it says so; every call gets another "
    "state."
)


def markdown(rows: Sequence[Row], targets: Sequence[Target], conditions: dict[str, Any]) -> str:
    parts = ["# Benchmarks", _conditions(conditions), _LEGEND]
    for case in CASES:
        here = [row for row in rows if row.case == case.name]
        if not here:
            continue
        parts.append(f"## {case.title}")
        if any(row.method for row in here):
            parts.append(_TABLES.get(case.name, by_machine)(here).strip())
        if lost := failures(here):
            parts.append("Missing or failed:\n\n" + lost)
    parts += ["## Targets", target_table(targets)]
    return "\n\n".join(parts) + "\n"


#: Robots of the README's table; all are in the report.
_SHOWN = ("Panda", "Talos")


def short_table(rows: Sequence[Row]) -> str:
    """The README's: the fastest of every engine and our default, C++ where an engine has it."""
    wide = [r for r in rows if r.case == "single" or (r.case == "robots" and r.machine in _SHOWN)]
    machines = list(dict.fromkeys(row.machine for row in wide if row.measured))
    lines = []
    for engine, name in NAMES.items():
        mine = [r for r in wide if r.engine == engine]
        if engine == "linkwise":
            mine = [r for r in mine if r.method == "auto"]
            lines.append(["**linkwise**, loads of all joints included", *_cells(mine, machines)])
            batch = [r for r in rows if r.case == "batch" and r.engine == engine]
            if any(r.measured for r in batch):
                lines.append(["the same, per state of a batch", *_cells(batch, machines)])
        elif mine:
            python = "" if any(r.arena == CPP for r in mine) else ", from Python"
            lines.append([f"{name}{python}", *_cells(mine, machines)])
    return table(["ns per body", *machines], lines)


def _cells(rows: Sequence[Row], machines: Sequence[str]) -> list[str]:
    cells = []
    for machine in machines:
        here = [row for row in rows if row.machine == machine]
        inside = [row for row in here if row.arena == CPP]
        found = best(inside) or best(here)
        lost = "fails" if any(row.failure for row in here) else ""
        cells.append(significant(found.ns_per_body or 0) if found else lost)
    return cells
