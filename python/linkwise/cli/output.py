"""What commands print: tables for people, JSON for programs."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from linkwise.results import Run

DONE, FAILED, WRONG_INPUT = 0, 1, 2

JsonOption = Annotated[
    bool, typer.Option("--json", help="Print one JSON object on stdout and nothing else there.")
]


def say(message: str) -> str:
    """One line on stderr, whatever the message holds; returns it."""
    line = text(" ".join(message.split()))
    print(f"linkwise: {line}", file=sys.stderr)
    return line


def say_warnings(found: Sequence[Mapping[str, str]]) -> None:
    """What was ignored or assumed when the machine was read, on stderr."""
    from linkwise.notes import warning_lines

    for line in warning_lines(found):
        say(f"warning: {line}")


def print_json(value: Mapping[str, Any]) -> None:
    from linkwise.base import json_value

    print(json.dumps(json_value(value), indent=2, allow_nan=False))


def console(*, stderr: bool = False) -> Console:
    """A console for results (stdout) or progress (stderr), which prints what users wrote escaped.

    Rich colours a terminal only, and not when NO_COLOR is set. Off a terminal lines are not folded:
    what reads them wants whole rows.
    """
    from rich.console import Console
    from rich.segment import Segment

    class SafeConsole(Console):
        def on_broken_pipe(self) -> None:
            raise BrokenPipeError  # `main` decides; Rich would exit with 1

        def render(self, *args: Any, **kwargs: Any) -> Iterator[Segment]:
            for said, style, control in super().render(*args, **kwargs):
                shown = said if control else "\n".join(map(text, said.split("\n")))
                yield Segment(shown, style, control)

    made = SafeConsole(stderr=stderr, highlight=False, soft_wrap=False, markup=False, emoji=False)
    if not made.is_terminal:
        made.width = 200
    return made


def table(title: str, columns: Sequence[tuple[str, str]]) -> Table:
    """A plain table; columns are (heading, "left" or "right")."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    made = Table(title=title or None, title_justify="left", box=SIMPLE_HEAD, pad_edge=False)
    for heading, justify in columns:
        # As Text: in a string Rich would take "[s]" for a style.
        made.add_column(Text(text(heading)), justify=justify, overflow="fold")  # type: ignore[arg-type]
    return made


def text(value: object) -> str:
    """What users wrote, with what controls a terminal escaped; see `linkwise.base.printable`."""
    from linkwise.base import printable

    return printable(value)


def shown_path(path: object) -> str:
    """A path as short as it means the same from this folder."""
    try:
        return str(Path(str(path)).relative_to(Path.cwd()))
    except (OSError, ValueError):
        return str(path)


def number(value: float, digits: int = 4) -> str:
    return "" if not math.isfinite(value) else f"{value:.{digits}g}"


_KNOWN = ("force_determinate", "moment_determinate")
IN_BRACKETS = "; in brackets: not determined by rigid bodies, one choice of many"


def in_brackets(shown: str, record: Mapping[str, Any], name: str = "determinate") -> str:
    """What is shown of a record, in brackets where rigid bodies do not determine it."""
    return shown if not shown or record.get(name, True) else f"({shown})"


def meaning_of_brackets(records: Iterable[Mapping[str, Any]], *names: str) -> str:
    """What titles of tables add where there are any."""
    every = names or ("determinate",)
    known = all(record.get(name, True) for record in records for name in every)
    return "" if known else IN_BRACKETS


def whose(extremes: str) -> str:
    """What titles of peaks add, by the attribute `extremes`: nothing unless samples stand there."""
    return "" if extremes == "along the steps" else f" {extremes} (the run holds no extremes)"


def peak_records(run: Run) -> tuple[list[dict[str, Any]], str]:
    """Per joint the largest force and moment and when, as plain records; the attribute `extremes`
    of the peaks."""
    peaks = run.peak_loads()
    columns = ["force", "force_time", "moment", "moment_time"]
    columns += [name for name in _KNOWN if name in peaks]
    values = [peaks[name].values.tolist() for name in columns]
    records = [
        {"joint": joint, **dict(zip(columns, row, strict=True))}
        for joint, *row in zip(peaks["joint"].values.tolist(), *values, strict=True)
    ]
    return records, str(peaks.attrs["extremes"])


def bracketed(record: Mapping[str, Any], name: str) -> str:
    """A force or a moment, in brackets where rigid bodies do not determine it."""
    return in_brackets(number(record[name]), record, f"{name}_determinate")


def peak_table(records: Sequence[Mapping[str, Any]], extremes: str, limit: int = 40) -> Table:
    """What `peak_records` returned as a table; of many joints those with the largest forces."""
    shown = list(records)
    title = f"Peak joint loads{whose(extremes)}"
    if len(shown) > limit:
        shown = sorted(
            shown, key=lambda record: (not record.get(_KNOWN[0], True), -record["force"])
        )[:limit]
        title += f" (the {limit} largest forces of {len(records)} joints)"
    title += meaning_of_brackets(shown, *_KNOWN)
    made = table(
        title,
        [
            ("joint", "left"),
            ("force [N]", "right"),
            ("at [s]", "right"),
            ("moment [N m]", "right"),
            ("at [s]", "right"),
        ],
    )
    for record in shown:
        made.add_row(
            text(record["joint"]),
            bracketed(record, "force"),
            number(record["force_time"]),
            bracketed(record, "moment"),
            number(record["moment_time"]),
        )
    return made


def write_csv(records: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Records with the same keys as a table with a head."""
    import csv

    from linkwise._core import InputError
    from linkwise.io.writing import csv_cell, written_whole

    if not records:
        raise InputError(f"{str(path)!r}: there is nothing to write")
    with written_whole(path) as aside, open(aside, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, records[0], lineterminator="\n")
        writer.writeheader()
        for record in records:
            writer.writerow({k: "" if v != v else csv_cell(v) for k, v in record.items()})
