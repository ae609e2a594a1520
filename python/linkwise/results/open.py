"""Opening runs, finished or not."""

from __future__ import annotations

import os
from pathlib import Path

from linkwise._core import InputError
from linkwise.record.claim import is_being_written, is_run
from linkwise.record.provenance import FORMAT_KEY, FORMAT_VERSION, UNFINISHED
from linkwise.record.read import open_dataset
from linkwise.results.run import Run


def open_run(path: str | os.PathLike[str]) -> Run:
    """Open a run that linkwise wrote, also one that was killed or still goes on.

    Arrays are read when they are used. A run that has not ended has the outcome "running" while
    its process lives and "killed" afterwards, and holds the samples that were written whole.

    Raises:
        InputError: there is no linkwise run at `path`.
    """
    where = Path(path)
    shown = f"run {str(path)!r}"
    if not where.exists():
        raise InputError(f"{shown}: does not exist; give a folder that linkwise wrote")
    if not is_run(where):
        raise InputError(f"{shown}: is not a linkwise run; give a folder that linkwise wrote")
    try:
        living = is_being_written(where)
        dataset = open_dataset(where)
    except (OSError, ValueError, KeyError, TypeError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"{shown}: is damaged ({reason}); simulate again") from error
    if dataset.attrs[FORMAT_KEY] != FORMAT_VERSION:
        raise InputError(
            f"{shown}: has format {dataset.attrs[FORMAT_KEY]}, this linkwise reads "
            f"{FORMAT_VERSION}; update linkwise"
        )
    if dataset.attrs.get("outcome") == UNFINISHED:
        dataset.attrs["outcome"] = "running" if living else "killed"
    return Run(dataset, path=where)
