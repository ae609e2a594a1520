"""What leaves joint loads of closed loops open, and what would decide them: in sentences.

Self-stresses that load the same joints hold each other, and are told together. A remedy is named
only after it was tried: with it, the loads are determinate where the machine stands.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from linkwise import _core
from linkwise._core import InputError
from linkwise.base import COMPONENTS, AnyArray, Array
from linkwise.loads.determinate import FEW_ROWS, MOST_ROWS, Held, loop_rows

if TYPE_CHECKING:
    from linkwise._core import Indeterminacy, Model

#: Of the largest component of the self-stresses: what is less is rounding.
_TOUCHED = 1e-8
#: Stiffnesses of a trial: what is decided depends on which directions yield, not on how much.
_TRIAL = {"axial": 1e8, "radial": 1e8, "tilt": 1e6, "torsion": 1e6}
#: Directions in which joints move freely, so that a bearing has none.
_FREE = {
    "revolute": {"torsion"},
    "continuous": {"torsion"},
    "prismatic": {"axial"},
    "cylindrical": {"axial", "torsion"},
    "spherical": {"tilt", "torsion"},
    "planar": {"radial", "torsion"},
    "floating": set(_TRIAL),
}
_ONE_AXIS = {"revolute", "continuous", "prismatic", "cylindrical", "planar", "helical"}
#: What hinges and sliders may become.
_FREER = {
    "revolute": ("cylindrical", "spherical"),
    "continuous": ("cylindrical", "spherical"),
    "prismatic": ("cylindrical",),
}
_MOST_NAMED = 6
_MOST_FREED = 6  # joints among which two to be freed are looked for
#: Part of a preload by which the load of its bearing may differ without a word.
_BALANCED = 0.01


class Undecided(NamedTuple):
    """Loads that hold each other, and that nothing decides.

    self_stresses: how many independent ones there are among them; joints: their components by
    joint; couplings: those whose loads are open; remedies: what was tried and decides them.
    """

    self_stresses: int
    joints: dict[str, tuple[str, ...]]
    couplings: tuple[str, ...]
    remedies: tuple[str, ...]

    @property
    def text(self) -> str:
        """A sentence."""
        names = [f"{name!r} {' '.join(parts)}" for name, parts in self.joints.items()]
        names += [f"coupling {name!r}" for name in self.couplings]
        times = "" if self.self_stresses == 1 else f" in {self.self_stresses} ways"
        verb = "hold each other" if len(names) > 1 else "is held twice"
        head = f"{_listed(names)} {verb}{times}"
        if self.couplings:
            count = self.self_stresses
            head += (
                f"; {'one of them repeats' if count == 1 else f'{count} of them repeat'} the others"
            )
        return head + ("; to decide it, " + ", or ".join(self.remedies) if self.remedies else "")


def undecided_loads(model: Model, q: Array | None = None) -> list[Undecided]:
    """Which joint loads neither rigid bodies nor bearings decide, and what would.

    Args:
        model: The machine.
        q: Position (nq,) [rad, m] that closes its loops; the model's `initial_configuration()` by
            default.

    Returns:
        One entry for all loads that hold each other, with as many self-stresses as are independent
        [wojtyra2005], and remedies that were tried in this position: stiffnesses of bearings, or
        joints that leave more freedom while the machine can move in as many ways as before. Of
        machines whose loops hold more than 100 directions no remedies are looked for. Empty where
        all loads are determinate.

    Raises:
        InputError: `q` leaves a loop open, or the loops hold more than 1,000 directions.
    """
    rows = loop_rows(model)
    if rows > MOST_ROWS:
        raise InputError(
            f"model: its loops hold {rows} directions, and what is undecided is looked for among "
            f"up to {MOST_ROWS}"
        )
    if not rows:
        return []
    return describe(model, model.initial_configuration() if q is None else q, [])


def describe(model: Model, q: Array, given: Iterable[str]) -> list[Undecided]:
    """As `undecided_loads`, of a machine with joints that are locked or move as given."""
    held = list(given)
    found = Held(model, held).indeterminacy(q)
    trial = _Trial(model, np.asarray(q, dtype=float), held, found)
    return [
        Undecided(count, joints, couplings, trial.remedies(rows, couplings))
        for count, rows, joints, couplings in _blocks(model, found)
    ]


#: Independent self-stresses, rows of loads, their components by joint, and couplings.
_Block: TypeAlias = tuple[int, AnyArray, dict[str, tuple[str, ...]], tuple[str, ...]]


def _blocks(model: Model, found: Indeterminacy) -> list[_Block]:
    """Independent self-stresses, rows of loads, their components by joint, and couplings, of all
    that hold each other: parts of the reduced echelon form that share no row."""
    loads = np.asarray(found.undecided)
    open_couplings = tuple(  # what holds locked joints comes behind the model's own
        name
        for name, known in zip(model.coupling_names, found.couplings, strict=False)
        if not known
    )
    silent = [k for k, one in enumerate(loads) if not one.any()]  # load couplings alone
    loud = np.delete(loads, silent, axis=0)
    names = [*model.joint_names, *model.loop_names]
    made: list[_Block] = []
    known = np.asarray(found.determinate, dtype=np.bool_)
    reduced = _echelon(_scaled(np.where(known, 0.0, loud)))
    seen = np.abs(reduced) > _TOUCHED
    left = list(range(len(reduced)))
    while left:
        group, rows = [left.pop(0)], np.zeros(seen.shape[1], dtype=np.bool_)
        for k in group:
            rows |= seen[k]
            more = [m for m in left if (seen[m] & rows).any()]
            group += more
            left = [m for m in left if m not in more]
        table = rows.reshape(-1, 6)
        joints = {
            names[j]: tuple(c for c, one in zip(COMPONENTS, table[j], strict=True) if one)
            for j in np.flatnonzero(table.any(axis=1))
        }
        made.append((len(group), rows, joints, ()))
    if silent:
        none = np.zeros(6 * len(names), dtype=np.bool_)
        made.append((len(silent), none, {}, open_couplings))
    return made


def _scaled(loads: Array) -> Array:
    """Self-stresses (n, joints, 6) as rows (n, 6 joints), the largest force and moment 1."""
    halves = loads.reshape(*loads.shape[:2], 2, 3)
    size = np.abs(halves).max(axis=(0, 1, 3), initial=0.0)
    scaled: Array = (halves / np.where(size > 0, size, 1.0)[:, None]).reshape(
        len(loads), 6 * loads.shape[1]
    )
    return scaled


def _echelon(rows: Array) -> Array:
    """Reduced echelon form, the largest element left as the next pivot."""
    made = rows.copy()
    for k in range(len(made)):
        i, j = divmod(int(np.argmax(np.abs(made[k:]))), made.shape[1])
        made[[k, k + i]] = made[[k + i, k]]
        if not abs(made[k, j]) > _TOUCHED:
            return made[:k]
        made[k] /= made[k, j]
        others = np.arange(len(made)) != k
        made[others] -= np.outer(made[others, j], made[k])
    return made


def _stiffness(model: Model, joint: int, kinds: Sequence[str]) -> dict[str, float]:
    """Of these kinds what a bearing of the joint can have and does not have."""
    name = [*model.joint_names, *model.loop_names][joint]
    kind = [*model.joint_types, *model.loop_types][joint]
    had = model.bearings.get(name, {})
    if kind in ("rod", "spring"):
        kinds = [k for k in kinds if k == "axial" and kind == "rod"]
    elif kind not in _ONE_AXIS and "axis" not in had:
        pairs = ({"axial", "radial"}, {"tilt", "torsion"})
        kinds = [k for pair in pairs if pair & set(kinds) for k in _TRIAL if k in pair]
    return {k: _TRIAL[k] for k in kinds if k not in _FREE.get(kind, ()) and k not in had}


class _Trial:
    """Changes of a machine, and whether they decide some of its loads where it stands."""

    def __init__(self, model: Model, q: Array, held: list[str], found: Indeterminacy) -> None:
        self._model, self._q, self._held, self._found = model, q, held, found
        self._names = [*model.joint_names, *model.loop_names]
        self._types = [*model.joint_types, *model.loop_types]
        self._axes = [*model.joint_axes, *model.loop_axes]

    def remedies(self, rows: AnyArray, couplings: tuple[str, ...]) -> tuple[str, ...]:
        """Sentences of what decides these rows of loads (6 joints,)."""
        if loop_rows(self._model) > FEW_ROWS:
            return ()
        if couplings:
            return ()
        joints = [int(j) for j in np.flatnonzero(rows.reshape(-1, 6).any(axis=1))]
        tried = (self._bearings(rows, joints), self._freed(rows, joints))
        return tuple(text for text in tried if text)

    def _indeterminacy(self, model: Model, q: Array) -> Indeterminacy | None:
        try:
            return Held(model, self._held).indeterminacy(q)
        except InputError:  # it does not close there, or cannot be held
            return None

    # -- bearings -----------------------------------------------------------------------------

    def _bearings(self, rows: AnyArray, joints: list[int]) -> str:
        """Stiffness of all bearings against the loads that hold each other, or of all kinds."""
        for every in (False, True):
            given = {
                j: _stiffness(self._model, j, tuple(_TRIAL) if every else self._kinds(rows, j))
                for j in joints
            }
            given = {j: more for j, more in given.items() if more}
            found = self._with_bearings(given) if given else None
            if found is not None and found.determinate.reshape(-1)[rows].all():
                return self._said_of_bearings(given)
        return ""

    def _kinds(self, rows: AnyArray, joint: int) -> list[str]:
        """Of the stiffnesses those against the loads of the joint that are among the rows."""
        axis = np.asarray(self._axes[joint][0][1] if self._axes[joint] else np.zeros(3))
        kinds = []
        touched = rows.reshape(-1, 2, 3)[joint]
        for half, (along, across) in zip(
            touched, (("axial", "radial"), ("torsion", "tilt")), strict=True
        ):
            is_along, is_across = np.abs(axis) > _TOUCHED, np.abs(axis) < 1 - _TOUCHED
            kinds += [along] if (half & is_along).any() else []
            kinds += [across] if (half & is_across).any() else []
        return kinds

    def _with_bearings(self, given: Mapping[int, Mapping[str, float]]) -> Indeterminacy | None:
        model = self._model
        try:
            for j, more in given.items():
                had: dict[str, Any] = model.bearings.get(self._names[j], {})
                model = model.with_bearing(self._names[j], **{**had, **more})
        except InputError:
            return None
        return self._indeterminacy(model, self._q)

    def _said_of_bearings(self, given: Mapping[int, Mapping[str, float]]) -> str:
        by_kinds: dict[tuple[str, ...], list[str]] = {}
        for j, more in given.items():
            by_kinds.setdefault(tuple(more), []).append(repr(self._names[j]))
        said = [f"{_and(list(kinds))} of {_listed(names)}" for kinds, names in by_kinds.items()]
        return f"say how stiff their bearings are ([bearing.JOINT]: {'; '.join(said)})"

    # -- joints with more freedom ---------------------------------------------------------------

    def _freed(self, rows: AnyArray, joints: list[int]) -> str:
        """One joint, or two, that leave more freedom and hold the machine as before."""
        closing_first = joints[::-1]
        some = [(j, kind) for j in closing_first for kind in _FREER.get(self._types[j], ())]
        few = len(joints) <= _MOST_FREED
        pairs = [(a, b) for a, b in combinations(some, 2) if a[0] != b[0]] if few else []
        for change in [*((one,) for one in some), *pairs]:
            if self._would_free(rows, change) and self._frees(rows, change):
                by_kind: dict[str, list[str]] = {}
                for j, kind in change:
                    by_kind.setdefault(kind, []).append(repr(self._names[j]))
                return f"make {_and([f'{_and(names)} {kind}' for kind, names in by_kind.items()])}"
        return ""

    def _would_free(self, rows: AnyArray, change: Sequence[tuple[int, str]]) -> bool:
        """By the self-stresses alone, which is quick: those without the loads that are freed."""
        directions = [(j, row) for j, kind in change for row in self._lost(j, kind)]
        of_all, of_open = (
            np.array([s[:, j] @ row for j, row in directions])
            for s in (np.asarray(self._found.self_stresses), np.asarray(self._found.undecided))
        )
        if np.linalg.matrix_rank(of_all, tol=1e-6) < len(directions):
            return False
        _, sizes, turned = np.linalg.svd(of_open)
        left = turned[int((sizes > 1e-6).sum()) :]
        loads = np.asarray(self._found.undecided).reshape(len(self._found.undecided), -1)[:, rows]
        return bool(np.abs(left @ loads).max(initial=0.0) < _TOUCHED * np.abs(loads).max())

    def _lost(self, joint: int, kind: str) -> list[Array]:
        """Directions (6,) of load that the joint no longer has."""
        axis = np.asarray(self._axes[joint][0][1], dtype=float)
        slides = self._types[joint] == "prismatic"
        if kind == "cylindrical":
            half = np.concatenate([np.zeros(3), axis]) if slides else np.append(axis, np.zeros(3))
            return [half]
        across = np.linalg.svd(axis[None])[2][1:]
        return [np.concatenate([np.zeros(3), one]) for one in across]

    def _frees(self, rows: AnyArray, change: Sequence[tuple[int, str]]) -> bool:
        """Tried: the machine with those joints, where it stands."""
        model = self._model
        try:
            for j, kind in change:
                name = self._names[j]
                if name in model.bearings or name in self._held:
                    return False
                model = model.with_joint_type(name, kind)
        except InputError:  # a coupling or a drive holds its coordinate
            return False
        if set(model.joint_names) != set(self._model.joint_names):
            return False  # another joint closes the loop
        freed = {self._names[j]: kind for j, kind in change}
        q = np.array(model.neutral_configuration(), dtype=float)
        for k, name in enumerate(self._model.joint_names):
            own = self._q[self._model.q_slice(name)]
            axes = self._model.joint_axes[k]
            q[model.q_slice(name)] = _moved(own, self._model.joint_types[k], freed.get(name), axes)
        found = self._indeterminacy(model, q)
        if found is None or found.mobility != self._found.mobility:
            return False
        order = [[*model.joint_names, *model.loop_names].index(name) for name in self._names]
        return bool(np.asarray(found.determinate)[order].reshape(-1)[rows].all())


def _moved(own: Array, had: str, kind: str | None, axes: Sequence[Any]) -> Array:
    """Coordinates of a joint that became another kind, where it was."""
    if kind is None:
        return own
    if kind == "cylindrical":
        return np.array([own[0], 0.0] if had == "prismatic" else [0.0, own[0]])
    axis = np.asarray(axes[0][1], dtype=float)
    return np.append(np.sin(own[0] / 2) * axis, np.cos(own[0] / 2))


def _and(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def _listed(names: Sequence[str]) -> str:
    if len(names) <= _MOST_NAMED:
        return _and(names)
    return f"{', '.join(names[:_MOST_NAMED])} and {len(names) - _MOST_NAMED} more"


# -- misfits ----------------------------------------------------------------------------------


def misfit_notes(model: Model, q: Array) -> list[tuple[str, str]]:
    """Joints whose bearings do not fit, and what is to be known of that where the machine stands:
    that it loads nothing, or that a preload is not in balance."""
    misfits = {name: set(_MISFITS) & bearing.keys() for name, bearing in model.bearings.items()}
    if not any(misfits.values()) or not 0 < loop_rows(model) <= FEW_ROWS:
        return []
    made = []
    for name, bearing in model.bearings.items():
        for key, along, one in _parts(bearing):
            if text := _without_effect(model, q, name, {key: one}):
                made.append((name, f"{key} of its bearing{along}: {text}"))
    preloads = {n: {"preload": b["preload"]} for n, b in model.bearings.items() if "preload" in b}
    names = [*model.joint_names, *model.loop_names]
    loads = _misfit_loads(model, q, preloads) if preloads else np.zeros((len(names), 6))
    for name, given in preloads.items():
        wanted = float(np.linalg.norm(given["preload"]))
        got = float(np.linalg.norm(loads[names.index(name), :3]))
        if _SMALL * wanted < got and abs(got - wanted) > _BALANCED * wanted:
            text = (
                f"its bearing gets {got:.4g} N of the preload of {wanted:.4g} N where the machine "
                "starts: a preload counts in full where those that it acts against have theirs; "
                "give them, or an offset"
            )
            made.append((name, text))
    return made


_MISFITS = ("offset", "turn", "preload")
_SMALL = 1e-8  # of what a misfit would do if it was held: what is less is rounding


def _parts(bearing: Mapping[str, Any]) -> Iterable[tuple[str, str, Any]]:
    """Each number of a misfit: its key, along what, and the misfit alone."""
    for key in _MISFITS:
        given = np.asarray(bearing.get(key, 0.0), dtype=float)
        if given.ndim == 0 and given:
            yield key, "", float(given)
        for k in np.flatnonzero(given) if given.ndim else ():
            yield key, f" along {'xyz'[k]}", np.where(np.arange(3) == k, given, 0.0)


def _without_effect(model: Model, q: Array, name: str, misfit: Mapping[str, Any]) -> str:
    """Why a misfit loads nothing, "" where it does."""
    size = float(np.linalg.norm(next(iter(misfit.values()))))
    stiffness = [b[k] for b in model.bearings.values() for k in _TRIAL if k in b]
    least = 1.0 if "preload" in misfit else min(stiffness, default=0.0)
    if np.abs(_misfit_loads(model, q, {name: misfit})).max() > _SMALL * least * size > 0:
        return ""
    if np.abs(_misfit_loads(_yielding(model), q, {name: misfit})).max() > _SMALL * size:
        return (
            "what holds against it is rigid, which leaves its loads open; say how stiff those "
            "bearings are"
        )
    return (
        "nothing holds against it, so it moves the machine as that is assembled, which rigid "
        "bodies leave out"
    )


def _yielding(model: Model) -> Model:
    """The machine with bearings that yield in all directions that its joints hold."""
    made = model
    for j, name in enumerate([*model.joint_names, *model.loop_names]):
        if more := _stiffness(model, j, tuple(_TRIAL)):
            made = made.with_bearing(name, **{**model.bearings.get(name, {}), **more})
    return made


def _least(bearing: Mapping[str, Any]) -> dict[str, Any]:
    """A bearing that has a misfit alone: there is none without anything."""
    return {k: np.multiply(v, 1e-30) for k, v in bearing.items() if k in _MISFITS}


def _misfit_loads(model: Model, q: Array, misfits: Mapping[str, Mapping[str, Any]]) -> Array:
    """Loads (joints, 6) of these misfits alone, by joint."""
    changed = model
    for name, bearing in model.bearings.items():
        own = {k: v for k, v in bearing.items() if k not in _MISFITS} | dict(misfits.get(name, {}))
        changed = changed.with_bearing(name, **(own or _least(bearing)))
    rest = np.zeros(model.nv)
    loads: Array = np.asarray(_core.joint_loads_by_cause(changed, ["misfit"], q, rest))[0]
    return loads
