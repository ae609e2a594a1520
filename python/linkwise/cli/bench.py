"""`linkwise bench`: speed beside every other engine that is installed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from linkwise.cli.output import JsonOption, print_json, say


def bench(
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            help="Under a minute: fewer machines and repeats, and the C++ side only if an earlier "
            "run has compiled it.",
        ),
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Folder for bench.json, bench.md and the figures.",
            show_default=False,
        ),
    ] = None,
    cases: Annotated[
        str,
        typer.Option(
            "--cases",
            metavar="NAME,...",
            help="Some of single, robots, batch, threads, memory, simulation; all by default.",
            show_default=False,
        ),
    ] = "",
    sources: Annotated[
        Path | None,
        typer.Option(
            "--sources",
            help="Clone of the repository whose C++ side is compiled; by default that around this "
            "package or the current folder.",
            show_default=False,
        ),
    ] = None,
    build: Annotated[
        Path | None,
        typer.Option(
            "--build",
            help="Where the C++ side is compiled; by default a cache folder.",
            show_default=False,
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Time this machine: linkwise beside Pinocchio, MuJoCo, DART and Drake where installed."""
    from linkwise.bench.run import check_cases, run_bench, write

    chosen = check_cases([name.strip() for name in cases.split(",") if name.strip()])
    if output is not None and output.exists() and not output.is_dir():
        raise typer.BadParameter(f"{output} is no folder", param_hint="--output")
    result = run_bench(quick=quick, cases=chosen, sources=sources, build=build, say=say)
    if output is not None:
        for path in write(result, output):
            say(f"wrote {path}")
    if as_json:
        print_json(result.records())
    else:
        print(result.markdown, end="")
