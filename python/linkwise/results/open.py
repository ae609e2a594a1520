"""Opening runs, finished or not."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

from linkwise._core import InputError
from linkwise.io.complaint import check_path
from linkwise.record.checksums import LIST
from linkwise.record.claim import is_being_written, run_attributes
from linkwise.record.provenance import FORMAT_KEY, FORMAT_VERSION, UNFINISHED
from linkwise.record.read import open_dataset
from linkwise.record.replace import restore
from linkwise.results.run import Run


def open_run(path: str | os.PathLike[str]) -> Run:
    """Open a run that linkwise wrote, also one that was killed or still goes on.

    Arrays are read when they are used. A run that has not ended has the outcome "running" while
    its process lives and "killed" afterwards, and holds the samples that were written whole.

    Raises:
        InputError: there is no linkwise run at `path`, or a file that all of it needs is damaged.
            What is damaged elsewhere is said when it is read.

    A run whose list of checksums is missing is read with a warning.
    """
    check_path("run", path)
    where = Path(os.path.abspath(path))
    shown = f"run {str(path)!r}"
    restore(where)
    if not os.path.exists(where):  # Path.exists raises where a name is too long
        raise InputError(f"{shown}: does not exist; give a folder that linkwise wrote")
    attrs = run_attributes(where)
    listed = (where / LIST).is_file()
    if attrs is None:
        if listed:
            raise InputError(f"{shown}: zarr.json is damaged; copy the run again or simulate again")
        raise InputError(f"{shown}: is not a linkwise run; give a folder that linkwise wrote")
    version = attrs[FORMAT_KEY]
    if version != FORMAT_VERSION:
        raise InputError(
            f"{shown}: has format {str(version)[:20]}, this linkwise reads {FORMAT_VERSION}; "
            "update linkwise, or simulate again"
        )
    if not listed:
        warnings.warn(
            f"{shown}: has no checksums ({LIST} is missing); damage to its files would not be "
            "noticed",
            UserWarning,
            stacklevel=2,
        )
    living = is_being_written(where)
    dataset = open_dataset(where, finished=attrs.get("outcome") != UNFINISHED)
    if dataset.attrs.get("outcome") == UNFINISHED:
        dataset.attrs["outcome"] = "running" if living else "killed"
    return Run(dataset, path=where)
