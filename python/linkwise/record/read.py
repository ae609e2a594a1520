"""Opening runs, finished or not."""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise._core import InputError
from linkwise.record.claim import is_being_written, is_run
from linkwise.record.labels import text_array
from linkwise.record.provenance import FORMAT_KEY, FORMAT_VERSION, UNFINISHED
from linkwise.record.schema import ORDER

if TYPE_CHECKING:
    import xarray as xr

    from linkwise.result import Run


def _complete_samples(times: np.ndarray[Any, Any]) -> int:
    """Samples before the first that was not written; `time` is written last."""
    missing = np.flatnonzero(np.isnan(times))
    return int(missing[0]) if missing.size else int(times.size)


def open_dataset(path: Path) -> xr.Dataset:
    """All arrays, read when used, cut to the complete samples; labels are read at once."""
    import xarray as xr

    with warnings.catch_warnings():
        # A process killed while replacing a file leaves the replacement beside the arrays.
        warnings.filterwarnings("ignore", message="Object at .* is not recognized")
        whole: xr.Dataset = xr.open_zarr(
            path, consolidated=False, chunks=None, decode_times=False, mask_and_scale=False
        )
    dataset = whole.isel(time=slice(_complete_samples(whole["time"].values)))
    labels = {
        name: (values.dims, text_array(values.values.tolist()), values.attrs)
        for name, values in dataset.variables.items()
        if values.dtype.kind in "TO"  # StringDType, objects before NumPy 2
    }
    # A folder lists its arrays in any order.
    rank = {name: k for k, name in enumerate(ORDER)}
    names = sorted(dataset.data_vars, key=lambda name: (rank.get(str(name), len(rank)), str(name)))
    return dataset[names].assign_coords(labels)


def open_run(path: str | os.PathLike[str]) -> Run:
    """Open a run that linkwise wrote, also one that was killed or still goes on.

    Arrays are read when they are used. A run that has not ended has the outcome "running" while
    its process lives and "killed" afterwards, and holds the samples that were written whole.

    Raises:
        InputError: there is no linkwise run at `path`.
    """
    from linkwise.result import Run

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
