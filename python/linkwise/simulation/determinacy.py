"""Which joint loads of a machine with loops rigid bodies leave open: a variable of its runs, and
the warning that says it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from linkwise import _core
from linkwise._core import InputError
from linkwise.base import COMPONENTS, DERIVED, AnyArray
from linkwise.drives import Locked, Motion
from linkwise.loads.determinate import FEW_ROWS, MOST_ROWS, PEAKS, POSES, Held, loop_rows
from linkwise.loads.undecided import Undecided, describe, misfit_notes
from linkwise.notes import Ignored
from linkwise.record.extremes import ROWS
from linkwise.record.schema import BY_BEARINGS, DETERMINATE

if TYPE_CHECKING:
    from linkwise._core import Model
    from linkwise.drives import Drive

_MOST_NAMED = 8
_ROUNDING = 1e-12
_LIFTED = (
    "the force along its axis turns against its preload in this run: a bearing that carries one "
    "way alone would let go there, and here it pulls; give more preload, or bearings that carry "
    "both ways"
)
_TURNED = (
    "the force{} turns against its preload in samples of this run, first at {:.4g} s: what "
    "carries one way alone would let go there, and here it pulls; give more preload, or bearings "
    "that carry both ways"
)
_REMEDY = (
    ", but say how stiff its bearings are ([bearing.JOINT], with_bearing), or leave a joint of the "
    "loop more freedom (a spherical or cylindrical one)"
)
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
        explain: whether `notes` says what holds each other, and what would decide it.
    """

    def __init__(
        self,
        model: Model,
        drives: Mapping[str, Drive],
        q: AnyArray,
        samples: int,
        *,
        explain: bool = True,
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
        self._by_bearings = np.zeros(self._open.shape, dtype=np.bool_)
        self._couplings: set[str] = set()
        self._told: list[Undecided] = []
        self._misfits: list[tuple[str, str]] = []
        self._turned: dict[str, tuple[str, float]] = {}
        self.preloaded = any("preload" in bearing for bearing in model.bearings.values())
        self._classify(q)
        if self._count and explain and small:
            self._told = describe(model, q, given) if self._self_stresses else []
            self._misfits = misfit_notes(model, q)

    @property
    def needs(self) -> tuple[str, ...]:
        """The quantities of samples that `see` takes."""
        return ("position", "joint_load") if self.preloaded else ("position",)

    @property
    def throughout(self) -> AnyArray:
        """(n_joints + n_loops, 6) [bool]: determinate in every pose that was looked at."""
        found: AnyArray = self._open == 0
        return found

    def marks(self) -> dict[str, AnyArray]:
        """By variable of the run (n_joints + n_loops, 6) [bool]."""
        return {DETERMINATE: self.throughout, BY_BEARINGS: self.by_bearings}

    @property
    def by_bearings(self) -> AnyArray:
        """(n_joints + n_loops, 6) [bool]: determinate in all poses, in some by bearings alone."""
        return self._by_bearings & self.throughout

    def _classify(self, q: AnyArray) -> None:
        if not np.isfinite(q).all():
            return
        try:
            found = self._held.indeterminacy(q)
        except InputError:  # of a run that went astray: its loops are open
            return
        self._count += 1
        self._by_bearings |= np.asarray(found.by_bearings)
        # What holds locked joints comes behind the model's own couplings.
        names = zip(self._model.coupling_names, found.couplings, strict=False)
        self._couplings |= {name for name, known in names if not known}
        self._open += np.logical_not(found.determinate)
        self._self_stresses = max(self._self_stresses, len(found.undecided))

    def see(
        self, positions: AnyArray, loads: AnyArray | None = None, times: AnyArray | None = None
    ) -> None:
        """The next samples (time, nq), of which a few are looked at; with loads (time, n_joints +
        n_loops, 6) at `times` [s] all of them, whether a force turns against its preload."""
        if loads is not None and times is not None and self.preloaded:
            self._see_preloads(positions, loads, times)
        for k in range(self._seen, self._seen + len(positions)):
            if k in self._wanted:
                self._classify(positions[k - self._seen])
        self._seen += len(positions)

    def _see_preloads(self, positions: AnyArray, loads: AnyArray, times: AnyArray) -> None:
        """Of joints with an axis the part across it; `see_extremes` has that along it."""
        there = np.isfinite(positions).all(axis=1)  # of members of a batch until they end
        positions, loads, times = positions[there], loads[there], times[there]
        preloads = _core.preload_forces(self._model, positions)
        names = [*self._model.joint_names, *self._model.loop_names]
        axes = [*self._model.joint_axes, *self._model.loop_axes]
        for name, bearing in self._model.bearings.items():
            j = names.index(name)
            if "preload" not in bearing or name in self._turned:
                continue
            given, part = preloads[:, j], ""
            if axes[j]:
                axis = np.asarray(axes[j][0][1], dtype=float)
                size = np.abs(given).max(initial=0.0)
                given, part = given - np.outer(given @ axis, axis), " across its axis"
                if np.abs(given).max(initial=0.0) <= _ROUNDING * size:
                    continue
            against = np.einsum("ti,ti->t", loads[:, j, :3], given) < 0
            if against.any():
                self._turned[name] = part, float(times[np.argmax(against)])

    def see_peaks(self, states: AnyArray | None) -> None:
        """The states at the peaks of the loads, (..., state), whose first numbers are positions."""
        if states is None or not self._peaks:
            return
        q = states.reshape(-1, states.shape[-1])[:, : self._model.nq]
        different = np.unique(q, axis=0)
        for k in {round(k) for k in np.linspace(0, len(different) - 1, self._peaks)}:
            self._classify(different[k])

    def see_extremes(self, extremes: AnyArray | None) -> None:
        """The extremes of quantities (row, quantity, joint) of all joints: where the force along
        the axis of a preloaded bearing turned round."""
        if extremes is None or extremes.shape[-1] != len(self._open):
            return
        names = [*self._model.joint_names, *self._model.loop_names]
        axes = [*self._model.joint_axes, *self._model.loop_axes]
        axial = extremes[:, DERIVED.index("axial")]
        low, high = (axial[ROWS.index(row)] for row in ("minimum", "maximum"))
        for name, bearing in self._model.bearings.items():
            j = names.index(name)
            preload = np.asarray(bearing.get("preload", 0.0), dtype=float)
            if not axes[j]:
                continue
            along = float(preload) if preload.ndim == 0 else float(preload @ axes[j][0][1])
            if (along > 0 and low[j] < 0) or (along < 0 and high[j] > 0):
                self._misfits.append((name, _LIFTED))

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
        if self._couplings:
            parts.append(f"what couplings {_and(sorted(map(repr, self._couplings)))} carry")
        notes = [Ignored("", name, text) for name, text in self._misfits]
        turned = self._turned.items()
        notes += [Ignored("", name, _TURNED.format(*found)) for name, found in turned]
        if not parts or not self._count:
            return notes
        count = self._self_stresses
        told = [one for one in self._told if one.remedies or one.couplings]
        remedy = "" if told else _REMEDY
        text = (
            f"rigid bodies do not determine {', and '.join(parts)}: {count} "
            f"self-stress{'es' if count > 1 else ''} of the closed loops load "
            "them by any amount, and what is shown is one choice of many; do not size parts by "
            f"it{remedy}"
        )
        notes.append(Ignored("", _ELEMENT, text))
        notes += [Ignored("", _ELEMENT, one.text) for one in told]
        return notes


def _listed(names: list[str], mask: AnyArray) -> str:
    said = [
        f"{name!r} ({', '.join(c for c, one in zip(COMPONENTS, row, strict=True) if one)})"
        for name, row in zip(names, mask, strict=True)
        if row.any()
    ]
    more = f" and {len(said) - _MOST_NAMED} more" if len(said) > _MOST_NAMED else ""
    return ", ".join(said[:_MOST_NAMED]) + more


def _and(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


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
