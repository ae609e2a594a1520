"""The arrays of a stored run, cut to the samples that were written whole."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.record.labels import text_array
from linkwise.record.schema import ORDER

if TYPE_CHECKING:
    import xarray as xr


def _complete_samples(times: np.ndarray[Any, Any]) -> int:
    """Samples before the first that was not written; `time` is written last."""
    missing = np.flatnonzero(np.isnan(times))
    return int(missing[0]) if missing.size else int(times.size)


def open_dataset(path: Path) -> xr.Dataset:
    """All arrays, read when used, cut to the complete samples; labels are read at once."""
    import xarray as xr

    with warnings.catch_warnings():
        # A process that was killed while it replaced a file leaves the replacement beside the
        # arrays.
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
