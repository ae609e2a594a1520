"""Simulating what a scenario describes; apart from simulate.py, which needs no reader of files."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

from linkwise._core import InputError
from linkwise.io.complaint import shorten
from linkwise.record.claim import check_target
from linkwise.scenario import Scenario, load_scenario
from linkwise.simulation.simulate import simulate

if TYPE_CHECKING:
    from linkwise.results import Run
    from linkwise.simulation.time_loop import Progress


def run_scenario(
    scenario: Scenario | str | os.PathLike[str],
    *,
    output: str | os.PathLike[str] | None = None,
    progress: Callable[[Progress], object] | None = None,
    on_failure: Literal["raise", "return"] = "raise",
) -> Run:
    """Simulate a scenario, given as a file or as `load_scenario` returned it.

    `output` overrides the scenario's own `[output] path`; without either the run stays in memory.
    See `simulate` for the rest.

    Raises InputError, too, where `[output] path` would replace what stands outside the scenario's
    folder: only `output` does that.
    """
    loaded = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    model = loaded.load_model()
    arguments = loaded.simulate_arguments(model)
    if output is not None:
        arguments["output"] = output
    elif (standing := loaded.replaces_elsewhere()) is not None:
        raise InputError(
            f"{shorten(loaded.path, 400)}: output.path: '{shorten(standing, 400)}' exists outside "
            "the scenario's folder; give output= (run: --output) to replace it, or another path"
        )
    if arguments["output"] is not None:
        check_target(arguments["output"])
    try:
        return simulate(model, **arguments, progress=progress, on_failure=on_failure)
    except InputError as error:
        raise InputError(f"{shorten(loaded.path, 400)}: {error}") from None
