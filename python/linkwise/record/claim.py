"""Which output paths may be written, and who is writing them."""

from __future__ import annotations

import contextlib
import json
import os
from pathlib import Path
from typing import Any

from linkwise._core import InputError
from linkwise.io.complaint import check_path
from linkwise.io.files import read_bytes
from linkwise.record.provenance import FORMAT_KEY

fcntl: Any
try:
    import fcntl
except ModuleNotFoundError:  # no POSIX: runs are not protected from a second writer
    fcntl = None


MOST_ATTRIBUTES = 16 << 20


def run_attributes(path: Path) -> dict[str, Any] | None:
    """The attributes of the linkwise run at `path`, None where there is no such run."""
    try:
        content = json.loads(read_bytes(path / "zarr.json", "run", MOST_ATTRIBUTES))
        attrs: dict[str, Any] = content["attributes"]
        return attrs if FORMAT_KEY in attrs else None
    except (ValueError, KeyError, TypeError, RecursionError):
        return None


def is_run(path: Path) -> bool:
    """Whether `path` is a linkwise run, judged by the attributes of its Zarr group."""
    return run_attributes(path) is not None


def hold(path: Path) -> int | None:
    """Lock a run's folder for writing; the system releases the lock when the process ends.

    Returns None where the file system has no locks.
    """
    if fcntl is None:
        return None
    handle = os.open(path, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(handle)
        return None
    return handle


def release(handle: int | None) -> None:
    if handle is not None:
        with contextlib.suppress(OSError):
            os.close(handle)


def is_being_written(path: Path) -> bool:
    """Whether a living process holds the run at `path`."""
    if fcntl is None:
        return False
    try:
        handle = os.open(path, os.O_RDONLY)
    except OSError:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    finally:
        os.close(handle)
    return False


def check_target(path: str | os.PathLike[str]) -> None:
    """Refuse an output path that must not or cannot be written; nothing is created."""
    check_path("output", path)
    target = Path(path)
    shown = f"output {str(path)!r}"
    if not target.name:
        raise InputError(f"{shown}: names no file; give a path such as 'run.zarr'")
    parent = target.parent
    if not os.path.isdir(parent):
        raise InputError(f"{shown}: folder {str(parent)!r} does not exist; create it first")
    if not os.access(parent, os.W_OK | os.X_OK):
        raise InputError(f"{shown}: folder {str(parent)!r} is not writable; choose another")
    if not os.path.lexists(target):
        return
    if target.is_symlink() or not target.is_dir():
        raise InputError(f"{shown}: exists and is not a linkwise run; remove it or choose another")
    if not any(target.iterdir()):
        return
    if not is_run(target):
        raise InputError(f"{shown}: exists and is not a linkwise run; remove it or choose another")
    if is_being_written(target):
        raise InputError(f"{shown}: is being written by another process; choose another path")


def unused_path(path: str | os.PathLike[str]) -> Path:
    """`path`, or with -2, -3, ... before its suffix when something is there already."""
    first = Path(path)
    candidate, number = first, 1
    while os.path.lexists(candidate):
        number += 1
        candidate = first.with_name(f"{first.stem}-{number}{first.suffix}")
    return candidate
