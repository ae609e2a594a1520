"""A new run in the place of an older one: what linkwise wrote goes, what a person put there stays.

Beside a run `r.zarr` there may be `.r.zarr.XXXXXXXX.new`, a run that has not taken its place yet,
and `.r.zarr.XXXXXXXX.old`, one that has lost it. Both are gone a moment later, unless their process
is killed: then the next run at that path clears them away, and an older run that was moved aside
comes back as soon as it is asked for.
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
from collections.abc import Collection, Iterator
from pathlib import Path

from linkwise._core import InputError
from linkwise.record.checksums import GROUP, read_list
from linkwise.record.claim import check_target, hold, is_run, release
from linkwise.record.model import GROUP as MACHINE
from linkwise.record.schema import ORDER

# The folders of a run that does not list its files.
_FOLDERS = {"time", *ORDER, MACHINE, GROUP, "joint", "body", "component", "coordinate", "dof"}
_FOLDERS |= {"wrenched_body", *(f"{name}_units" for name in ORDER)}
# What linkwise writes into them: descriptions, chunks, halves of both that a killed process left.
_FILE = re.compile(
    r"(?:description/)?(?:zarr\.json|c(?:/\d+)*)"
    r"|(?:description/)?(?:c/)?(?:\d+/)*(?:zarr|c|\d+)(?:\.[0-9a-f]{32})?\.partial"
    r"|checksums\.txt(?:\.partial)?|spare"
)


def beside(path: Path, what: str) -> Path:
    """A name beside `path` for a run that is "new" or "old"."""
    return path.with_name(f".{path.name}.{secrets.token_hex(4)}.{what}")


def _leftovers(path: Path, what: str) -> list[Path]:
    """Runs beside `path` whose process has ended."""
    shape = re.compile(rf"\.{re.escape(path.name)}\.[0-9a-f]{{8}}\.{what}")
    try:
        found = sorted(f for f in path.parent.iterdir() if shape.fullmatch(f.name))
    except OSError:
        return []
    return [f for f in found if f.is_dir() and not f.is_symlink() and _is_abandoned(f)]


def _is_abandoned(run: Path) -> bool:
    """Whether no process writes a run; not so where there are no locks that could tell."""
    lock = hold(run)
    release(lock)
    return lock is not None


def restore(path: Path) -> None:
    """Bring an older run back whose process was killed before the new one took its place."""
    if not os.path.lexists(path):
        for old in _leftovers(path, "old"):
            with contextlib.suppress(OSError):
                os.rename(old, path)
                return


def clear_leftovers(path: Path) -> None:
    """Remove what killed processes left beside `path`; a person's files go back to the run."""
    restore(path)
    for old in _leftovers(path, "old"):
        if is_run(path):
            carry_over(old, path)
    for new in _leftovers(path, "new"):
        remove_run(new)


def _folders(run: Path) -> Collection[str]:
    listed = read_list(run)
    return {key.partition("/")[0] for key in listed} | {GROUP} if listed else _FOLDERS


def _entries(run: Path) -> Iterator[tuple[Path, bool]]:
    """What lies in a run's folder, and whether linkwise wrote it; links are not followed."""
    folders = _folders(run)
    for entry in sorted(run.iterdir()):
        if entry.is_symlink() or not entry.is_dir():
            yield entry, bool(_FILE.fullmatch(entry.name))
        elif entry.name not in folders:
            yield entry, False
        else:
            for base, below, files in os.walk(entry):
                links = [name for name in below if os.path.islink(os.path.join(base, name))]
                for name in [*files, *links]:
                    file = Path(base, name)
                    yield file, bool(_FILE.fullmatch(file.relative_to(entry).as_posix()))


def remove_run(run: Path) -> None:
    """Delete what linkwise wrote in a folder, and the folders that become empty."""
    with contextlib.suppress(OSError):
        folders = _folders(run)  # from the list, which goes as well
        for entry, is_ours in list(_entries(run)):
            if is_ours:
                entry.unlink(missing_ok=True)
        emptied = [base for name in folders for base, _, _ in os.walk(run / name, topdown=False)]
        for base in [*emptied, str(run)]:
            with contextlib.suppress(OSError):  # it is not empty
                os.rmdir(base)


def carry_over(old: Path, new: Path) -> None:
    """Move a person's files from an old run to the new one, and remove the old.

    What cannot be moved stays where it is.
    """
    for entry, is_ours in list(_entries(old)):
        to = new / entry.relative_to(old)
        if not is_ours and not os.path.lexists(to):
            with contextlib.suppress(OSError):
                to.parent.mkdir(parents=True, exist_ok=True)
                os.rename(entry, to)
    remove_run(old)


def take_place(new: Path, path: Path) -> None:
    """Rename the run at `new` to `path`; a run there goes, a person's files in it stay.

    Raises InputError where something else has come to stand at `path`.
    """
    problem = ""
    for _ in range(8):  # who opens `path` in between may have restored the old run
        check_target(path)
        old = None
        if is_run(path):
            old = beside(path, "old")
            os.rename(path, old)
        try:
            os.rename(new, path)  # refuses a folder that is not empty, so nothing is lost
        except OSError as error:
            problem = str(error.strerror)
            if old is not None and not os.path.lexists(path):
                os.rename(old, path)
            continue
        if old is not None:
            carry_over(old, path)
        return
    raise InputError(f"output {str(path)!r}: cannot write there ({problem}); choose another path")
