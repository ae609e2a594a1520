"""Loads inside elastic links."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from linkwise import _core
from linkwise._core import InputError
from linkwise.base import COMPONENTS, Array
from linkwise.io.complaint import near, shorten, shown
from linkwise.loads.samples import blocks, model_of, need_whole, rows

if TYPE_CHECKING:
    import xarray as xr

    from linkwise._core import Model
    from linkwise.loads.samples import RunLike

_MOST = 10_000


def section_loads(run: RunLike, link: str, n: int = 11) -> xr.Dataset:
    """The load at sections of an elastic link, by equilibrium of all that is outboard of each.

    Signs are those of joint loads: what the inboard part puts on the outboard part, so tension is
    a negative fx. At the link's start it is the load of its inboard joint, turned into the beam's
    axes, to rounding.

    Args:
        run: recorded with position, velocity, acceleration and joint_load of all joints.
        link: an elastic link, by the name under which it was made flexible.
        n: how many sections, evenly from its start to its end.

    Returns:
        A dataset with section_load (time, section, component) [N, N m] in the axes of the bent
        section, x along the beam and y, z across it; discretisation_error of the same shape, how
        far the strains that the link's coordinates can follow are from it (NaN for fy and fz,
        which strains do not say); and the coordinate x (section) [m] from the link's start.

    Raises:
        InputError: the link is not elastic, n is not from 2 to 10,000, or the run lacks a quantity.
    """
    import xarray as xr

    model = model_of(run, None)
    need_whole(run, model, "position", "velocity", "acceleration", "joint_load")
    whole = isinstance(n, int | np.integer) and not isinstance(n, bool)
    if not whole or not 2 <= n <= _MOST:
        raise InputError(f"n: is {shown(n)}; give a number of sections from 2 to {_MOST}")
    links, places, x = _sections(model, link, n)
    time = np.asarray(run.dataset["time"])
    load = np.empty((len(time), n, 6))
    error = np.full((len(time), n, 6), np.nan)
    for block in blocks(run, 8 * (model.nq + 2 * model.nv + 6 * model.n_joints + 10 * n)):
        q, v, acceleration = (
            rows(run, name, block) for name in ("position", "velocity", "acceleration")
        )
        joints = rows(run, "joint_load", block)
        found: Array = _core.section_loads(model, links, places, q, v, acceleration, joints)
        load[block] = found[..., :6]
        error[block][..., [0, 3, 4, 5]] = np.abs(found[..., [0, 3, 4, 5]] - found[..., 6:])
    dims = ("time", "section", "component")
    axes = "axes of the bent section: x along the beam, y and z its own"
    return xr.Dataset(
        {
            "section_load": (dims, load, {"units": "N, N m", "frame": axes}),
            "discretisation_error": (dims, error, {"units": "N, N m", "frame": axes}),
        },
        coords={
            "time": ("time", time, {"units": "s"}),
            "x": ("section", x, {"units": "m", "long_name": "distance from the link's start"}),
            "component": list(COMPONENTS),
        },
        attrs={"link": link, "sign": "inboard part on outboard part"},
    )


def _sections(model: Model, link: str, n: int) -> tuple[list[str], list[float], Array]:
    """Link and place on it of each section, and the distance from the start of the first link."""
    lengths = model.beam_lengths
    if not isinstance(link, str):
        raise InputError(f"link: is {shown(link)}; give the name of an elastic link")
    if link not in lengths:
        remedy = near(link, list(lengths), "the elastic links are") if lengths else "make it so"
        raise InputError(f"link '{shorten(link)}' is not elastic; {remedy}")
    row = [link]
    while (after := f"{link}:{len(row) + 1}") in lengths:
        row.append(after)
    ends = np.cumsum([lengths[name] for name in row])
    x = np.linspace(0.0, ends[-1], n)
    which = np.minimum(np.searchsorted(ends, x * (1 - 1e-12), side="right"), len(row) - 1)
    starts = np.concatenate([[0.0], ends[:-1]])
    places = np.clip(x - starts[which], 0.0, [lengths[row[k]] for k in which])
    return [row[k] for k in which], places.tolist(), x
