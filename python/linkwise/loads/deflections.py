"""How elastic links of a run bend, and the energy in them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.base import Array
from linkwise.loads.bent import check_count, row_of, section_frames, spread
from linkwise.loads.members import each_member
from linkwise.loads.samples import blocks, model_of, need_whole, rows

if TYPE_CHECKING:
    import xarray as xr

    from linkwise._core import Model
    from linkwise.loads.members import each_member
from linkwise.loads.samples import RunLike


@each_member
def section_deflections(
    run: RunLike, link: str, n: int = 11, model: Model | None = None
) -> xr.Dataset:
    """Where sections of an elastic link are, and how it is bent.

    Args:
        run: recorded with position of all joints.
        link: an elastic link, by the name under which it was made flexible.
        n: how many sections, evenly from its start to its end.
        model: the machine, if the run does not hold it.

    Returns:
        A dataset with `deflection` (time, section, axis) [m], from where the section would be if
        the link were straight, and `turn` (time, section, axis) [rad], the rotation vector of the
        section, both along x, y, z of the beam at its start; `point` (time, section, axis) [m] in
        the world; `strain_energy` (time) [J] of the whole link; and the coordinate x (section) [m]
        from the link's start.

    Raises:
        InputError: the link is not elastic, n is not from 2 to 10,000, or the run lacks a quantity.
    """
    import xarray as xr

    machine = model_of(run, model)
    row = row_of(machine, link)
    links, places, x = spread(row, machine.beam_lengths, check_count(n))
    need_whole(run, machine, "position", "joint_load")
    times = np.asarray(run.dataset["time"], dtype=float)
    deflection, turn, point = (np.empty((times.size, len(x), 3)) for _ in range(3))
    energy = np.empty(times.size)
    for block in blocks(run, 8 * (machine.nq + 40 * len(x) + 16 * len(machine.link_names))):
        q = rows(run, "position", block)
        frames, _ = section_frames(machine, links, places, q)
        start = frames[:, :1]
        point[block] = frames[..., :3, 3]
        along = (frames[..., :3, 3] - start[..., :3, 3]) @ start[:, 0, :3, :3]
        along[..., 0] -= x
        deflection[block] = along
        turn[block] = rotation_vectors(start[..., :3, :3].swapaxes(-1, -2) @ frames[..., :3, :3])
        energy[block] = strain_energy(machine, link, len(row), q)
    dims = ("time", "section", "axis")
    own = {"frame": "axes of the beam at its start"}
    data: dict[str, Any] = {
        "deflection": (dims, deflection, {"units": "m", **own}),
        "turn": (dims, turn, {"units": "rad", **own}),
        "point": (dims, point, {"units": "m", "frame": "world"}),
        "strain_energy": ("time", energy, {"units": "J"}),
    }
    about = {"units": "m", "long_name": "distance from the link's start"}
    return xr.Dataset(
        data,
        coords={
            "time": ("time", times, {"units": "s"}),
            "x": ("section", x, about),
            "axis": ["x", "y", "z"],
        },
        attrs={"link": link},
    )


def strain_energy(model: Model, link: str, beams: int, q: Array) -> Array:
    """Energy (...) [J] of the bending, twist and stretch of a link of so many beams in a row."""
    stiffness = np.asarray(model.dof_property("stiffness"))
    total = np.zeros(q.shape[:-1])
    for k in range(beams):
        joint = f"{link}:{k + 1}"
        own = q[..., model.q_slice(joint)]
        total += 0.5 * (own**2 @ stiffness[model.v_slice(joint)])
    return total


def rotation_vectors(rotations: Array) -> Array:
    """Axis times angle (..., 3) [rad] of rotation matrices (..., 3, 3), angles below pi."""
    R = rotations
    pairs = ((2, 1), (0, 2), (1, 0))
    sine = np.stack([R[..., i, j] - R[..., j, i] for i, j in pairs], axis=-1) / 2
    size = np.linalg.norm(sine, axis=-1, keepdims=True)
    cosine = (np.trace(R, axis1=-2, axis2=-1)[..., None] - 1) / 2
    angle = np.arctan2(size, cosine)
    found: Array = np.where(size > 0, angle / np.maximum(size, 1e-300), 1.0) * sine
    return found
