"""The model inside a run: its own description as bytes, in a group that xarray does not look into.

A run can then be shown and evaluated again where the model's file is not. The bytes are checked
when they are read and run no code. The path of the model's file stays out of them.
"""

from __future__ import annotations

import os
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

import numpy as np

from linkwise._core import InputError, Model
from linkwise.record.checksums import damage, reason

if TYPE_CHECKING:
    import zarr

GROUP = "machine"
ARRAY = "description"
MOST_BYTES = 64 << 20
"""Longest description kept: about 200 000 links. A longer model must be at hand as its source."""
_CHUNK_BYTES = 4 << 20


def write_model(run: zarr.Group, model: Model) -> None:
    """Put the description of `model` into the group of a run, unless it is too long."""
    if model.n_joints > MOST_BYTES // 100:  # no link takes fewer bytes: spare the work
        return
    name = PurePath(model.source).name if model.source else ""
    from linkwise.record.checked_store import packing

    content = np.frombuffer(model.to_bytes(source=name), dtype=np.uint8)
    if content.size > MOST_BYTES:
        return
    array = run.create_group(GROUP).create_array(
        ARRAY,
        shape=content.shape,
        chunks=(min(content.size, _CHUNK_BYTES),),
        dtype="uint8",
        compressors=packing(),
    )
    array[:] = content


def read_model(path: str | os.PathLike[str]) -> Model:
    """The model that the run at `path` simulated; InputError if the run does not hold it."""
    from linkwise.record.checked_store import CheckedStore, open_array

    folder = Path(os.path.abspath(path))
    store = CheckedStore(folder)
    if not (folder / GROUP).is_dir() and f"{GROUP}/zarr.json" not in (store.checksums or {}):
        raise InputError(
            f"run {str(folder)!r}: does not hold its model, which is too large; give the model "
            "file as well"
        )
    name = f"{GROUP}/{ARRAY}"
    array = open_array(store, name)
    if array.dtype != np.uint8 or array.size > MOST_BYTES:
        raise damage(folder, f"{name}/zarr.json", "is not that of a model")
    try:
        content = np.asarray(array[:]).tobytes()
    except InputError:
        raise
    except Exception as error:
        raise damage(folder, f"{name}/c/0", f"is damaged ({reason(error)})") from None
    try:
        return Model.from_bytes(content)
    except Exception as error:
        raise damage(folder, name, f"is damaged ({reason(error)})") from None
