"""Joint loads of machines with closed loops by what their motion needs.

In a tree the motion alone decides the loads. Loops pass torques on, so the loads also depend on
which joints have the drives that make the motion. With v = N v_d (driven_jacobian) accelerations
are a = N a_d + a_v, and a_v, those at constant rates v_d of the driven joints, belong to the rates.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from linkwise import _core
from linkwise._core import InputError, NumericsError
from linkwise.base import Array
from linkwise.loads.samples import drive_kinds, rows

if TYPE_CHECKING:
    from linkwise._core import Model
    from linkwise.loads.samples import RunLike


class DrivenMotion:
    """What the motion of a machine with loops needs of the drives of some joints."""

    def __init__(self, run: RunLike, model: Model, driven: Sequence[str] | None) -> None:
        kinds = drive_kinds(run) or {}
        drives = [joint for joint, kind in kinds.items() if kind != "free"]
        self.model = model
        self.driven = drives if driven is None else list(driven)
        for joint in drives:
            if joint not in self.driven:
                raise InputError(
                    f"driven: joint {joint!r} has a drive in this run, which loads the others; "
                    'name it too, or split the loads by "force"'
                )
        if not self.driven:
            raise InputError(
                "by: where loops close, how loads split by motion depends on which joints drive "
                "it, and none does in this run; name them by driven=[...] (on the command line "
                'by --driven), or split by "force"'
            )
        self._require_motion(run)

    def _require_motion(self, run: RunLike) -> None:
        """InputError where the driven joints do not determine the motion, wherever it is looked at:
        at dead points, which a run may start in, they never do."""
        wrong: Exception | None = None
        for k in np.linspace(0, run.dataset.sizes["time"] - 1, 3).astype(int).tolist():
            try:
                _core.driven_jacobian(self.model, rows(run, "position", [k])[0], self.driven)
                return
            except (InputError, NumericsError) as error:
                wrong = wrong or error
        if wrong is not None:
            raise wrong

    def shares(
        self, names: Sequence[str], q: Array, v: Array, a: Array, outside: Array | None
    ) -> Array:
        """(state, cause, joint, 6); NaN at states where the driven joints do not decide the
        motion."""
        size = self.model.n_joints + self.model.n_loops
        made = np.full((len(q), len(names), size, 6), np.nan)
        try:
            for k, part in enumerate(self._parts(names, q, v, a, outside)):
                made[:, k] = part
        except (InputError, NumericsError):
            if len(q) > 1:
                for k in range(len(q)):
                    here = slice(k, k + 1)
                    of_here = None if outside is None else outside[here]
                    made[here] = self.shares(names, q[here], v[here], a[here], of_here)
        return made

    def _parts(
        self, names: Sequence[str], q: Array, v: Array, a: Array, outside: Array | None
    ) -> list[Array]:
        """What belongs to the rates is what is left of the whole: a_v alone may be rounding.
        Misfits of bearings load a machine that needs nothing."""
        N = _core.driven_jacobian(self.model, q, self.driven)
        speeding = np.einsum("tij,tj->ti", N, self._driven_accelerations(q, v, a))
        whole = self._loads(q, v, a, gravity=1.0)
        misfit = self._loads(q, None, None) if "misfit" in names else 0.0
        made = {
            "gravity": self._loads(q, None, None, gravity=1.0) - misfit,
            "acceleration": self._loads(q, None, speeding) - misfit,
        }
        made["velocity"] = whole - made["gravity"] - made["acceleration"] - misfit
        if "passive" in names:
            made["passive"] = self._loads(q, v, a, gravity=1.0, passive=True) - whole
        if "external" in names:
            made["external"] = self._loads(q, None, None, outside=outside) - misfit
        if "misfit" in names:
            made["misfit"] = np.asarray(misfit)
        return [made[name] for name in names]

    def _driven_accelerations(self, q: Array, v: Array, a: Array) -> Array:
        model = self.model
        of_loops = _core.loop_accelerations(model, q, v, a) if model.n_loops else a[:, :0]
        loops = dict(zip(model.loop_names, model.loop_slices, strict=True))
        return np.concatenate(
            [
                of_loops[:, loops[joint][1]] if joint in loops else a[:, model.v_slice(joint)]
                for joint in self.driven
            ],
            axis=1,
        )

    def _loads(
        self,
        q: Array,
        v: Array | None,
        a: Array | None,
        *,
        gravity: float = 0.0,
        outside: Array | None = None,
        passive: bool = False,
    ) -> Array:
        return _core.inverse_dynamics_loads(
            self.model,
            q,
            v,
            a,
            external=outside,
            driven=self.driven,
            passive=passive,
            gravity=gravity,
        )
