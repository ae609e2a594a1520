"""The checksums of a run's files, and reading these files with care.

A file tells of damage only where something else says what it should hold. Chunks carry a checksum
of their own (Zarr's crc32c), which finds changed bits; `files/checksums.txt` lists every file with
its CRC-32, which finds files that are missing, exchanged or changed in their descriptions as well.

The list is only ever appended to while a run goes on, and a file's line comes before the file: a
process that is killed between the two leaves the older file, whose line is in the list, too.
"""

from __future__ import annotations

import os
import stat
import zlib
from pathlib import Path
from typing import Any

from linkwise._core import InputError
from linkwise.base import printable

GROUP = "files"
LIST = f"{GROUP}/checksums.txt"
MOST_CHUNK_BYTES = 256 << 20
"""Largest file read, and largest chunk unpacked: what linkwise writes stays far below."""

Checksums = dict[str, list[int]]


def checksum(data: Any) -> int:
    return zlib.crc32(data)


def read_list(folder: Path) -> Checksums | None:
    """The checksums that each file has had, the newest last; None without a list.

    A line that a killed process left half, or that is damaged, is left out.
    """
    try:
        text = plain_bytes(folder, LIST)
    except InputError:
        return {}
    if text is None:
        return None
    found: Checksums = {}
    for line in text.decode("utf-8", "replace").split("\n")[:-1]:
        digits, _, key = line.partition(" ")
        try:
            number = int(digits, 16)
        except ValueError:
            continue
        found.setdefault(key, []).append(number)
    return found


def write_list(folder: Path, checksums: Checksums) -> None:
    """Replace the list by one with the newest checksum of each file."""
    aside = folder / f"{LIST}.partial"
    lines = (f"{numbers[-1]:08x} {key}\n" for key, numbers in sorted(checksums.items()))
    aside.write_bytes("".join(lines).encode("utf-8"))
    os.replace(aside, folder / LIST)


def damage(folder: Path, key: str, problem: str) -> InputError:
    text = (
        f"run {str(folder)!r}: {key} {problem}; what needs this file cannot be read, copy the run "
        "again or simulate again"
    )
    return InputError(printable(text))


def plain_bytes(folder: Path, key: str) -> bytes | None:
    """The bytes of a regular file inside `folder`, None where there is none.

    A run from elsewhere may hold anything: links that lead out of it, pipes and devices that never
    end, and files larger than memory are refused.
    """
    path = folder / key
    if os.path.realpath(path) != os.path.join(os.path.realpath(folder), *key.split("/")):
        raise damage(folder, key, "is a link or lies behind one")
    try:
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    except (FileNotFoundError, NotADirectoryError, IsADirectoryError):
        return None
    except OSError as error:
        raise damage(folder, key, f"cannot be read ({error.strerror})") from None
    try:
        about = os.fstat(handle)
        if stat.S_ISDIR(about.st_mode):
            return None
        if not stat.S_ISREG(about.st_mode):
            raise damage(folder, key, "is no regular file")
        if about.st_size > MOST_CHUNK_BYTES:
            raise damage(folder, key, f"is larger than {MOST_CHUNK_BYTES >> 20} MiB")
        with open(handle, "rb", closefd=False) as file:
            return file.read(MOST_CHUNK_BYTES)
    except OSError as error:
        raise damage(folder, key, f"cannot be read ({error.strerror})") from None
    finally:
        os.close(handle)


def reason(error: BaseException) -> str:
    """What an exception of a library says, on one line."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:200]
