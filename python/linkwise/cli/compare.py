"""`linkwise compare`: every method, solver and guess on the user's own model and machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from linkwise.cli.model import FloatingBase, PackageDirs, load_given
from linkwise.cli.output import JsonOption, console, number, print_json, say_warnings, table, text
from linkwise.cli.progress import live_steps


def compare(
    model: Annotated[
        Path,
        typer.Argument(metavar="MODEL|SCENARIO", help="Model file (URDF, MJCF, SDF) or scenario."),
    ],
    states: Annotated[
        int, typer.Option(min=1, max=10_000, help="Successive states to evaluate at.")
    ] = 32,
    tolerance: Annotated[
        float, typer.Option(help="Relative tolerance of iterative solvers.")
    ] = 1e-7,
    stop: Annotated[
        str, typer.Option(help="Stop rule: energy_norm, residual or paper.")
    ] = "energy_norm",
    limit: Annotated[
        float, typer.Option(min=0.01, help="Seconds that a solver may take over all states.")
    ] = 0.5,
    seed: Annotated[int, typer.Option(min=0, help="Of the random pose of a model.")] = 0,
    plot: Annotated[
        Path | None,
        typer.Option("--plot", help="Write a chart (SVG) to this file.", show_default=False),
    ] = None,
    floating_base: FloatingBase = False,
    package_dir: PackageDirs = None,
    as_json: JsonOption = False,
) -> None:
    """Run every method, solver and initial guess on MODEL or SCENARIO and compare them.

    A model is let go in a random pose at random rates; a scenario is followed to its middle.
    Iterative solvers start from the solutions of the steps before.
    """
    from linkwise.compare import compare as run_comparison
    from linkwise.compare import driven_trajectory, free_trajectory
    from linkwise.compare import plot as draw
    from linkwise.io.writing import check_file, write_text
    from linkwise.notes import plain_warnings, warnings_of

    if plot is not None and plot.suffix.lower() != ".svg":
        raise typer.BadParameter(f"{plot}: charts are written as SVG; name a file in .svg")
    if plot is not None:
        check_file(plot)
    loaded, scenario = load_given(model, floating_base, package_dir)
    if scenario is None:
        trajectory = free_trajectory(loaded, states, seed)
    else:
        trajectory = driven_trajectory(loaded, scenario.simulate_arguments(loaded), states)
    with live_steps(quiet=as_json) as progress:
        found = run_comparison(
            loaded, trajectory, tolerance=tolerance, stop=stop, time_limit=limit, progress=progress
        )
    found["warnings"] = plain_warnings(warnings_of(loaded))
    if plot is not None:
        write_text(plot, draw(found) + "\n")
        found["plot"] = str(plot)
    if as_json:
        print_json(found)
    else:
        _show(found)


def _show(found: dict[str, Any]) -> None:
    screen = console()
    unknowns = found["unknowns"]
    system = (
        f"A f = b has {unknowns} unknowns, condition {number(found['condition_estimate'], 3)}, "
        f"Jacobi's spectral radius {number(found['spectral_radius'], 6)}."
        if unknowns is not None
        else f"No condition of A f = b: {found['system_message']}."
    )
    if found["spectrum_bound"] is not None:
        least, most = (number(x, 3) for x in found["spectrum_bound"])
        system += (
            f" Its bodies bound the spectrum that conjugate gradients meet to [{least}, {most}]: "
            f"at most {found['iterations_bound']:.0f} iterations for any number of them."
        )
    screen.print(
        f"{text(found['model'])}, {found['bodies']} bodies, {found['degrees_of_freedom']} degrees "
        f"of freedom, {found['motion']}: {found['states']} steps of "
        f"{number(1e3 * found['mean_step'], 3)} ms. {text(system)}",
    )
    shown = table(
        "",
        [
            ("method or solver", "left"),
            ("guess", "left"),
            ("iterations", "right"),
            ("most", "right"),
            ("time a call [us]", "right"),
            ("error", "right"),
            ("its own bound", "right"),
            ("outcome", "left"),
        ],
    )
    for row in found["rows"]:
        style = "" if row["outcome"] == "converged" else "yellow"
        shown.add_row(
            row["solver"] or row["method"],
            row["initial_guess"],
            _cell(row["mean_iterations"], 3),
            _cell(row["max_iterations"], 6),
            _cell(row["seconds"], 3, 1e6),
            _cell(row["error"], 2),
            _estimate(row),
            row["outcome"],
            style=style,
        )
    screen.print(shown)
    who: dict[str, dict[str, None]] = {}  # each message once, with all that it is about, in order
    for row in found["rows"]:
        if row["message"]:
            name = row["solver"] or row["method"]
            who.setdefault(row["message"].removeprefix(f"solver '{name}' "), {})[name] = None
    for message, names in who.items():
        screen.print(f"{', '.join(names)}: {text(message)}", markup=False)
    say_warnings(found["warnings"])
    if "plot" in found:
        screen.print(f"Chart: {found['plot']}", markup=False)


def _estimate(row: dict[str, Any]) -> str:
    """What a solver says of its error; in brackets where it does not bound it."""
    shown = _cell(row["error_estimate"], 2)
    return shown if row["error_is_bound"] or not shown else f"({shown})"


def _cell(value: float | None, digits: int, scale: float = 1.0) -> str:
    if value is None:
        return ""
    shown = scale * value
    return f"{shown:.0f}" if 10**digits <= abs(shown) < 1e7 else number(shown, digits)
