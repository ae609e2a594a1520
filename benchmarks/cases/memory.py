"""Chains of up to a million links: time and memory per link, every engine as far as it goes."""

from __future__ import annotations

from benchmarks.engines.base import Offer
from benchmarks.machine import hanging_chain, states_for
from benchmarks.race import race
from benchmarks.rows import Row
from benchmarks.sessions import PYTHON, Workers

SIZES, QUICK_SIZES = (1000, 10_000, 100_000, 1_000_000), (1000, 100_000)
#: Writing a longer chain for the peers takes minutes, and none of them gets this far.
LONGEST_FOR_PEERS = 100_000


def wanted(engine: str, _arena: str, offer: Offer) -> bool:
    """One method an engine, so that the memory is that of this method."""
    if engine == "linkwise":
        return offer.method == "auto"
    return offer.method in ("aba, local", "mj_forward", "aba")


def run(workers: Workers) -> list[Row]:
    workers.begin_family()
    rows: list[Row] = []
    for n in QUICK_SIZES if workers.effort.quick else SIZES:
        workers.say(f"memory: chain of {n}")
        peers = n <= (1000 if workers.effort.quick else LONGEST_FOR_PEERS)
        machine = hanging_chain(n, peers=peers)
        states = states_for(n, most=16)
        rows += race(workers, "memory", machine, states=states, wanted=wanted, arenas=[PYTHON])
    return rows
