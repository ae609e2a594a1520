"""Closed loops of growing size: time of an evaluation, and memory.

    python -m benchmarks closed_loops [-o DIR]

Three kinds of machines, each in a process of its own. A mooring chain is held at both ends, which
is one loop, and compared with the same chain held at one end, in turns in the same process. Rows
of four-bar linkages are the benchmark A02 of the IFToMM. A net of n x n knots has rods between
neighbours and ball joints at both ends of each, and hangs by a corner; its coordinates follow a
tree along one side and down all columns, and a rod that crosses closes a loop. Nets are evaluated
by the recursion along their loops, by the sparse factor of all joint constraint forces, and by
conjugate gradients to 1e-8, with torques in all joints, drawn at random, which the slowest modes
take part in; doubled: five of their joints are there twice. Writes closed_loops.json and
closed_loops.md.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from typing import Any

import numpy as np

import linkwise as lw
from benchmarks import study
from benchmarks.timing import timed

CASES = [
    *(("chain of hinges", n) for n in (1_000, 100_000)),
    *(("chain of ball joints", n) for n in (1_000, 100_000)),
    *(("row of four-bars", n) for n in (10, 100, 1_000, 10_000)),
    *(("net, recursion", n) for n in (4, 8, 16, 32)),
    *(("net, sparse factor", n) for n in (4, 8, 16, 32, 100)),
    *(("net, iteration", n) for n in (4, 8, 16, 32, 100)),
    *((f"doubled net, {by}", n) for by in ("sparse factor", "iteration") for n in (32, 100)),
]
#: Of nets.
WAYS: dict[str, dict[str, Any]] = {
    "recursion": {"method": "articulated_body"},
    "sparse factor": {"method": "constraint_force"},
    "iteration": {
        "method": "constraint_force",
        "solver": "conjugate_gradient",
        "tolerance": 1e-8,
    },
}
DOUBLED = 5
DOWN = (0.0, 0.0, -9.81)
SLENDER = np.diag([1e-3, 1 / 12, 1 / 12])


def chain(n: int, joint: str, *, held: bool) -> lw.Model:
    """Rods of 1 m, straight."""
    builder = lw.ModelBuilder("chain", gravity=DOWN)
    builder.add_link("ground")
    axis = (0, 1, 0) if joint == "revolute" else None
    for k in range(n):
        builder.add_link(f"rod_{k}", mass=1.0, com=(0.5, 0, 0), inertia=SLENDER)
        parent, at = (f"rod_{k - 1}", 1.0) if k else ("ground", 0.0)
        builder.add_joint(f"J{k}", joint, parent, f"rod_{k}", translation=(at, 0, 0), axis=axis)
    if held:
        last, far = f"rod_{n - 1}", (float(n), 0.0, 0.0)
        at_end = (1.0, 0.0, 0.0)
        builder.add_loop(
            "anchor", joint, last, "ground", translation=at_end, child_translation=far, axis=axis
        )
    return builder.build()


def net(n: int, doubled: int = 0) -> lw.Model:
    """doubled: so many of the joints that close loops are there twice."""
    builder = lw.ModelBuilder("net", gravity=DOWN)
    builder.add_link("ground")
    for i in range(n):
        for j in range(n):
            builder.add_link(f"knot_{i}_{j}", mass=0.5, inertia=0.01 * np.eye(3))
    builder.add_joint("corner", "spherical", "ground", "knot_0_0")
    for i in range(n):
        for j in range(n):
            for along, (k, m) in enumerate(((i, j + 1), (i + 1, j))):
                if k == n or m == n:
                    continue
                name, point = f"rod_{i}_{j}_{along}", np.eye(3)[along]
                turned = SLENDER if along == 0 else SLENDER[[1, 0, 2]][:, [1, 0, 2]]
                builder.add_link(name, mass=1.0, com=point / 2, inertia=turned)
                builder.add_joint(f"start_{name}", "spherical", f"knot_{i}_{j}", name)
                add = builder.add_loop if along == 0 and i > 0 else builder.add_joint
                add(f"end_{name}", "spherical", name, f"knot_{k}_{m}", translation=point)
                if along == 0 and i > 0 and doubled > 0:
                    doubled -= 1
                    add(f"twin_{name}", "spherical", name, f"knot_{k}_{m}", translation=point)
    return builder.build()


def shortest(calls: list[Callable[[], Any]], rounds: int) -> list[float]:
    """Seconds of each, in turns."""
    best = [np.inf] * len(calls)
    for _ in range(rounds):
        for k, call in enumerate(calls):
            best[k] = min(best[k], timed(call)[1].seconds)
    return best


def evaluation(model: lw.Model, q: Any, v: Any, tau: Any = None, **way: Any) -> Callable[[], Any]:
    method = lw.DynamicsMethod(model, **way)
    return lambda: method.evaluate(0.0, q, v, tau)


def measure(kind: str, n: int) -> dict[str, Any]:
    empty = study.peak_bytes()
    calls = []
    tau, way = None, {}
    if kind.startswith("chain"):
        joint = "revolute" if "hinges" in kind else "spherical"
        model = chain(n, joint, held=True)
        free = chain(n, joint, held=False)
        calls.append(evaluation(free, free.neutral_configuration(), np.zeros(free.nv)))
        state = model.neutral_configuration(), np.zeros(model.nv)
    elif "net" in kind:
        model = net(n, DOUBLED if "doubled" in kind else 0)
        state = model.neutral_configuration(), np.zeros(model.nv)
        tau = np.random.default_rng(1).normal(size=model.nv)
        way = WAYS[kind.split(", ")[1]]
    else:
        start = lw.scenes.benchmark("four_bars", n=n)
        model, state = start.model, (start.q0, start.v0)
    calls.insert(0, evaluation(model, *state, tau, **way))
    seconds = shortest(calls, 3 if "net" in kind and n > 16 else 20)
    report = calls[0]()[2]
    if report.outcome != "converged":
        raise SystemExit(f"{kind} of {n}: {report.outcome}")
    return {
        "kind": kind,
        "n": n,
        "bodies": model.n_bodies,
        "loops": model.n_loops,
        "seconds": seconds[0],
        "open_seconds": seconds[1] if len(seconds) > 1 else None,
        "iterations": report.iterations,
        "bytes": study.peak_bytes() - empty,
    }


COLUMNS: study.Columns = {
    "machine": lambda r: (
        f"{r['kind']}, {r['n']:,}" + (f" x {r['n']}" if "net" in r["kind"] else "")
    ),
    "bodies": lambda r: f"{r['bodies']:,}",
    "loops": lambda r: f"{r['loops']:,}",
    "evaluation": lambda r: f"{1e3 * r['seconds']:.3g} ms",
    "per body": lambda r: f"{1e6 * r['seconds'] / r['bodies']:.2g} µs",
    "over the open chain": lambda r: (
        f"{r['seconds'] / r['open_seconds']:.1f}" if r["open_seconds"] else ""
    ),
    "iterations": lambda r: f"{r['iterations']:,}" if r["iterations"] else "",
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
    rows = [study.in_own_process("closed_loops", "--case", *case) for case in CASES]
    study.write(asked.output, "closed_loops", study.table(rows, COLUMNS), rows)
