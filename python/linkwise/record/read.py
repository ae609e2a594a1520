"""The arrays of a stored run, checked and cut to the samples that were written whole.

A run from elsewhere is as untrusted as a model file: its sizes are believed only as far as its
files bear them out.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise._core import InputError
from linkwise.base import Array, printable
from linkwise.record.checksums import LIST, damage, reason
from linkwise.record.extremes import PREFIX
from linkwise.record.labels import text_array
from linkwise.record.model import GROUP
from linkwise.record.provenance import FORMAT_KEY
from linkwise.record.schema import BY_BEARINGS, DETERMINATE, ORDER

if TYPE_CHECKING:
    import xarray as xr

    from linkwise.record.checked_store import CheckedStore

_OTHER_GROUPS = {GROUP, Path(LIST).parent.name}


def _times(store: CheckedStore) -> Array:
    """The times before the first that was not written; `time` is written last.

    Read chunk by chunk, because the length of the array is a mere claim.
    """
    from linkwise.record.checked_store import open_array

    array = open_array(store, "time")
    if len(array.shape) != 1 or array.dtype != np.float64:
        raise damage(store.root, "time/zarr.json", "is no list of times")
    parts = []
    for start in range(0, array.shape[0], array.chunks[0]):
        key = f"time/c/{start // array.chunks[0]}"
        try:
            part = np.asarray(array[start : start + array.chunks[0]], dtype=np.float64)
        except InputError:
            raise
        except Exception as error:
            raise damage(store.root, key, f"is damaged ({reason(error)})") from None
        missing = np.flatnonzero(np.isnan(part))
        parts.append(part[: missing[0]] if missing.size else part)
        if missing.size:
            break
    times = np.concatenate(parts) if parts else np.zeros(0)
    if not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        raise damage(store.root, "time", "does not run forward")
    return times


def _labels(store: CheckedStore, name: str) -> Any:
    from linkwise.record.checked_store import dimensions, open_array

    array = open_array(store, name)
    try:
        texts = text_array([str(text) for text in np.asarray(array[:]).ravel().tolist()])
        return dimensions(array), texts.reshape(array.shape), dict(array.attrs)
    except InputError:
        raise
    except Exception as error:
        raise damage(store.root, f"{name}/c/0", f"is damaged ({reason(error)})") from None


def _names(store: CheckedStore) -> list[str]:
    """The arrays of the run; what else lies in its folder is not looked at."""
    if store.checksums is None:
        folders = (f.name for f in store.root.iterdir() if (f / "zarr.json").is_file())
        return sorted(set(folders) - _OTHER_GROUPS)
    listed = {key.partition("/")[0] for key in store.checksums if key.endswith("/zarr.json")}
    there = {f.name for f in store.root.iterdir() if (f / "zarr.json").is_file()}
    for name in sorted(there - listed - _OTHER_GROUPS):
        _left_out(damage(store.root, f"{name}/zarr.json", f"is not listed in {LIST}"), name)
    return sorted(listed - _OTHER_GROUPS)


def _left_out(error: InputError, name: str) -> None:
    warnings.warn(printable(f"{error}; {name} is left out"), UserWarning, stacklevel=2)


def _is_label(array: Any) -> bool:
    return array.dtype.kind in "TO"  # StringDType, objects before NumPy 2


def open_dataset(path: Path, *, finished: bool) -> xr.Dataset:
    """All arrays, read when used, cut to the complete samples; labels are read at once.

    An array whose description is damaged is left out with a warning; without its times or labels a
    run cannot be read.

    Raises:
        InputError: names the file that is damaged.
    """
    from linkwise.record.checked_store import CheckedStore, open_array

    store = CheckedStore(path, finished=finished)
    try:
        names = _names(store)
    except OSError as error:
        raise damage(store.root, "its folder", f"cannot be read ({error.strerror})") from None
    if "time" not in names:
        raise damage(store.root, "time/zarr.json", "is missing")
    times = _times(store)
    coordinates: dict[str, Any] = {}
    data = []
    for name in names:
        if name == "time":
            coordinates[name] = ("time", times, dict(open_array(store, name).attrs))
            continue
        try:
            array = open_array(store, name)
        except InputError as error:
            if name not in (*ORDER, DETERMINATE, BY_BEARINGS) and not name.startswith(PREFIX):
                raise
            _left_out(error, name)
            continue
        if _is_label(array):
            coordinates[name] = _labels(store, name)
        else:
            data.append(name)
    return _assemble(store, data, coordinates, times.size)


def _assemble(
    store: CheckedStore, data: list[str], coordinates: dict[str, Any], samples: int
) -> xr.Dataset:
    import xarray as xr

    store.names = data
    try:
        whole: xr.Dataset = xr.open_zarr(
            store,
            consolidated=False,
            zarr_format=3,
            chunks=None,
            decode_times=False,
            decode_coords=False,
            mask_and_scale=False,
        )
        if whole.sizes.get("time", samples) < samples:
            raise damage(store.root, "time", "is longer than the other arrays")
        # A folder lists its arrays in any order.
        rank = {name: k for k, name in enumerate(ORDER)}
        ranked = sorted(data, key=lambda name: (rank.get(name, len(rank)), name))
        cut = whole.isel(time=slice(samples)) if "time" in whole.sizes else whole
        dataset: xr.Dataset = cut[ranked].assign_coords(coordinates)
    except InputError:
        raise
    except Exception as error:
        shown = f"run {str(store.root)!r}"
        raise InputError(
            f"{shown}: is damaged ({reason(error)}); copy it again or simulate again"
        ) from None
    if FORMAT_KEY not in dataset.attrs:
        raise damage(store.root, "zarr.json", "is damaged: it is not that of a run")
    return dataset
