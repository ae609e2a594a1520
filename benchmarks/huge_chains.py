"""Simulations of chains of 100,000 and 1,000,000 links: time, peak memory, and are they right?

    python -m benchmarks huge_chains [-o DIR]

A chain of rods of 1 m and 1 kg, hinges about x and y in turn, is held out straight from its upper
end and let go. Its far end does not know of the hinge yet and falls freely, by g t^2 / 2; energy
stays what it was. The shorter chain is simulated for a second with error control, the longer one
for some steps of fixed size. Each runs in a process of its own, all loads of the last sample
included. Writes huge_chains.json and huge_chains.md.
"""

from __future__ import annotations

import argparse
import json
from typing import Any

import numpy as np

import linkwise as lw
from benchmarks import study
from benchmarks.timing import timed

G = 9.81
CASES: dict[int, dict[str, Any]] = {
    100_000: {"times": [0.0, 1.0], "numerics": lw.Numerics(step_tolerance=1e-6)},
    1_000_000: {"times": [0.0, 0.01], "numerics": {"integrator": "runge_kutta_4", "step": 2e-3}},
}
#: What the process takes without any chain.
EMPTY = study.peak_bytes()


def simulate(n: int) -> dict[str, Any]:
    options = CASES[n]
    model, built = timed(lambda: lw.scenes.chain(n, gravity=(0, 0, -G)))
    q0 = np.zeros(model.nq)
    q0[0] = np.pi / 2
    kept = ["position", "joint_load", "energy", "statistics"]
    run, taken = timed(lambda: lw.simulate(model, q0=q0, record=kept, **options))
    end = float(run.time[-1])
    # Against the start: a million turned frames in a row round the height by some 1e-5 m.
    tips = lw.link_poses(model, run.position.values[[0, -1]])[:, -1] @ [0, 0, -1.0, 1]
    energy = (run.kinetic_energy + run.potential_energy).values
    peak = study.peak_bytes()
    evaluations = int(run.evaluations[-1])
    return {
        "links": n,
        "simulated_seconds": end,
        "integrator": json.loads(run.attrs["options"])["integrator"],
        "steps": int(run.steps[-1]),
        "evaluations": evaluations,
        "build_seconds": built.seconds,
        "seconds": taken.seconds,
        "processor_seconds": taken.cpu,
        "ns_per_body": taken.cpu / evaluations / n * 1e9,
        "peak_bytes_per_link": (peak - EMPTY) / n,
        "peak_bytes": peak,
        "tip_fell": tips[0, 2] - tips[1, 2],
        "free_fall": G * end**2 / 2,
        "energy_drift": float((energy[-1] - energy[0]) / run.kinetic_energy.values[-1]),
        "method": run.attrs["method"],
    }


SHOWN: study.Columns = {
    "simulated": lambda r: f"{r['simulated_seconds']:g} s, {r['integrator']}",
    "method": lambda r: r["method"],
    "steps, evaluations": lambda r: f"{r['steps']}, {r['evaluations']}",
    "model built in": lambda r: f"{r['build_seconds']:.2f} s",
    "simulated in": lambda r: f"{r['seconds']:.1f} s",
    "processor time, labels of the results included": lambda r: f"{r['processor_seconds']:.0f} s",
    "peak memory": lambda r: f"{r['peak_bytes'] / 2**30:.2f} GiB",
    "bytes per link": lambda r: f"{r['peak_bytes_per_link']:.0f}",
    "tip fell": lambda r: f"{r['tip_fell']:.9g} m of {r['free_fall']:.9g} m",
    "energy drift": lambda r: f"{r['energy_drift']:.1e} of the kinetic energy",
}


def markdown(rows: list[dict[str, Any]]) -> str:
    """A column per chain."""
    columns: dict[str, Any] = {"": lambda line: line[0]}
    for k, row in enumerate(rows):
        columns[f"{row['links']:,} links"] = lambda line, k=k: line[1][k]
    lines = [(name, [show(row) for row in rows]) for name, show in SHOWN.items()]
    return study.table(lines, columns)


def main() -> None:
    parser = study.parser(__doc__)
    parser.add_argument("--links", type=int, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.links:
        print(json.dumps(simulate(asked.links)))
        return
    rows = [study.in_own_process("huge_chains", "--links", n) for n in CASES]
    for row in rows:
        if abs(row["tip_fell"] - row["free_fall"]) > 1e-4 or abs(row["energy_drift"]) > 1e-4:
            raise SystemExit(f"{row['links']} links do not fall as they must: {row}")
    study.write(asked.output, "huge_chains", markdown(rows), rows)
