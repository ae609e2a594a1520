"""Loads inside elastic links."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise import _core
from linkwise._core import InputError
from linkwise.base import COMPONENTS, Array
from linkwise.loads.bent import beams_of, check_count, row_of, spread
from linkwise.loads.causes import CAUSES, Split
from linkwise.loads.members import each_member
from linkwise.loads.samples import blocks, model_of, need_whole, rows

if TYPE_CHECKING:
    import xarray as xr

    from linkwise._core import Model
    from linkwise.loads.members import each_member
from linkwise.loads.samples import RunLike

_AXES = "axes of the bent section: x along the beam, y and z its own"
_SIGN = "inboard part on outboard part"
STATE = ("position", "velocity", "acceleration", "joint_load")


class Sections:
    """Sections of one elastic link, evenly from its start to its end.

    links, places: link in a row and place on it [m] of each; x: how far [m] each is from the start;
    section: what it is made of, as `_core.beam_properties` says.
    """

    def __init__(self, run: RunLike, link: str, n: int, model: Model | None = None) -> None:
        self.run, self.model = run, model_of(run, model)
        row = row_of(self.model, link)
        self.links, self.places, self.x = spread(row, self.model.beam_lengths, check_count(n))
        need_whole(run, self.model, *STATE)
        self.link, self.n = link, len(self.links)
        self.section: dict[str, Any] = _core.beam_properties(self.model)[link]
        self.times: Array = np.asarray(run.dataset["time"], dtype=float)

    @property
    def row_bytes(self) -> int:
        """Bytes of one sample."""
        model = self.model
        return 8 * (model.nq + 2 * model.nv + 6 * model.n_joints + 20 * self.n)

    def blocks(self) -> Iterator[tuple[slice, Array, Array]]:
        """Samples with their loads and discretisation errors, (time, section, 6) each."""
        for block in blocks(self.run, self.row_bytes):
            q, v, a, joints = (rows(self.run, name, block) for name in STATE)
            load, strain = self.loads(q, v, a, joints)
            error = np.full(load.shape, np.nan)
            error[..., [0, 3, 4, 5]] = np.abs(load[..., [0, 3, 4, 5]] - strain)
            yield block, load, error

    def loads(
        self, q: Array, v: Array, a: Array, joints: Array, gravity: float = 1.0
    ) -> tuple[Array, Array]:
        """(time, section, 6) of states with their accelerations and joint loads, and (time,
        section, 4) what strains say of the force along x and the moments."""
        found: Array = _core.section_loads(
            self.model, self.links, self.places, q, v, a, joints, gravity=gravity
        )
        return found[..., :6], found[..., 6:]

    def coords(self) -> dict[str, Any]:
        """The coordinate x of a dataset."""
        about = {"units": "m", "long_name": "distance from the link's start"}
        return {"x": ("section", self.x, about)}


def fibres(section: dict[str, Any]) -> tuple[Array, Array] | None:
    """y and z [m] of outer points of a section: four corners, or 24 around a circle; None where its
    outer sizes are not known."""
    width, height = section["width"], section["height"]
    if not width > 0:
        return None
    if section["round"]:
        angle = np.arange(24) * np.pi / 12
        return width / 2 * np.cos(angle), width / 2 * np.sin(angle)
    return width / 2 * np.array([1, 1, -1, -1]), height / 2 * np.array([1, -1, 1, -1])


def stress_at(load: Array, section: dict[str, Any], y: Array, z: Array) -> Array:
    """Normal stresses (..., points) [Pa] at points of a section with the loads (..., 6): tension is
    positive. By N / A - M_y z / I_y + M_z y / I_z, the signs being those of loads of sections."""
    E = section["EA"] / section["area"]
    axial = -load[..., 0] / section["area"]
    # The inboard part puts the load on the outboard one: about y it bends towards -z there.
    about_y = -load[..., 4] / (section["EIy"] / E)
    about_z = load[..., 5] / (section["EIz"] / E)
    found: Array = axial[..., None] + about_y[..., None] * z + about_z[..., None] * y
    return found


def extreme_stress(load: Array, section: dict[str, Any]) -> tuple[Array, Array]:
    """Lowest and highest normal stress (...) [Pa] in sections with the loads (..., 6), anywhere on
    their outside."""
    E = section["EA"] / section["area"]
    axial = -load[..., 0] / section["area"]
    y, z = load[..., 5] / (section["EIz"] / E), load[..., 4] / (section["EIy"] / E)
    if section["round"]:
        bending = np.hypot(y, z) * section["width"] / 2
    else:
        bending = np.abs(y) * section["width"] / 2 + np.abs(z) * section["height"] / 2
    return axial - bending, axial + bending


@each_member
def section_loads(run: RunLike, link: str, n: int = 11, model: Model | None = None) -> xr.Dataset:
    """The load at sections of an elastic link, by equilibrium of all that is outboard of each.

    Signs are those of joint loads: what the inboard part puts on the outboard part, so tension is
    a negative fx. At the link's start it is the load of its inboard joint, turned into the beam's
    axes, to rounding.

    Args:
        run: recorded with position, velocity, acceleration and joint_load of all joints.
        link: an elastic link, by the name under which it was made flexible.
        n: how many sections, evenly from its start to its end.
        model: the machine, if the run does not hold it.

    Returns:
        A dataset with section_load (time, section, component) [N, N m] in the axes of the bent
        section, x along the beam and y, z across it; discretisation_error of the same shape, how
        far the strains that the link's coordinates can follow are from it (NaN for fy and fz,
        which strains do not say); and the coordinate x (section) [m] from the link's start. Where
        the outer sizes of the section are known, lowest_stress and highest_stress (time, section)
        [Pa] too, the normal stresses of its fibres by beam theory, tension positive.

    Raises:
        InputError: the link is not elastic, n is not from 2 to 10,000, or the run lacks a quantity.
    """
    import xarray as xr

    of = Sections(run, link, n, model)
    load = np.empty((of.times.size, of.n, 6))
    error = np.empty_like(load)
    for block, here, off in of.blocks():
        load[block], error[block] = here, off
    dims = ("time", "section", "component")
    about = {"units": "N, N m", "frame": _AXES}
    data: dict[str, Any] = {
        "section_load": (dims, load, about),
        "discretisation_error": (dims, error, dict(about)),
    }
    if fibres(of.section) is not None:
        both = extreme_stress(load, of.section)
        for name, values in zip(("lowest", "highest"), both, strict=True):
            about = {"units": "Pa", "long_name": f"{name} normal stress of the section"}
            data[f"{name}_stress"] = (dims[:2], values, about)
    coords = {"time": ("time", of.times, {"units": "s"}), **of.coords()}
    return xr.Dataset(
        data,
        coords={**coords, "component": list(COMPONENTS)},
        attrs={"link": link, "sign": _SIGN},
    )


@each_member
def section_split(run: RunLike, link: str, n: int = 11, model: Model | None = None) -> xr.DataArray:
    """The load at sections of an elastic link by what the motion needs; the shares add up to it.

    Args:
        run: As for `section_loads`, with external_wrench where there are wrenches.
        link, n, model: As for `section_loads`.

    Returns:
        DataArray (time, cause, section, component) [N, N m], axes and signs as `section_loads`.
        Causes are those of `split(run, by="motion")`: what holds the link as bent against gravity,
        what the rates need, what the accelerations need, those of the link's own bending among
        them, and what balances the wrenches from outside.

    Raises:
        InputError: as `section_loads`, or the machine has closed loops.
    """
    import xarray as xr

    of = Sections(run, link, n, model)
    if of.model.n_loops or of.model.coupling_names:
        raise InputError(
            "run: its machine has closed loops, where the loads inside links do not split by "
            "cause yet; ask for section_loads"
        )
    made = Split(run, "motion", of.model)
    found = np.empty((of.times.size, len(made.names), of.n, 6))
    for block in blocks(run, of.row_bytes * max(1, len(made.names))):
        q, v, a = (rows(run, name, block) for name in STATE[:3])
        shares = made.shares(block)
        still = np.zeros_like(a)
        for k, cause in enumerate(made.names):
            found[block, k] = of.loads(
                q,
                v if cause == "velocity" else still,
                a if cause == "acceleration" else still,
                np.ascontiguousarray(shares[:, k]),
                gravity=1.0 if cause == "gravity" else 0.0,
            )[0]
    return xr.DataArray(
        found,
        dims=("time", "cause", "section", "component"),
        coords={
            "time": ("time", of.times, {"units": "s"}),
            "cause": made.names,
            **of.coords(),
            "component": list(COMPONENTS),
        },
        attrs={
            "link": link,
            "sign": _SIGN,
            "units": "N, N m",
            "frame": _AXES,
            **{f"cause {name}": CAUSES["motion"][name] for name in made.names},
        },
        name="section_load",
    )


def elastic_links(model: Model) -> list[str]:
    """The links that were made flexible."""
    return list(beams_of(model))
