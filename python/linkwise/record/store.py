"""A run on disk: a Zarr v3 group, written chunk by chunk along time.

Every array has its full length from the start and reads as "not written" (NaN) until its chunks
arrive, so nothing but chunk files changes while a run goes on. A chunk file is replaced as a whole
(zarr >= 3.1.3 writes aside and renames), and the `time` array is written after all others: the
samples whose time is finite are exactly those that are complete, wherever the process is killed.
"""

from __future__ import annotations

import contextlib
import os
import time as clock
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise._core import InputError
from linkwise.base import AnyArray
from linkwise.record.checksums import GROUP
from linkwise.record.claim import check_target, hold, is_run, release
from linkwise.record.model import write_model
from linkwise.record.provenance import plain
from linkwise.record.read import open_dataset
from linkwise.record.replace import beside, clear_leftovers, remove_run, take_place
from linkwise.record.schema import TIME_ATTRS, Coordinate, Schema
from linkwise.record.variable import Variable

if TYPE_CHECKING:
    import xarray as xr
    import zarr

    from linkwise._core import Model

# A block of samples is held in memory and rewritten when flushed early; a chunk is one file.
SAMPLE_BLOCK_BYTES = 32 << 20
CHUNK_BYTES = 4 << 20
MAX_BLOCK_ROWS = 4096
SCALAR_ROWS = 4096
FLUSH_SECONDS = 2.0
SPARE = "spare"
SPARE_BYTES = 64 << 10
MOST_LINES = 100_000  # older ones in the list of checksums, which is then written anew


def block_rows(schema: Schema, total: int) -> int:
    """Samples per chunk: many for a small system, few for a large one."""
    fitting = max(1, SAMPLE_BLOCK_BYTES // schema.row_bytes)
    return int(max(1, min(fitting, MAX_BLOCK_ROWS, total)))


def chunk_shape(variable: Variable, rows: int) -> tuple[int, ...]:
    """Chunks hold one block in time and are cut along joints when they get large.

    Scalars get longer chunks, rewritten with every block: a large system has blocks of few samples,
    and as many files per scalar would take long to open.
    """
    if not variable.shape:
        return (max(rows, SCALAR_ROWS),)
    if variable.shape[0] == 0:
        return (rows, *(max(1, size) for size in variable.shape))
    first, *rest = variable.shape
    bytes_each = rows * variable.dtype.itemsize * int(np.prod(rest, dtype=np.int64))
    return (rows, max(1, min(first, CHUNK_BYTES // max(1, bytes_each))), *rest)


class RunWriter:
    """Writes one run to `path`, which appears at once and whole: a group with no samples yet.

    An existing linkwise run at `path` is replaced when this one has samples beyond its start;
    anything else there is refused.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        schema: Schema,
        attrs: Mapping[str, Any],
        *,
        samples: int,
        model: Model | None = None,
        flush_seconds: float = FLUSH_SECONDS,
        extremes: Callable[[], Mapping[str, AnyArray]] | None = None,
    ) -> None:
        self._shown = repr(os.fspath(path))
        # Absolute: a drive or another thread may change the folder of the process.
        target = Path(os.path.abspath(path))
        clear_leftovers(target)
        check_target(path)
        self.path: Path | None = target
        self._schema = schema
        self._samples = samples
        self._rows = block_rows(schema, samples)
        self._flush_seconds = flush_seconds
        self._extremes = extremes
        self._written = 0
        self._pending: list[tuple[AnyArray, dict[str, AnyArray]]] = []
        self._waiting = 0
        self._flushed = clock.monotonic()
        self._broken = False
        self._aside: Path | None = beside(target, "new")
        self._old_lock: int | None = None
        try:
            os.mkdir(self._aside)
        except OSError as error:
            raise InputError(
                f"output {self._shown}: cannot write there ({error.strerror}); choose another path"
            ) from None
        self._lock = hold(self._aside)
        try:
            self._create(self._aside, attrs, model)
            if is_run(target):  # stays until this run has samples
                self._old_lock = hold(target)
                self._open(self._aside)
            else:
                self._take_place()
        except BaseException as error:
            self._give_up()
            if isinstance(error, OSError):
                raise OSError(
                    f"output {self._shown}: cannot be written ({error.strerror}); make room or "
                    "choose another path"
                ) from error
            raise

    def _take_place(self) -> None:
        assert self._aside is not None
        assert self.path is not None
        release(self._old_lock)
        self._old_lock = None
        take_place(self._aside, self.path)
        self._aside = None
        self._open(self.path)

    def _give_up(self) -> None:
        """Nobody writes any more; a run that never took its place goes."""
        release(self._lock)
        release(self._old_lock)
        self._lock = self._old_lock = None
        if self._aside is not None:
            remove_run(self._aside)

    def _open(self, where: Path) -> None:
        import zarr

        from linkwise.record.checked_store import WritingStore

        self._store = WritingStore(where)
        group = zarr.open_group(self._store, mode="r+", zarr_format=3, use_consolidated=False)
        kept = (*self._schema.variables, *self._schema.timeless)
        names = ["time", *(variable.name for variable in kept)]
        # A chunk that holds nothing but fill values is a file, too: one that is missing is damage.
        with zarr.config.set({"array.write_empty_chunks": True}):
            self._arrays: dict[str, Any] = {name: group[name] for name in names}
        self._group = group

    def _create(self, where: Path, attrs: Mapping[str, Any], model: Model | None) -> None:
        import zarr

        from linkwise.record.checked_store import WritingStore, packing

        # Mode "w" would drop the locked folder.
        group = zarr.open_group(WritingStore(where), mode="a", zarr_format=3)
        group.create_group(GROUP)
        time = Variable("time", (), (), np.dtype(np.float64), TIME_ATTRS)
        for variable in (time, *self._schema.variables):
            whole_numbers = variable.dtype.kind == "i"
            group.create_array(
                variable.name,
                shape=(self._samples, *variable.shape),
                chunks=chunk_shape(variable, self._rows),
                dtype=variable.dtype,
                fill_value=0 if whole_numbers else np.nan,
                dimension_names=("time", *variable.dims),
                attributes={**variable.attrs},
                compressors=packing(),
            )
        for variable in self._schema.timeless:
            group.create_array(
                variable.name,
                shape=variable.shape,
                chunks=tuple(max(1, size) for size in variable.shape),
                dtype=variable.dtype,
                fill_value=False if variable.dtype.kind == "b" else np.nan,
                dimension_names=variable.dims,
                attributes={**variable.attrs},
                compressors=packing(),
            )
        for name, coordinate in self._schema.coordinates.items():
            _create_text(group, name, coordinate)
        if model is not None:
            write_model(group, model)
        group.update_attributes({name: plain(value) for name, value in attrs.items()})
        # Room for the last words of a run that fills the disk; no file system packs these bytes.
        size = SPARE_BYTES + 2 * (where / "zarr.json").stat().st_size
        with contextlib.suppress(OSError):  # without it the run ends as one that was killed
            (where / GROUP / SPARE).write_bytes(os.urandom(size))

    def append(self, chunk: Mapping[str, Any]) -> None:
        """Take what one call of `Simulation.advance` returned."""
        times = np.array(chunk["time"], dtype=np.float64)
        if times.size == 0:
            return
        if self._written + self._waiting + times.size > self._samples:
            raise ValueError("more samples than the run was created for")
        # `rows` may hand out views of the caller's arrays; what is kept must not change later.
        rows = {v.name: v.rows(chunk, times.size).copy() for v in self._schema.variables}
        self._pending.append((times, rows))
        self._waiting += times.size
        while self._waiting >= self._to_boundary():
            self._write(self._to_boundary())
        if self._waiting and clock.monotonic() - self._flushed >= self._flush_seconds:
            self._write(self._waiting)

    def _to_boundary(self) -> int:
        """Samples that complete the current chunk."""
        return min(self._rows, self._samples) - self._written % self._rows

    def _take(self, count: int) -> tuple[AnyArray, dict[str, AnyArray]]:
        """The first `count` waiting samples, joined."""
        taken: list[tuple[AnyArray, dict[str, AnyArray]]] = []
        missing = count
        while missing:
            times, rows = self._pending.pop(0)
            if times.size > missing:
                rest = {name: values[missing:] for name, values in rows.items()}
                self._pending.insert(0, (times[missing:], rest))
                times = times[:missing]
                rows = {name: values[:missing] for name, values in rows.items()}
            taken.append((times, rows))
            missing -= times.size
        if len(taken) == 1:
            return taken[0]
        names = [variable.name for variable in self._schema.variables]
        joined = {name: np.concatenate([rows[name] for _, rows in taken]) for name in names}
        return np.concatenate([times for times, _ in taken]), joined

    def _write(self, count: int) -> None:
        times, rows = self._take(count)
        self._waiting -= count
        where = slice(self._written, self._written + count)
        try:
            for name, values in rows.items():
                self._arrays[name][where] = values
            if self._extremes is not None and self._schema.timeless:
                self._write_extremes(self._extremes())
            self._arrays["time"][where] = times  # last: it says that the others are complete
            self._store.shorten_list(MOST_LINES)
        except OSError as error:
            self._broken = True  # later samples must not come in the place of these
            raise OSError(
                f"output {self._shown}: cannot be written further ({error.strerror}); make "
                f"room or choose another path (the {self._written} samples there are complete)"
            ) from error
        self._written += count
        self._flushed = clock.monotonic()
        if self._aside is not None and self._written > 1:  # more than the state at the start
            self._take_place()

    def _write_extremes(self, found: Mapping[str, AnyArray]) -> None:
        for name, values in found.items():
            if values.size:
                self._arrays[name][...] = values

    def flush(self) -> None:
        if self._waiting and not self._broken:
            self._write(self._waiting)

    def finish(
        self, attrs: Mapping[str, Any], extremes: Mapping[str, AnyArray] | None = None
    ) -> xr.Dataset:
        """Write what waits, the extremes and the final attributes; return the opened results.

        A run that failed at its start does not take the place of an older one: it is returned in
        memory, and `path` is None.
        """
        folder = self._store.root
        try:
            (folder / GROUP / SPARE).unlink(missing_ok=True)
            try:
                self.flush()
                if extremes:
                    self._write_extremes(extremes)
                elif self._schema.extremes:
                    self._write_extremes(self._schema.extremes.empty())
            finally:
                self._group.update_attributes({name: plain(value) for name, value in attrs.items()})
                with contextlib.suppress(OSError):
                    self._store.shorten_list()
            if self._aside is not None and attrs.get("outcome") == "converged":
                self._take_place()
            if self._aside is None:
                return open_dataset(self._store.root, finished=True)
            self.path = None
            return open_dataset(self._aside, finished=True).load()
        finally:
            self._give_up()


def _create_text(group: zarr.Group, name: str, coordinate: Coordinate) -> None:
    """Text as Zarr's `string` type: fixed-width text has no Zarr v3 specification."""
    from linkwise.record.checked_store import packing

    values = coordinate.values
    array = group.create_array(
        name,
        shape=values.shape,
        chunks=tuple(max(1, size) for size in values.shape),
        dtype="string",
        dimension_names=coordinate.dims,
        attributes={**coordinate.attrs},
        compressors=packing(),
    )
    if values.size:
        array[:] = values.astype(object)
