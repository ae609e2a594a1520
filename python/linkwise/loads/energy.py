"""Where the energy of a run comes from and goes: the balance that checks an integration."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from linkwise import _core
from linkwise.base import Array
from linkwise.loads.samples import external, model_of, need_whole, rows

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


def energy_balance(run: RunLike, model: Model | None = None) -> xr.Dataset:
    """Energy, the work that went in, and what does not add up.

    Args:
        run: Holds `position`, `velocity`, `drive_torque`, `energy` of all joints, and
            `external_wrench` where there are wrenches.
        model: The machine, if the run does not hold it.

    Returns:
        Dataset over time [J]: `kinetic_energy`, `potential_energy`, `drive_work`,
        `external_work`, `dissipated` (all works since the first sample, by Simpson's rule),
        `residual`: change of energy less drive and external work plus what was dissipated. It
        holds the error of the integration and that of Simpson's rule at this sampling.
    """
    import xarray as xr
    from scipy.integrate import cumulative_simpson

    machine = model_of(run, model)
    wanted = ("joint_load", "position", "velocity", "drive_torque", "kinetic_energy")
    need_whole(run, machine, *wanted)
    times = run.dataset["time"].values
    everything = slice(None)
    q, v = rows(run, "position", everything), rows(run, "velocity", everything)
    powers = {
        "drive_work": np.einsum("ti,ti->t", rows(run, "drive_torque", everything), v),
        "external_work": external_power(machine, q, v, external(run, machine, everything)),
        "dissipated": dissipated_power(machine, q, v),
    }
    works = {
        name: cumulative_simpson(power, x=times, initial=0) if times.size > 2 else 0 * power
        for name, power in powers.items()
    }
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
    return xr.Dataset(data, coords={"time": run.dataset["time"]})
