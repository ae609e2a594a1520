"""How a simulation is computed: the options that few users touch, in one object."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from linkwise import _core
from linkwise._core import InputError
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
    solver_options: Mapping[str, Any] | None = None

    @classmethod
    def of(cls, given: Numerics | Mapping[str, Any] | None) -> Numerics:
        """From one itself, or from its fields by name; InputError where a name is unknown."""
        if given is None or isinstance(given, Numerics):
            return given or cls()
        known = [field.name for field in fields(cls)]
        if not isinstance(given, Mapping):
            raise InputError(f"numerics: {given!r} given; give a linkwise.Numerics")
        for name in given:
            if name not in known:
                raise InputError(f"numerics: unknown option {name!r}; known: {', '.join(known)}")
        return cls(**given)

    def with_given(self, **given: Any) -> dict[str, Any]:
        """Keyword arguments of the core: these options, and before them those given here.

        InputError where a value is of the wrong kind.
        """
        options: dict[str, Any] = {}
        for field in fields(self):
            name = field.name
            value = given.get(name)
            value = getattr(self, name) if value is None else value
            if value is None:
                continue
            if field.type == "float | None":
                value = number(name, value)
            elif field.type == "int | None":
                value = optional_count(name, value)
            elif field.type == "str | None" and not isinstance(value, str):
                raise InputError(f"{name}: {value!r} given; give a name in quotes")
            elif name == "solver_options":
                value = dict(value) if isinstance(value, Mapping) else value
            options[name] = value
        return options
