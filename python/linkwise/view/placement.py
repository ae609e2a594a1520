"""Where the parts of a picture are in a snapshot: the properties of a group of instances.

Each placement also says how it is made (`plan`), so that player.js makes the same pictures in an
exported page: a kind there is a class here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from linkwise.base import AnyArray, Array
from linkwise.view.arrows import NOTHING, colors_of, in_world, instances
from linkwise.view.shapes import quaternions, turning_z_to

if TYPE_CHECKING:
    from linkwise.view.shown_loads import RatingUse

Indices = npt.NDArray[np.int64]


@dataclass
class BentBeams:
    """The pieces at one instant: middles (n, 3) [m], rotations (n, 3, 3) whose columns are y and z
    of the section and the direction of the piece, their lengths (n,) [m], and the largest bending
    moments (n,) [N m] on them."""

    middles: Array
    rotations: Array
    lengths: Array
    moments: Array


@dataclass
class Snapshot:
    """The machine at one instant: frames of links (n, 4, 4), of joints as `Places` has them,
    loads (n_joints, 6) of all joints with a load, which forces and moments (n_joints, 2) of
    them are determinate (None: all), and elastic links (None: there are none)."""

    links: Array
    joints: Array
    loads: Array | None
    known: AnyArray | None = None
    beams: BentBeams | None = None


@dataclass
class LoadStyle:
    """How loads are drawn, whichever they are.

    largest: the force and the moment that get the longest arrow and arc, of the length `longest`
    [m]; use: colours by use of the ratings (None: by size).
    """

    largest: tuple[float, float]
    longest: float
    use: RatingUse | None = None


@dataclass
class BendStyle:
    """largest: the bending moment [N m] of the last colour."""

    largest: float = 0.0


class Placement(Protocol):
    def __call__(self, snapshot: Snapshot) -> dict[str, Any]:
        """What changes of the group's properties."""

    def plan(self) -> dict[str, Any]:
        """Kind and parameters, for player.js."""


@dataclass
class Following:
    """Instances fixed to links: `offsets` (n, 4, 4) from the frames of the links."""

    links: Indices
    offsets: Array

    def __call__(self, snapshot: Snapshot) -> dict[str, Array]:
        frames = snapshot.links[self.links] @ self.offsets
        return {
            "batched_positions": frames[:, :3, 3],
            "batched_wxyzs": quaternions(frames[:, :3, :3]),
        }

    def plan(self) -> dict[str, Any]:
        return {
            "kind": "following",
            "links": self.links,
            "positions": self.offsets[:, :3, 3],
            "wxyzs": quaternions(self.offsets[:, :3, :3]),
        }


@dataclass
class Spanning:
    """Rods between places: a sliding joint changes their length."""

    inboard: Indices
    outboard: Indices
    radius: float

    def __call__(self, snapshot: Snapshot) -> dict[str, Array]:
        here, there = (snapshot.joints[end, :3, 3] for end in (self.inboard, self.outboard))
        span = there - here
        length = np.linalg.norm(span, axis=1)
        along = np.where(length[:, None] > 0, span / np.maximum(length, 1e-300)[:, None], [0, 0, 1])
        scales = np.column_stack([np.full((length.size, 2), self.radius), np.maximum(length, 1e-9)])
        return {
            "batched_positions": (here + there) / 2,
            "batched_wxyzs": turning_z_to(along),
            "batched_scales": scales,
        }

    def plan(self) -> dict[str, Any]:
        ends = {"inboard": self.inboard, "outboard": self.outboard}
        return {"kind": "spanning", **ends, "radius": self.radius}


@dataclass
class Lines:
    """Segments between joint points."""

    inboard: Indices
    outboard: Indices

    def __call__(self, snapshot: Snapshot) -> dict[str, Array]:
        points = snapshot.joints[:, :3, 3]
        return {"points": np.stack([points[self.inboard], points[self.outboard]], axis=1)}

    def plan(self) -> dict[str, Any]:
        return {"kind": "lines", "inboard": self.inboard, "outboard": self.outboard}


@dataclass
class Marks:
    """One at every joint point, loop joints included."""

    count: int

    def __call__(self, snapshot: Snapshot) -> dict[str, Array]:
        return {"batched_positions": snapshot.joints[: self.count, :3, 3]}

    def plan(self) -> dict[str, Any]:
        return {"kind": "marks"}


@dataclass
class Loads:
    """Arrows of forces (half 0) or arcs of moments (half 1) at the points of these joints; of the
    loads that are determinate where they are `known`, of the others where they are not."""

    half: int
    style: LoadStyle
    joints: Indices
    known: bool = True

    def __call__(self, snapshot: Snapshot) -> dict[str, Any]:
        if snapshot.loads is None:
            return {}
        frames = snapshot.joints[self.joints]
        vectors = in_world(frames, snapshot.loads[self.joints])[self.half]
        use = None
        if self.style.use is not None:
            use = self.style.use.of(snapshot.loads, self.half)[self.joints]
        points = frames[:, :3, 3]
        made = instances(points, vectors, self.style.largest[self.half], self.style.longest, use)
        scales = made.scales
        if snapshot.known is not None:
            shown = snapshot.known[self.joints, self.half] == self.known
            scales = np.where(shown, scales, self.style.longest * NOTHING)
        return {
            "batched_positions": made.positions,
            "batched_wxyzs": made.quaternions,
            "batched_scales": scales,
            "batched_colors": made.colors,
        }

    def plan(self) -> dict[str, Any]:
        plan = {"kind": "loads", "half": self.half, "joints": self.joints}
        return {**plan, "known": int(self.known)}


@dataclass
class Bending:
    """Pieces of elastic links; scales (n, 2): of the group's mesh along y and z."""

    pieces: npt.NDArray[np.int64]
    scales: Array
    style: BendStyle

    def __call__(self, snapshot: Snapshot) -> dict[str, Any]:
        beams = snapshot.beams
        if beams is None:
            return {}
        here = self.pieces
        share = np.zeros(here.size)
        if self.style.largest > 0:
            share = beams.moments[here] / self.style.largest
        return {
            "batched_positions": beams.middles[here],
            "batched_wxyzs": quaternions(beams.rotations[here]),
            "batched_scales": np.column_stack([self.scales, np.maximum(beams.lengths[here], 1e-9)]),
            "batched_colors": colors_of(share),
        }

    def plan(self) -> dict[str, Any]:
        return {"kind": "bending", "pieces": self.pieces, "sizes": self.scales}


@dataclass
class Fixed:
    """Nothing moves."""

    def __call__(self, snapshot: Snapshot) -> dict[str, Any]:
        return {}

    def plan(self) -> dict[str, Any]:
        return {"kind": "fixed"}
