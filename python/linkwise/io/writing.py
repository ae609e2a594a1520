"""Writing a file that a person named: whole or not at all, and in place of files alone."""

from __future__ import annotations

import errno
import os
import secrets
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from linkwise._core import InputError

# A spreadsheet takes a cell that starts with one of these for a formula.
_FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r")


@dataclass(frozen=True)
class _Target:
    """Where to write: a file to be replaced, or a device or pipe to be written into."""

    shown: str
    path: Path  # absolute, so that it stays the same place when the process changes its folder
    is_stream: bool

    def error(self, problem: str) -> InputError:
        return InputError(f"{self.shown}: {problem}; choose another path")


def _ask(path: str | os.PathLike[str]) -> _Target:
    """What stands at `path`; InputError where no file can be written. Nothing is changed."""
    target = _Target(repr(os.fspath(path)), Path(os.path.abspath(path)), False)
    place = target.path
    try:
        if place.is_symlink():
            # Links stay what they are: the file that they lead to is replaced. Only those of open
            # files, such as /dev/stdout, lead to no name.
            if os.readlink(place).startswith("/proc/"):
                return _Target(target.shown, place, True)
            place = Path(os.path.realpath(place))
        mode = os.stat(place).st_mode
    except FileNotFoundError:
        mode = None
    except (OSError, ValueError) as error:
        raise target.error(f"cannot be written ({_reason(error)})") from None
    if not os.path.isdir(place.parent):
        raise InputError(
            f"{target.shown}: folder {str(place.parent)!r} does not exist; create it first"
        )
    if mode is not None and stat.S_ISDIR(mode):
        raise InputError(f"{target.shown}: is a folder; give a file name")
    if mode is None or stat.S_ISREG(mode):
        if not os.access(place if mode is not None else place.parent, os.W_OK):
            raise target.error("may not be written")
        return _Target(target.shown, place, False)
    if stat.S_ISCHR(mode) or stat.S_ISFIFO(mode):
        return _Target(target.shown, place, True)
    raise target.error("is no file that can be replaced or written into")


def _reason(error: Exception) -> str:
    return " ".join(str(getattr(error, "strerror", None) or error).split())


def check_file(path: str | os.PathLike[str]) -> None:
    """InputError where `written_whole` cannot write, found before anything is computed."""
    _ask(path)


@contextmanager
def written_whole(path: str | os.PathLike[str], expected_bytes: int = 0) -> Iterator[Path]:
    """A name to write to, whose content gets to `path` when all went well: never half a file.

    A regular file is replaced, also at the end of a link. A character device or a pipe with a
    reader is written into. `expected_bytes` must be free, for libraries that crash on a full disk.

    Raises:
        InputError: something else stands there, or it cannot be written.
    """
    target = _ask(path)
    try:
        if target.is_stream:
            with tempfile.TemporaryDirectory(prefix="linkwise-") as folder:
                whole = Path(folder) / (target.path.name or "file")
                _check_room(target, Path(folder), expected_bytes)
                yield whole
                _pour(whole, target)
            return
        aside = target.path.with_name(f".{target.path.name}.{secrets.token_hex(4)}.new")
        _check_room(target, target.path.parent, expected_bytes)
        try:
            yield aside
            with suppress(FileNotFoundError):
                shutil.copymode(target.path, aside)
            os.replace(aside, target.path)
        finally:
            aside.unlink(missing_ok=True)
    except OSError as error:
        raise target.error(f"cannot be written ({_reason(error)})") from error


def _check_room(target: _Target, folder: Path, expected: int) -> None:
    free = shutil.disk_usage(folder).free
    if expected > free:
        raise target.error(
            f"cannot be written (it takes {expected / 1e6:.0f} MB, {free / 1e6:.0f} MB are free)"
        )


def _pour(whole: Path, target: _Target) -> None:
    """Copy a file into a device or pipe."""
    try:
        # Opening a pipe that nobody reads would wait for ever.
        handle = os.open(target.path, os.O_WRONLY | os.O_APPEND | getattr(os, "O_NONBLOCK", 0))
    except OSError as error:
        if error.errno == errno.ENXIO:
            raise InputError(
                f"{target.shown}: nobody reads this pipe; start its reader first"
            ) from None
        raise
    os.set_blocking(handle, True)
    with open(handle, "wb") as stream, open(whole, "rb") as content:
        shutil.copyfileobj(content, stream)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a text file as `written_whole` does."""
    with written_whole(path) as aside:
        aside.write_text(text, encoding="utf-8")


def csv_cell(value: object) -> object:
    """`value` for a CSV file; text that a spreadsheet would compute gets an apostrophe in front."""
    if isinstance(value, str) and value.lstrip("'").startswith(_FORMULA_STARTS):
        return f"'{value}"
    return value


def spelled(cell: str) -> str:
    """The text for which csv_cell wrote `cell`."""
    is_marked = cell.startswith("'") and cell.lstrip("'").startswith(_FORMULA_STARTS)
    return cell[1:] if is_marked else cell
