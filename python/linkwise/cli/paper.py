"""`linkwise paper`: the 1993 paper's tables and figures, ours beside theirs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from linkwise.cli.output import JsonOption, console, print_json, table, text
from linkwise.cli.progress import live_steps


def paper(
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder for index.html and results.json.")
    ],
    quick: Annotated[
        bool, typer.Option("--quick", help="Short chains and rough times: under a minute.")
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Of the chains' poses.")] = 0,
    as_json: JsonOption = False,
) -> None:
    """Compute the tables and figures of the 1993 paper again and judge its claims."""
    from rich.text import Text

    from linkwise.paper import write_report

    with live_steps(quiet=as_json) as progress:
        results = write_report(output, quick=quick, seed=seed, progress=progress)
    if as_json:
        print_json(results)
        return
    screen = console()
    shown = table("Claims", [("claim", "left"), ("verdict", "left")])
    colours = {"confirmed": "green", "confirmed in part": "yellow", "not confirmed": "red"}
    for claim in results["claims"]:
        verdict = claim["verdict"]
        shown.add_row(text(claim["claim"]), Text(verdict, style=colours[verdict]))
    screen.print(shown)
    screen.print(
        f"Report: {output / 'index.html'}, data: {output / 'results.json'} "
        f"({results['run_seconds']:.0f} s)",
        markup=False,
    )
