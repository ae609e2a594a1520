"""What passes through fixed joints whose links are merged, such as the flange of a force sensor.

A merged joint is no joint of the equations of motion, but it carries a load all the same: what
moves the links beyond it, on its outboard side. With their mass m, centre c, inertia I about the
origin of the joint's child link, and that frame's own acceleration a, turning w and gravity g,

    f = m (a - g + w' x c + w x (w x c)),    n = m c x (a - g) + I w' + w x I w,

plus the loads of the joints that hang on them, less those of joints that close a loop to them, less
the wrenches that act on them from outside.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from linkwise import _core
from linkwise._core import Frame, InputError
from linkwise.base import Array
from linkwise.loads.samples import external, need, rows

if TYPE_CHECKING:
    from linkwise._core import Model
    from linkwise.loads.samples import RunLike


class Weld:
    """A merged joint of a model: the links on both sides, and what is beyond it."""

    def __init__(self, model: Model, joint: str) -> None:
        self.model, self.joint = model, joint
        outboard: dict[str, list[str]] = {}
        for name, parent, child in model.welds:
            outboard.setdefault(parent, []).append(child)
            if name == joint:
                self.parent, self.child = parent, child
        self.beyond = [self.child]
        for link in self.beyond:  # grows while it is walked
            self.beyond += outboard.get(link, [])
        links = set(self.beyond)
        parents = [*model.parent_link_names, *model.loop_parent_link_names]
        self._signs = {k: 1.0 for k, parent in enumerate(parents) if parent in links}
        for k, child in enumerate(model.loop_child_link_names, model.n_joints):
            if child in links:  # of a joint between two of them nothing is left
                self._signs[k] = self._signs.get(k, 0.0) - 1.0
        self.body, self._axes, self._origin = model.frame_placement(self.child)

    def load(self, run: RunLike, child: Array, where: slice | Sequence[int]) -> Array:
        """Loads (time, 6) at the child link's origin in its axes, positive on what is beyond.

        child: poses (time, joint, 4, 4) of the model's joint frames at these samples.
        """
        q = rows(run, "position", where)
        pose = _core.frame_pose(self.model, q, self.child)
        load = self._of_masses(run, q, pose, where)
        load += self.of_joints(q, rows(run, "joint_load", where), child)
        return load - self._external(run, q, pose, where)

    def of_joints(self, q: Array, loads: Array, child: Array) -> Array:
        """What loads (n, joint, 6) of all joints alone ask for, (n, 6)."""
        pose = _core.frame_pose(self.model, q, self.child)
        total = np.zeros((len(q), 6))
        for k, sign in self._signs.items():
            total += sign * carried_to(pose, loads[:, k], child[:, k])
        return total

    def _of_masses(
        self, run: RunLike, q: Array, pose: Array, where: slice | Sequence[int]
    ) -> Array:
        mass, center, inertia = self._inertia()
        weight = np.einsum("tki,k->ti", pose[:, :3, :3], self.model.gravity)
        if self.body is None:
            a = alpha = w = np.zeros_like(weight)
        else:
            need(run, "velocity", "acceleration")
            v, du = rows(run, "velocity", where), rows(run, "acceleration", where)
            w = _core.frame_velocity(self.model, q, v, self.child, axes="frame")[:, 3:]
            both = _core.frame_acceleration(self.model, q, v, du, self.child, axes="frame")
            a, alpha = both[:, :3], both[:, 3:]
        felt = a - weight
        force = mass * (felt + np.cross(alpha, center) + np.cross(w, np.cross(w, center)))
        moment = mass * np.cross(center, felt) + alpha @ inertia + np.cross(w, w @ inertia)
        return np.concatenate([force, moment], axis=1)

    def _inertia(self) -> tuple[float, Array, Array]:
        """Mass, centre and inertia about the child link's origin, in its axes, of what is beyond.

        Moving links that hang there have joints of their own and are not in it.
        """
        model, total = self.model, 0.0
        first, second = np.zeros(3), np.zeros((3, 3))
        index = {name: k for k, name in enumerate(model.link_names)}
        masses, centers, inertias = (
            model.link_masses,
            model.link_centers_of_mass,
            model.link_inertias,
        )
        for link in self.beyond:
            k = index[link]
            _, axes, origin = model.frame_placement(link)
            turn = self._axes.T @ axes
            center = turn @ centers[k] + self._axes.T @ (origin - self._origin)
            total += masses[k]
            first += masses[k] * center
            about = np.eye(3) * (center @ center) - np.outer(center, center)
            second += turn @ inertias[k] @ turn.T + masses[k] * about
        return total, first / total if total > 0 else first, second

    def _external(self, run: RunLike, q: Array, pose: Array, where: slice | Sequence[int]) -> Array:
        """The wrenches (time, 6) on what is beyond. The run holds their sum on the whole body, and
        those that are constant."""
        if self.body is None:
            return np.zeros(6)
        beyond: list[ToldWrench] = []
        before: list[ToldWrench] = []
        for wrench in told_wrenches(run):
            if self.model.frame_placement(wrench.at)[0] == self.body:
                (beyond if wrench.at.link in self.beyond else before).append(wrench)
        if not beyond:
            return np.zeros(6)
        if before and all(wrench.value is not None for wrench in beyond):
            return self._sum(beyond, q, pose)
        if any(wrench.value is None for wrench in before):
            raise InputError(
                f"joint {self.joint!r} is fixed and its links are merged, wrenches change on both "
                f"sides of it ({before[0].at.link!r} and {beyond[0].at.link!r}), and the run holds "
                "their sum; simulate without those on one side, or load with keep_fixed"
            )
        rest: Array = self._recorded(run, where) - self._sum(before, q, pose)
        return rest

    def _sum(self, wrenches: Sequence[ToldWrench], q: Array, pose: Array) -> Array:
        """Constant wrenches, added up at the child link's origin in its axes."""
        total = np.zeros((len(q), 6))
        for wrench in wrenches:
            at = _core.frame_pose(self.model, q, wrench.at)
            if wrench.along_world:
                at[:, :3, :3] = np.eye(3)
            total += carried_to(pose, np.tile(np.asarray(wrench.value), (len(q), 1)), at)
        return total

    def _recorded(self, run: RunLike, where: slice | Sequence[int]) -> Array:
        """The sum on the whole body, at the child link's origin in its axes."""
        whole = external(run, self.model, where)
        if whole is None:
            return np.zeros(6)
        given = whole[:, self.model.child_link_names.index(str(self.body))]
        force = given[:, :3] @ self._axes
        moment = (given[:, 3:] - np.cross(self._origin, given[:, :3])) @ self._axes
        return np.concatenate([force, moment], axis=1)


class ToldWrench(NamedTuple):
    """An external wrench as the attributes of a run tell it; value: None unless constant."""

    at: Frame
    along_world: bool
    value: list[float] | None


def told_wrenches(run: RunLike) -> list[ToldWrench]:
    found = []
    for name, told in json.loads(run.dataset.attrs.get("wrenches", "{}")).items():
        at = told.get("at", {"link": name})  # before frames a name was that of a link
        value = told.get("value")
        constant = value if isinstance(value, list) else None
        axes = told.get("axes", told.get("frame", "world"))  # before axes were called so
        found.append(ToldWrench(Frame(**at), axes == "world", constant))
    return found


def carried_to(pose: Array, load: Array, origin: Array) -> Array:
    """Loads (time, 6) in frames `origin` (time, 4, 4), at and in the frames `pose`."""
    turn = np.einsum("tki,tkj->tij", pose[:, :3, :3], origin[:, :3, :3])
    arm = np.einsum("tki,tk->ti", pose[:, :3, :3], origin[:, :3, 3] - pose[:, :3, 3])
    force = np.einsum("tij,tj->ti", turn, load[:, :3])
    moment = np.einsum("tij,tj->ti", turn, load[:, 3:]) + np.cross(arm, force)
    return np.concatenate([force, moment], axis=1)
