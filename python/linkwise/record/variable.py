"""One array of a run: its name, dimensions, texts, and where its numbers come from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from linkwise.base import AnyArray


@dataclass(frozen=True)
class Variable:
    """One recorded array; `take` picks its columns from what the core returns."""

    name: str
    dims: tuple[str, ...]
    shape: tuple[int, ...]  # without time
    dtype: np.dtype[Any]
    attrs: Mapping[str, str]
    take: npt.NDArray[np.intp] | None = None

    @property
    def row_bytes(self) -> int:
        return int(np.prod(self.shape, dtype=np.int64)) * self.dtype.itemsize

    def rows(self, chunk: Mapping[str, Any], count: int) -> AnyArray:
        """This variable's rows of one chunk returned by `Simulation.advance`."""
        values = np.asarray(chunk[self.name])
        if self.take is not None:
            values = values[:, self.take]
        return np.ascontiguousarray(values, dtype=self.dtype).reshape((count, *self.shape))
