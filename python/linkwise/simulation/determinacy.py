"""Which joint loads of a machine with loops rigid bodies leave open: a variable of its runs, and
the warning that says it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from linkwise._core import InputError
from linkwise.base import COMPONENTS, AnyArray
from linkwise.drives import Locked, Motion
from linkwise.loads.determinate import FEW_ROWS, MOST_ROWS, PEAKS, POSES, Held, loop_rows
from linkwise.notes import Ignored

if TYPE_CHECKING:
    from linkwise._core import Model
    from linkwise.drives import Drive

_MOST_NAMED = 8
_ELEMENT = "joint_load"


def is_looked_at(model: Model) -> bool:
    """Whether its loads may be open, and it is small enough to find out which are."""
    return 0 < loop_rows(model) <= MOST_ROWS


class Determinacy:
    """What was seen in the poses of one run.

    Args:
        model: the machine; one that `is_looked_at`; drives: by joint.
        q: (nq,) [rad, m]: the start, which closes all loops.
        samples: how many positions `see` will be given.
    """

    def __init__(
        self, model: Model, drives: Mapping[str, Drive], q: AnyArray, samples: int
    ) -> None:
        self._model = model
        given = [name for name, drive in drives.items() if isinstance(drive, Locked | Motion)]
        self._held = Held(model, given)
        small = loop_rows(model) <= FEW_ROWS
        poses = min(samples, POSES if small else 2)
        self._wanted = {round(k) for k in np.linspace(0, samples - 1, poses)}
        self._peaks = PEAKS if small else 0
        self._seen = 0
        self._open = np.zeros((model.n_joints + model.n_loops, len(COMPONENTS)), dtype=np.int64)
        self._count = 0
        self._self_stresses = 0
        self._classify(q)

    @property
    def throughout(self) -> AnyArray:
        """(n_joints + n_loops, 6) [bool]: determinate in every pose that was looked at."""
        found: AnyArray = self._open == 0
        return found

    def _classify(self, q: AnyArray) -> None:
        if not np.isfinite(q).all():
            return
        try:
            found = self._held.indeterminacy(q)
        except InputError:  # of a run that went astray: its loops are open
            return
        self._count += 1
        self._open += np.logical_not(found.determinate)
        self._self_stresses = max(self._self_stresses, len(found.undecided))

    def see(self, positions: AnyArray) -> None:
        """The next samples (time, nq); a few of all are looked at."""
        for k in range(self._seen, self._seen + len(positions)):
            if k in self._wanted:
                self._classify(positions[k - self._seen])
        self._seen += len(positions)

    def see_peaks(self, states: AnyArray | None) -> None:
        """The states at the peaks of the loads, (..., state), whose first numbers are positions."""
        if states is None or not self._peaks:
            return
        q = states.reshape(-1, states.shape[-1])[:, : self._model.nq]
        different = np.unique(q, axis=0)
        for k in {round(k) for k in np.linspace(0, len(different) - 1, self._peaks)}:
            self._classify(different[k])

    def notes(self) -> list[Ignored]:
        """What the reader of the run is told: nothing where all loads are determinate."""
        always = self._open == self._count
        sometimes = ~always & (self._open > 0)
        names = [*self._model.joint_names, *self._model.loop_names]
        parts = []
        if always.any():
            parts.append(f"the loads of joints {_listed(names, always)}")
        if sometimes.any():
            parts.append(f"in some poses only those of joints {_listed(names, sometimes)}")
        if not parts or not self._count:
            return []
        count = self._self_stresses
        text = (
            f"rigid bodies do not determine {', and '.join(parts)}: {count} "
            f"self-stress{'es' if count > 1 else ''} of the closed loops load "
            "them by any amount, and what is shown is one choice of many; do not size parts by "
            "it, but say how stiff its bearings are ([bearing.JOINT], with_bearing), or leave "
            "a joint of the loop more freedom (a spherical or cylindrical one)"
        )
        return [Ignored("", _ELEMENT, text)]


def _listed(names: list[str], mask: AnyArray) -> str:
    said = [
        f"{name!r} ({', '.join(c for c, one in zip(COMPONENTS, row, strict=True) if one)})"
        for name, row in zip(names, mask, strict=True)
        if row.any()
    ]
    more = f" and {len(said) - _MOST_NAMED} more" if len(said) > _MOST_NAMED else ""
    return ", ".join(said[:_MOST_NAMED]) + more


def not_looked_at(models: Iterable[Model]) -> list[Ignored]:
    """What is said of machines that are too large to be looked at."""
    if all(loop_rows(model) <= MOST_ROWS for model in models):
        return []
    return [
        Ignored(
            "",
            _ELEMENT,
            "which loads of closed loops rigid bodies determine was not looked at in a machine "
            "of this size; where constraints repeat each other they are one choice of many",
        )
    ]
