"""Simulations of chains of 100,000 and 1,000,000 links: time, peak memory, and are they right?

    python benchmarks/huge_chains.py [-o benchmarks/results]

A chain of rods of 1 m and 1 kg, hinges about x and y in turn, is held out straight from its upper
end and let go. Its far end does not know of the hinge yet and falls freely, by g t^2 / 2; energy
stays what it was. The shorter chain is simulated for a second with error control, the longer one
for some steps of fixed size. Each runs in a process of its own, all loads of the last sample
included. Writes huge_chains.json and huge_chains.md.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

import linkwise as lw
from linkwise.record.provenance import versions

G = 9.81
CASES = {
    100_000: {"times": [0.0, 1.0], "step_tolerance": 1e-6},
    1_000_000: {"times": [0.0, 0.01], "integrator": "runge_kutta_4", "step": 2e-3},
}
#: What the process takes without any chain.
EMPTY = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def simulate(n: int) -> dict[str, Any]:
    options = CASES[n]
    started = time.perf_counter()
    model = lw.scenes.chain(n, gravity=(0, 0, -G))
    built = time.perf_counter() - started
    q0 = np.zeros(model.nq)
    q0[0] = np.pi / 2
    kept = ["position", "joint_load", "energy", "statistics"]
    started, processor = time.perf_counter(), time.process_time()
    run = lw.simulate(model, q0=q0, quantities=kept, **options)
    seconds, processor = time.perf_counter() - started, time.process_time() - processor
    end = float(run.time[-1])
    # Against the start: a million turned frames in a row round the height by some 1e-5 m.
    tips = lw.link_poses(model, run.position.values[[0, -1]])[:, -1] @ [0, 0, -1.0, 1]
    energy = (run.kinetic_energy + run.potential_energy).values
    peak = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    evaluations = int(run.evaluations[-1])
    return {
        "links": n,
        "simulated_seconds": end,
        "integrator": options.get("integrator", "adams"),
        "steps": int(run.steps[-1]),
        "evaluations": evaluations,
        "build_seconds": built,
        "seconds": seconds,
        "processor_seconds": processor,
        "ns_per_body": processor / evaluations / n * 1e9,
        "peak_bytes_per_link": (peak - EMPTY) / n,
        "peak_bytes": peak,
        "tip_fell": tips[0, 2] - tips[1, 2],
        "free_fall": G * end**2 / 2,
        "energy_drift": float((energy[-1] - energy[0]) / run.kinetic_energy.values[-1]),
        "method": run.attrs["method"],
        "cpu_target": run.attrs["cpu_target"],
    }


def markdown(rows: list[dict[str, Any]]) -> str:
    heads = {
        "links": lambda r: f"{r['links']:,}",
        "simulated": lambda r: f"{r['simulated_seconds']:g} s, {r['integrator']}",
        "method": lambda r: r["method"],
        "steps, evaluations": lambda r: f"{r['steps']}, {r['evaluations']}",
        "model built in": lambda r: f"{r['build_seconds']:.2f} s",
        "simulated in": lambda r: f"{r['seconds']:.1f} s",
        "processor time, labels of the results included": lambda r: (
            f"{r['processor_seconds']:.0f} s"
        ),
        "peak memory": lambda r: f"{r['peak_bytes'] / 2**30:.2f} GiB",
        "bytes a link": lambda r: f"{r['peak_bytes_per_link']:.0f}",
        "tip fell": lambda r: f"{r['tip_fell']:.9g} m of {r['free_fall']:.9g} m",
        "energy drift": lambda r: f"{r['energy_drift']:.1e} of the kinetic energy",
    }
    lines = ["| | " + " | ".join(f"{r['links']:,} links" for r in rows) + " |"]
    lines.append("|---|" + "---:|" * len(rows))
    for head, show in list(heads.items())[1:]:
        lines.append(f"| {head} | " + " | ".join(show(r) for r in rows) + " |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path(__file__).parent / "results")
    parser.add_argument("--links", type=int, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.links:
        print(json.dumps(simulate(arguments.links)))
        return
    rows = []
    for n in CASES:
        done = subprocess.run(
            [sys.executable, __file__, "--links", str(n)],
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        )
        rows.append(json.loads(done.stdout))
    for row in rows:
        if abs(row["tip_fell"] - row["free_fall"]) > 1e-4 or abs(row["energy_drift"]) > 1e-4:
            raise SystemExit(f"{row['links']} links do not fall as they must: {row}")
    arguments.output.mkdir(parents=True, exist_ok=True)
    text = markdown(rows)
    (arguments.output / "huge_chains.json").write_text(
        json.dumps({"versions": versions(), "rows": rows}, indent=1) + "\n", encoding="utf-8"
    )
    (arguments.output / "huge_chains.md").write_text(
        f"{text}\n\n`python benchmarks/huge_chains.py`\n", encoding="utf-8"
    )
    print(text)


if __name__ == "__main__":
    main()
