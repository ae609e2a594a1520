"""The figures of the report, as plotly describes them: plain data and layout.

They are written by hand rather than by plotly's Python classes, which take longer to build than the
loads to compute.
"""

from __future__ import annotations

import base64
import contextlib
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from linkwise._core import InputError
from linkwise.base import HALVES, AnyArray, Array, lengths
from linkwise.loads.causes import Split, along_total
from linkwise.loads.determinate import components_of, signal_of
from linkwise.loads.energy import energy_balance
from linkwise.loads.engineering import derive, joint_directions
from linkwise.loads.extremes import component_extremes, loads_at_peaks
from linkwise.loads.fatigue import load_duration, spectrum
from linkwise.loads.samples import blocks, joint_names, model_of, rows, select

if TYPE_CHECKING:
    from linkwise._core import Model
    from linkwise.loads.samples import RunLike

Figure = dict[str, Any]
COLOURS = ("#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#bbbbbb")
_OPEN = {"dash": "dot"}
_NOT_KNOWN = "; dotted and in brackets: one choice of many"
TIMES = "times"
"""Stands for the times of the samples drawn, which the page holds once."""


def packed(values: npt.ArrayLike) -> dict[str, str]:
    """Numbers as plotly takes them in binary: four bytes each, enough for a screen."""
    data = np.ascontiguousarray(values, dtype="<f4").tobytes()
    return {"dtype": "f4", "bdata": base64.b64encode(data).decode("ascii")}


def layout_of(title: str, x: str, y: str, **more: Any) -> Figure:
    return {
        "title": {"text": title, "font": {"size": 14}, "x": 0.02},
        "xaxis": {"title": {"text": x}},
        "yaxis": {"title": {"text": y}},
        "margin": {"l": 60, "r": 10, "t": 40, "b": 45},
        "legend": {"orientation": "h", "y": -0.27},
        "hovermode": "x unified",
        **more,
    }


def curve(name: str, x: Any, y: npt.ArrayLike, **more: Any) -> Figure:
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
    return curve("extreme", packed(x), y, **more)


def _components(run: RunLike, joint: int) -> AnyArray:
    """(6,) [bool] which components of this of the recorded joints are determinate."""
    known = components_of(run)
    return np.ones(6, dtype=np.bool_) if known is None else known[joint]


def _histories(load: Array, run: RunLike, joint: int) -> list[Figure]:
    made = []
    extremes = component_extremes(run, joint)
    peak_times, peaks = loads_at_peaks(run, joint)
    open_ones = ~_components(run, joint)
    for k, (half, unit, components) in enumerate(HALVES):
        part = load[:, 3 * k : 3 * k + 3]
        data = []
        for c, (name, color) in enumerate(zip(components, COLOURS, strict=False)):
            line = {"color": color} | (_OPEN if open_ones[3 * k + c] else {})
            label = f"({name})" if open_ones[3 * k + c] else name
            data.append(curve(label, TIMES, part[:, c], line=line))
            data.append(_dots(color, *extremes[name]))
        some = bool(open_ones[3 * k : 3 * k + 3].any())
        line = {"color": "black"} | (_OPEN if some else {})
        data.append(curve("(size)" if some else "size", TIMES, lengths(part), line=line))
        data.append(_dots("black", peak_times, lengths(peaks[:, 3 * k : 3 * k + 3])))
        title = half.capitalize() + (_NOT_KNOWN if some else "")
        layout = layout_of(title, "time [s]", f"{half} [{unit}]")
        made.append({"data": data, "layout": layout})
    return made


def _shown(name: str, sure: bool) -> str:
    return name if sure else f"({name})"


def _dotted(sure: bool) -> dict[str, str]:
    return {} if sure else _OPEN


def _areas(shares: Array, causes: list[str], known: AnyArray) -> list[Figure]:
    """Stacked areas: what adds to the size above zero, what relieves below. known: (6,) [bool]
    which components are determinate; shares lie along the total, which is open as one of these is.
    """
    made = []
    for k, (half, unit, _) in enumerate(HALVES):
        sure = bool(known[3 * k : 3 * k + 3].all())
        parts, total = along_total(shares[..., 3 * k : 3 * k + 3])
        data = []
        for sign, group in ((1.0, "up"), (-1.0, "down")):
            for c, cause in enumerate(causes):
                values = sign * np.maximum(sign * parts[:, c], 0)
                style = {
                    "stackgroup": group,
                    "line": {"width": 0, "color": COLOURS[c % len(COLOURS)]},
                    "legendgroup": cause,
                    "showlegend": sign > 0,
                }
                data.append(curve(_shown(cause, sure), TIMES, values, **style))
        line = {"color": "black", **_dotted(sure)}
        data.append(curve(_shown("total", sure), TIMES, total, line=line))
        title = f"{half.capitalize()} by cause" + ("" if sure else _NOT_KNOWN)
        layout = layout_of(title, "time [s]", f"{half} [{unit}]")
        made.append({"data": data, "layout": layout})
    return made


def _across(direction: Array) -> Array:
    """Two axes (2, 3) across an axis: the joint frame's own where the axis is one of them."""
    helper = np.eye(3)[(int(np.argmax(np.abs(direction))) + 1) % 3]
    first = helper - (helper @ direction) * direction
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(direction, first)])


def _polar(load: Array, direction: Array, known: Mapping[str, bool]) -> Figure:
    """The radial force's size and direction, as the outboard body feels it."""
    if np.isnan(direction).any():
        raise InputError("no axis")
    x, y = _across(direction) @ load[:, :3].T
    trace = {
        "type": "scatterpolar",
        "mode": "lines",
        "r": packed(np.hypot(x, y)),
        "theta": packed(np.degrees(np.arctan2(y, x))),
        "line": {"width": 1.2, **_dotted(known["radial"])},
    }
    polar = {"radialaxis": {"title": {"text": "N"}}}
    text = "Radial force about the axis, in the joint frame"
    text += "" if known["radial"] else _NOT_KNOWN
    title = {"text": text, "font": {"size": 14}}
    return {
        "data": [trace],
        "layout": {"title": title, "polar": polar, "margin": {"t": 60, "b": 30}},
    }


def _spectra(run: RunLike, joint: str, half: int) -> Figure:
    data, surest = [], True
    kind, unit, components = HALVES[half]
    for component in components:
        found = spectrum(run, joint, component)
        frequency = found["frequency"].values[1:]
        sure = bool(found.coords.get("determinate", True))
        surest &= sure
        values = np.maximum(found.values[1:], 1e-30)
        name, line = _shown(component, sure), _dotted(sure)
        data.append(curve(name, packed(frequency), values, line=line))
    density = "N²/Hz" if unit == "N" else "N² m²/Hz"
    title = f"Spectral density of the {kind}" + ("" if surest else _NOT_KNOWN)
    layout = layout_of(title, "frequency [Hz]", density)
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
    sure = bool(found.coords.get("determinate", True))
    title = "Load duration" + ("" if sure else " (one choice of many)")
    return {"data": [trace], "layout": layout_of(title, "force [N]", "time [s]")}


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
            figures += _areas(shares[:, :, j], causes, _components(run, where[j]))
        own, direction = load[:, j], directions[where[j]]
        known = _quantities(run, machine, where[j], direction)
        optional: tuple[tuple[Callable[..., Figure], tuple[Any, ...]], ...] = (
            (_engineering, (own, direction, 0, known)),
            (_engineering, (own, direction, 1, known)),
            (_polar, (own, direction, known)),
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


def _quantities(run: RunLike, model: Model, joint: int, direction: Array) -> dict[str, bool]:
    """Whether what a figure shows of a joint with this axis is determinate, by its name."""
    names = [name for pair in _ALONG_AND_ACROSS for name in pair]
    if np.isnan(direction).any():
        return dict.fromkeys(names, True)
    found = {name: signal_of(run, model, joint, name, direction) for name in names}
    return {name: one is not False for name, one in found.items()}


_ALONG_AND_ACROSS = (("axial", "radial"), ("torque", "tilting_moment"))


def _engineering(load: Array, direction: Array, half: int, known: Mapping[str, bool]) -> Figure:
    """Parts along and across the axis: apart, so that neither scale hides the other."""
    if np.isnan(direction).any():
        raise InputError("no axis")
    found = derive(load[:, None], direction[None])
    names = _ALONG_AND_ACROSS[half]
    data = [
        curve(
            _shown(name.replace("_", " "), known[name]),
            TIMES,
            found[name][:, 0],
            line=_dotted(known[name]),
        )
        for name in names
    ]
    title = ("Force along and across the axis", "Moment about and across the axis")[half]
    title += "" if all(known[name] for name in names) else _NOT_KNOWN
    kind, unit, _ = HALVES[half]
    return {"data": data, "layout": layout_of(title, "time [s]", f"{kind} [{unit}]")}


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
        str(name): curve(values.attrs["long_name"], TIMES, values.values[::every])
        for name, values in balance.data_vars.items()
    }
    residual = lines.pop("residual")
    step = [] if "step_size" not in run.dataset else [_steps(run, every)]
    return [
        {"data": list(lines.values()), "layout": layout_of("Energy", "time [s]", "energy [J]")},
        {"data": [residual], "layout": layout_of("What does not add up", "time [s]", "energy [J]")},
        *step,
    ]


def _steps(run: RunLike, every: int) -> Figure:
    layout = layout_of("Integration step", "time [s]", "step [s]")
    layout["yaxis"]["type"] = "log"
    steps = run.dataset["step_size"].values[::every]
    line = curve("step", TIMES, np.where(steps > 0, steps, np.nan))  # none before the first
    return {"data": [line], "layout": layout}
