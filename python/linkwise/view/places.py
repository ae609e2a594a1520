"""Where joints are: those of the tree, those that close loops, and the other ends of the latter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from linkwise import _core
from linkwise.base import Array

if TYPE_CHECKING:
    import numpy.typing as npt

    from linkwise._core import Model


_LINES = ("rod", "spring")  # types of what stands between two points


class Places:
    """The frames of a machine's joints.

    names: the joints with a load, those of the tree first, as runs have them; spans: from the joint
    of each link to where loop joints meet it (n, 2); rods: the two ends of each rod and spring
    (n, 2), as numbers of places.
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        self.names = [*model.joint_names, *model.loop_names]
        links = {name: k for k, name in enumerate(model.link_names)}
        ends = (model.loop_child_link_names, model.loop_parent_link_names)
        self._links = np.array([links[name] for end in ends for name in end], dtype=int)
        placements = model.loop_placements.reshape(-1, 2, 4, 4)
        self._placements = np.concatenate([placements[:, 1], placements[:, 0]])
        first, n = model.n_joints, model.n_loops
        joint_of = _joints_by_link(model)
        met = [
            (joint_of[name], first + k)
            for k, name in enumerate([*ends[0], *ends[1]])
            if name in joint_of
        ]
        self.spans: npt.NDArray[np.int64] = np.array(met, dtype=int).reshape(-1, 2)
        rods = [(first + n + k, first + k) for k, t in enumerate(model.loop_types) if t in _LINES]
        self.rods: npt.NDArray[np.int64] = np.array(rods, dtype=int).reshape(-1, 2)

    def frames(self, links: Array, q: Array) -> Array:
        """Frames (n, 4, 4) in the world: of the tree's joints, of the loop joints on their child
        links, then on their parent links; links: those of the links."""
        joints = _core.joint_poses(self._model, q)
        if not self._links.size:
            return joints
        return np.concatenate([joints, links[self._links] @ self._placements])


def _joints_by_link(model: Model) -> dict[str, int]:
    """The joint that each link hangs on; what is welded to the ground hangs on none."""
    found = {name: k for k, name in enumerate(model.child_link_names)}
    together = [set(weld[1:]) for weld in model.welds]
    while True:  # welded links hang on the joint of any of them
        new = {
            name: found[next(iter(pair & found.keys()))]
            for pair in together
            for name in pair - found.keys()
            if pair & found.keys()
        }
        if not new:
            return found
        found |= new
