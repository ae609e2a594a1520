"""How a simulation is computed: the options that few users touch, in one object."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from linkwise import _core
from linkwise._core import InputError
from linkwise.io.complaint import shown
from linkwise.simulation.arguments import number, optional_count

#: Of every option what holds where nothing is given, as the core states it.
DEFAULTS: dict[str, Any] = {entry["name"]: entry["default"] for entry in _core.numerics()}


@dataclass(frozen=True, kw_only=True)
class Numerics:
    """Options of the integrator, the method and the solver of a simulation.

    What is None has its default. `linkwise.numerics()` lists names, defaults and meanings.
    """

    tolerance: float | None = None
    step_tolerance: float | None = None
    integrator: str | None = None
    step: float | None = None
    max_step: float | None = None
    max_steps: int | None = None
    method: str | None = None
    solver: str | None = None
    initial_guess: str | None = None
    stop: str | None = None
    solver_tolerance: float | None = None
    max_iterations: int | None = None
    state: str | None = None
    assemble: str | None = None
    solver_options: Mapping[str, Any] | None = None

    def options(self, tolerance: float | None = None) -> dict[str, Any]:
        """What is given, as keyword arguments of the core; `tolerance` goes before the one here.

        InputError where a value is of the wrong kind.
        """
        options: dict[str, Any] = {}
        for field in fields(self):
            name, value = field.name, getattr(self, field.name)
            if name == "tolerance" and tolerance is not None:
                value = tolerance
            if value is None:
                continue
            if field.type == "float | None":
                value = number(name, value)
            elif field.type == "int | None":
                value = optional_count(name, value)
            elif field.type == "str | None" and not isinstance(value, str):
                raise InputError(f"{name}: {shown(value)} given; give a name in quotes")
            elif name == "solver_options":
                value = dict(value) if isinstance(value, Mapping) else value
            options[name] = value
        return options
