"""A run kept in memory: the chunks of the time loop, joined when it ends."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.base import AnyArray
from linkwise.record.provenance import plain
from linkwise.record.schema import TIME_ATTRS, Schema

if TYPE_CHECKING:
    import xarray as xr


class MemoryRecord:
    """Collects chunks; `finish` makes the xarray Dataset."""

    path = None

    def __init__(self, schema: Schema, attrs: Mapping[str, Any]) -> None:
        self._schema = schema
        self._attrs = dict(attrs)
        self._times: list[AnyArray] = []
        self._chunks: dict[str, list[AnyArray]] = {v.name: [] for v in schema.variables}

    def append(self, chunk: Mapping[str, Any]) -> None:
        times = np.array(chunk["time"], dtype=np.float64)
        if times.size == 0:
            return
        rows = {v.name: v.rows(chunk, times.size) for v in self._schema.variables}
        self._times.append(times)
        for name, values in rows.items():
            self._chunks[name].append(values)

    def finish(
        self, attrs: Mapping[str, Any], extremes: Mapping[str, AnyArray] | None = None
    ) -> xr.Dataset:
        import xarray as xr

        self._attrs.update(attrs)
        count = sum(times.size for times in self._times)
        time = np.concatenate(self._times) if self._times else np.zeros(0)
        coordinates = {
            name: (coordinate.dims, coordinate.values, dict(coordinate.attrs))
            for name, coordinate in self._schema.coordinates.items()
        }
        data = {}
        for variable in self._schema.variables:
            values = np.empty((count, *variable.shape), dtype=variable.dtype)
            chunks = self._chunks.pop(variable.name)
            if chunks:
                np.concatenate(chunks, out=values)
            data[variable.name] = (("time", *variable.dims), values, dict(variable.attrs))
        data |= {
            v.name: (v.dims, (extremes or {})[v.name], dict(v.attrs))
            for v in self._schema.timeless
            if extremes
        }
        return xr.Dataset(
            data,
            coords={"time": ("time", time, dict(TIME_ATTRS)), **coordinates},
            attrs={name: plain(value) for name, value in self._attrs.items()},
        )
