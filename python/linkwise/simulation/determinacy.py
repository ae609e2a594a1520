"""Which joint loads of a machine with loops rigid bodies leave open: a warning of its runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from linkwise import _core
from linkwise.base import COMPONENTS
from linkwise.loads.certainty import MOST_ROWS
from linkwise.notes import Ignored

if TYPE_CHECKING:
    import numpy.typing as npt

    from linkwise._core import Model

_MOST_NAMED = 8
_ELEMENT = "joint_load"


def undetermined_loads(model: Model, q: npt.ArrayLike, v: npt.ArrayLike) -> list[Ignored]:
    """What is said of loads that no rigid-body calculation knows, at the start of a run.

    Args:
        model: the machine.
        q: (nq,) [rad, m]; v: (nv,) [rad/s, m/s]: the start, which is assembled first.
    """
    if not model.n_loops and not model.coupling_names:
        return []
    if sum(6 - freedom for freedom in model.loop_nv) + len(model.coupling_names) > MOST_ROWS:
        return [
            Ignored(
                "",
                _ELEMENT,
                "which loads of closed loops rigid bodies determine was not looked at in a machine "
                "of this size; where constraints repeat each other they are one choice of many",
            )
        ]
    found = _core.indeterminacy(model, _core.assemble(model, q, v, [])["q"])
    names = [*model.joint_names, *model.loop_names]
    open_loads = {
        name: [c for c, known in zip(COMPONENTS, row, strict=True) if not known]
        for name, row in zip(names, found.determinate, strict=True)
    }
    said = [f"{name!r} ({', '.join(of)})" for name, of in open_loads.items() if of]
    if not said:
        return []
    more = f" and {len(said) - _MOST_NAMED} more" if len(said) > _MOST_NAMED else ""
    count = found.rows - found.rank
    return [
        Ignored(
            "",
            _ELEMENT,
            f"rigid bodies do not determine the loads of joints {', '.join(said[:_MOST_NAMED])}"
            f"{more}: {count} self-stress{'es' if count > 1 else ''} of the closed loops load "
            "them by any amount, and what is shown is one choice of many; do not size parts by "
            "it, or leave a joint of the loop more freedom (a spherical or cylindrical one)",
        )
    ]
