"""One run: the cases asked for, and what becomes of their rows."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from linkwise._core import InputError
from linkwise.bench import plots
from linkwise.bench.cases.table import BY_NAME, CASES
from linkwise.bench.compiling import compile_worker, find_sources
from linkwise.bench.conditions import conditions
from linkwise.bench.pits import FULL, QUICK, Pits
from linkwise.bench.process import memory_limit
from linkwise.bench.report import markdown
from linkwise.bench.rows import Row
from linkwise.bench.targets import Target, targets


@dataclass(frozen=True)
class Result:
    rows: list[Row]
    targets: list[Target]
    conditions: dict[str, Any]

    @property
    def markdown(self) -> str:
        return markdown(self.rows, self.targets, self.conditions)

    def records(self) -> dict[str, Any]:
        """Plain data: conditions, rows, targets."""
        return {
            "conditions": self.conditions,
            "rows": [row.record() for row in self.rows],
            "targets": [{**asdict(t), "reached": t.reached} for t in self.targets],
        }


def check_cases(names: Sequence[str]) -> list[str]:
    """The cases of that name in their order, all without names; InputError for an unknown one."""
    for name in names:
        if name not in BY_NAME:
            raise InputError(f"case {name!r} is unknown; known: {', '.join(BY_NAME)}")
    return [case.name for case in CASES if not names or case.name in names]


def run_bench(
    *,
    quick: bool = False,
    cases: Sequence[str] = (),
    sources: Path | None = None,
    build: Path | None = None,
    say: Callable[[str], object] = lambda message: None,
) -> Result:
    """Measures; `say` gets a line now and then.

    Args:
        quick: under a minute, with few repeats; takes the C++ side only if it is compiled already.
        cases: names of `linkwise.bench.cases.table`; all when empty.
        sources: the repository whose benchmarks/cpp is compiled; found by itself when None.
        build: where; a cache folder when None.
    """
    chosen = check_cases(cases)
    compiled = compile_worker(sources=sources, build=build, only_if_ready=quick, say=say)
    if compiled.reason:
        say(f"no C++ side: {compiled.reason}")
    memory = memory_limit()
    found = conditions(compiled, memory, sources or find_sources())
    for name in found["missing"]:
        say(f"{name} is not installed")
    rows: list[Row] = []
    effort = QUICK if quick else FULL
    with Pits(memory, compiled.program, effort, say, compiled.engines) as pits:
        for name in chosen:
            rows += BY_NAME[name].run(pits)
    return Result(rows, targets(rows), found)


def write(result: Result, folder: Path) -> list[Path]:
    """bench.json, bench.md, and the figures where matplotlib is installed."""
    folder.mkdir(parents=True, exist_ok=True)
    written = [folder / "bench.json", folder / "bench.md"]
    text = json.dumps(_finite(result.records()), indent=1, allow_nan=False)
    written[0].write_text(text + "\n")
    written[1].write_text(result.markdown)
    return [*written, *(plots.draw(result.rows, folder) if plots.available() else [])]


def read(path: Path) -> Result:
    """What `write` wrote to bench.json."""
    stored = json.loads(path.read_text())
    rows = [Row.of(record) for record in stored["rows"]]
    return Result(rows, targets(rows), stored["conditions"])


def _finite(value: Any) -> Any:
    """JSON has no infinities; six digits are more than any of these numbers is worth."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    if isinstance(value, float):
        return float(f"{value:.6g}") if math.isfinite(value) else None
    return value
