"""The figures of the report, as plotly describes them: plain data and layout.

They are written by hand rather than by plotly's Python classes, which take longer to build than the
loads to compute.
"""

from __future__ import annotations

import base64
import contextlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from linkwise._core import InputError
from linkwise.base import HALVES, Array, lengths
from linkwise.loads.causes import Split, along_total
from linkwise.loads.determinate import components_of
from linkwise.loads.energy import energy_balance
from linkwise.loads.engineering import derive, joint_directions
from linkwise.loads.extremes import component_extremes, loads_at_peaks
from linkwise.loads.fatigue import load_duration, spectrum
from linkwise.loads.samples import blocks, joint_names, model_of, rows, select

if TYPE_CHECKING:
    from linkwise._core import Model
    from linkwise.loads.samples import RunLike

Figure = dict[str, Any]
_COLOURS = ("#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#bbbbbb")
_OPEN = {"dash": "dot"}
_NOT_KNOWN = "; dotted and in brackets: one choice of many"
TIMES = "times"
"""Stands for the times of the samples drawn, which the page holds once."""


def packed(values: npt.ArrayLike) -> dict[str, str]:
    """Numbers as plotly takes them in binary: four bytes each, enough for a screen."""
    data = np.ascontiguousarray(values, dtype="<f4").tobytes()
    return {"dtype": "f4", "bdata": base64.b64encode(data).decode("ascii")}


def _layout(title: str, x: str, y: str, **more: Any) -> Figure:
    return {
        "title": {"text": title, "font": {"size": 14}, "x": 0.02},
        "xaxis": {"title": {"text": x}},
        "yaxis": {"title": {"text": y}},
        "margin": {"l": 60, "r": 10, "t": 40, "b": 45},
        "legend": {"orientation": "h", "y": -0.27},
        "hovermode": "x unified",
        **more,
    }


def _line(name: str, x: Any, y: npt.ArrayLike, **more: Any) -> Figure:
    line = {"width": 1.5, **more.pop("line", {})}
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": x,
        "y": packed(y),
        "line": line,
    } | more


def _dots(color: str, x: Array, y: Array) -> Figure:
    """Extremes between the samples, in the colour of their line."""
    dots = {"color": color, "size": 7}
    more = {"mode": "markers", "marker": dots, "showlegend": False}
    return _line("extreme", packed(x), y, **more)


def _histories(load: Array, run: RunLike, joint: int) -> list[Figure]:
    made = []
    extremes = component_extremes(run, joint)
    peak_times, peaks = loads_at_peaks(run, joint)
    known = components_of(run)
    open_ones = np.zeros(6, dtype=np.bool_) if known is None else ~known[joint]
    for k, (half, unit, components) in enumerate(HALVES):
        part = load[:, 3 * k : 3 * k + 3]
        data = []
        for c, (name, color) in enumerate(zip(components, _COLOURS, strict=False)):
            line = {"color": color} | (_OPEN if open_ones[3 * k + c] else {})
            label = f"({name})" if open_ones[3 * k + c] else name
            data.append(_line(label, TIMES, part[:, c], line=line))
            data.append(_dots(color, *extremes[name]))
        some = bool(open_ones[3 * k : 3 * k + 3].any())
        line = {"color": "black"} | (_OPEN if some else {})
        data.append(_line("(size)" if some else "size", TIMES, lengths(part), line=line))
        data.append(_dots("black", peak_times, lengths(peaks[:, 3 * k : 3 * k + 3])))
        title = half.capitalize() + (_NOT_KNOWN if some else "")
        layout = _layout(title, "time [s]", f"{half} [{unit}]")
        made.append({"data": data, "layout": layout})
    return made


def _areas(shares: Array, causes: list[str]) -> list[Figure]:
    """Stacked areas: what adds to the size above zero, what relieves below."""
    made = []
    for k, (half, unit, _) in enumerate(HALVES):
        parts, total = along_total(shares[..., 3 * k : 3 * k + 3])
        data = []
        for sign, group in ((1.0, "up"), (-1.0, "down")):
            for c, cause in enumerate(causes):
                values = sign * np.maximum(sign * parts[:, c], 0)
                style = {
                    "stackgroup": group,
                    "line": {"width": 0, "color": _COLOURS[c % len(_COLOURS)]},
                    "legendgroup": cause,
                    "showlegend": sign > 0,
                }
                data.append(_line(cause, TIMES, values, **style))
        data.append(_line("total", TIMES, total, line={"color": "black"}))
        layout = _layout(f"{half.capitalize()} by cause", "time [s]", f"{half} [{unit}]")
        made.append({"data": data, "layout": layout})
    return made


def _across(direction: Array) -> Array:
    """Two axes (2, 3) across an axis: the joint frame's own where the axis is one of them."""
    helper = np.eye(3)[(int(np.argmax(np.abs(direction))) + 1) % 3]
    first = helper - (helper @ direction) * direction
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(direction, first)])


def _polar(load: Array, direction: Array) -> Figure:
    """The radial force's size and direction, as the outboard body feels it."""
    if np.isnan(direction).any():
        raise InputError("no axis")
    x, y = _across(direction) @ load[:, :3].T
    trace = {
        "type": "scatterpolar",
        "mode": "lines",
        "r": packed(np.hypot(x, y)),
        "theta": packed(np.degrees(np.arctan2(y, x))),
        "line": {"width": 1.2},
    }
    polar = {"radialaxis": {"title": {"text": "N"}}}
    title = {"text": "Radial force about the axis, in the joint frame", "font": {"size": 14}}
    return {
        "data": [trace],
        "layout": {"title": title, "polar": polar, "margin": {"t": 60, "b": 30}},
    }


def _spectra(run: RunLike, joint: str, half: int) -> Figure:
    data = []
    kind, unit, components = HALVES[half]
    for component in components:
        found = spectrum(run, joint, component)
        frequency = found["frequency"].values[1:]
        data.append(_line(component, packed(frequency), np.maximum(found.values[1:], 1e-30)))
    density = "N²/Hz" if unit == "N" else "N² m²/Hz"
    layout = _layout(f"Spectral density of the {kind}", "frequency [Hz]", density)
    layout["xaxis"]["type"] = layout["yaxis"]["type"] = "log"
    layout["yaxis"]["exponentformat"] = "power"
    return {"data": data, "layout": layout}


def _duration(run: RunLike, joint: str, model: Model) -> Figure:
    found = load_duration(run, joint, "force", model=model)
    trace = {
        "type": "bar",
        "x": packed(found["level"].values),
        "y": packed(found.values),
        "width": float(found.attrs["class_width"]),
    }
    return {"data": [trace], "layout": _layout("Load duration", "force [N]", "time [s]")}


def joint_figures(
    run: RunLike, joints: list[str], every: int, model: Model | None
) -> dict[str, list[Figure]]:
    """The figures of each joint, drawing one sample of `every`."""
    machine = model_of(run, model)
    found = select(run, machine)
    directions = joint_directions(machine)[found.joints]
    where = [joint_names(run).index(joint) for joint in joints]
    load = rows(run, "joint_load", slice(None))[::every][:, where]
    shares, causes = _thinned_shares(run, machine, every, where)
    made: dict[str, list[Figure]] = {}
    for j, joint in enumerate(joints):
        figures = _histories(load[:, j], run, where[j])
        if shares is not None:
            figures += _areas(shares[:, :, j], causes)
        own, direction = load[:, j], directions[where[j]]
        optional: tuple[tuple[Callable[..., Figure], tuple[Any, ...]], ...] = (
            (_engineering, (own, direction, 0)),
            (_engineering, (own, direction, 1)),
            (_polar, (own, direction)),
            (_duration, (run, joint, machine)),
            (_spectra, (run, joint, 0)),
            (_spectra, (run, joint, 1)),
        )
        for make, arguments in optional:
            # An InputError says that this joint or run has no such figure.
            with contextlib.suppress(InputError):
                figures.append(make(*arguments))
        made[joint] = figures
    return made


def _engineering(load: Array, direction: Array, half: int) -> Figure:
    """Parts along and across the axis: apart, so that neither scale hides the other."""
    if np.isnan(direction).any():
        raise InputError("no axis")
    found = derive(load[:, None], direction[None])
    names = (("axial", "radial"), ("torque", "tilting_moment"))[half]
    data = [_line(name.replace("_", " "), TIMES, found[name][:, 0]) for name in names]
    title = ("Force along and across the axis", "Moment about and across the axis")[half]
    kind, unit, _ = HALVES[half]
    return {"data": data, "layout": _layout(title, "time [s]", f"{kind} [{unit}]")}


def _thinned_shares(
    run: RunLike, model: Model, every: int, where: list[int]
) -> tuple[Array | None, list[str]]:
    parts = []
    try:  # a run may lack what a split needs, or its machine have what a split does not take
        split = Split(run, "force", model)
        for block in blocks(run, 8 * 60 * (model.n_joints + model.n_loops)):
            keep = np.arange(block.start, block.stop) % every == 0
            parts.append(split.shares(block)[keep][:, :, where])
    except InputError:
        return None, []
    return np.concatenate(parts), split.names


def energy_figure(run: RunLike, every: int, model: Model | None) -> list[Figure]:
    """Energies and works, and what does not add up; nothing for runs without energies."""
    try:
        balance = energy_balance(run, model)
    except InputError:
        return []
    lines = {
        str(name): _line(values.attrs["long_name"], TIMES, values.values[::every])
        for name, values in balance.data_vars.items()
    }
    residual = lines.pop("residual")
    step = [] if "step_size" not in run.dataset else [_steps(run, every)]
    return [
        {"data": list(lines.values()), "layout": _layout("Energy", "time [s]", "energy [J]")},
        {"data": [residual], "layout": _layout("What does not add up", "time [s]", "energy [J]")},
        *step,
    ]


def _steps(run: RunLike, every: int) -> Figure:
    layout = _layout("Integration step", "time [s]", "step [s]")
    layout["yaxis"]["type"] = "log"
    steps = run.dataset["step_size"].values[::every]
    line = _line("step", TIMES, np.where(steps > 0, steps, np.nan))  # none before the first
    return {"data": [line], "layout": layout}
