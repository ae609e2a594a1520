"""CSV tables over time: one time column, one column for each driven quantity."""

from __future__ import annotations

import codecs
import csv
import io
import os
import re
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice

import numpy as np
import numpy.typing as npt

from linkwise.io.complaint import complain, near, shorten
from linkwise.io.files import TABLE_BYTES, read_bytes
from linkwise.io.numbers import parse_number
from linkwise.io.units import Unit, parse_unit
from linkwise.io.writing import spelled

_TIME_NAMES = ("time", "t")  # in capitals as well
# A name and its unit where blanks separate names.
_BLANKS = re.compile(r"[^\s\[\]]+(?:\s*\[[^\[\]]*\])?")
_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}(?:,[0-9]{3})+\Z")
_MOST_PREAMBLE = 1000
_HEADER = re.compile(r"(.*?)\s*\[([^\[\]]*)\]\Z", re.DOTALL)


@dataclass(frozen=True)
class CsvTable:
    """The columns of a CSV file, in SI units.

    path: the file; times: (n,) seconds, strictly increasing; names: of the other columns;
    values: (n, len(names)); dimensions: what each column's unit measures, None without a unit.
    """

    path: str
    times: npt.NDArray[np.float64]
    names: tuple[str, ...]
    values: npt.NDArray[np.float64]
    dimensions: tuple[str | None, ...]

    def column(self, name: str) -> npt.NDArray[np.float64]:
        """The values (n,) of a column; InputError with the nearest name if there is none."""
        return self.values[:, self.index(name)]

    def index(self, name: str) -> int:
        """The position of a column among ``names``."""
        if name not in self._positions:
            complain(
                self.path,
                f"column '{shorten(name)}'",
                "does not exist",
                near(name, self.names, "the columns are"),
                1,
            )
        return self._positions[name]

    @cached_property
    def _positions(self) -> dict[str, int]:
        return {name: k for k, name in enumerate(self.names)}


def read_table(path: str | os.PathLike[str]) -> CsvTable:
    """Read a CSV table.

    The first line that is neither empty nor a comment (``#``) is the header. One column is called
    ``time`` or ``t``, in capitals or not; the others are free. If the first one is called ``time``,
    others may be as well, and so may those with a unit of something else. A name may carry a unit,
    as in ``elbow [deg]`` or ``time [ms]``; values are converted to SI. Commas separate; if the
    header has none semicolons, tabs or blanks do, and numbers may have decimal commas. What OpenSim
    writes above a header (.sto, .mot) is skipped. UTF-8, or UTF-16 with its mark.

    Raises InputError naming file, line and column for gaps (empty cells, short or empty lines),
    NaN, infinity, text, time that stands still or runs backwards, fewer than two rows.
    """
    text = _decode(path, read_bytes(path, "table", TABLE_BYTES))
    rows = _rows(path, text)
    header_line, header = next(rows, (1, []))
    if not header:
        complain(path, "table", "is empty", "give a header line and at least two rows")
    names, units, time_column = _header(path, header_line, header)
    # Arrays of machine numbers, because lists of Python objects would take several times the file's
    # size.
    data = array("d")
    lines = array("q")
    for line, cells in rows:
        data.extend(_numbers(path, line, cells, names))
        lines.append(line)
    if len(lines) < 2:
        complain(
            path,
            "table",
            f"has {'only one row' if lines else 'no rows'} of numbers",
            "give at least two (a constant needs no table)",
            lines[-1] if lines else header_line,
        )
    table = np.frombuffer(data).reshape(len(lines), len(names))
    table = table * np.array([unit.factor if unit else 1.0 for unit in units])
    times = np.ascontiguousarray(table[:, time_column])
    _check_times(path, times, lines)
    others = [i for i in range(len(names)) if i != time_column]
    return CsvTable(
        os.fspath(path),
        times,
        tuple(names[i] for i in others),
        np.ascontiguousarray(table[:, others]),
        tuple(unit.dimension if (unit := units[i]) else None for i in others),
    )


def _decode(path: str | os.PathLike[str], data: bytes) -> str:
    try:
        wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        text = data.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        complain(path, "table", "is not UTF-8 text", "save it as CSV with UTF-8 encoding", line)
    if "\0" in text:
        complain(path, "table", "holds binary data", "give a CSV file")
    return text


def _rows(path: str | os.PathLike[str], text: str) -> Iterator[tuple[int, list[str]]]:
    """Line number and cells of each row; empty lines may stand before the header and at the end."""
    skipped = _preamble(path, text)
    written = (s.strip() for s in islice(io.StringIO(text, newline=None), skipped, None))
    delimiter = _delimiter(next((s for s in written if s and not s.startswith("#")), ""))
    empty: int | None = None
    started = commas = points = decimals = False
    for line, raw in enumerate(io.StringIO(text, newline=None), 1):
        content = raw.strip()
        if line <= skipped or content.startswith("#"):
            continue
        if not content:
            empty = empty or (line if started else None)
            continue
        if empty:
            complain(path, "table", "an empty line is a gap", "delete it or fill the row in", empty)
        if started and delimiter != ",":
            commas, points = commas or "," in content, points or "." in content
            if commas and points:
                problem = "numbers have commas and points; which are decimals is not clear"
                complain(path, "table", problem, "write decimals with points, as 1234.5", line)
            decimals = decimals or _has_decimal_comma(content.split(delimiter))
            content = content.replace(",", ".")
        if '"' in content:
            cells = _quoted(path, line, content, delimiter)
        elif delimiter == " ":
            cells = content.split() if started else _BLANKS.findall(content)
        else:
            cells = content.split(delimiter)
        started = True
        yield line, cells
    if commas and not decimals:
        problem = "commas may separate thousands or decimals"
        complain(path, "table", problem, "write decimals with points, and no thousands apart", line)


def _has_decimal_comma(cells: Sequence[str]) -> bool:
    """Whether a comma among these stands where it cannot separate thousands."""
    return any("," in cell and not _THOUSANDS.match(cell.strip(' "')) for cell in cells)


def _quoted(path: str | os.PathLike[str], line: int, content: str, delimiter: str) -> list[str]:
    """The cells of a line with quotes; several blanks separate as one does."""
    try:
        rows = csv.reader(
            [content], delimiter=delimiter, skipinitialspace=delimiter == " ", strict=True
        )
        return next(rows)
    except csv.Error as error:
        complain(path, "table", f"is not CSV ({error})", "check quotes and separators", line)


def _delimiter(header: str) -> str:
    """What separates the names in a header: commas, else semicolons, tabs or blanks."""
    return next((mark for mark in (",", ";", "\t") if mark in header), _blank_or_comma(header))


def _blank_or_comma(header: str) -> str:
    return " " if '"' in header or len(_BLANKS.findall(header)) > 1 else ","


def _preamble(path: str | os.PathLike[str], text: str) -> int:
    """How many lines go before the header in files of OpenSim (.sto, .mot); 0 in others."""
    lines = [s.strip() for s in islice(io.StringIO(text, newline=None), _MOST_PREAMBLE)]
    if "endheader" not in lines:
        return 0
    count = lines.index("endheader") + 1
    for number, line in enumerate(lines[:count], 1):
        if line.replace(" ", "").lower() == "indegrees=yes":
            complain(
                path,
                "inDegrees",
                "does not say which columns are angles",
                "write their units in the header, as 'elbow [deg]', and delete this line",
                number,
            )
    return count


def _header(
    path: str | os.PathLike[str], line: int, cells: Sequence[str]
) -> tuple[list[str], list[Unit | None], int]:
    """Names and units of the columns, and which one is the time."""
    names: list[str] = []
    units: list[Unit | None] = []
    for number, cell in enumerate(cells, 1):
        match = _HEADER.match(cell.strip()) if len(cell) <= 1000 else None
        name = spelled(match.group(1) if match else cell.strip())
        element = f"column {number}"
        if not name:
            complain(path, element, "has no name", "name every column in the header", line)
        try:
            unit = parse_unit(match.group(2)) if match else None
        except ValueError as error:
            complain(path, f"{element} '{shorten(name)}'", str(error), "use one of them", line)
        names.append(name)
        units.append(unit)
    clock = _time_column(path, line, names, units)
    known: set[str] = set()
    for number, name in enumerate(names, 1):
        if name in known:
            element = f"column {number} '{shorten(name)}'"
            complain(path, element, "the name is used twice", "rename one", line)
        if number - 1 != clock:
            known.add(name)
    if len(names) < 2:
        complain(path, "header", "has only a time column", "add a column of values", line)
    return names, units, clock


def _time_column(
    path: str | os.PathLike[str], line: int, names: Sequence[str], units: Sequence[Unit | None]
) -> int:
    """The number of the time column. A joint may be called time, too."""
    clocks, foreign = [], []
    for i, (name, unit) in enumerate(zip(names, units, strict=True)):
        if name.lower() not in _TIME_NAMES:
            continue
        if unit is None or unit.dimension == "time":
            clocks.append(i)
        else:
            foreign.append(unit.dimension)
    if len(clocks) == 1 or (clocks and clocks[0] == 0 and names[0].lower() == "time"):
        return clocks[0]
    if foreign and not clocks:
        problem = f"has a unit of {foreign[0]}"
        complain(path, "time column", problem, "use s, ms, min or h", line)
    complain(
        path,
        "header",
        f"has {'no' if not clocks else 'more than one'} time column",
        "call one column 'time' (columns: "
        f"{', '.join(shorten(n, 20) for n in names[:8])}{', ...' if len(names) > 8 else ''})",
        line,
    )


def _numbers(
    path: str | os.PathLike[str], line: int, cells: Sequence[str], names: Sequence[str]
) -> list[float]:
    if len(cells) != len(names):
        complain(
            path,
            "row",
            f"has {len(cells)} cells where the header has {len(names)}",
            "separate columns by semicolons, or write decimals with points"
            if len(cells) == 2 * len(names)
            else "give every row one number per column",
            line,
        )
    row = []
    for name, cell in zip(names, cells, strict=True):
        try:
            row.append(parse_number(cell))
        except ValueError as error:
            problem = "the cell is empty: a gap" if not cell.strip() else str(error)
            remedy = "give a finite number in every cell"
            complain(path, f"column '{shorten(name)}'", problem, remedy, line)
    return row


def _check_times(
    path: str | os.PathLike[str], times: npt.NDArray[np.float64], lines: Sequence[int]
) -> None:
    wrong = np.flatnonzero(np.diff(times) <= 0)
    if wrong.size:
        k = int(wrong[0]) + 1
        problem = "stands still" if times[k] == times[k - 1] else "runs backwards"
        complain(
            path,
            "time column",
            f"time {problem}: {times[k]:g} s after {times[k - 1]:g} s",
            "sort the rows and give each time once",
            lines[k],
        )
