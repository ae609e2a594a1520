"""`linkwise view`: a model or a run in 3-D in the browser, or as an HTML file."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from linkwise.cli.model import FloatingBase, PackageDirs
from linkwise.cli.output import JsonOption, console, print_json, say, say_warnings

if TYPE_CHECKING:
    from linkwise.view.source import Source


def view(
    target: Annotated[
        Path,
        typer.Argument(
            metavar="RUN|MODEL",
            help="A run's folder, a model file (URDF, MJCF, SDF) or a scenario.",
        ),
    ],
    port: Annotated[int, typer.Option("--port", help="Where to serve; 0: any free port.")] = 8080,
    host: Annotated[
        str,
        typer.Option(
            "--host", help="Address to serve on. By default this machine alone can connect."
        ),
    ] = "127.0.0.1",
    export: Annotated[
        Path | None,
        typer.Option(
            "--export",
            help="Write an HTML file that plays offline instead of serving.",
            show_default=False,
        ),
    ] = None,
    no_open: Annotated[bool, typer.Option("--no-open", help="Do not start a browser.")] = False,
    model: Annotated[
        Path | None,
        typer.Option(
            "--model",
            help="The file of a run's model, for its meshes; masses and joints are the run's own. "
            "By default the file of that name beside the run or in this folder.",
            show_default=False,
        ),
    ] = None,
    package_dir: PackageDirs = None,
    floating_base: FloatingBase = False,
    no_loads: Annotated[
        bool, typer.Option("--no-loads", help="Show the motion of a run alone.")
    ] = False,
    cause: Annotated[
        list[str] | None,
        typer.Option(
            "--cause",
            help="Only loads with this cause: gravity, velocity, drive, motion, passive, external; "
            "repeatable.",
        ),
    ] = None,
    color: Annotated[
        str, typer.Option("--color", metavar="size|rating", help="What colours of loads mean.")
    ] = "size",
    ratings: Annotated[
        Path | None,
        typer.Option(
            help=r"TOML file with \[rating.JOINT] tables; those of the run's scenario by default.",
            show_default=False,
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show RUN or MODEL in 3-D in the browser: motion, and the load of every joint. Ctrl-C ends."""
    from linkwise.view.source import Options, open_source

    _check(color, export, host, port)
    options = Options(
        model=model,
        package_dirs=package_dir or [],
        floating_base=floating_base,
        loads=not no_loads,
        ratings=ratings,
        causes=cause or [],
    )
    source = open_source(target, options)
    for note in source.notes:
        say(note)
    if not as_json:
        say_warnings(source.warnings)
    if export is not None:
        _export(source, export, color == "rating", as_json)
    else:
        _serve(source, host, port, not no_open, color == "rating", as_json)


def _check(color: str, export: Path | None, host: str, port: int) -> None:
    """InputError for an option that cannot be met, before anything is read."""
    from linkwise._core import InputError
    from linkwise.io.complaint import shown
    from linkwise.view.export import check_file
    from linkwise.view.server import check_address

    if color not in ("size", "rating"):
        raise InputError(f"--color: {shown(color)} is unknown; use size or rating")
    if export is not None:
        check_file(export)
    else:
        check_address(host, port)


def _export(source: Source, path: Path, by_rating: bool, as_json: bool) -> None:
    from linkwise.view.export import write_html

    told = len(source.notes)
    written = write_html(source, path, by_rating=by_rating)
    for note in source.notes[told:]:  # of meshes that were opened only now
        say(note)
    _report(
        as_json,
        {
            "export": str(written.path),
            "frames": written.frames,
            "duration": written.duration,
            "bytes": written.bytes,
            "warnings": list(source.warnings),
        },
        f"{written.path}: {written.frames} frames, {written.duration:g} s, "
        f"{written.bytes / 2**20:.1f} MiB. Opens in any browser, offline.",
    )


def _serve(
    source: Source, host: str, port: int, open_browser: bool, by_rating: bool, as_json: bool
) -> None:
    from linkwise.view.live import show

    told = len(source.notes)

    def started(address: str) -> None:
        for note in source.notes[told:]:
            say(note)
        facts = {"address": address, "warnings": list(source.warnings)}
        _report(as_json, facts, f"{address} shows {source.title}; Ctrl-C ends.")

    with contextlib.suppress(KeyboardInterrupt):
        show(
            source,
            host=host,
            port=port,
            open_browser=open_browser,
            started=started,
            by_rating=by_rating,
        )


def _report(as_json: bool, facts: dict[str, Any], sentence: str) -> None:
    """Printed at once, because whoever reads the address through a pipe waits for it."""
    if as_json:
        print_json(facts)
    else:
        console().print(sentence, markup=False)
    import sys

    sys.stdout.flush()
