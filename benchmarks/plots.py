"""The figures of a run, as SVG; nothing where matplotlib is not installed."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module, util
from pathlib import Path
from typing import Any

from benchmarks.cases.simulation import counts
from benchmarks.report import NAMES
from benchmarks.rows import Row
from benchmarks.sessions import CPP

COLOURS = {
    "linkwise": "#0b6e4f",
    "pinocchio": "#c1666b",
    "mujoco": "#4281a4",
    "dart": "#d4b483",
    "drake": "#7d5ba6",
}
_MARKERS = "os^vDP*X"


def available() -> bool:
    return util.find_spec("matplotlib") is not None


def draw(rows: Sequence[Row], folder: Path) -> list[Path]:
    matplotlib: Any = import_module("matplotlib")
    matplotlib.use("Agg")
    # The same run gives the same file.
    matplotlib.rcParams.update({"svg.hashsalt": "linkwise", "svg.fonttype": "none"})
    pyplot: Any = import_module("matplotlib.pyplot")
    drawn = []
    for name, make in (("single", _by_size), ("robots", _bars), ("batch", _bars)):
        here = [row for row in rows if row.case == name and row.measured]
        if here:
            drawn.append(_save(pyplot, folder / f"{name}.svg", make(pyplot, here)))
    simulated = [row for row in rows if row.case == "simulation" and counts(row)]
    for number, machine in enumerate(dict.fromkeys(row.machine for row in simulated)):
        here = [row for row in simulated if row.machine == machine]
        figure = _work_precision(pyplot, here)
        drawn.append(_save(pyplot, folder / f"simulation_{number + 1}.svg", figure))
    return drawn


def _save(pyplot: Any, path: Path, figure: Any) -> Path:
    figure.savefig(path, metadata={"Date": None}, bbox_inches="tight")
    pyplot.close(figure)
    return path


def _contestants(rows: Sequence[Row]) -> dict[tuple[str, str], list[Row]]:
    """C++ where an engine has it, Python elsewhere."""
    compiled = {row.engine for row in rows if row.arena == CPP}
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        if (row.arena == CPP) == (row.engine in compiled):
            groups.setdefault((row.engine, row.method), []).append(row)
    return groups


def _style(engine: str, number: int) -> dict[str, Any]:
    width = 2.0 if engine == "linkwise" else 1.2
    return {"color": COLOURS.get(engine), "marker": _MARKERS[number % 8], "lw": width, "ms": 5}


def _by_size(pyplot: Any, rows: Sequence[Row]) -> Any:
    figure, axes = pyplot.subplots(figsize=(8, 5))
    seen: dict[str, int] = {}
    for (engine, method), group in _contestants(rows).items():
        seen[engine] = seen.get(engine, -1) + 1
        axes.loglog(
            [row.n_bodies for row in group],
            [row.ns_per_body for row in group],
            label=f"{NAMES[engine]} {method}",
            **_style(engine, seen[engine]),
        )
    axes.set_xlabel("bodies")
    axes.set_ylabel("ns per body")
    return _finish(figure, axes, "One forward-dynamics evaluation")


def _bars(pyplot: Any, rows: Sequence[Row]) -> Any:
    machines = list(dict.fromkeys(row.machine for row in rows))
    groups = _contestants(rows)
    figure, axes = pyplot.subplots(figsize=(8, 4.5))
    width = 0.8 / max(1, len(groups))
    for k, ((engine, method), group) in enumerate(groups.items()):
        axes.bar(
            [machines.index(row.machine) + (k + 0.5) * width - 0.4 for row in group],
            [row.ns_per_body for row in group],
            width,
            color=COLOURS.get(engine),
            alpha=1 - 0.1 * (k % 5),
            label=f"{NAMES[engine]} {method}",
        )
    axes.set_yscale("log")
    axes.set_xticks(range(len(machines)), machines)
    axes.set_ylabel("ns per body")
    return _finish(figure, axes, "One forward-dynamics evaluation per state")


def _work_precision(pyplot: Any, rows: Sequence[Row]) -> Any:
    figure, axes = pyplot.subplots(figsize=(8, 5))
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row.engine, row.method), []).append(row)
    seen: dict[str, int] = {}
    for (engine, method), group in groups.items():
        seen[engine] = seen.get(engine, -1) + 1
        points = sorted((r.figures["error"], r.figures["seconds"]) for r in group)
        axes.loglog(
            [error for error, _ in points],
            [1e3 * seconds for _, seconds in points],
            label=f"{NAMES[engine]} {method}",
            **_style(engine, seen[engine]),
        )
    axes.set_xlabel("error of the end position [rad]")
    axes.set_ylabel("time [ms]")
    axes.invert_xaxis()
    duration = rows[0].figures["duration"]
    return _finish(figure, axes, f"A {rows[0].machine}, {duration:g} s of motion")


def _finish(figure: Any, axes: Any, title: str) -> Any:
    axes.set_title(title)
    axes.grid(True, which="major", alpha=0.3)
    axes.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure
