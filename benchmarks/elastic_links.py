"""Chains and nets of elastic links: iterations of conjugate gradients, and what bounds them.

    python -m benchmarks elastic_links [-o DIR]

Chains of equal beams, of six coordinates each, on hinges about parallel or crossed axes, on ball
joints, or welded, at a random position near the straight one; nets of lw.scenes.net, held at the
corners. Torques are drawn at random in all coordinates, so that every mode takes part. Iterations
are to 1e-7, times those of the processor. The bound and the spectrum are those of graph_spectrum;
the largest machines have none measured. Writes elastic_links.json and elastic_links.md.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

import linkwise as lw
from benchmarks import study
from benchmarks.timing import timed
from linkwise import _core

AXES = {"hinges, parallel axes": "zz", "hinges, crossed axes": "zy"}
JOINTS = {"ball joints": "spherical", "welds": "fixed"}
CASES = [
    *((kind, n) for kind in (*AXES, *JOINTS) for n in (8, 96, 1_000, 10_000, 100_000)),
    *(("net", n) for n in (8, 16, 32, 64, 100)),
]
#: A spectrum takes some 30 iterations, on one core.
MOST_MEASURED = 10_000
TOLERANCE = 1e-7
METHODS: dict[str, dict[str, Any]] = {
    "iteration": {
        "method": "constraint_force",
        "solver": "conjugate_gradient",
        "tolerance": TOLERANCE,
    },
    "factor": {"method": "constraint_force", "solver": "thomas"},
    "recursion": {"method": "articulated_body"},
}


def chain(kind: str, n: int) -> lw.Model:
    builder = lw.ModelBuilder("chain")
    builder.add_link("base")
    for i in range(n):
        builder.add_link(f"link{i}", mass=1.0)
        parent, x = (f"link{i - 1}", 1.0) if i else ("base", 0.0)
        given: dict[str, Any] = {"translation": (x, 0, 0)}
        if kind in AXES:
            given["axis"] = {"z": (0, 0, 1), "y": (0, 1, 0)}[AXES[kind][i % 2]]
        builder.add_joint(f"joint{i}", JOINTS.get(kind, "revolute"), parent, f"link{i}", **given)
    for i in range(n):
        builder.make_flexible(
            f"link{i}",
            section=lw.Section.round(0.04),
            E=70e9,
            G=26e9,
            density=2700,
            interior_modes=0,
            end=(1, 0, 0),
        )
    return builder.build()


def measure(kind: str, n: int) -> dict[str, Any]:
    empty = study.peak_bytes()
    rng = np.random.default_rng(n)
    if kind == "net":
        model = lw.scenes.net(n, n)
        q = model.initial_configuration()
    else:
        model = chain(kind, n)
        q = 5e-4 * rng.normal(size=model.nq)
    v, tau = np.zeros(model.nv), rng.normal(size=model.nv)
    row: dict[str, Any] = {"kind": kind, "n": n, "beams": len(model.beam_lengths)}
    if row["beams"] <= MOST_MEASURED:
        found = _core.graph_spectrum(model, q)
        row |= {
            "unknowns": found.unknowns,
            "bound": found.bound,
            "spectrum": (found.found.smallest, found.found.largest),
            "most": found.iterations(TOLERANCE),
        }
    for name, given in METHODS.items():
        if kind == "net" and name == "recursion" and n > 16:
            continue
        method = lw.DynamicsMethod(model, **given)
        results = [timed(partial(method.evaluate, 0.0, q, v, tau)) for _ in range(3)]
        report: Any = results[-1][0][2]
        ended = report.outcome == "converged"
        row[name] = min(spent.cpu for _, spent in results) if ended else report.outcome
        if name == "iteration":
            row["iterations"] = report.iterations
    return {**row, "bytes": study.peak_bytes() - empty}


def _interval(row: dict[str, Any], name: str) -> str:
    return "[{:.3f}, {:.3f}]".format(*row[name]) if name in row else ""


def _time(name: str) -> Callable[[dict[str, Any]], str]:
    def cell(row: dict[str, Any]) -> str:
        value = row.get(name, "")
        return value if isinstance(value, str) else f"{1e3 * value:.3g} ms"

    return cell


COLUMNS: study.Columns = {
    "machine": lambda r: f"{r['kind']}, {r['n']:,}" + (f" x {r['n']}" * (r["kind"] == "net")),
    "beams": lambda r: f"{r['beams']:,}",
    "unknowns": lambda r: f"{r['unknowns']:,}" if "unknowns" in r else "",
    "bound": lambda r: _interval(r, "bound"),
    "spectrum": lambda r: _interval(r, "spectrum"),
    "iterations": lambda r: r["iterations"],
    "at most": lambda r: f"{r['most']:.0f}" if "most" in r else "",
    **{name: _time(name) for name in METHODS},
    "memory": lambda r: f"{r['bytes'] / 2**20:.0f} MiB",
}


def main() -> None:
    parser = study.parser(__doc__)
    parser.add_argument("--case", nargs=2, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.case:
        kind, n = asked.case
        print(json.dumps(measure(kind, int(n))))
        return
    rows = [study.in_own_process("elastic_links", "--case", *case) for case in CASES]
    study.write(asked.output, "elastic_links", study.table(rows, COLUMNS), rows)
