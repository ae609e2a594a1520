"""The `linkwise` program: commands, and exceptions turned into one line and an exit code."""

from __future__ import annotations

import contextlib
import io
import os
import sys
import warnings
from typing import Annotated, NoReturn

import typer

from linkwise.cli.compare import compare
from linkwise.cli.demo import demo
from linkwise.cli.inspect import inspect
from linkwise.cli.loads import loads
from linkwise.cli.output import DONE, FAILED, WRONG_INPUT, print_json, say
from linkwise.cli.paper import paper
from linkwise.cli.run import run
from linkwise.cli.sweep import sweep
from linkwise.cli.view import view

app = typer.Typer(
    name="linkwise",
    help="Simulate mechanisms and find the load of every joint.",
    epilog="Exit codes: 0 done, 1 the simulation failed, 2 the input is wrong.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command()(compare)
app.command()(demo)
app.command()(inspect)
app.command()(loads)
app.command()(paper)
app.command()(run)
app.command()(sweep)
app.command()(view)

# Typer re-exports BadParameter, a UsageError, which is a ClickException: the class of every
# complaint about the command line, wherever this version of Typer keeps it.
_CommandLineError: type[Exception] = typer.BadParameter.__mro__[2]


def _show_version(wanted: bool) -> None:
    if wanted:
        from linkwise.record.provenance import versions

        print(f"linkwise {versions()['linkwise']}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    pass


def _complain(message: str, code: int) -> int:
    """One line on stderr; with --json also an object on stdout, which is never left empty."""
    line = say(message)
    if "--json" in sys.argv[1:]:
        with contextlib.suppress(BrokenPipeError):
            print_json({"error": line, "exit_code": code})
    return code


def _usage_message(error: Exception) -> str:
    context = getattr(error, "ctx", None)
    command = getattr(context, "command_path", "linkwise")
    text = str(getattr(error, "format_message", lambda: error)())
    return f"{text.rstrip('.')}; see '{command} --help'"


def _is_wrong_input(error: Exception) -> bool:
    """Whether `error` is an InputError, without importing the core for it."""
    core = sys.modules.get("linkwise._core")
    return core is not None and isinstance(error, core.InputError)


def _is_of_a_model(message: Warning | str) -> bool:
    """Whether `message` is a ModelWarning, without importing NumPy for it."""
    notes = sys.modules.get("linkwise.notes")
    return notes is not None and isinstance(message, notes.ModelWarning)


def _exit_code() -> int:
    try:
        # Not standalone: Typer would print framed messages of several lines.
        result = app(standalone_mode=False, prog_name="linkwise")
    except _CommandLineError as error:
        # Without any command the "error" is the help text.
        if type(error).__name__ == "NoArgsIsHelpError":
            print(error, file=sys.stderr)
            return WRONG_INPUT
        return _complain(_usage_message(error), WRONG_INPUT)
    except SystemExit as error:
        # Typer's answer to a pipe that nobody reads is an exit with 1.
        if isinstance(error.__context__, BrokenPipeError):
            raise BrokenPipeError from None
        raise
    except KeyboardInterrupt as error:
        return _complain(str(error) or "interrupted", FAILED)
    except Exception as error:
        if _is_wrong_input(error):
            return _complain(str(error), WRONG_INPUT)
        if isinstance(error, BrokenPipeError):
            raise
        if os.environ.get("LINKWISE_TRACEBACK"):
            raise
        known = isinstance(error, (OSError, MemoryError)) and str(error)
        return _complain(str(error) if known else f"{type(error).__name__}: {error}", FAILED)
    return result if isinstance(result, int) else DONE


def _warn(message: Warning | str, *_: object, **__: object) -> None:
    """One line, without the place in the sources that Python adds.

    Commands say themselves what was ignored in a model, with what they show.
    """
    if not _is_of_a_model(message):
        say(f"warning: {message}")


def _open_standard_streams() -> None:
    """Streams that the caller closed (`linkwise ... >&-`) lead nowhere; no text fails on others.

    Otherwise the next file that is opened would get their number, and messages would go into it.
    """
    while (handle := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(handle)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
    # Names that the encoding of the terminal lacks are shown with question marks.
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def main() -> NoReturn:
    """Run the command line of this process and exit."""
    _open_standard_streams()
    warnings.showwarning = _warn
    code = DONE  # the reader of a pipe went away (`linkwise inspect x | head`): not a failure
    with contextlib.suppress(BrokenPipeError):
        code = _exit_code()
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        # Python must not complain about it while it closes stdout.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(code)
