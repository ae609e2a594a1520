"""Engineering quantities of joint loads: axial, radial, tilting moment, torque, drive power."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from linkwise.base import DERIVED, Array, lengths
from linkwise.loads.determinate import ABOUT_DETERMINATE, quantities_of
from linkwise.loads.extremes import what_samples_miss
from linkwise.loads.members import each_member
from linkwise.loads.samples import Selection, dof_rows, joint_names, model_of, need, rows, select
from linkwise.record.schema import DETERMINATE

if TYPE_CHECKING:
    import xarray as xr

    from linkwise._core import Model
    from linkwise.loads.samples import RunLike


class Quantity(NamedTuple):
    long_name: str
    units: str
    convention: str


_AXIS = "the joint's axis through the joint point; none for joints of several directions"
QUANTITIES: dict[str, Quantity] = {
    "force": Quantity("joint force", "N", "length of the force (fx, fy, fz)"),
    "axial": Quantity(
        "axial force",
        "N",
        f"force along {_AXIS}; positive: the inboard body pushes the outboard body along +axis",
    ),
    "radial": Quantity(
        "radial force", "N", f"length of the part of the force across {_AXIS}; never negative"
    ),
    "moment": Quantity(
        "joint moment", "N m", "length of the moment (nx, ny, nz) about the joint point"
    ),
    "tilting_moment": Quantity(
        "tilting moment",
        "N m",
        f"length of the part of the moment about the joint point across {_AXIS}; never negative",
    ),
    "torque": Quantity(
        "torque about the axis",
        "N m",
        f"moment about {_AXIS}; positive: the inboard body turns the outboard body about +axis; "
        "drive, damping, friction, spring and stop together",
    ),
    "drive_power": Quantity(
        "drive power", "W", "drive torque times joint rate; positive: into the mechanism"
    ),
}


assert tuple(QUANTITIES) == DERIVED


def joint_directions(model: Model) -> Array:
    """Direction of each joint's axis in its frame (joint, 3), of those that close loops behind
    those of the tree; NaN where it has no single one."""
    found = np.full((model.n_joints + model.n_loops, 3), np.nan)
    listed = [*model.joint_axes, *model.loop_axes]
    single = [k for k, axes in enumerate(listed) if len(axes) == 1]
    if single:
        directions = np.array([listed[k][0][1] for k in single], dtype=np.float64)
        found[single] = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    for k, axes in enumerate(listed):
        if len(axes) == 1:
            continue
        directions = np.array([axis[1] for axis in axes], dtype=np.float64).reshape(-1, 3)
        if len(directions) == 0:
            continue
        first = directions[0] / np.linalg.norm(directions[0])
        across = np.linalg.norm(np.cross(first, directions), axis=1)
        if np.all(across <= 1e-9 * np.linalg.norm(directions, axis=1)):
            found[k] = first
    return found


def derive(load: Array, directions: Array) -> dict[str, Array]:
    """Quantities (..., joint) of loads (..., joint, 6) for axes (joint, 3)."""
    force, moment = load[..., :3], load[..., 3:]
    axial = np.einsum("...ji,ji->...j", force, directions)
    torque = np.einsum("...ji,ji->...j", moment, directions)
    return {
        "force": lengths(force),
        "axial": axial,
        "radial": lengths(force - axial[..., None] * directions),
        "moment": lengths(moment),
        "tilting_moment": lengths(moment - torque[..., None] * directions),
        "torque": torque,
    }


def has_power(run: RunLike) -> bool:
    given = ("drive_torque", "velocity")
    return any(all(loop + name in run.dataset for name in given) for loop in ("", "loop_"))


def drive_power(run: RunLike, found: Selection, where: slice) -> Array:
    """Power of each joint's drive (time, joint) [W]."""
    each = dof_rows(run, "drive_torque", where) * dof_rows(run, "velocity", where)
    power = np.zeros((len(each), found.joints.size))
    np.add.at(power.T, found.owner, each.T)
    return power


def derived_rows(
    run: RunLike, found: Selection, directions: Array, where: slice
) -> dict[str, Array]:
    """All quantities of one block of samples, (time, joint) each."""
    values = derive(rows(run, "joint_load", where), directions)
    if has_power(run):
        values["drive_power"] = drive_power(run, found, where)
    return values


def quantity_attrs(name: str) -> dict[str, str]:
    about = QUANTITIES[name]
    return {
        "long_name": about.long_name,
        "units": about.units,
        "convention": about.convention,
        "point": "joint point: the origin of the joint frame",
        "of": "wrench that the inboard body exerts on the outboard body through the joint",
    }


def _drive_energy(run: RunLike, found: Selection, power: Array) -> tuple[Array, str]:
    """Work of each joint's drive (time, joint) since the first sample, and how it was found."""
    from scipy.integrate import cumulative_simpson

    if "drive_work" in run.dataset:
        each = dof_rows(run, "drive_work", slice(None))
        energy = np.zeros_like(power)
        np.add.at(energy.T, found.owner, (each - each[0]).T)
        return energy, "along the integration's own steps"
    times = run.dataset["time"].values
    if times.size < 3:
        return np.full_like(power, np.nan), "not known from fewer than three samples"
    return cumulative_simpson(power, x=times, axis=0, initial=0), "by Simpson's rule"


@each_member
def quantities(run: RunLike, model: Model | None = None) -> xr.Dataset:
    """Engineering quantities over time and joint, each with its convention in `attrs`.

    Args:
        run: Holds `joint_load`; with `velocity` and `drive_torque` also drive power and energy.
        model: The machine, if the run does not hold it.

    Returns:
        Dataset over (time, joint): `force`, `axial`, `radial`, `moment`, `tilting_moment`,
        `torque`, `drive_power`, `drive_energy` [J] (the power's integral since the first sample,
        along the integration's steps where the run holds `work`, else by Simpson's rule). NaN
        where a joint has no single axis. The attribute `samples` says what these miss of the
        peaks, which `summary` has. Of machines with loops the coordinate `determinate`
        (quantity, joint) says which of them rigid bodies determine.
    """
    import xarray as xr

    need(run, "joint_load")
    machine = model_of(run, model)
    found = select(run, machine)
    directions = joint_directions(machine)[found.joints]
    values = derived_rows(run, found, directions, slice(None))
    coords: dict[str, Any] = {"time": run.dataset["time"], "joint": ("joint", joint_names(run))}
    known = quantities_of(run, machine, directions, list(values))
    if known is not None:
        coords["quantity"] = list(values)
        coords[DETERMINATE] = (("quantity", "joint"), known, dict(ABOUT_DETERMINATE))
    data = {
        name: (("time", "joint"), array, quantity_attrs(name)) for name, array in values.items()
    }
    if "drive_power" in values:
        energy, how = _drive_energy(run, found, values["drive_power"])
        attrs = {
            "long_name": "drive energy",
            "units": "J",
            "convention": f"integral of drive_power since the first sample, {how}",
        }
        data["drive_energy"] = (("time", "joint"), energy, attrs)
    return xr.Dataset(data, coords=coords, attrs={"samples": what_samples_miss(run)})
