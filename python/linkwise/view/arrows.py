"""Joint loads as instances of an arrow and of an arc, sized and coloured by magnitude."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from linkwise.base import Array, lengths
from linkwise.view.shapes import turning_z_to

# From small to large; the lightness falls evenly, so that the order survives a grey print.
_STOPS = np.array(
    [[120, 180, 230], [40, 130, 210], [70, 70, 190], [150, 20, 120], [170, 0, 20]], dtype=float
)
_USE_STOPS = np.array([[10, 70, 150], [225, 170, 0], [215, 80, 0]], dtype=float)
_OVERLOADED, _UNRATED = np.array([110.0, 0, 20]), np.array([110.0, 110, 110])
NOTHING = 1e-9  # of a size: three.js cannot invert a transform of scale 0


class Instances(NamedTuple):
    """Positions (n, 3), quaternions (n, 4), scales (n,) and colours (n, 3) of one mesh."""

    positions: Array
    quaternions: Array
    scales: Array
    colors: npt.NDArray[np.uint8]


def _between(stops: Array, share: Array) -> Array:
    """Colours (n, 3) between the stops, the first at share 0 and the last at 1."""
    at = np.clip(np.nan_to_num(share), 0.0, 1.0) * (len(stops) - 1)
    low = np.minimum(at.astype(int), len(stops) - 2)
    mixed: Array = stops[low] + (at - low)[:, None] * (stops[low + 1] - stops[low])
    return mixed


def colors_of(share: Array) -> npt.NDArray[np.uint8]:
    """Colours (n, 3) of magnitudes given as shares of the largest."""
    return np.asarray(np.rint(_between(_STOPS, share)), dtype=np.uint8)


def colors_of_use(use: Array) -> npt.NDArray[np.uint8]:
    """Colours (n, 3) of shares of a rating: one step at 1; grey where nothing is rated."""
    mixed = _between(_USE_STOPS, use)
    mixed[use > 1] = _OVERLOADED
    mixed[np.isnan(use)] = _UNRATED
    return np.asarray(np.rint(mixed), dtype=np.uint8)


def color_table() -> dict[str, list[object]]:
    """The colours, for player.js."""
    tables = {"size": _STOPS, "use": _USE_STOPS, "overloaded": _OVERLOADED, "unrated": _UNRATED}
    return {name: table.tolist() for name, table in tables.items()}


def color_bar() -> str:
    """The colours as a CSS gradient, small ones left."""
    return f"linear-gradient(90deg, {', '.join(map(_css, _STOPS))})"


def use_bar() -> str:
    """The colours of shares of a rating as a CSS gradient: 0 left, 1 at four fifths."""
    end = 80 / (len(_USE_STOPS) - 1)
    steps = [f"{_css(color)} {end * k:g}%" for k, color in enumerate(_USE_STOPS)]
    return f"linear-gradient(90deg, {', '.join(steps)}, {_css(_OVERLOADED)} 80%)"


def _css(color: Array) -> str:
    return "rgb({:.0f}, {:.0f}, {:.0f})".format(*color)


def in_world(frames: Array, loads: Array) -> tuple[Array, Array]:
    """Forces and moments (n, 3) along the world's axes of loads (n, 6) along those of `frames`."""
    halves = loads.reshape(-1, 2, 3)
    turned = halves @ frames[:, :3, :3].swapaxes(1, 2)
    return turned[:, 0], turned[:, 1]


def instances(
    points: Array, vectors: Array, largest: float, longest: float, use: Array | None = None
) -> Instances:
    """One instance per vector: `largest` gets the length `longest` [m], others their share.

    The colour is that of the share, or of `use`, the shares of a rating.
    """
    size = lengths(vectors)
    size = np.where(np.isfinite(size), size, 0.0)
    share = size / largest if largest > 0 else np.zeros_like(size)
    up = np.array([0.0, 0.0, 1.0])
    directions = np.where(size[:, None] > 0, vectors / np.maximum(size, 1e-300)[:, None], up)
    colors = colors_of(share) if use is None else colors_of_use(use)
    scales = longest * np.maximum(share, NOTHING)
    return Instances(points, turning_z_to(directions), scales, colors)
