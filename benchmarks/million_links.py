"""One forward dynamics of a chain of a million links: time and memory per link, by method.

    python -m benchmarks million_links [--links N] [-o DIR]

A chain of rods, hinges about x and y in turn, bent a little everywhere. Each method runs in a
process of its own, so that the memory is its own: that of the model, and that of the process at
its peak, method, state and joint loads included. The accelerations must agree.
"""

from __future__ import annotations

import argparse
import json
from typing import Any

import numpy as np

import linkwise as lw
from benchmarks import study
from benchmarks.timing import timed

METHODS: dict[str, dict[str, Any]] = {
    "auto": {},
    "articulated_body": {"method": "articulated_body"},
    "constraint_force, thomas": {"method": "constraint_force", "solver": "thomas"},
}
#: Random torques of every joint [N m] accelerate the chain without gravity.
SEED, BEND = 1993, 0.01
AGREEMENT = 1e-9


def evaluate(name: str, n: int) -> dict[str, Any]:
    empty = study.peak_bytes()
    model, built = timed(lambda: lw.scenes.chain(n, gravity=(0, 0, 0)))
    with_model = study.peak_bytes()
    rng = np.random.default_rng(SEED)
    q, tau = BEND * rng.standard_normal(model.nq), rng.standard_normal(model.nv)
    state = q, np.zeros(model.nv), tau
    found, taken = timed(lambda: lw.forward_dynamics(model, *state, full=True, **METHODS[name]))
    if found.report.outcome != "converged":
        raise SystemExit(f"{name}: {found.report.outcome}")
    return {
        "method": name,
        "build_seconds": built.seconds,
        "seconds": taken.seconds,
        "model_bytes": (with_model - empty) / n,
        "bytes": (study.peak_bytes() - empty) / n,
        "accelerations": found.acceleration[:: max(1, n // 1000)].tolist(),
    }


COLUMNS: study.Columns = {
    "method": lambda r: r["method"],
    "model built in": lambda r: f"{r['build_seconds']:.1f} s",
    "evaluated in": lambda r: f"{r['seconds']:.2f} s",
    "bytes per link, model": lambda r: f"{r['model_bytes']:.0f}",
    "in all": lambda r: f"{r['bytes']:.0f}",
    "deviation": lambda r: f"{r['deviation']:.0e}",
}


def main() -> None:
    parser = study.parser(__doc__)
    parser.add_argument("--links", type=int, default=1_000_000)
    parser.add_argument("--method", choices=METHODS, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.method:
        print(json.dumps(evaluate(asked.method, asked.links)))
        return
    rows = [
        study.in_own_process("million_links", "--links", asked.links, "--method", name)
        for name in METHODS
    ]
    expected = np.array(rows[0]["accelerations"])
    for row in rows:
        found = np.array(row.pop("accelerations"))
        row["deviation"] = float(np.abs(found - expected).max() / np.abs(expected).max())
        if row["deviation"] > AGREEMENT:
            raise SystemExit(f"{row['method']} differs from {rows[0]['method']}")
    study.write(asked.output, "million_links", study.table(rows, COLUMNS), rows)
