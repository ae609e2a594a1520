"""One forward dynamics of a chain of a million links: time and memory a link, by method.

    python benchmarks/million_links.py [--links N]

A chain of rods, hinges about x and y in turn, bent a little everywhere. Each method runs in a
process of its own, so that the memory is its own: that of the model, and that of the process at
its peak, method, state and joint loads included. The accelerations must agree.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from typing import Any

import numpy as np

import linkwise as lw

METHODS: dict[str, dict[str, Any]] = {
    "auto": {},
    "articulated_body": {"method": "articulated_body"},
    "constraint_force, thomas": {"method": "constraint_force", "solver": "thomas"},
}
#: Random torques of every joint [N m] accelerate the chain without gravity.
SEED, BEND = 1993, 0.01
AGREEMENT = 1e-9


def used() -> int:
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def evaluate(name: str, n: int) -> dict[str, Any]:
    empty, started = used(), time.perf_counter()
    model = lw.scenes.chain(n, gravity=(0, 0, 0))
    built, with_model = time.perf_counter() - started, used()
    rng = np.random.default_rng(SEED)
    q, tau = BEND * rng.standard_normal(model.nq), rng.standard_normal(model.nv)
    started = time.perf_counter()
    found = lw.forward_dynamics(model, q, np.zeros(model.nv), tau, full=True, **METHODS[name])
    seconds = time.perf_counter() - started
    if found.report.outcome != "converged":
        raise SystemExit(f"{name}: {found.report.outcome}")
    return {
        "method": name,
        "build_seconds": built,
        "seconds": seconds,
        "model_bytes": (with_model - empty) / n,
        "bytes": (used() - empty) / n,
        "accelerations": found.acceleration[:: max(1, n // 1000)].tolist(),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--links", type=int, default=1_000_000)
    parser.add_argument("--method", choices=METHODS, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.method:
        print(json.dumps(evaluate(arguments.method, arguments.links)))
        return
    rows = []
    for name in METHODS:
        command = [sys.executable, __file__, "--links", str(arguments.links), "--method", name]
        rows.append(json.loads(subprocess.check_output(command, text=True)))
    expected = np.array(rows[0]["accelerations"])
    print("| method | model built in | evaluated in | bytes a link, model | in all | deviation |")
    print("|---|---:|---:|---:|---:|---:|")
    for row in rows:
        off = float(np.abs(row["accelerations"] - expected).max() / np.abs(expected).max())
        print(
            f"| {row['method']} | {row['build_seconds']:.1f} s | {row['seconds']:.2f} s | "
            f"{row['model_bytes']:.0f} | {row['bytes']:.0f} | {off:.0e} |"
        )
        if off > AGREEMENT:
            raise SystemExit(f"{row['method']} differs from {rows[0]['method']}")


if __name__ == "__main__":
    main()
