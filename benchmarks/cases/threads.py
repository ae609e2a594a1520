"""One chain on several threads, and many states on several threads: ours, by the clock."""

from __future__ import annotations

from benchmarks.engines.base import Offer
from benchmarks.engines.linkwise import takes_threads
from benchmarks.machine import Machine, random_chain, states_for
from benchmarks.race import race
from benchmarks.rows import Row
from benchmarks.sessions import PYTHON, Workers

SIZES, QUICK_SIZES = (1000, 3000, 10_000), (1000,)
ARM_STATES = 4096


def run(workers: Workers) -> list[Row]:
    if not takes_threads():
        reason = "evaluations of this version take no threads="
        return [Row("threads", "", 0, "linkwise", PYTHON, "", failure=reason)]
    rows: list[Row] = []
    for n in QUICK_SIZES if workers.effort.quick else SIZES:
        workers.say(f"threads: chain of {n}")
        rows += _scaling(workers, random_chain(n), states_for(n), batch=False)
    workers.say(f"threads: {ARM_STATES} states of a 7-joint arm")
    return rows + _scaling(workers, random_chain(7), ARM_STATES, batch=True)


def _scaling(workers: Workers, machine: Machine, states: int, *, batch: bool) -> list[Row]:
    def wanted(_engine: str, _arena: str, offer: Offer) -> bool:
        return offer.method.endswith(("thread", "threads")) and batch == (offer.systems > 1)

    rows = race(
        workers,
        "threads",
        machine,
        states=states,
        wanted=wanted,
        engines=["linkwise"],
        threads=True,
    )
    alone = {row.arena: row for row in rows if row.threads == 1}
    for row in rows:
        one = alone.get(row.arena)
        if one is None or not one.ns_per_body or not row.ns_per_body:
            continue
        row.figures["speedup"] = one.ns_per_body / row.ns_per_body
        row.figures["same_bits"] = row.figures["digest"] == one.figures["digest"]
    return rows
