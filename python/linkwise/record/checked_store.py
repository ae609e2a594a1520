"""A run's folder as a Zarr store: read with every file checked, written with every file listed."""

from __future__ import annotations

import asyncio
import json
import math
import threading
from collections.abc import AsyncIterator, Collection, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import google_crc32c
import numcodecs.zstd
import zarr
from zarr.core.buffer import default_buffer_prototype
from zarr.storage import LocalStore

from linkwise._core import InputError
from linkwise.record.checksums import (
    GROUP,
    LIST,
    MOST_CHUNK_BYTES,
    Checksums,
    checksum,
    damage,
    plain_bytes,
    read_list,
    reason,
    write_list,
)

if TYPE_CHECKING:
    from zarr.core.buffer import Buffer, BufferPrototype

_CODECS = {"bytes", "vlen-utf8", "zstd", "crc32c"}
_ZSTD_MAGIC = bytes.fromhex("28b52ffd")


def _unpacked_bytes(data: bytes) -> int | None:
    """The size that a Zstandard frame says to have, None where it does not [RFC 8878, 3.1.1.1]."""
    if len(data) < 6 or data[:4] != _ZSTD_MAGIC:
        return None
    descriptor = data[4]
    single = descriptor >> 5 & 1
    length = (single, 2, 4, 8)[descriptor >> 6]
    start = 5 + (1 - single) + (0, 1, 2, 4)[descriptor & 3]
    if length == 0 or len(data) < start + length:
        return None
    return int.from_bytes(data[start : start + length], "little") + (256 if length == 2 else 0)


def is_chunk(key: str) -> bool:
    return "/c/" in key or key.endswith("/c")


def _check_unlisted(folder: Path, key: str, data: bytes) -> None:
    """InputError where a chunk that no list has fits neither its own checksum nor its array.

    Zarr and Zstandard would say so too, without the file's name and when values are used.
    """
    name = key.removesuffix("/c").partition("/c/")[0]
    try:
        described = json.loads(plain_bytes(folder, f"{name}/zarr.json") or b"")
        packed = [codec["name"] for codec in described["codecs"]]
        body = data[:-4] if "crc32c" in packed else data
        if body is not data and google_crc32c.value(body) != int.from_bytes(data[-4:], "little"):
            raise ValueError("it does not fit its own checksum")
        unpacked = len(numcodecs.zstd.decompress(body))
        kind = described["data_type"]
        if kind in ("float64", "int64"):
            shape = described["chunk_grid"]["configuration"]["chunk_shape"]
            if unpacked != 8 * math.prod(shape):
                raise ValueError("it has another size than its array says")
    except Exception as error:
        raise damage(folder, key, f"is damaged ({reason(error)})") from None


class CheckedStore(LocalStore):
    """A run's folder, read: each file is checked before anything is made of it.

    Raises InputError that names the file. `names` are the arrays that are shown at the top, all by
    default. Of a run whose list is missing, only files that cannot be are refused.
    """

    def __init__(
        self,
        root: Path | str,
        *,
        read_only: bool = True,
        finished: bool = True,
        names: Collection[str] | None = None,
    ) -> None:
        super().__init__(root, read_only=True)
        self.finished = finished
        self.names = names
        self.checksums = read_list(Path(root))

    def with_read_only(self, read_only: bool = False) -> CheckedStore:
        if not read_only:
            raise ValueError("a run that ended is only read")
        return self

    def read(self, key: str) -> bytes | None:
        data = plain_bytes(self.root, key)
        if self.checksums is not None and not self._fits(key, data):
            # A run that goes on has perhaps written the file since the list was read.
            self.checksums = read_list(self.root) or {}
            data = plain_bytes(self.root, key)
            if not self._fits(key, data):
                raise self._complaint(key, data)
        if data is not None and is_chunk(key):
            size = _unpacked_bytes(data)
            if size is None or size > MOST_CHUNK_BYTES:
                raise damage(self.root, key, "is not packed as linkwise packs chunks")
            if self.checksums is None:
                _check_unlisted(self.root, key, data)
        return data

    def _fits(self, key: str, data: bytes | None) -> bool:
        assert self.checksums is not None
        known = self.checksums.get(key)
        if data is None:
            # Chunks of time that were not reached. A run that was killed may have listed the next.
            of_time = key.startswith("time/") and is_chunk(key)
            expected = known is not None if not is_chunk(key) else not of_time
            return not (expected or (known is not None and self.finished))
        return known is not None and checksum(data) in known

    def _complaint(self, key: str, data: bytes | None) -> InputError:
        assert self.checksums is not None
        if data is None:
            return damage(self.root, key, "is missing")
        if key not in self.checksums:
            return damage(self.root, key, f"is not listed in {LIST}")
        return damage(self.root, key, f"is damaged: it does not fit its checksum in {LIST}")

    # What Zarr asks for. Everything else of LocalStore looks at names only.

    async def get(
        self, key: str, prototype: BufferPrototype | None = None, byte_range: Any = None
    ) -> Buffer | None:
        return await asyncio.to_thread(self.get_sync, key, prototype=prototype)

    def get_sync(
        self, key: str, *, prototype: BufferPrototype | None = None, byte_range: Any = None
    ) -> Buffer | None:
        if byte_range is not None:  # parts of files are read of shards alone, which no run has
            raise damage(self.root, key, "is not packed as linkwise packs chunks")
        data = self.read(key)
        if data is None:
            return None
        return (prototype or default_buffer_prototype()).buffer.from_bytes(data)

    async def get_partial_values(
        self, prototype: BufferPrototype, key_ranges: Iterable[tuple[str, Any]]
    ) -> list[Buffer | None]:
        return [self.get_sync(k, prototype=prototype, byte_range=r) for k, r in key_ranges]

    async def list_dir(self, prefix: str) -> AsyncIterator[str]:
        async for name in super().list_dir(prefix):
            if prefix.strip("/") or self.names is None or name in self.names:
                yield name


def dimensions(array: zarr.Array[Any]) -> tuple[str | None, ...] | None:
    metadata: Any = array.metadata
    names: tuple[str | None, ...] | None = metadata.dimension_names
    return names


def _check_array(folder: Path, array: zarr.Array[Any]) -> None:
    """InputError unless the array is laid out as linkwise lays arrays out."""
    key = f"{array.path}/zarr.json"
    described: Any = array.metadata.to_dict()
    packed = {codec["name"] for codec in described["codecs"]}
    if packed - _CODECS or "zstd" not in packed:
        raise damage(folder, key, "tells of a packing that linkwise does not write")
    kind = array.dtype.kind
    if kind not in "bfiuTO":
        raise damage(folder, key, f"tells of values of type {array.dtype}")
    bytes_each = array.dtype.itemsize or 16
    whole = array.shape if kind in "TO" else array.chunks  # labels are read at once
    if math.prod(whole) * bytes_each > MOST_CHUNK_BYTES:
        raise damage(folder, key, "tells of a size that linkwise does not write")
    dims = dimensions(array)
    if dims is not None and (len(dims) != len(array.shape) or None in dims):
        raise damage(folder, key, "names too few dimensions")


def open_array(store: CheckedStore, name: str) -> zarr.Array[Any]:
    try:
        array = zarr.open_array(store, path=name, mode="r", zarr_format=3)
        _check_array(store.root, array)
    except InputError:
        raise
    except Exception as error:
        raise damage(store.root, f"{name}/zarr.json", f"is damaged ({reason(error)})") from None
    return array


def packing() -> tuple[Any, ...]:
    """How chunks are packed: compressed, with a checksum that any reader of Zarr looks at."""
    from zarr.codecs import Crc32cCodec, ZstdCodec

    return (ZstdCodec(), Crc32cCodec())


class WritingStore(LocalStore):
    """A run's folder, written: each file's checksum gets into the list before the file."""

    def __init__(self, root: Path | str, *, read_only: bool = False) -> None:
        super().__init__(root, read_only=False)
        (Path(root) / GROUP).mkdir(exist_ok=True)
        self.checksums: Checksums = read_list(Path(root)) or {}
        self._lines = sum(map(len, self.checksums.values()))
        self._one = threading.Lock()

    def with_read_only(self, read_only: bool = False) -> WritingStore:
        return self

    def _list(self, key: str, value: Buffer) -> None:
        number = checksum(value.as_buffer_like())
        line = f"{number:08x} {key}\n".encode()
        with self._one, open(self.root / LIST, "ab", buffering=0) as file:
            before = file.tell()
            try:
                while line:
                    line = line[file.write(line) :]
            except OSError:  # the disk is full: no half line may precede the next
                file.truncate(before)
                raise
            self.checksums[key] = [number]
            self._lines += 1

    def shorten_list(self, most: int = 0) -> None:
        """Leave the newest checksum of each file, where the list is `most` lines longer."""
        if self._lines - len(self.checksums) >= most:
            write_list(self.root, self.checksums)
            self._lines = len(self.checksums)

    def set_sync(self, key: str, value: Buffer) -> None:
        self._list(key, value)
        super().set_sync(key, value)

    async def _set(self, key: str, value: Buffer, exclusive: bool = False) -> None:
        self._list(key, value)
        await super()._set(key, value, exclusive=exclusive)
