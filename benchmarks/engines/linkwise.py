"""Ours, through the Python interface that users have."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import linkwise as lw
from benchmarks.engines.base import Contestant, Field, Motion, Offer, Simulator
from benchmarks.machine import Array, States, read_model
from benchmarks.timing import timed
from linkwise import _core
from linkwise._core import Model

_DIRECT = {"method": "constraint_force", "solver": "thomas"}


def takes_threads() -> bool:
    """Whether this version's evaluations have an argument `threads`."""
    text = (lw.forward_dynamics.__doc__ or "").partition("\n")[0]
    return "threads" in text


def thread_counts() -> list[int]:
    """1, 2, 4 ... up to the cores that there are."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    counts = [1]
    while counts[-1] * 2 <= (cores or 1):
        counts.append(counts[-1] * 2)
    return counts


def build(folder: Path) -> Field:
    model = read_model(folder)
    states = States.read(folder / "linkwise.states")
    one = {"threads": 1} if takes_threads() else {}

    def single(name: str, **options: Any) -> Contestant:
        return Contestant(Offer(name, loads=True), _evaluation(model, **options))

    def batch(name: str, count: int = 1, **options: Any) -> Contestant:
        offer = Offer(name, loads=True, systems=states.count, threads=count)
        return Contestant(offer, _batch(model, states, **options))

    contestants = [
        single("auto", **one),
        Contestant(Offer("auto, no loads"), _plain(model, **one)),
        single("articulated_body", method="articulated_body", **one),
        single("constraint_force + thomas", **_DIRECT, **one),
        batch("batch", **one),
    ]
    for n in thread_counts() if takes_threads() else []:
        name = f"{n} thread{'s' if n > 1 else ''}"
        offer = Offer(name, loads=True, threads=n)
        contestants.append(Contestant(offer, _evaluation(model, threads=n)))
        contestants.append(batch(f"batch, {name}", n, threads=n))
    return Field(states, contestants, [_simulator(model, states, e) for e in lw.integrators()])


def _evaluation(model: Model, **options: Any) -> Callable[[Array, Array, Array], Array]:
    def evaluate(q: Array, v: Array, tau: Array) -> Array:
        result = lw.forward_dynamics(model, q, v, tau, full=True, **options)
        if result.report.outcome != "converged":
            raise RuntimeError(f"{result.report.method}: {result.report.outcome}")
        found: Array = result.acceleration
        return found

    return evaluate


def _plain(model: Model, **options: Any) -> Callable[[Array, Array, Array], Array]:
    def evaluate(q: Array, v: Array, tau: Array) -> Array:
        found: Array = lw.forward_dynamics(model, q, v, tau, **options)
        return found

    return evaluate


def _batch(model: Model, states: States, **options: Any) -> Callable[[Array, Array, Array], Array]:
    """All states in one call, whichever is asked for."""
    evaluate = _evaluation(model, **options)
    return lambda _q, _v, _tau: evaluate(states.q, states.v, states.tau)


def _simulator(model: Model, states: States, entry: dict[str, Any]) -> Simulator:
    name, fixed = entry["name"], bool(entry["fixed_step"])

    def simulate(duration: float, setting: float) -> Motion:
        accuracy: dict[str, Any] = {"step" if fixed else "step_tolerance": setting}
        # The loop alone, as of the peers: lw.simulate labels and records the results as well.
        loop = _core.Simulation(model, integrator=name, **accuracy)

        def run() -> dict[str, Array]:
            loop.start(0.0, states.q[0], states.v[0])
            return loop.advance(np.array([duration]), {"position"})

        found, taken = timed(run)
        if loop.ending.outcome != "converged":
            raise RuntimeError(f"{loop.ending.outcome} at {loop.ending.time:g} s")
        return Motion(np.array(found["position"][-1]), taken.cpu, loop.statistics.evaluations)

    return Simulator(name, fixed, simulate)
