"""The model inside a run: its own description as bytes, in a group that xarray does not look into.

A run can then be shown and evaluated again where the model's file is not. The bytes are checked
when they are read and run no code. The path of the model's file stays out of them.
"""

from __future__ import annotations

import os
from pathlib import Path, PurePath

import numpy as np

from linkwise._core import InputError, Model

GROUP = "machine"
ARRAY = "description"
MOST_BYTES = 64 << 20
"""Longest description kept: about 200 000 links. A longer model must be at hand as its source."""
_CHUNK_BYTES = 4 << 20


def write_model(store: Path, model: Model) -> None:
    """Put the description of `model` into the run at `store`, unless it is too long."""
    import zarr

    if model.n_joints > MOST_BYTES // 100:  # no link takes fewer bytes: spare the work
        return
    name = PurePath(model.source).name if model.source else ""
    content = np.frombuffer(model.to_bytes(source=name), dtype=np.uint8)
    if content.size > MOST_BYTES:
        return
    group = zarr.open_group(store / GROUP, mode="w", zarr_format=3)
    array = group.create_array(
        ARRAY, shape=content.shape, chunks=(min(content.size, _CHUNK_BYTES),), dtype="uint8"
    )
    array[:] = content


def read_model(store: str | os.PathLike[str]) -> Model:
    """The model that the run at `store` simulated; InputError if the run does not hold it."""
    import zarr

    shown = f"run {os.fspath(store)!r}"
    if not (Path(store) / GROUP).is_dir():
        raise InputError(
            f"{shown}: does not hold its model (it is too large, or an older linkwise wrote the "
            "run); give the model file as well"
        )
    try:
        array = zarr.open_group(Path(store) / GROUP, mode="r", use_consolidated=False)[ARRAY]
        if not isinstance(array, zarr.Array) or array.dtype != np.uint8:
            raise ValueError("its model is not made of bytes")
        if array.size > MOST_BYTES:
            raise ValueError("its model is too large")
        return Model.from_bytes(np.asarray(array[:]).tobytes())
    except (OSError, RuntimeError, ValueError, KeyError, TypeError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"{shown}: is damaged ({reason}); simulate again") from None
