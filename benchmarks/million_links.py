"""A chain of a million links: built, one forward dynamics a method, time and memory a link.

    python benchmarks/million_links.py [--links 1000000] [--json]

Memory is the process's resident size above what it was before the model, per link: with the model
alone, and at its highest (the builder's own copy, or the method's work space and results).
"""

from __future__ import annotations

import argparse
import json
import resource
import time
from pathlib import Path

import numpy as np

import linkwise as lw

METHODS = (
    {"method": "articulated_body"},
    {"method": "constraint_force", "solver": "thomas"},
)


def resident():
    """Bytes of memory that the process holds now."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize()


def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def measure(n):
    before = resident()
    start = time.perf_counter()
    model = lw.scenes.chain(n_bodies=n, joint="revolute")
    built = time.perf_counter() - start
    rows = [row("build", built, n, resident() - before, peak() - before)]
    rng = np.random.default_rng(0)
    # Gently bent and turning: a chain of a million joints of random angles is a ball of yarn.
    q, v, tau = rng.uniform(-0.1, 0.1, (3, model.nv))
    answers = {}
    for options in METHODS:
        start = time.perf_counter()
        answers[options["method"]] = lw.forward_dynamics(model, q, v, tau, **options)
        taken = time.perf_counter() - start
        rows.append(row(options["method"], taken, n, resident() - before, peak() - before))
    first, second = answers.values()
    residual = lw.inverse_dynamics(model, q, v, first) - tau
    static = lw.inverse_dynamics(model, q, 0 * v, 0 * v)  # what it takes to hold the chain still
    return {
        "links": n,
        "stages": rows,
        "methods_differ_by": float(np.abs(first - second).max() / np.abs(first).max()),
        "torque_residual": float(np.abs(residual).max() / np.abs(static).max()),
    }


def row(stage, seconds, n, held, highest):
    return {
        "stage": stage,
        "seconds": seconds,
        "ns_per_link": 1e9 * seconds / n,
        "bytes_per_link_held": held / n,
        "bytes_per_link_at_peak": highest / n,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--links", type=int, default=1_000_000)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    result = measure(arguments.links)
    if arguments.json:
        print(json.dumps(result, indent=1))
        return
    print(f"{result['links']} links")
    for stage in result["stages"]:
        print(
            f"{stage['stage']:>20}: {stage['seconds']:7.2f} s, {stage['ns_per_link']:7.0f} ns/link,"
            f" {stage['bytes_per_link_held']:6.0f} bytes/link held,"
            f" {stage['bytes_per_link_at_peak']:6.0f} at peak"
        )
    print(f"methods differ by {result['methods_differ_by']:.1e} of the largest acceleration;")
    print(
        f"inverse dynamics gives the torques back to {result['torque_residual']:.1e} of the largest"
    )


if __name__ == "__main__":
    main()
