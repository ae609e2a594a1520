"""The load of one joint over time, beside the scene, with a dot at the time shown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.base import HALVES, Array, lengths

if TYPE_CHECKING:
    import viser

    from linkwise.view.source import Recording

MOST_SAMPLES = 500
COLORS = ("#30363d", "#c0392b", "#2e8b57", "#2f6fb7")


class LoadPlot:
    """Two plots: magnitude and components of force and moment in the joint frame."""

    def __init__(self, server: viser.ViserServer, recording: Recording) -> None:
        self._recording = recording
        self._times: Array = np.zeros(0)
        self._columns: list[tuple[Array, ...]] = []
        self._dot = -1
        self._plots: list[Any] = []
        blank = np.zeros(2)
        for half, unit, labels in HALVES:
            names = ("size", *labels)
            series: list[Any] = [{"label": "t [s]"}]
            for name, color in zip(names, COLORS, strict=True):
                width = 2 if name == "size" else 1
                series.append({"label": name, "stroke": color, "width": width})
            dot = {"show": True, "size": 9, "fill": "#e67e22", "stroke": "#e67e22"}
            # NaN everywhere but at one sample, so its range must not be asked for.
            series.append({"label": "now", "stroke": "#e67e22", "points": dot, "auto": False})
            self._plots.append(
                server.gui.add_uplot(
                    (blank,) * 6,
                    tuple(series),
                    title=f"{half.capitalize()} [{unit}]",
                    scales={"x": {"time": False}},
                    height=190,
                )
            )

    def choose(self, joint: int) -> None:
        """Show the load of this joint; drawn with the next `show`."""
        self._times, loads = self._recording.history(joint, MOST_SAMPLES)
        self._columns = [(lengths(half), *half.T) for half in (loads[:, :3], loads[:, 3:])]
        self._dot = -1

    def show(self, time: float) -> None:
        """Put the dot at this time."""
        dot = int(np.argmin(np.abs(self._times - time)))
        if dot == self._dot:
            return
        self._dot = dot
        for plot, columns in zip(self._plots, self._columns, strict=True):
            now = np.full(self._times.size, np.nan)
            now[dot] = columns[0][dot]
            plot.data = (self._times, *(np.ascontiguousarray(c) for c in columns), now)
