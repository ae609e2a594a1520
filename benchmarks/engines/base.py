"""What a worker times: methods of one engine on one machine, and whole simulations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from benchmarks.machine import Array, States


@dataclass(frozen=True)
class Offer:
    """What a worker says about a method."""

    method: str
    loads: bool = False  # whether a call finds the joint loads too
    systems: int = 1  # that one call evaluates
    threads: int = 1


@dataclass(frozen=True)
class Contestant:
    offer: Offer
    evaluate: Callable[[Array, Array, Array], Array]  # q, v, tau in the engine's coordinates


@dataclass(frozen=True)
class Motion:
    """Where a simulation ended, and what it took."""

    q: Array  # in our coordinates
    cpu_seconds: float
    evaluations: int


@dataclass(frozen=True)
class Simulator:
    """A whole simulation from state 0, without torques, at one setting of its accuracy."""

    method: str
    fixed_step: bool  # the setting is a step [s], otherwise a tolerance
    simulate: Callable[[float, float], Motion]  # duration, setting


@dataclass
class Field:
    """An engine with one machine loaded."""

    states: States  # in the engine's coordinates
    contestants: list[Contestant]
    simulators: list[Simulator] = field(default_factory=list)
    to_ours: Callable[[Array], Array] = lambda accelerations: accelerations
