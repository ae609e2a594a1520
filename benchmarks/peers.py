"""linkwise beside every other engine that is installed.

    python -m benchmarks peers [--quick] [--cases NAME,...] [-o DIR] [--json]

Some minutes; the first time it compiles the C++ side. `--quick` takes less than one: fewer machines
and repeats, and the C++ side only if an earlier run has compiled it.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchmarks import plots
from benchmarks.cases.table import BY_NAME, CASES
from benchmarks.compiling import compile_worker
from benchmarks.conditions import conditions
from benchmarks.process import memory_limit
from benchmarks.report import markdown
from benchmarks.rows import Row
from benchmarks.sessions import FULL, QUICK, Workers
from benchmarks.study import say
from benchmarks.targets import Target, targets
from linkwise import InputError


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
    build: Path | None = None,
    say: Callable[[str], object] = say,
) -> Result:
    """Measures; `say` gets a line now and then.

    Args:
        quick: under a minute, with few repeats; takes the C++ side only if it is compiled already.
        cases: names of `benchmarks.cases.table`; all when empty.
        build: where the C++ side is compiled; a cache folder when None.
    """
    chosen = check_cases(cases)
    compiled = compile_worker(build=build, only_if_ready=quick, say=say)
    if compiled.reason:
        say(f"no C++ side: {compiled.reason}")
    memory = memory_limit()
    found = conditions(compiled, memory)
    for name in found["missing"]:
        say(f"{name} is not installed")
    rows: list[Row] = []
    effort = QUICK if quick else FULL
    with Workers(memory, compiled.program, effort, say, compiled.engines) as workers:
        for name in chosen:
            rows += BY_NAME[name].run(workers)
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


def main() -> None:
    parser = argparse.ArgumentParser(description="linkwise beside the other engines.")
    parser.add_argument("--quick", action="store_true", help="under a minute")
    parser.add_argument("-o", "--output", type=Path, help="folder for table, data and figures")
    parser.add_argument("--cases", default="", help=f"some of {','.join(BY_NAME)}")
    parser.add_argument("--build", type=Path, help="where the C++ side is compiled")
    parser.add_argument("--json", action="store_true", help="all numbers instead of the table")
    asked = parser.parse_args()
    if asked.output is not None and asked.output.exists() and not asked.output.is_dir():
        raise InputError(f"--output: {asked.output} is no folder; give another name")
    cases = [name.strip() for name in asked.cases.split(",") if name.strip()]
    result = run_bench(quick=asked.quick, cases=cases, build=asked.build, say=say)
    if asked.output is not None:
        for path in write(result, asked.output):
            say(f"wrote {path}")
    if asked.json:
        print(json.dumps(_finite(result.records()), indent=1, allow_nan=False))
    else:
        print(result.markdown, end="")
