"""Figures of a run, by matplotlib: `run.plot.loads("elbow")`, `.split("elbow")`, `.energy()`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise._core import InputError
from linkwise.base import COMPONENTS, HALVES
from linkwise.loads.causes import along_total, split
from linkwise.loads.determinate import components_of
from linkwise.loads.energy import energy_balance
from linkwise.loads.extremes import component_extremes, missed_peaks
from linkwise.loads.samples import joint_position

if TYPE_CHECKING:
    from linkwise.loads.causes import By
    from linkwise.loads.samples import RunLike


def _figure(rows: int) -> tuple[Any, Any]:
    try:
        from matplotlib import figure
    except ModuleNotFoundError:
        raise InputError("plots need matplotlib; pip install 'linkwise[plot]'") from None
    made = figure.Figure(figsize=(8.0, 2.6 * rows), layout="constrained")
    axes = np.atleast_1d(made.subplots(rows, 1, sharex=True))
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
    axes[-1].set_xlabel("time [s]")
    return made, axes


class RunPlots:
    """The figures of one run; every method returns the matplotlib Figure."""

    def __init__(self, run: RunLike) -> None:
        self._run = run

    def loads(self, joint: str) -> Any:
        """Force and moment of a joint over time, by component, at the joint point in its frame.

        Lines join the samples; dots are each component's extremes between them. Components that
        rigid bodies do not determine are dashed, with their names in brackets.
        """
        where = joint_position(self._run, joint)
        load = self._run.dataset["joint_load"].isel(joint=where)
        figure, axes = _figure(2)
        times = self._run.dataset["time"].values
        extremes = component_extremes(self._run, where)
        known = components_of(self._run)
        for axis, (half, unit, components) in zip(axes, HALVES, strict=True):
            for name in components:
                is_open = known is not None and not known[where, COMPONENTS.index(name)]
                (line,) = axis.plot(
                    times,
                    load.sel(component=name).values,
                    label=f"({name})" if is_open else name,
                    linewidth=1.2,
                    linestyle="--" if is_open else "-",
                )
                axis.plot(*extremes[name], "o", color=line.get_color(), markersize=4)
            axis.set_ylabel(f"{half} [{unit}]")
            axis.legend(loc="upper right", ncols=3, frameon=False)
        figure.suptitle(f"Load of {joint}: inboard on outboard body, joint frame")
        return figure

    def split(self, joint: str, by: By = "force") -> Any:
        """What each cause adds to the size of a joint's force and moment.

        A cause's share is its part along the total, so that the shares add up to the size; a
        negative share relieves the joint. Where rigid bodies do not determine a component, the
        total is dashed, and names are in brackets.
        """
        where = joint_position(self._run, joint)
        shares = split(self._run, by).isel(joint=where)
        times, causes = shares["time"].values, [str(c) for c in shares["cause"].values]
        figure, axes = _figure(2)
        known, first_sure = components_of(self._run), True
        for k, (axis, (half, unit, _)) in enumerate(zip(axes, HALVES, strict=True)):
            sure = known is None or bool(known[where, 3 * k : 3 * k + 3].all())
            first_sure = sure if k == 0 else first_sure
            names = causes if sure else [f"({name})" for name in causes]
            parts, total = along_total(shares.values[..., 3 * k : 3 * k + 3])
            up, down = np.maximum(parts, 0), np.minimum(parts, 0)
            if causes:
                areas = axis.stackplot(times, up.T, labels=names, linewidth=0)
                colours = [area.get_facecolor()[0] for area in areas]
                axis.stackplot(times, down.T, colors=colours, linewidth=0)
            style = "-" if sure else "--"
            label = "total" if sure else "(total)"
            axis.plot(times, total, style, color="black", linewidth=1.2, label=label)
            axis.set_ylabel(f"{half} [{unit}]")
            if k == 0 or sure != first_sure:
                axis.legend(loc="upper right", ncols=4, frameon=False)
        figure.suptitle(f"Load of {joint} by cause")
        missed = missed_peaks(self._run, [joint])
        if missed:
            axes[0].set_title(str(missed[0]).replace("; ", ";\n"), fontsize="small")
        return figure

    def energy(self) -> Any:
        """Energies and works over time, and what does not add up."""
        balance = energy_balance(self._run)
        figure, axes = _figure(2)
        for name in balance.data_vars:
            axis = axes[1] if name == "residual" else axes[0]
            label = balance[name].attrs["long_name"]
            axis.plot(balance["time"].values, balance[name].values, label=label, linewidth=1.2)
        for axis in axes:
            axis.set_ylabel("energy [J]")
            axis.legend(loc="best", frameon=False)
        return figure
