"""One evaluation of a chain whose joint axes change, by its number of bodies."""

from __future__ import annotations

from linkwise.bench.engines.base import Offer
from linkwise.bench.machine import random_chain, states_for
from linkwise.bench.pits import PYTHON, Pits
from linkwise.bench.race import race
from linkwise.bench.rows import Row

SIZES, QUICK_SIZES = (7, 30, 100, 300, 1000, 3000), (7, 30, 300)


def wanted(engine: str, arena: str, offer: Offer) -> bool:
    """From Python, ours as it is called by default: its methods are compared in C++."""
    if offer.systems > 1 or offer.method.endswith(("thread", "threads")):
        return False
    return engine != "linkwise" or arena != PYTHON or offer.method.startswith("auto")


def run(pits: Pits) -> list[Row]:
    pits.begin_family()
    rows: list[Row] = []
    for n in QUICK_SIZES if pits.effort.quick else SIZES:
        pits.say(f"single: chain of {n}")
        most = 16 if pits.effort.quick else 64
        states = states_for(n, most=most)
        rows += race(pits, "single", random_chain(n), states=states, wanted=wanted)
    return rows
