"""Reading a whole file with a bound on its size, and resolving paths that input files name."""

from __future__ import annotations

import difflib
import os
import stat
from collections.abc import Sequence
from pathlib import Path

from linkwise._core import InputError
from linkwise.io.complaint import complain, shorten

MODEL_BYTES = 32 * 2**20
"""Largest model file read: about 90 000 links of URDF, which take 1.5 GB while they are read."""
TABLE_BYTES = 128 * 2**20
"""Largest CSV table read."""
SCENARIO_BYTES = 2**20
"""Largest scenario file read."""


def read_bytes(path: str | os.PathLike[str], kind: str, limit: int) -> bytes:
    """The bytes of a regular file of at most ``limit`` bytes; ``kind`` names it in complaints.

    Raises InputError for a missing file, a directory, a device or pipe (which might never end),
    a file without read permission and one that is too large.
    """
    try:
        with open(path, "rb", opener=_open_without_waiting) as file:
            mode = os.fstat(file.fileno()).st_mode
            if not stat.S_ISREG(mode):
                complain(path, kind, "is not a regular file", "give the path of a file")
            data = file.read(limit + 1)
    except InputError:  # itself a ValueError
        raise
    except FileNotFoundError:
        complain(path, kind, "no such file", f"check the path {_nearby(Path(path))}".rstrip())
    except IsADirectoryError:
        complain(path, kind, "is a directory", "give the path of a file in it")
    except PermissionError:
        complain(path, kind, "may not be read", "check its permissions")
    except (OSError, ValueError) as error:
        complain(path, kind, f"cannot be read ({shorten(error)})", "check the path")
    if len(data) > limit:
        complain(
            path,
            kind,
            f"is larger than {limit // 2**20} MiB",
            "build very large models with linkwise.ModelBuilder or linkwise.scenes"
            if limit == MODEL_BYTES
            else "split it or keep fewer rows",
        )
    return data


def _open_without_waiting(path: str, flags: int) -> int:
    # A named pipe without a writer would block the open for ever.
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def _nearby(path: Path) -> str:
    folder = path.parent
    if not os.path.isdir(folder):
        return f"(there is no directory '{shorten(folder, 200)}')"
    names = []
    with os.scandir(folder) as entries:
        for entry in entries:
            names.append(entry.name)
            if len(names) >= 1000:
                break
    matches = difflib.get_close_matches(path.name, names, n=1, cutoff=0.6)
    return f"(did you mean '{shorten(matches[0])}'?)" if matches else ""


def resolve_mesh(
    uri: str,
    model_file: str | os.PathLike[str],
    package_dirs: Sequence[str | os.PathLike[str]] = (),
) -> Path | None:
    """The local file that a mesh reference of a URDF means, or None if it does not exist.

    ``package://NAME/REST`` is looked for as NAME/REST below each of ``package_dirs`` (a directory
    that is itself called NAME counts too) and below every directory above the model file;
    ``file://`` and plain paths are taken relative to the model file. Nothing is ever fetched:
    any other scheme gives None.
    """
    folder = Path(model_file).resolve().parent
    scheme, separator, rest = uri.partition("://")
    if not separator:
        candidates = [folder / uri]
    elif scheme == "file":
        candidates = [Path(rest)]
    elif scheme == "package":
        package, _, inside = rest.partition("/")
        if not inside or ".." in Path(rest).parts:
            return None
        bases = [Path(d) for d in package_dirs]
        candidates = [base / rest for base in bases]
        candidates += [base / inside for base in bases if base.name == package]
        candidates += [base / rest for base in (folder, *folder.parents)]
        candidates += [base / inside for base in (folder, *folder.parents) if base.name == package]
    else:
        return None
    return next((c for c in candidates if _is_file(c)), None)


def _is_file(path: Path) -> bool:
    """Whether a file stands there; not where no file could, such as under 5,000 letters."""
    return os.path.isfile(path)  # Path.is_file raises there
