"""The report: one HTML file with interactive figures that opens without a network."""

from __future__ import annotations

import json
import os
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise._core import InputError
from linkwise.io.writing import check_file, write_text
from linkwise.loads.extremes import what_samples_miss
from linkwise.loads.fatigue import damage_equivalent
from linkwise.loads.peaks import envelope
from linkwise.notes import recorded_warnings
from linkwise.plot.inside_figures import PEAK_HEADINGS, inside, peak_rows
from linkwise.plot.report_figures import energy_figure, joint_figures, packed

if TYPE_CHECKING:
    import xarray as xr

    from linkwise._core import Model
    from linkwise.loads.samples import RunLike

# Joints with figures, the most loaded first: each takes some 200 kB.
MOST_JOINTS = 16
# Samples drawn of a longer run; tables use them all.
MOST_SAMPLES = 2000

_STYLE = """
body { font: 14px/1.5 system-ui, sans-serif; margin: 0 auto; max-width: 1200px; padding: 1rem 2rem;
  color: #1a1a1a; background: #fff }
h1 { font-size: 1.5rem } h2 { font-size: 1.15rem; margin-top: 2rem }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; width: 100% }
td { white-space: nowrap } .facts td:last-child { white-space: normal }
th, td { padding: .2rem .6rem; text-align: right; border-bottom: 1px solid #ddd }
th:first-child, td:first-child, .facts td, .named td:nth-child(2), .named th:nth-child(2) {
  text-align: left } .facts { width: auto } td small { display: block; color: #555 }
tr.over td { color: #b00020; font-weight: 600 }
pre { background: #f5f5f5; padding: 1rem; overflow-x: auto } .scroll { overflow-x: auto }
.grid { display: grid; grid-template-columns: repeat(auto-fit, minmax(480px, 1fr)); gap: 1rem }
.figure { height: 340px } .note { color: #555 } select { font: inherit; padding: .2rem .5rem }
"""
_SCRIPT = """
const figures = JSON.parse(document.getElementById("figures").textContent);
const options = {responsive: true, displaylogo: false};
// Curves over time say so instead of each holding the times.
for (const figure of [...Object.values(figures.joints).flat(),
    ...Object.values(figures.inside).flat(), ...figures.energy]) {
  for (const trace of figure.data) if (trace.x === "times") trace.x = figures.times;
}
function draw(place, list) {
  place.querySelectorAll(".figure").forEach(old => Plotly.purge(old));
  place.replaceChildren();
  // All boxes before the first figure: the grid's width of one box depends on the others.
  const boxes = list.map(() => place.appendChild(document.createElement("div")));
  list.forEach((figure, k) => {
    boxes[k].className = "figure";
    Plotly.newPlot(boxes[k], figure.data, figure.layout, options);
  });
}
for (const [id, made] of [["joint", figures.joints], ["link", figures.inside]]) {
  const chooser = document.getElementById(id), place = document.getElementById(`${id}-figures`);
  if (!chooser) continue;
  chooser.addEventListener("change", () => draw(place, made[chooser.value]));
  draw(place, made[chooser.value]);
}
draw(document.getElementById("energy-figures"), figures.energy);
"""


_PEAKS = {
    "along the steps": "Of the whole motion, between the samples too.",
    "of the samples": "Of the samples: the run holds no extremes, and peaks between the samples "
    "are not known.",
}


def _note(text: str) -> str:
    return f"<p class='note'>{escape(text)}</p>"


def _number(value: float, digits: int = 4) -> str:
    return "" if not np.isfinite(value) else f"{value:.{digits}g}"


def _row(cells: list[str], tag: str = "td", style: str = "") -> str:
    inner = "".join(f"<{tag}>{cell}</{tag}>" for cell in cells)
    return f'<tr class="{style}">{inner}</tr>' if style else f"<tr>{inner}</tr>"


def _table(headings: list[str], rows: list[str], style: str = "") -> str:
    head = _row([escape(h) for h in headings], "th") if headings else ""
    return f'<div class="scroll"><table class="{style}">{head}{"".join(rows)}</table></div>'


def _peak(value: float, bound: float) -> str:
    shown = _number(value)
    return f"{shown} ± {_number(bound, 1)}" if shown and np.isfinite(bound) else shown


def _bracketed(shown: str, known: bool) -> str:
    return shown if known or not shown else f"({shown})"


def _known(found: xr.Dataset) -> Any:
    """Which values rigid bodies determine: all, where the run has no loops."""
    if "determinate" in found:
        return found["determinate"].values
    return np.ones((found.sizes["quantity"], found.sizes["joint"]), dtype=np.bool_)


def _brackets(summary: xr.Dataset) -> str:
    if _known(summary).all():
        return ""
    return " Numbers in brackets are not determined by rigid bodies: they are one choice of many."


def _peak_table(summary: xr.Dataset, limits: xr.Dataset | None) -> str:
    names = [str(q) for q in summary["quantity"].values]
    units = [str(u) for u in summary["quantity_units"].values]
    peak, when = summary["peak"].values, summary["peak_time"].values
    known = _known(summary)
    bound = _bounds(summary, limits)
    pairs = zip(names, units, strict=True)
    headings = ["joint", *(f"{name.replace('_', ' ')} [{unit}]" for name, unit in pairs)]
    rows = []
    for j, joint in enumerate(summary["joint"].values):
        cells = [escape(str(joint))]
        for k in range(len(names)):
            shown = _bracketed(_peak(peak[k, j], bound[k, j]), known[k, j])
            cells.append(f"{shown}<small>at {_number(when[k, j])} s</small>" if shown else "")
        rows.append(_row(cells))
    return _table(headings, rows)


def _bounds(summary: xr.Dataset, limits: xr.Dataset | None) -> Any:
    """The plus-minus (quantity, joint) of the peaks, NaN where it is not known."""
    if limits is None:
        return np.full(summary["peak"].shape, np.nan)
    return limits["plus_minus"].values


def _margin_table(summary: xr.Dataset, left: xr.Dataset, limits: xr.Dataset | None) -> str:
    rows = []
    bound, determinate = _bounds(summary, limits), _known(summary)
    for k, quantity in enumerate(left["quantity"].values):
        for j, joint in enumerate(left["joint"].values):
            rating, use = float(left["rating"][k, j]), float(left["use"][k, j])
            known = bool(determinate[k, j])
            if not np.isfinite(rating):
                continue
            cells = [
                escape(str(joint)),
                f"{quantity} [{summary['quantity_units'].values[k]}]".replace("_", " "),
                _bracketed(_peak(float(summary["peak"][k, j]), bound[k, j]), known),
                _number(rating),
                _bracketed(f"{100 * use:.1f} %", known),
                _bracketed(f"{100 * float(left['margin'][k, j]):.1f} %", known),
            ]
            # What is one choice of many is not ranked among the others.
            rows.append(((not known, -use), _row(cells, style="over" if use > 1 else "")))
    ordered = [row for _, row in sorted(rows, key=lambda item: item[0])]
    return _table(["joint", "quantity", "peak", "rating", "use", "margin"], ordered, "named")


def _envelope_table(run: RunLike) -> str:
    found = envelope(run)
    components = [str(c) for c in found["component"].values]
    headings = ["joint", *(f"{c} [{'N' if c[0] == 'f' else 'N m'}]" for c in components)]
    low, high = found["minimum"].values, found["maximum"].values
    known = np.ones(low.shape, dtype=np.bool_)
    if "determinate" in found:
        known = found["determinate"].values
    rows = [
        _row(
            [
                escape(str(joint)),
                *(
                    _bracketed(f"{_number(a)} .. {_number(b)}", one)
                    for a, b, one in zip(low[j], high[j], known[j], strict=True)
                ),
            ]
        )
        for j, joint in enumerate(found["joint"].values)
    ]
    return _table(headings, rows)


def _fatigue_table(run: RunLike, joints: list[str]) -> str:
    found = damage_equivalent(run, joints=joints)
    known = np.ones(found.shape[1:], dtype=np.bool_)
    if "determinate" in found.coords:
        known = found["determinate"].values
    components = [str(c) for c in found["component"].values]
    rows = [
        _row(
            [
                escape(joint) if k == 0 else "",
                f"{float(m):g}",
                *(
                    _bracketed(_number(x), one)
                    for x, one in zip(found.values[k, j], known[j], strict=True)
                ),
            ]
        )
        for j, joint in enumerate(joints)
        for k, m in enumerate(found["exponent"].values)
    ]
    return _table(["joint", "exponent m", *components], rows)


def _health(run: RunLike, limits: xr.Dataset | None) -> str:
    attrs = run.dataset.attrs
    options = json.loads(attrs.get("options", "{}"))
    facts = [
        ("outcome", run.outcome),
        ("model", f"{attrs.get('model', '')} ({attrs.get('model_joints', '?')} joints)"),
        ("model hash", str(attrs.get("model_hash", ""))[:16]),
        ("method", f"{attrs.get('method', '')} {attrs.get('solver', '')}".replace(" none", "")),
        ("integrator", f"{options.get('integrator')}, tolerance {options.get('tolerance')}"),
        ("steps, evaluations", f"{attrs.get('total_steps')}, {attrs.get('total_evaluations')}"),
        ("created", str(attrs.get("created", ""))),
        ("linkwise", str(attrs.get("linkwise_version", ""))),
    ]
    if limits is not None:
        force = limits["algebraic"].sel(quantity="force").values
        if np.isfinite(force).any():  # loads that rigid bodies do not determine have no bound
            facts.append(("largest algebraic error of a force", f"{np.nanmax(force):.1e} N"))
        certain = np.isfinite(limits["integration"].values).any()
        text = (
            "bounded by a run at a tighter tolerance"
            if certain
            else "not bounded; add --certify SCENARIO"
        )
        facts.append(("integration error", text))
    return _table([], [_row([escape(a), escape(b)]) for a, b in facts], "facts")


def _warnings(run: RunLike) -> str:
    """What was ignored or assumed when the machine was read; the figures do not hold it."""
    ignored = recorded_warnings(run.dataset.attrs)
    if not ignored:
        return ""
    rows = [_row([escape(entry["element"]), escape(entry["text"])]) for entry in ignored]
    return f"<h2>Warnings of the model</h2>{_table([], rows, 'facts')}"


def _plotly() -> Any:
    try:
        import plotly.offline
    except ModuleNotFoundError:
        raise InputError(
            "the report needs the package plotly; pip install 'linkwise[report]'"
        ) from None
    return plotly


def script_json(value: Any) -> str:
    """JSON that cannot end the script element it stands in."""
    return json.dumps(value).replace("<", "\\u003c")


def _inside(summaries: dict[str, Any], missing: str) -> str:
    """Peaks inside flexible links, and the place of their figures."""
    if missing:
        return f"<h2>Inside flexible links</h2>{_note(missing)}"
    if not summaries:
        return ""
    rows = [_row(cells) for link, one in summaries.items() for cells in peak_rows(link, one)]
    options = "".join(f"<option value='{escape(n)}'>{escape(n)}</option>" for n in summaries)
    about = (
        "Of the samples: what the inboard part puts on the outboard part, in the axes of the bent "
        "section; tension is a negative fx, and a positive stress. Areas hold the whole run, lines "
        "are of the instant at which the largest load is in the figure."
    )
    return (
        f"<h2>Inside flexible links</h2>{_note(about)}{_table(PEAK_HEADINGS, rows)}"
        f"<label>Link <select id='link'>{options}</select></label>"
        "<div id='link-figures' class='grid'></div>"
    )


def write_report(
    run: RunLike, path: str | os.PathLike[str], found: dict[str, Any], model: Model | None = None
) -> Path:
    """Write the report of a run.

    Args:
        run: Holds `joint_load`; figures that need other quantities are left out without them.
        path: The HTML file; an existing one is replaced.
        found: Results of the functions "summary", "bounds" and "margins"; the last two may be None.
        model: The machine, if the run does not hold it.
    """
    plotly = _plotly()
    target = Path(os.path.abspath(path))
    check_file(target)
    summary, limits, left = found["summary"], found.get("bounds"), found.get("margins")
    names = [str(name) for name in summary["joint"].values]
    force = summary["peak"].sel(quantity="force").values
    known = _known(summary)[summary["quantity"].values.tolist().index("force")]
    ranked = [names[k] for k in np.lexsort((-force, ~known))[:MOST_JOINTS]]
    drawn = [name for name in names if name in set(ranked)]
    every = max(1, -(-run.dataset.sizes["time"] // MOST_SAMPLES))
    within, summaries, missing = inside(run, every)
    content = {
        "inside": within,
        "times": packed(run.dataset["time"].values[::every]),
        "joints": joint_figures(run, drawn, every, model),
        "energy": energy_figure(run, every, model),
    }
    chooser = "".join(f"<option value='{escape(name)}'>{escape(name)}</option>" for name in drawn)
    title = escape(f"Joint loads of {run.dataset.attrs.get('model', 'a machine')}")
    fewer = (
        f" of the {len(drawn)} most loaded of {len(names)} joints"
        if len(drawn) < len(names)
        else ""
    )
    scenario = str(run.dataset.attrs.get("scenario", ""))
    missed = what_samples_miss(run)
    parts = [
        "<!DOCTYPE html><html lang='en'><head><meta charset='utf-8'>",
        "<meta http-equiv='Content-Security-Policy' content=\"default-src 'none'; "
        "script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:\">",
        f"<title>{title}</title><style>{_STYLE}</style></head><body><h1>{title}</h1>",
        "<p class='note'>Wrench that the inboard body exerts on the outboard body, in the joint "
        "frame fixed in the outboard body, moments about the joint point. SI units. ± is the "
        f"bound of algebraic and integration error.{_brackets(summary)}</p>",
        _warnings(run),
        f"<h2>Peaks</h2>{_note(_PEAKS[summary.attrs['extremes']])}{_peak_table(summary, limits)}",
        f"<h2>Against the ratings</h2>{_margin_table(summary, left, limits)}"
        if left is not None
        else "",
        f"<h2>Envelopes</h2>{_envelope_table(run)}",
        f"<h2>Damage-equivalent ranges{fewer}</h2>"
        + _note(
            f"Peak to peak, one cycle a second of the run. Of the samples and the largest and "
            f"smallest values between them; {missed}."
        )
        + _fatigue_table(run, drawn),
        f"<h2>Over time{fewer}</h2>"
        + _note(
            f"Lines, areas, durations and spectra are of the samples, dots are extremes "
            f"between them; {missed}."
        )
        + f"<label>Joint <select id='joint'>{chooser}</select></label>",
        "<div id='joint-figures' class='grid'></div>",
        _inside(summaries, missing),
        "<h2>Energy and solver</h2><div id='energy-figures' class='grid'></div>",
        _health(run, limits),
        f"<h2>Scenario</h2><pre>{escape(scenario)}</pre>" if scenario else "",
        f"<script type='application/json' id='figures'>{script_json(content)}</script>",
        f"<script>{plotly.offline.get_plotlyjs()}</script><script>{_SCRIPT}</script></body></html>\n",
    ]
    write_text(target, "".join(parts))
    return target
