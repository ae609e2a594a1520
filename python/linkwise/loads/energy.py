"""Where the energy of a run comes from and goes: the balance that checks an integration."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from linkwise import _core
from linkwise._core import InputError
from linkwise.base import Array
from linkwise.loads.members import each_member
from linkwise.loads.samples import dof_rows, external, model_of, need_whole, rows

if TYPE_CHECKING:
    import xarray as xr

    from linkwise._core import Model
    from linkwise.loads.samples import RunLike


def dissipated_power(model: Model, q: Array, v: Array) -> Array:
    """Power (time,) that damping, friction and the damping of stops take out of the mechanism [W].

    Springs and stops store energy too: at rest the passive torque is theirs alone.
    """
    lost = _core.passive_torque(model, q, v) - _core.passive_torque(model, q, np.zeros_like(v))
    power: Array = np.einsum("ti,ti->t", lost, v)
    return -power


def external_power(model: Model, q: Array, v: Array, wrenches: Array | None) -> Array:
    """Power (time,) of the external wrenches (time, body, 6) [W]."""
    power = np.zeros(len(q))
    if wrenches is None:
        return power
    for body in np.flatnonzero(np.abs(wrenches).max(axis=(0, 2)) > 0):
        twist = np.einsum("tik,tk->ti", _core.body_jacobian(model, q, int(body)), v)
        power += np.einsum("ti,ti->t", wrenches[:, body], twist)
    return power


_RECORDED = ("drive_work", "external_work", "dissipated_energy")


def _recorded_works(run: RunLike) -> dict[str, Array] | None:
    """The works that were integrated along with the steps, since the first sample; None where the
    run holds none."""
    if any(name not in run.dataset for name in _RECORDED):
        return None
    everything = slice(None)
    drive = dof_rows(run, "drive_work", everything)
    outside, dissipated = (rows(run, name, everything) for name in _RECORDED[1:])
    works = {"drive_work": drive.sum(axis=1), "external_work": outside, "dissipated": dissipated}
    if not all(np.isfinite(work).all() for work in works.values()):
        return None
    return {name: work - work[0] for name, work in works.items()}


def _sampled_works(run: RunLike, model: Model) -> dict[str, Array]:
    """The same from the powers at the samples, by Simpson's rule."""
    from scipy.integrate import cumulative_simpson

    if model.n_loops:
        raise InputError(
            "run holds no work, and of machines with closed loops it is not found from samples; "
            "record work"
        )
    times = run.dataset["time"].values
    everything = slice(None)
    q, v = rows(run, "position", everything), rows(run, "velocity", everything)
    powers = {
        "drive_work": np.einsum("ti,ti->t", rows(run, "drive_torque", everything), v),
        "external_work": external_power(model, q, v, external(run, model, everything)),
        "dissipated": dissipated_power(model, q, v),
    }
    return {
        name: cumulative_simpson(power, x=times, initial=0) if times.size > 2 else np.nan * power
        for name, power in powers.items()
    }


@each_member
def energy_balance(run: RunLike, model: Model | None = None) -> xr.Dataset:
    """Energy, the work that went in, and what does not add up.

    Args:
        run: Holds `energy` and `work` of all joints. Without `work`: `position`, `velocity`,
            `drive_torque`, and `external_wrench` where there are wrenches.
        model: The machine, if the run does not hold it.

    Returns:
        Dataset over time [J]: `kinetic_energy`, `potential_energy`, `drive_work`,
        `external_work`, `dissipated` (all works since the first sample), `residual`: change of
        energy less drive and external work plus what was dissipated. Where the run holds `work`,
        the residual is the error of the integration at any sampling, and the attribute
        `integrated` is "along the steps". Where it holds none, works are integrated from the
        samples by Simpson's rule, whose error is in the residual too; `integrated` is then "from
        the samples", and works of fewer than three samples are NaN.
    """
    import xarray as xr

    machine = model_of(run, model)
    works = _recorded_works(run)
    along = works is not None
    needed = ("drive_work",) if along else ("position", "velocity", "drive_torque")
    need_whole(run, machine, "joint_load", *needed, "kinetic_energy")
    if works is None:
        works = _sampled_works(run, machine)
    stored = {name: run.dataset[name].values for name in ("kinetic_energy", "potential_energy")}
    energy = stored["kinetic_energy"] + stored["potential_energy"]
    works["residual"] = (
        energy - energy[0] - works["drive_work"] - works["external_work"] + works["dissipated"]
    )
    names = {
        "drive_work": "work of the drives",
        "external_work": "work of the external wrenches",
        "dissipated": "dissipated by damping and friction",
        "residual": "energy that does not add up",
        "kinetic_energy": "kinetic energy",
        "potential_energy": "potential energy of gravity, springs and stops",
    }
    data = {
        name: ("time", values, {"long_name": names[name], "units": "J"})
        for name, values in {**stored, **works}.items()
    }
    how = "along the steps" if along else "from the samples"
    return xr.Dataset(data, coords={"time": run.dataset["time"]}, attrs={"integrated": how})
