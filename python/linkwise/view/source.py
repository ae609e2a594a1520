"""What is shown: a run with the model that it holds, or a model alone."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from linkwise import _core
from linkwise._core import InputError, Model
from linkwise.base import Array, rows_per_block
from linkwise.io.complaint import near, shorten
from linkwise.io.load import load
from linkwise.io.urdf_visuals import Appearance, read_appearance
from linkwise.loads.determinate import FEW_ROWS, loop_rows
from linkwise.loads.extremes import loads_at_peaks, missed_peaks
from linkwise.loads.samples import blocks, held_model, model_of, rows
from linkwise.loads.undecided import undecided_loads
from linkwise.notes import plain_warnings, warnings_of
from linkwise.record.model import read_model
from linkwise.results import Run, open_run
from linkwise.scenario import load_ratings, load_scenario, ratings_in
from linkwise.view.known import Known, known_in
from linkwise.view.shown_loads import CauseLoads

if TYPE_CHECKING:
    from linkwise.loads.rating import Rating

PathLike = str | os.PathLike[str]


@dataclass(frozen=True)
class Options:
    """How to find a model and its appearance.

    model: file that says how a run's machine looks, and what it is where the run does not hold it;
    package_dirs, floating_base: as in linkwise.load; loads: whether joint loads are shown; ratings:
    a file of them instead of the scenario's; causes: only the loads that these cause.
    """

    model: Path | None = None
    package_dirs: Sequence[Path] = ()
    floating_base: bool = False
    loads: bool = True
    ratings: Path | None = None
    causes: Sequence[str] = ()


class Recording:
    """The samples of a run, read block by block: a run may be larger than memory.

    times: (n,); largest: the largest force [N] and moment [N m] of all joints and samples; peaks:
    the largest force of each joint [N]; causes: which causes' loads are shown.
    """

    def __init__(self, run: Run, model: Model, *, loads: bool) -> None:
        self._shown = f"run {str(run.path)!r}"
        self.has_loads = loads
        self._check(run, model)
        self.times: Array = np.asarray(run.dataset["time"].values, dtype=float)
        self._run = run
        n_joints = model.n_joints + model.n_loops
        self._row_bytes = 8 * (model.nq + (6 * n_joints if loads else 0))
        self._first = self._last = 0
        self._positions = np.zeros((0, model.nq))
        self._loads = np.zeros((0, n_joints, 6))
        self.largest = (0.0, 0.0)
        self.peaks: Array = np.zeros(n_joints)
        self.causes: CauseLoads | None = None
        if loads:
            self.causes = CauseLoads(run, model)
            peaks = run.peak_loads()
            self.peaks = np.asarray(peaks["force"].values)
            self.largest = (float(peaks["force"].max()), float(peaks["moment"].max()))

    def _check(self, run: Run, model: Model) -> None:
        held = run.dataset
        needed = {"position": model.nq}
        if self.has_loads:
            needed["joint_load"] = model.n_joints + model.n_loops
        for name, count in needed.items():
            if name not in held:
                remedy = " or view it with --no-loads" if name == "joint_load" else ""
                raise InputError(
                    f"{self._shown}: holds no {name}; record the quantity {name!r}{remedy}"
                )
            if held[name].shape[1] != count:
                raise InputError(
                    f"{self._shown}: holds {name} of {held[name].shape[1]} of {count} "
                    f"{'joints' if name == 'joint_load' else 'coordinates'}; record all joints"
                )
        if held.sizes["time"] == 0:
            raise InputError(f"{self._shown}: holds no samples; simulate again")

    def _read(self, sample: int) -> int:
        """Row of `sample` in the block at hand, which is replaced when it is not in there."""
        if not self._first <= sample < self._last:
            count = rows_per_block(self._row_bytes)
            self._first = sample - sample % count
            self._last = min(self._first + count, self.times.size)
            block = slice(self._first, self._last)
            self._positions = rows(self._run, "position", block)
            if self.has_loads:
                self._loads = rows(self._run, "joint_load", block)
        return sample - self._first

    def position(self, sample: int) -> Array:
        row = self._read(sample)
        return np.asarray(self._positions[row])

    def positions(self) -> Iterator[Array]:
        """Positions (time, nq) of all samples, block by block."""
        for block in blocks(self._run, self._row_bytes):
            yield rows(self._run, "position", block)

    def load(self, sample: int) -> Array:
        """Loads (n_joints, 6) in the joint frames, of the chosen causes."""
        if self.causes is not None and not self.causes.everything:
            return self.causes.load(sample)[: self.peaks.size]
        row = self._read(sample)
        return np.asarray(self._loads[row])

    def history(self, joint: int, most: int) -> tuple[Array, Array]:
        """Times (n,) and loads (n, 6) of one joint: at most `most` evenly spaced samples, and what
        the run holds of its largest force and moment between them.

        Of chosen causes, like `load`, the samples alone.
        """
        chosen = np.unique(np.linspace(0, self.times.size - 1, most).astype(int))
        if self.causes is not None and not self.causes.everything:
            chosen, loads = self.causes.history(joint, chosen)
            return self.times[chosen], loads
        load = self._run.dataset["joint_load"].transpose("time", "joint", "component")[:, joint]
        times, loads = self.times[chosen], np.asarray(load.values[chosen])
        peak_times, peaks = loads_at_peaks(self._run, joint)
        order = np.argsort(np.concatenate([times, peak_times]), kind="stable")
        return np.concatenate([times, peak_times])[order], np.concatenate([loads, peaks])[order]


@dataclass(frozen=True)
class Source:
    """A model, how its links look, and the samples of a run (None: the model alone).

    notes: what is not shown as it looks; warnings: what was ignored or assumed when the model was
    read; known: which loads are determinate, None: all; start: the position (nq,) in which a model
    alone is first shown, as near as its loops can be closed with the joints `held`
    where they are.
    """

    title: str
    model: Model
    appearance: Appearance
    recording: Recording | None = None
    ratings: Mapping[str, Rating] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    warnings: Sequence[Mapping[str, str]] = ()
    known: Known | None = None
    start: Array | None = None
    held: Sequence[str] = ()

    @property
    def first_position(self) -> Array:
        """(nq,) [rad, m] of a model alone; loops may be open."""
        drawn = self.model.initial_configuration() if self.start is None else self.start
        return np.array(drawn, dtype=float)


def open_source(target: PathLike, options: Options) -> Source:
    """What `linkwise view TARGET` shows: a folder is a run, a file is a model or a scenario.

    Raises InputError when it is neither, or lacks what is needed.
    """
    path = Path(target)
    if os.path.isdir(path):
        return _open_run(path, options)
    if options.model is not None:
        raise InputError(f"{str(path)!r}: --model goes with a run, and this is a file; remove it")
    if options.causes:
        raise InputError(f"{str(path)!r}: causes go with a run, and this is a file; leave them out")
    model, file, package_dirs = _load_model(path, options)
    appearance = Appearance([], [], []) if file is None else read_appearance(file, package_dirs)
    ignored = plain_warnings(warnings_of(model))
    notes = _notes(appearance)
    if path.suffix.lower() != ".toml":
        ratings, known = _ratings(options, ""), _known(model, None, [], notes)
        return Source(model.name, model, appearance, None, ratings, notes, ignored, known)
    scenario = load_scenario(path)
    ratings = _ratings(options, scenario.text)
    start, held = scenario.first_position(model)
    known = _known(model, start, held, notes)
    return Source(model.name, model, appearance, None, ratings, notes, ignored, known, start, held)


def _known(
    model: Model, start: Array | None, held: Sequence[str], notes: list[str]
) -> Known | None:
    """Which of its loads are determinate, None where nobody can say; adds to the notes what would
    decide those that are open in the pose that is shown first."""
    if not 0 < loop_rows(model) <= FEW_ROWS:
        return None
    q = model.initial_configuration() if start is None else start
    try:
        closed = _core.assemble(model, q, np.zeros(model.nv), list(held))["q"]
        known = np.asarray(_core.indeterminacy(model, closed).determinate, dtype=np.bool_)
        if not known.all():
            notes += [_DASHED, *(one.text for one in undecided_loads(model, closed))]
    except InputError:  # the view says where loops stay open
        known = np.ones((model.n_joints + model.n_loops, 6), dtype=np.bool_)
    return Known(model, known)


_DASHED = "dashed arrows and numbers in brackets are not determined by rigid bodies"


def _ratings(options: Options, scenario: str) -> Mapping[str, Rating]:
    """Those of the file that the options name, or of the scenario's text."""
    return ratings_in(scenario) if options.ratings is None else load_ratings(options.ratings)


def _load_model(path: Path, options: Options) -> tuple[Model, Path | None, Sequence[Path]]:
    """The model of a file, the file that may say how it looks, and where its packages are."""
    if path.suffix.lower() != ".toml":
        model = load(
            path,
            floating_base=options.floating_base,
            package_dirs=options.package_dirs,
        )
        return model, path, options.package_dirs
    scenario = load_scenario(path)
    model = scenario.load_model()
    folders = [Path(scenario.resolve(folder)) for folder in scenario.settings.package_dirs]
    file = Path(model.source) if model.source else None
    return model, file, [*folders, *options.package_dirs]


def _open_run(path: Path, options: Options) -> Source:
    run = open_run(path)
    if options.model is not None:
        # The file says how the machine looks. What it weighs and how it moves says the run: a
        # payload or other masses of its scenario are not in the file.
        drawn, file, package_dirs = _load_model(options.model, options)
        _check_same_machine(run, drawn, options.model)
        model = held_model(run) or model_of(run, drawn)
    else:
        model, package_dirs = read_model(path), options.package_dirs
        file = _file_beside(path, str(run.dataset.attrs.get("model_source", "")))
    appearance = Appearance([], [], [])
    if file is not None:
        appearance = read_appearance(file, package_dirs)
        if set(appearance.links) - set(model.link_names):  # another machine under the same name
            appearance = Appearance([], [], [])
    recording = Recording(run, model, loads=options.loads)
    if options.causes:
        if recording.causes is None:
            raise InputError("causes: are those of loads, and --no-loads hides them; leave one out")
        recording.causes.choose(options.causes)
    ratings = _ratings(options, str(run.dataset.attrs.get("scenario", "")))
    notes = _notes(appearance)
    missed = missed_peaks(run) if options.loads else []
    if missed:
        notes.append(f"arrows and colours are of the samples: {missed[0]}")
    known = known_in(run, model) if options.loads else None
    if known is not None:
        notes.append(_DASHED)
    return Source(model.name, model, appearance, recording, ratings, notes, run.warnings, known)


def _file_beside(path: Path, name: str) -> Path | None:
    """The model's file next to the run or in the current folder; a run keeps its name alone."""
    if not name or name != Path(name).name:
        return None
    return next((f for f in (path.parent / name, Path(name)) if os.path.isfile(f)), None)


def _check_same_machine(run: Run, model: Model, file: Path) -> None:
    held = [str(name) for name in run.dataset["joint"].values] if "joint" in run.dataset else []
    known = [*model.joint_names, *model.loop_names]
    for name in held:
        if name not in known:
            raise InputError(
                f"{str(file)!r}: has no joint {name!r}, which the run has; {near(name, known)}"
            )


def _notes(appearance: Appearance) -> list[str]:
    if not appearance.missing:
        return []
    first = shorten(Path(appearance.missing[0]).name)
    return [
        f"{len(appearance.missing)} meshes are not on this disk (the first is {first!r}); "
        "--package-dir says where packages are"
    ]
