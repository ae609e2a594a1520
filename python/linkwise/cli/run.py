"""`linkwise run`: simulate a scenario file."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from linkwise.cli.output import (
    FAILED,
    JsonOption,
    console,
    number,
    peak_records,
    peak_table,
    print_json,
    say,
    say_warnings,
    shown_path,
    text,
)

if TYPE_CHECKING:
    from linkwise.results import Run

_MOST_NAMED = 4  # joints beyond their limits


def run(
    scenario: Annotated[Path, typer.Argument(metavar="SCENARIO", help="Scenario file (TOML).")],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Where to write the results (a Zarr store). An earlier run there is replaced. "
            "By default the scenario's output.path, or its name with .zarr in this folder, "
            "numbered if it exists.",
            show_default=False,
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Simulate a SCENARIO file and write the results. Ctrl-C keeps those until then."""
    from linkwise.cli.progress import live_progress
    from linkwise.record.claim import unused_path
    from linkwise.scenario import load_scenario
    from linkwise.simulation.scenarios import run_scenario
    from linkwise.simulation.simulate import SimulationError, SimulationInterrupted

    loaded = load_scenario(scenario)
    if output is None and loaded.settings.output.path is None:
        output = unused_path(f"{scenario.stem}.zarr")
    standing = None if output is not None else loaded.replaces_elsewhere()
    if standing is not None and not as_json and sys.stdin.isatty():
        where = text(shown_path(standing))
        if not typer.confirm(f"{where} lies outside the scenario's folder. Replace it?", err=True):
            say("nothing was replaced; choose another place with --output")
            raise typer.Exit(FAILED)
        output = standing
    try:
        with live_progress(quiet=as_json) as progress:
            result = run_scenario(loaded, output=output, progress=progress)
    except (SimulationError, SimulationInterrupted) as stopped:
        show_run(stopped.run, as_json)
        say(str(stopped))
        raise typer.Exit(FAILED) from None
    show_run(result, as_json)


def summary(run: Run) -> dict[str, Any]:
    """What a program wants to know about a run."""
    attrs = run.dataset.attrs
    names = ("outcome", "message", "stop_time", "stop_joint", "wall_time")
    counts = ("total_steps", "total_evaluations", "total_iterations")
    chosen = ("model", "model_hash", "method", "solver", "reason")
    found = {name: attrs.get(name) for name in (*names, *chosen, *counts)}
    found["run"] = shown_path(run.path) if run.path is not None else None
    found["warnings"] = run.warnings
    found["samples"] = run.dataset.sizes["time"]
    return found


def has_loads(run: Run) -> bool:
    return "joint_load" in run and run.dataset.sizes["time"] > 0


def _solver(name: str) -> str:
    return "" if name == "none" else f" with {name}"


def show_run(run: Run, as_json: bool) -> None:
    """How the run went, the peak loads, and where the results are."""
    from linkwise.loads.limits import beyond_limits

    peaks, extremes = peak_records(run) if has_loads(run) else ([], "")
    beyond = beyond_limits(run) if run.dataset.sizes["time"] else []
    if as_json:
        about = {"peak_loads": peaks, "extremes": extremes, "beyond_limits": beyond}
        print_json(summary(run) | about)
        return
    attrs = run.dataset.attrs
    screen = console()
    if peaks:
        screen.print(peak_table(peaks, extremes))
    screen.print(
        f"Simulated {attrs['stop_time']:g} s in {number(attrs['wall_time'], 3)} s: "
        f"{attrs['total_steps']} steps, {attrs['total_evaluations']} evaluations, "
        f"by {attrs['method']}{_solver(attrs['solver'])}.",
        markup=False,
    )
    if beyond:
        screen.print(_limit_note(beyond), markup=False)
    say_warnings(run.warnings)
    if run.path is None:
        screen.print("No results written: the run failed at its start, the older one was kept.")
    else:
        screen.print(f"Results: {shown_path(run.path)}", markup=False)


def _limit_note(beyond: Sequence[Mapping[str, Any]]) -> str:
    """One sentence about what `beyond_limits` found, and what to do about it."""
    said = [
        f"{joint['joint']} ({number(joint['lower'])} .. {number(joint['upper'])}) gets to "
        f"{number(joint['farthest'])}, outside from {number(joint['since'])} s"
        for joint in beyond[:_MOST_NAMED]
    ]
    if len(beyond) > _MOST_NAMED:
        said.append(f"and {len(beyond) - _MOST_NAMED} more")
    return (
        f"Beyond their limits, which exert no force: {'; '.join(said)}. "
        "Drive or lock such joints, or give them stops (limit_stiffness)."
    )
