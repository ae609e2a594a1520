"""`linkwise view`: a model or a run in 3-D in the browser, or as an HTML file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from linkwise.cli.model import FloatingBase, PackageDirs
from linkwise.cli.output import JsonOption, console, print_json, say


def view(
    target: Annotated[
        Path,
        typer.Argument(
            metavar="RUN|MODEL", help="A run's folder, a model file (URDF, MJCF) or a scenario."
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
            help="The file of a run's model, for its meshes. By default the file of that name "
            "beside the run or in this folder.",
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
            help="TOML file with [rating.JOINT] tables; those of the run's scenario by default.",
            show_default=False,
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show RUN or MODEL in 3-D in the browser: motion, and the load of every joint. Ctrl-C ends."""
    from linkwise._core import InputError
    from linkwise.view.export import check_file, write_html
    from linkwise.view.live import show
    from linkwise.view.server import check_address
    from linkwise.view.source import Options, open_source

    if color not in ("size", "rating"):
        raise InputError(f"--color: {color!r} is unknown; use size or rating")
    by_rating = color == "rating"
    if export is not None:
        check_file(export)
    else:
        check_address(host, port)
    source = open_source(
        target,
        Options(
            model=model,
            package_dirs=package_dir or [],
            floating_base=floating_base,
            loads=not no_loads,
            ratings=ratings,
            causes=cause or [],
        ),
    )
    for note in source.notes:
        say(note)
    if export is not None:
        written = write_html(source, export, by_rating=by_rating)
        _report(
            as_json,
            {
                "export": str(written.path),
                "frames": written.frames,
                "duration": written.duration,
                "bytes": written.bytes,
            },
            f"{written.path}: {written.frames} frames, {written.duration:g} s, "
            f"{written.bytes / 2**20:.1f} MiB. Opens in any browser, offline.",
        )
        return

    def started(address: str) -> None:
        _report(as_json, {"address": address}, f"{address} shows {source.title}; Ctrl-C ends.")

    try:
        show(
            source,
            host=host,
            port=port,
            open_browser=not no_open,
            started=started,
            by_rating=by_rating,
        )
    except KeyboardInterrupt:
        return


def _report(as_json: bool, facts: dict[str, Any], sentence: str) -> None:
    """Printed at once, because whoever reads the address through a pipe waits for it."""
    if as_json:
        print_json(facts)
    else:
        console().print(sentence, markup=False)
    import sys

    sys.stdout.flush()
