"""The 1993 paper, computed again: its tables and figures, ours beside theirs [sharf1993]."""

from __future__ import annotations

import json
import os
import platform
import time as clock
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from linkwise import _core
from linkwise.base import json_value
from linkwise.io.writing import write_text
from linkwise.paper import chains, guesses, other_codes, spectra, spread, state_choice, table2
from linkwise.paper.claims import judge_all
from linkwise.paper.published import INTEGRATOR_TOLERANCE, TOLERANCE_RATIO
from linkwise.paper.report import render
from linkwise.paper.tables import tables
from linkwise.record.provenance import versions

__all__ = ["Step", "reproduce", "write_report"]


class Step(NamedTuple):
    """What is about to be computed, and how many of how many steps are done."""

    what: str
    done: int
    total: int


class _Counter:
    def __init__(self, total: int, progress: Callable[[Step], object] | None) -> None:
        self._done, self._total, self._progress = 0, total, progress

    def __call__(self, what: str) -> None:
        if self._progress is not None:
            self._progress(Step(what, self._done, self._total))
        self._done += 1


def reproduce(
    *, quick: bool = False, seed: int = 0, progress: Callable[[Step], object] | None = None
) -> dict[str, Any]:
    """All results as plain data. Times apart, they depend on `quick` and `seed` alone.

    `quick` keeps chains short and times rough: under a minute instead of some minutes.
    """
    started = clock.perf_counter()
    counts = (table2.count(), spread.count(), chains.count(quick), guesses.count(), 3)
    advance = _Counter(sum(counts), progress)
    results: dict[str, Any] = {
        "quick": quick,
        "seed": seed,
        "made_by": {
            "version": versions()["linkwise"],
            "cpu_target": _core.cpu_target,
            "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        },
        "table2": table2.table2(advance),
        "spread": spread.spread(advance),
        "other_codes": other_codes.other_codes(advance),
        "fig2": (fig2 := chains.fig2(quick, seed, advance)),
        "fig3": chains.fig3(fig2, seed, advance),
        "warm_start": guesses.warm_start(advance),
        "stop_tests": guesses.stop_tests(advance),
        "tolerance_ratios": guesses.tolerance_ratios(advance),
        "state_choice": state_choice.state_choice(advance),
    }
    advance("spectra")
    results["spectra"] = spectra.spectra()
    results["printed_formula"] = spectra.printed_formula(INTEGRATOR_TOLERANCE * TOLERANCE_RATIO)
    results["claims"] = judge_all(results)
    results["run_seconds"] = clock.perf_counter() - started
    plain: dict[str, Any] = json_value(results)
    return plain


def _as_text(results: dict[str, Any]) -> str:
    """JSON with one row of a table per line: small, and still good for diffs."""

    def dump(value: Any) -> str:
        return json.dumps(value, allow_nan=False)

    parts = []
    for key, value in results.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            text = "[\n" + ",\n".join("  " + dump(row) for row in value) + "\n ]"
        else:
            text = dump(value)
        parts.append(f" {dump(key)}: {text}")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def write_report(
    directory: str | os.PathLike[str],
    *,
    quick: bool = False,
    seed: int = 0,
    progress: Callable[[Step], object] | None = None,
) -> dict[str, Any]:
    """Compute everything and write index.html, tables.md and results.json to `directory`."""
    folder = Path(os.path.abspath(directory))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _core.InputError(
            f"{folder}: cannot be made a folder ({error.strerror}); name another"
        ) from None
    results = reproduce(quick=quick, seed=seed, progress=progress)
    write_text(folder / "results.json", _as_text(results))
    write_text(folder / "tables.md", tables(results))
    write_text(folder / "index.html", render(results))
    return results
