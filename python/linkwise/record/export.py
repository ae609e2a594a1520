"""Exporting a run to NetCDF and CSV."""

from __future__ import annotations

import csv
import itertools
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise._core import InputError
from linkwise.base import blocks
from linkwise.io.complaint import check_path, shown
from linkwise.io.writing import csv_cell, written_whole
from linkwise.record.extremes import PREFIX, ROWS
from linkwise.record.schema import DETERMINATE, TABLE

if TYPE_CHECKING:
    import xarray as xr

_NETCDF_HEAD = 1 << 17  # of names and attributes

_EXTREME_COLUMNS = ("minimum", "minimum_time", "maximum", "maximum_time")

# Scalars of one group share a table.
_GROUPS = {row["name"]: row["group"] for row in TABLE if row["axis"] == "none"}


def _blocks(variables: list[xr.DataArray]) -> Iterator[slice]:
    """Slices of time that keep what is read at once small."""
    count = variables[0].sizes["time"]
    row = sum(v.nbytes // max(1, count) for v in variables)
    return blocks(count, row)


def write_netcdf(dataset: xr.Dataset, path: str | os.PathLike[str]) -> Path:
    """All variables, block by block: a stored run may be larger than memory."""
    import h5netcdf

    check_path("path", path)
    target = Path(os.path.abspath(path))
    # HDF5 that finds no room leaves the process in a state in which it crashes later.
    size = sum(variable.nbytes for variable in dataset.variables.values()) + _NETCDF_HEAD
    with written_whole(path, size) as aside, h5netcdf.File(aside, "w") as file:
        file.dimensions = {str(name): size for name, size in dataset.sizes.items()}
        file.attrs.update(dataset.attrs)
        for name, variable in dataset.variables.items():
            made = file.create_variable(
                str(name), tuple(str(dim) for dim in variable.dims), _netcdf_type(variable.dtype)
            )
            made.attrs.update(variable.attrs)
            if variable.dtype.kind == "b":
                made.attrs["dtype"] = "bool"  # so that xarray reads booleans again
            if name in dataset.coords or "time" not in variable.dims:
                made[...] = _netcdf_values(variable.values)
            if name not in dataset.coords:
                extra = [str(c) for c in dataset[name].coords if c not in variable.dims]
                if extra:
                    made.attrs["coordinates"] = " ".join(extra)
        timed = [v for v in dataset.data_vars.values() if "time" in v.dims]
        for where in _blocks(timed) if timed else ():
            for array in timed:
                # Sweeps have their members before the time.
                place = tuple(where if dim == "time" else slice(None) for dim in array.dims)
                file.variables[str(array.name)][place] = array[place].values
    return target


def _netcdf_type(dtype: np.dtype[Any]) -> Any:
    if dtype.kind == "U":
        import h5py

        return h5py.string_dtype()
    return np.dtype(np.int8) if dtype.kind == "b" else dtype  # NetCDF knows no booleans


def _netcdf_values(values: Any) -> Any:
    if values.dtype.kind == "b":
        return values.astype(np.int8)
    return values.astype(object) if values.dtype.kind == "U" else values


def _columns(variable: xr.DataArray) -> list[str]:
    """Headings such as `elbow.fx [N]`; scalars are headed by their own name."""
    dims = [dim for dim in variable.dims if dim != "time"]
    labels = [variable[dim].values.tolist() for dim in dims]
    names = [".".join(map(str, parts)) for parts in itertools.product(*labels)]
    if not dims:
        names = [str(variable.name)]
    units = f"{variable.name}_units"
    if units in variable.coords:
        per = variable.coords[units]
        count = len(names) // per.size
        listed = per.values.tolist()
        # Units follow the first dimension of scalars, the last one (components) of loads.
        unit = listed * count if variable.dims[-1] == per.dims[0] and len(dims) > 1 else listed
    else:
        unit = [variable.attrs.get("units", "1")] * len(names)
    return [
        name if text == "1" else f"{name} [{text}]" for name, text in zip(names, unit, strict=True)
    ]


def _marked(dataset: xr.Dataset, name: str) -> list[str]:
    """Headings, which say which loads rigid bodies do not determine."""
    columns = _columns(dataset[name])
    if DETERMINATE not in dataset or dataset[name].dims[1:] != dataset[DETERMINATE].dims:
        return columns
    known = dataset[DETERMINATE].values.ravel().tolist()
    marks = ("" if one else " (not determinate)" for one in known)
    return [column + mark for column, mark in zip(columns, marks, strict=True)]


def _write_table(dataset: xr.Dataset, names: list[str], path: Path) -> None:
    variables = [dataset[name] for name in names]
    headings = ["time [s]", *(column for name in names for column in _marked(dataset, name))]
    with written_whole(path) as aside, open(aside, "w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(map(csv_cell, headings))
        times = dataset["time"].values
        for where in _blocks(variables):
            # Lists of Python numbers print their shortest exact form.
            parts = [v[where].values.reshape(where.stop - where.start, -1) for v in variables]
            rows = zip(times[where].tolist(), *(part.tolist() for part in parts), strict=True)
            table.writerows([time, *itertools.chain(*values)] for time, *values in rows)


def _write_extremes(dataset: xr.Dataset, names: list[str], path: Path) -> None:
    """A row per column of the tables of samples: its extremes, between the samples too."""
    taken = [ROWS.index(name) for name in _EXTREME_COLUMNS]
    with written_whole(path) as aside, open(aside, "w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        times = ("[s]" if name.endswith("time") else "" for name in _EXTREME_COLUMNS)
        headings = (f"{n} {t}".strip() for n, t in zip(_EXTREME_COLUMNS, times, strict=True))
        table.writerow(["quantity", "column", *headings])
        for name in names:
            values = dataset[PREFIX + name].values.reshape(len(ROWS), -1)[taken].T
            for column, row in zip(_marked(dataset, name), values.tolist(), strict=True):
                table.writerow([name, csv_cell(column), *("" if v != v else v for v in row)])


def write_csv(
    dataset: xr.Dataset, path: str | os.PathLike[str], quantity: str | None
) -> list[Path]:
    check_path("path", path)
    target = Path(os.path.abspath(path))
    tables: dict[str, list[str]] = {}
    for key, variable in dataset.data_vars.items():
        if "time" not in variable.dims:  # extremes
            continue
        tables.setdefault(_GROUPS.get(str(key), str(key)), []).append(str(key))
    if quantity is not None and quantity in itertools.chain(*tables.values()):
        wanted = {quantity: [quantity]}
    elif quantity is not None:
        if quantity not in tables:
            raise InputError(f"run holds no {shown(quantity)}; it holds {', '.join(tables)}")
        wanted = {quantity: tables[quantity]}
    else:
        wanted = tables
    if target.suffix.lower() == ".csv":
        if len(wanted) != 1:
            raise InputError(
                f"{str(path)!r} is one file and the run holds {', '.join(tables)}; "
                "name one with quantity= or give a folder"
            )
        ((_, names),) = wanted.items()
        _write_table(dataset, names, target)
        return [target]
    if os.path.exists(target) and not os.path.isdir(target):
        raise InputError(f"{str(path)!r}: exists and is not a folder; give a folder or a .csv file")
    try:
        target.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError(f"{str(path)!r}: cannot make the folder ({error.strerror})") from None
    written = []
    for name, names in wanted.items():
        written.append(target / f"{name}.csv")
        _write_table(dataset, names, written[-1])
    bounded = [name for name in itertools.chain(*wanted.values()) if PREFIX + name in dataset]
    if bounded:
        written.append(target / "extremes.csv")
        _write_extremes(dataset, bounded, written[-1])
    return written
