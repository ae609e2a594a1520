"""One evaluation of a chain whose joint axes change, by its number of bodies."""

from __future__ import annotations

from benchmarks.engines.base import Offer
from benchmarks.machine import random_chain, states_for
from benchmarks.race import race
from benchmarks.rows import Row
from benchmarks.sessions import PYTHON, Workers

SIZES, QUICK_SIZES = (7, 30, 100, 300, 1000, 3000), (7, 30, 300)


def wanted(engine: str, arena: str, offer: Offer) -> bool:
    """From Python, ours as it is called by default: its methods are compared in C++."""
    if offer.systems > 1 or offer.method.endswith(("thread", "threads")):
        return False
    return engine != "linkwise" or arena != PYTHON or offer.method.startswith("auto")


def run(workers: Workers) -> list[Row]:
    workers.begin_family()
    rows: list[Row] = []
    for n in QUICK_SIZES if workers.effort.quick else SIZES:
        workers.say(f"single: chain of {n}")
        most = 16 if workers.effort.quick else 64
        states = states_for(n, most=most)
        rows += race(workers, "single", random_chain(n), states=states, wanted=wanted)
    return rows
