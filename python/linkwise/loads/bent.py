"""Where elastic links are as they bend."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from linkwise import _core
from linkwise._core import InputError
from linkwise.base import Array
from linkwise.io.complaint import near, shorten, shown

if TYPE_CHECKING:
    import numpy.typing as npt

    from linkwise._core import Model

MOST_SECTIONS = 10_000


def beams_of(model: Model) -> dict[str, list[str]]:
    """Links in a row of each elastic link, from its start, by the name that was made flexible."""
    names = list(model.beam_lengths)
    rows: dict[str, list[str]] = {}
    for name in names:
        whole, _, number = name.rpartition(":")
        if whole in rows and number == str(len(rows[whole]) + 1):
            rows[whole].append(name)
        else:
            rows[name] = [name]
    return rows


def row_of(model: Model, link: object) -> list[str]:
    """The links in a row of one elastic link; InputError where it is not one."""
    rows = beams_of(model)
    if not isinstance(link, str):
        raise InputError(f"link: is {shown(link)}; give the name of an elastic link")
    if model.flexible_links.get(link) == "modal":
        raise InputError(
            f"link '{shorten(link)}' is of finite elements, which have no sections; take the loads "
            "of its joints"
        )
    if link not in rows:
        remedy = near(link, list(rows), "the elastic beams are") if rows else "make it one"
        raise InputError(f"link '{shorten(link)}' is not an elastic beam; {remedy}")
    return rows[link]


def check_count(n: object) -> int:
    """A number of sections, or InputError."""
    whole = isinstance(n, int | np.integer) and not isinstance(n, bool)
    if not whole or not 2 <= n <= MOST_SECTIONS:  # type: ignore[operator]
        raise InputError(f"n: is {shown(n)}; give a number of sections from 2 to {MOST_SECTIONS}")
    return int(n)  # type: ignore[call-overload,no-any-return]


def spread(
    row: Sequence[str], lengths: Mapping[str, float], n: int
) -> tuple[list[str], list[float], Array]:
    """Link and place on it [m] of n sections, evenly along links in a row, and how far [m] from
    the start of the first."""
    ends = np.cumsum([lengths[name] for name in row])
    x = np.linspace(0.0, ends[-1], n)
    which = np.minimum(np.searchsorted(ends, x * (1 - 1e-12), side="right"), len(row) - 1)
    starts = np.concatenate([[0.0], ends[:-1]])
    places = np.clip(x - starts[which], 0.0, [lengths[row[k]] for k in which])
    places[-1] = lengths[row[-1]]
    return [row[k] for k in which], places.tolist(), x


def section_frames(
    model: Model, links: Sequence[str], places: Sequence[float], q: Array
) -> tuple[Array, Array]:
    """Frames (..., sections, 4, 4) in the world of sections as bent, and (..., sections, 4) what
    strains say of the force along x [N] and the moments [N m] there; q: positions (..., nq)."""
    index = {name: k for k, name in enumerate(model.link_names)}
    poses, strains = _core.bent_sections(model, list(links), list(places), q)
    at: npt.NDArray[np.int64] = np.array([index[name] for name in links], dtype=np.int64)
    frames: Array = _core.link_poses(model, q)[..., at, :, :] @ poses
    return frames, strains
