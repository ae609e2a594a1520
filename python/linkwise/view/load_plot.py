"""The load of one joint over time, beside the scene, with a dot at the time shown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.base import HALVES, AnyArray, Array, lengths

if TYPE_CHECKING:
    import viser

    from linkwise.view.source import Recording

MOST_SAMPLES = 500
COLORS = ("#30363d", "#c0392b", "#2e8b57", "#2f6fb7")


def lines_of(half: int, known: AnyArray | None) -> tuple[Any, ...]:
    """The lines of the plot of forces (half 0) or moments (1), as uPlot takes them; known: (6,)
    [bool] what of the joint's load is determinate, None: all."""
    here = np.ones(3, dtype=np.bool_) if known is None else known[3 * half : 3 * half + 3]
    series: list[Any] = [{"label": "t [s]"}]
    names = zip(("size", *HALVES[half][2]), (here.all(), *here), COLORS, strict=True)
    for name, sure, color in names:
        line: dict[str, Any] = {"label": name if sure else f"({name})", "stroke": color}
        line |= {"width": 2 if name == "size" else 1} | ({} if sure else {"dash": (4, 4)})
        series.append(line)
    dot = {"show": True, "size": 9, "fill": "#e67e22", "stroke": "#e67e22"}
    # NaN everywhere but at one sample, so its range must not be asked for.
    series.append({"label": "now", "stroke": "#e67e22", "points": dot, "auto": False})
    return tuple(series)


class LoadPlot:
    """Two plots: magnitude and components of force and moment in the joint frame.

    known: (joints, 6) [bool] what is determinate throughout, None: all. Other lines are dashed,
    with their names in brackets.
    """

    def __init__(
        self, server: viser.ViserServer, recording: Recording, known: AnyArray | None = None
    ) -> None:
        self._recording = recording
        self._known = known
        self._times: Array = np.zeros(0)
        self._columns: list[tuple[Array, ...]] = []
        self._dot = -1
        self._plots: list[Any] = []
        blank = np.zeros(2)
        for k, (half, unit, _) in enumerate(HALVES):
            self._plots.append(
                server.gui.add_uplot(
                    (blank,) * 6,
                    lines_of(k, None),
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
        if self._known is not None:
            for k, plot in enumerate(self._plots):
                plot.series = lines_of(k, self._known[joint])

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
