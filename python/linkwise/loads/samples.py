"""The samples of a run as arrays in the order that the core takes, block by block."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from linkwise import base
from linkwise._core import InputError, inverse_dynamics_loads, passive_torque
from linkwise.base import Array
from linkwise.io.complaint import near, shown

if TYPE_CHECKING:
    import xarray as xr

    from linkwise._core import Model


_SAME = 1e-9  # loads of the same motion that differ by less belong to the same machine


class RunLike(Protocol):
    """What functions of a run need of it; `linkwise.Run` has it.

    dataset: samples with names and units; path: where it is stored, None for one in memory;
    outcome: "converged", or how it ended instead; load_model: the machine that was simulated.
    """

    @property
    def dataset(self) -> xr.Dataset: ...
    @property
    def path(self) -> Path | None: ...
    @property
    def outcome(self) -> str: ...
    def load_model(self) -> Model: ...


def _require_run(run: object) -> None:
    if not (hasattr(run, "dataset") and hasattr(run, "load_model")):
        raise InputError(
            f"run: is a {type(run).__name__}; this takes a linkwise.Run. One member of a batch is "
            "linkwise.Run(batch.isel(member=0), model=model)"
        )


def need(run: RunLike, *names: str) -> None:
    """InputError where the run lacks one of these variables, or samples."""
    _require_run(run)
    for name in names:
        if name not in run.dataset:
            raise InputError(f'run holds no {name}; record the quantity "{name}"')
    if run.dataset.sizes["time"] == 0:
        raise InputError("run holds no samples: it stopped before the first was written")


def joint_names(run: RunLike) -> list[str]:
    """The joints whose loads the run holds."""
    need(run, "joint_load")
    return [str(name) for name in run.dataset["joint"].values]


def joint_position(run: RunLike, joint: str) -> int:
    """Which of the recorded joints this is."""
    names = joint_names(run)
    if joint not in names:
        raise InputError(
            f"run holds no joint {shown(joint)}; {near(joint, names, 'the joints are')}"
        )
    return names.index(joint)


def model_of(run: RunLike, model: Model | None) -> Model:
    """The machine of the run: the one given, checked, or the one inside the run.

    A model with other masses, frames or joint properties is refused where the run can tell; a run
    that does not hold its model is told apart by its hash alone, which is a warning, because a
    newer linkwise may describe the same machine differently.
    """
    _require_run(run)
    own = held_model(run)
    if model is None or model is own:
        return run.load_model()
    attrs = run.dataset.attrs
    size = {"model_joints": model.n_joints, "model_degrees_of_freedom": model.nv}
    same = all(attrs.get(name, count) == count for name, count in size.items())
    recorded = run.dataset.coords.get("joint")
    names = set() if recorded is None else {str(name) for name in recorded.values}
    if not (same and names <= {*model.joint_names, *model.loop_names}):
        raise InputError("model: is not the one that the run was made with; give that one")
    if own is None and model.hash != attrs.get("model_hash", model.hash):
        warnings.warn(
            "model: its hash is not that of the model that the run was made with; loads that are "
            "computed again are right only if it is the same machine",
            UserWarning,
            stacklevel=2,
        )
    if own is not None and not _move_alike(model, own):
        raise InputError(
            "model: is not the one that the run was made with, its masses, frames or joint "
            "properties differ; leave it out, the run holds its own"
        )
    return model


def _move_alike(one: Model, other: Model) -> bool:
    """Whether two machines with the same joints need the same loads for the same motion.

    An arbitrary motion at one pose shows every mass, inertia, frame and joint property. Hashes
    would tell apart what differs in the last bit.
    """
    if one.hash == other.hash:
        return True
    if one.joint_names != other.joint_names or one.joint_types != other.joint_types:
        return False
    if one.n_loops or other.n_loops or one.coupling_names or other.coupling_names:
        return False  # their loads depend on more than the motion
    v, a = np.random.default_rng(1).normal(size=(2, one.nv))
    loads = []
    for model in (one, other):
        q = one.neutral_configuration()
        wrenches = inverse_dynamics_loads(model, q, v, a).ravel()
        loads.append(np.concatenate([wrenches, passive_torque(model, q, v).ravel()]))
    size = np.abs(loads).max(initial=0.0)
    return bool(np.abs(loads[0] - loads[1]).max(initial=0.0) <= _SAME * size)


def held_model(run: RunLike) -> Model | None:
    """The machine inside the run, None where it holds none that can be read."""
    try:
        return run.load_model()
    except InputError:
        return None


@dataclass(frozen=True)
class Selection:
    """The recorded joints in the model: their indices among the loads, where the joints that
    close loops stand behind those of the tree, and which joint each of their dofs has."""

    model: Model
    joints: npt.NDArray[np.intp]
    owner: npt.NDArray[np.intp]

    @property
    def whole(self) -> bool:
        return bool(self.joints.size == self.model.n_joints + self.model.n_loops)


def select(run: RunLike, model: Model) -> Selection:
    where = {name: k for k, name in enumerate([*model.joint_names, *model.loop_names])}
    joints = np.array([where[name] for name in joint_names(run)], dtype=np.intp)
    driven = "loop_drive_torque" in run.dataset
    of_loops = [v.stop - v.start if driven else 0 for _, v in model.loop_slices]
    of_each = [*model.joint_nv, *of_loops]
    nv = np.asarray(of_each, dtype=np.intp)[joints]
    return Selection(model, joints, np.repeat(np.arange(joints.size), nv))


def need_whole(run: RunLike, model: Model, *names: str) -> Selection:
    """The selection of a run that holds these quantities of every joint."""
    need(run, *names)
    found = select(run, model)
    if not found.whole:
        count = model.n_joints + model.n_loops
        raise InputError(
            f"run holds {found.joints.size} of {count} joints; this needs a run of all joints "
            "(simulate without joints=)"
        )
    return found


def blocks(run: RunLike, row_bytes: int) -> Iterator[slice]:
    """Slices of time whose rows fit into memory."""
    return base.blocks(run.dataset.sizes["time"], row_bytes)


def dof_rows(run: RunLike, name: str, where: slice) -> Array:
    """A variable's rows (time, dof), those of joints that close loops behind those of the tree."""
    held = [each for each in (name, f"loop_{name}") if each in run.dataset]
    return np.concatenate([rows(run, each, where) for each in held], -1)


def rows(run: RunLike, name: str, where: slice | Sequence[int]) -> Array:
    """A variable's rows as (time, ...) in the model's order; the extremes have no time.

    Raises InputError where the files are damaged or a joint load is not a number.
    """
    variable = run.dataset[name]
    last = [dim for dim in variable.dims if dim != "time"]
    shown = f"run {str(run.path)!r}" if run.path is not None else "run"
    try:
        ordered = variable.transpose("time", *last) if "time" in variable.dims else variable
        values = ordered[where].values
    except InputError:  # a ValueError; it names the file
        raise
    except (RuntimeError, OSError, ValueError) as error:
        why = " ".join(str(error).split())
        raise InputError(
            f"{shown}: {name} cannot be read ({why}); its files are damaged, simulate again"
        ) from None
    found = np.asarray(values, dtype=np.float64)
    if name == "joint_load" and not np.isfinite(found).all():
        row, joint = np.argwhere(~np.isfinite(found))[0][:2]
        time = float(run.dataset["time"][where].values[row])
        raise InputError(
            f"{shown}: joint_load of joint {joint_names(run)[joint]!r} is not a finite number at "
            f"{time:g} s; simulate again"
        )
    return found


def external(run: RunLike, model: Model, where: slice | Sequence[int]) -> Array | None:
    """The wrenches on all bodies (time, body, 6), None where there are none.

    A run with wrenches that did not record them cannot be evaluated again.
    """
    if "external_wrench" not in run.dataset:
        if json.loads(run.dataset.attrs.get("wrenches", "{}")):
            raise InputError('run holds no external_wrench; record the quantity "external_wrench"')
        return None
    given = run.dataset["external_wrench"]
    bodies = {name: k for k, name in enumerate(model.child_link_names)}
    values = rows(run, "external_wrench", where)
    whole = np.zeros((len(values), model.n_joints, 6))
    whole[:, [bodies[str(name)] for name in given["wrenched_body"].values]] = values
    return whole


def drive_kinds(run: RunLike) -> dict[str, str] | None:
    """The kind of each joint's drive, for those that have one; None where the run does not say."""
    told = run.dataset.attrs.get("drives")
    if told is None:
        return None
    drives: dict[str, Any] = json.loads(told)
    return {joint: str(drive.get("kind")) for joint, drive in drives.items()}


def given_motions(run: RunLike) -> dict[str, str]:
    """The joints whose motion was given, those that close loops too: "locked" or "motion"."""
    kinds = drive_kinds(run) or {}
    return {joint: kind for joint, kind in kinds.items() if kind in ("locked", "motion")}


def loop_torque(run: RunLike, where: slice | Sequence[int]) -> Array | None:
    """Drive torques (time, dof) of the joints that close loops; None where there are none."""
    name = "loop_drive_torque"
    return rows(run, name, where) if name in run.dataset else None


def trapezoid_weights(times: Array) -> Array:
    """Seconds that each sample stands for."""
    if times.size < 2:
        return np.ones(times.size)
    gaps = np.diff(times)
    weights = np.zeros(times.size)
    weights[:-1] += gaps / 2
    weights[1:] += gaps / 2
    return weights
