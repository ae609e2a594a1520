"""Which loads are shown: of all causes or of some, and how much of the ratings they use."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from linkwise._core import InputError
from linkwise.base import Array, rows_per_block
from linkwise.io.complaint import shown
from linkwise.loads.causes import CAUSES, Split
from linkwise.loads.engineering import derive, joint_directions
from linkwise.loads.rating import rating_table
from linkwise.loads.samples import blocks

if TYPE_CHECKING:
    from linkwise._core import Model
    from linkwise.loads.rating import Rating
    from linkwise.results import Run

_MOST_BLOCK = 64  # samples: what a playback passes in a second or two
_MOST_IN_HISTORY = 200_000  # joint loads that a plot of some causes may take to evaluate
_HALVES = (("force", "axial", "radial"), ("moment", "tilting_moment", "torque"))


class CauseLoads:
    """Loads that some causes make: `names` are those that the run can have.

    chosen: the causes that are shown; without a split (`names` is empty) always everything.
    """

    def __init__(self, run: Run, model: Model) -> None:
        self.names: list[str] = []
        self.missing = ""
        try:
            self._split = Split(run, "force", model)
            self._require_whole(run, 48 * (model.n_joints + model.n_loops) * len(CAUSES["force"]))
            self.names = list(self._split.names)
        except InputError as error:
            self.missing = str(error)
        self.chosen = set(self.names)
        self._count = run.dataset.sizes["time"]
        size = 48 * (model.n_joints + model.n_loops) * max(1, len(self.names))
        self._rows = min(_MOST_BLOCK, rows_per_block(size))
        self._most = max(2, _MOST_IN_HISTORY // model.n_joints)
        self._first, self._shares = -1, np.zeros((0, 0, 0, 6))

    def _require_whole(self, run: Run, row_bytes: int) -> None:
        """Refuses runs of closed loops some of whose samples have no shares."""
        for block in blocks(run, row_bytes) if self._split.closed else ():
            if np.isnan(self._split.shares(block)).any():
                raise InputError(
                    "the machine passes a singular position, where its loads do not split"
                )

    def choose(self, names: Sequence[str]) -> None:
        """Show these causes alone. Raises InputError where the run has no such cause."""
        for name in names:
            if name not in CAUSES["force"]:
                raise InputError(
                    f"cause {shown(name)}: is unknown; use {', '.join(CAUSES['force'])}"
                )
            if name not in self.names:
                why = self.missing or f"the run has none; it has {', '.join(self.names)}"
                raise InputError(f"cause {shown(name)}: {why}")
        self.chosen = set(names)

    @property
    def everything(self) -> bool:
        return self.chosen == set(self.names)

    def load(self, sample: int) -> Array:
        """Loads (n_joints, 6) of the chosen causes at one sample."""
        first = sample - sample % self._rows
        if first != self._first:
            self._shares = self._split.shares(slice(first, min(first + self._rows, self._count)))
            self._first = first
        return np.asarray(self._shares[sample - first][self._mask()].sum(axis=0))

    def shares(self, samples: Array) -> Array:
        """Loads (samples, causes, n_joints, 6) of every cause at some samples."""
        parts = [
            self._split.shares(samples[k : k + self._rows].tolist())
            for k in range(0, len(samples), self._rows)
        ]
        return np.concatenate(parts)

    def history(self, joint: int, samples: Array) -> tuple[Array, Array]:
        """Samples, at most as many as a machine of this size allows, and loads (n, 6) there."""
        chosen = samples[:: max(1, -(-len(samples) // self._most))]
        step = max(1, self._rows)
        parts = [
            self._split.shares(chosen[k : k + step].tolist())[:, self._mask(), joint].sum(axis=1)
            for k in range(0, len(chosen), step)
        ]
        return chosen, np.concatenate(parts)

    def _mask(self) -> Array:
        return np.array([name in self.chosen for name in self.names], dtype=bool)


class RatingUse:
    """How much of their ratings loads use; NaN for joints without any."""

    def __init__(self, model: Model, ratings: Mapping[str, Rating]) -> None:
        self.directions = joint_directions(model)
        names = [name for half in _HALVES for name in half]
        table = rating_table(
            ratings, [*model.joint_names, *model.loop_names], [*names, "drive_power"]
        )
        self.limits = dict(zip(names, table, strict=False))
        """Ratings (n_joints,) of a quantity, NaN where there is none."""
        self.known = bool(np.isfinite(table[:-1]).any())

    def of(self, loads: Array, half: int) -> Array:
        """The largest share (n_joints,) of a rating that forces (0) or moments (1) use."""
        found = derive(loads, self.directions)
        uses = [np.abs(found[name]) / self.limits[name] for name in _HALVES[half]]
        return np.asarray(np.fmax.reduce(uses))


def rating_use(model: Model, ratings: Mapping[str, Rating], needed: bool) -> RatingUse | None:
    """The use of these ratings, None without any; InputError where they are `needed`."""
    use = RatingUse(model, ratings)
    if use.known:
        return use
    if needed:
        raise InputError(
            "colours by rating: there are no ratings of loads; give [rating.JOINT] tables in the "
            "scenario, or a file with --ratings"
        )
    return None
