"""A run kept in memory: the chunks of the time loop, joined when it ends."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.base import AnyArray
from linkwise.record.provenance import plain
from linkwise.record.schema import TIME_ATTRS, Coordinate, Schema

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
            coords=_coordinates(time, self._schema.coordinates),
            attrs={name: plain(value) for name, value in self._attrs.items()},
        )


# Of labels that most runs share, such as fx ... tz. An index takes as long to make as 4 variables.
_indexed: dict[str, tuple[AnyArray, xr.Coordinates]] = {}


def _coordinates(time: AnyArray, given: Mapping[str, Coordinate]) -> xr.Coordinates:
    import xarray as xr

    own: dict[str, Any] = {"time": ("time", time, dict(TIME_ATTRS))}
    shared = {}
    for name, coordinate in given.items():
        values = coordinate.values
        if name in ("joint", "dof", "coordinate") or (name,) != coordinate.dims or coordinate.attrs:
            own[name] = (coordinate.dims, values, dict(coordinate.attrs))
            continue
        known = _indexed.get(name)
        if known is None or not np.array_equal(known[0], values):
            known = _indexed[name] = (values, xr.Coordinates({name: (coordinate.dims, values)}))
        shared[name] = known[1]
    made = xr.Coordinates(own)
    variables, indexes = dict(made.variables), dict(made.xindexes)
    for name, one in shared.items():
        variables[name] = one.variables[name].copy(deep=False)
        indexes[name] = one.xindexes[name]
    ordered = {name: variables[name] for name in ("time", *given)}
    return xr.Coordinates(ordered, indexes=indexes)
