"""Elastic links as they bend: straight pieces along the bent centre line, coloured by moment."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from linkwise import _core
from linkwise.base import Array, lengths
from linkwise.loads.bent import beams_of, spread
from linkwise.view.arrows import color_bar
from linkwise.view.placement import BentBeams
from linkwise.view.shapes import quaternions

if TYPE_CHECKING:
    from linkwise._core import Model

MOST_PIECES = 24
"""Of one link."""
ALL_PIECES = 3000
"""Of all links together, at least one each: what a browser draws in time."""


class Beams:
    """The pieces of all elastic links of a machine: `sizes` (n, 2) [m] of their sections along y
    and z, which are `round` (n,), and the names of the `joints` that carry their ends."""

    def __init__(self, model: Model) -> None:
        self._model = model
        rows, lengths_ = beams_of(model), model.beam_lengths
        properties = _core.beam_properties(model)
        count = max(1, min(MOST_PIECES, ALL_PIECES // max(1, len(rows))))
        names: list[str] = []
        places: list[float] = []
        starts: list[int] = []
        sizes: list[tuple[float, float]] = []
        is_round: list[bool] = []
        for name, row in rows.items():
            pieces = max(count, min(len(row), ALL_PIECES // len(rows)))
            links, here, _ = spread(row, lengths_, 2 * pieces + 1)
            starts += range(len(names), len(names) + 2 * pieces, 2)
            names, places = names + links, places + here
            of = properties[name]
            sizes += [_outside(of)] * pieces
            is_round += [bool(of["round"])] * pieces
        index = {name: k for k, name in enumerate(model.link_names)}
        self.joints = {f"{name}:{k + 1}" for name, row in rows.items() for k in range(len(row))}
        self._names, self._places = names, places
        self._links: npt.NDArray[np.int64] = np.array([index[n] for n in names], dtype=np.int64)
        self._starts: npt.NDArray[np.int64] = np.array(starts, dtype=np.int64)
        self.sizes: Array = np.array(sizes, dtype=float).reshape(-1, 2)
        self.round: npt.NDArray[np.bool_] = np.array(is_round, dtype=np.bool_)

    @property
    def count(self) -> int:
        """How many pieces there are."""
        return int(self._starts.size)

    def at(self, links: Array, q: Array) -> BentBeams | None:
        """The pieces in one position (nq,), None without any; links: frames of all links."""
        if not self.count:
            return None
        poses, strains = _core.bent_sections(self._model, self._names, self._places, q)
        frames = links[self._links] @ poses
        first = self._starts
        start, middle, end = frames[first], frames[first + 1], frames[first + 2]
        along = end[:, :3, 3] - start[:, :3, 3]
        size = lengths(along)
        x = along / np.maximum(size, 1e-300)[:, None]
        z = middle[:, :3, 2] - np.sum(middle[:, :3, 2] * x, axis=1)[:, None] * x
        z /= lengths(z)[:, None]
        rotations = np.stack([np.cross(z, x), z, x], axis=-1)
        return BentBeams(
            (start[:, :3, 3] + end[:, :3, 3]) / 2, rotations, size, self._moments(strains)
        )

    def largest(self, positions: Iterable[Array]) -> float:
        """The largest bending moment [N m] in blocks of positions (time, nq)."""
        found = 0.0
        for q in positions if self.count else ():
            strains = _core.bent_sections(self._model, self._names, self._places, q)[1]
            found = max(found, float(self._moments(strains).max(initial=0.0)))
        return found

    def _moments(self, strains: Array) -> Array:
        """The largest (..., n) at the start, in the middle and at the end of each piece."""
        bending = np.hypot(strains[..., 2], strains[..., 3])
        three = [bending[..., self._starts + k] for k in range(3)]
        return np.asarray(np.maximum.reduce(three))


def _outside(of: dict[str, Any]) -> tuple[float, float]:
    """Width and height [m] of a section, of one without any those of the rectangle with its area's
    radii of gyration."""
    if of["width"] > 0:
        return of["width"], of["height"]
    return np.sqrt(12 * of["EIz"] / of["EA"]), np.sqrt(12 * of["EIy"] / of["EA"])


def rows_of(beams: BentBeams) -> Array:
    """(n, 9) of the pieces for player.js: middle, quaternion, length, moment."""
    turns = quaternions(beams.rotations)
    return np.column_stack([beams.middles, turns, beams.lengths, beams.moments])


def bend_legend(largest: float) -> str:
    """The meaning of the pieces' colours as HTML."""
    return (
        '<div style="padding:4px 12px;font-size:12px">'
        f'<div style="height:8px;border-radius:4px;background:{color_bar()}"></div>'
        '<div style="display:flex;justify-content:space-between">'
        f"<span>0</span><span>bending moment {largest:.4g} N m</span></div>"
        "<div>by the curvature of the bent shape</div></div>"
    )
