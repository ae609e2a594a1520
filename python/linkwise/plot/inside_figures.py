"""The part of the report about flexible links: what is inside them and how they bend."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise._core import InputError
from linkwise.base import COMPONENTS, Array
from linkwise.loads.deflections import section_deflections
from linkwise.loads.samples import held_model, rows
from linkwise.loads.section_summary import LONG_NAMES, STRESS, section_summary
from linkwise.loads.sections import STATE, Sections, elastic_links, extreme_stress
from linkwise.plot.report_figures import COLOURS, TIMES, Figure, curve, layout_of, packed

if TYPE_CHECKING:
    import xarray as xr

    from linkwise.loads.samples import RunLike

#: Flexible links with figures, the first ones: each takes some 100 kB.
MOST_LINKS = 16
SECTIONS = 21
_GROUPS = (
    ("Axial force", ("fx",), "force [N]"),
    ("Shear", ("fy", "fz"), "force [N]"),
    ("Torsion", ("nx",), "moment [N m]"),
    ("Bending", ("ny", "nz"), "moment [N m]"),
    ("Fibre stress", (STRESS,), "stress [Pa]"),
)
PEAK_HEADINGS = ["", "peak", "± beam's coordinates", "at x [m]", "at [s]", "smallest", "largest"]


def inside(run: RunLike, every: int) -> tuple[dict[str, list[Figure]], dict[str, Any], str]:
    """Figures and summary of each flexible link, the first ones, drawing one sample of `every` over
    time; and why there are none where the run holds too little."""
    model = held_model(run)
    links = [] if model is None else elastic_links(model)[:MOST_LINKS]
    figures: dict[str, list[Figure]] = {}
    summaries: dict[str, Any] = {}
    for link in links:
        try:
            summaries[link] = section_summary(run, link, SECTIONS)
            figures[link] = _diagrams(run, link, summaries[link]) + _over_time(run, link, every)
        except InputError as error:
            return {}, {}, str(error)
    return figures, summaries, ""


def _diagrams(run: RunLike, link: str, summary: xr.Dataset) -> list[Figure]:
    """Along the link: the band that loads stay in, and the loads when the largest was there."""
    of = Sections(run, link, SECTIONS)
    made = []
    for title, names, axis in _GROUPS:
        if names[0] not in summary["quantity"].values:
            continue
        own = summary.sel(quantity=list(names))
        worst = int(np.argmax(np.abs(own["peak"].values)))
        when = float(own["peak_time"].values[worst])
        at = _loads_at(of, int(np.argmin(np.abs(of.times - when))))
        data = []
        for k, name in enumerate(names):
            low, high = own["minimum"].values[:, k], own["maximum"].values[:, k]
            data += _band(name, of.x, low, high, COLOURS[k])
            for label in ("lowest", "highest") if name == STRESS else (name,):
                data.append(curve(label, packed(of.x), at[label], line={"color": COLOURS[k]}))
        about = f"{title} along {link}, at {when:.4g} s"
        made.append({"data": data, "layout": layout_of(about, "from the start [m]", axis)})
    return made


def _loads_at(of: Sections, sample: int) -> dict[str, Array]:
    """Components at the sections and the two stresses, at one sample."""
    q, v, a, joints = (rows(of.run, name, [sample]) for name in STATE)
    load = of.loads(q, v, a, joints)[0][0]
    low, high = extreme_stress(load, of.section)
    by_name = {name: load[:, c] for c, name in enumerate(COMPONENTS)}
    return by_name | {"lowest": low, "highest": high}


def _band(name: str, x: Array, low: Array, high: Array, color: str) -> list[Figure]:
    """The area between the smallest and the largest value."""
    plain = {"line": {"width": 0}, "hoverinfo": "skip"}
    shade = f"rgba({', '.join(str(int(color[k : k + 2], 16)) for k in (1, 3, 5))}, 0.2)"
    below = curve(f"{name} smallest", packed(x), low, showlegend=False, **plain)
    plain = {"line": {"width": 0}, "hoverinfo": "skip"}
    more = {"fill": "tonexty", "fillcolor": shade}
    return [below, curve(f"{name}, whole run", packed(x), high, **more, **plain)]


def _over_time(run: RunLike, link: str, every: int) -> list[Figure]:
    """Deflection of the end and strain energy."""
    found = section_deflections(run, link, 2)
    end = found["deflection"].values[::every, -1]
    curves = [curve(f"along {axis}", TIMES, end[:, k]) for k, axis in enumerate("xyz")]
    energy = curve("strain energy", TIMES, found["strain_energy"].values[::every])
    shape = layout_of(f"Deflection of {link}'s end", "time [s]", "deflection [m]")
    stored = layout_of(f"Strain energy of {link}", "time [s]", "energy [J]")
    return [{"data": curves, "layout": shape}, {"data": [energy], "layout": stored}]


def peak_rows(link: str, summary: xr.Dataset) -> list[list[str]]:
    """Cells of the table of one link's peaks."""

    def shown(value: float, digits: int = 4) -> str:
        return "" if not np.isfinite(value) else f"{value:.{digits}g}"

    low, high = summary["minimum"].values.min(axis=0), summary["maximum"].values.max(axis=0)
    units = summary["quantity_units"].values
    found = []
    for k, name in enumerate(summary["quantity"].values):
        one = [float(summary[key][k]) for key in ("peak", "peak_error", "peak_x", "peak_time")]
        short = "" if name == STRESS else f" {name}"
        cells = [f"{escape(link)}: {LONG_NAMES[str(name)]}{short} [{units[k]}]", shown(one[0])]
        cells += [shown(one[1], 1), shown(one[2]), shown(one[3])]
        found.append([*cells, shown(float(low[k])), shown(float(high[k]))])
    return found
