"""`linkwise loads --sections`: loads inside elastic links."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from linkwise.cli.output import console, number, print_json, say_warnings, table, text, write_csv

if TYPE_CHECKING:
    import xarray as xr

    from linkwise._core import Model
    from linkwise.results import Run

SectionsOption = Annotated[
    list[str] | None,
    typer.Option(
        "--sections",
        metavar="LINK",
        help="Loads inside this flexible link, along it, at the samples; may be repeated, all: "
        "inside every one.",
    ),
]
CountOption = Annotated[
    int | None,
    typer.Option(
        "-n", help="With --sections: how many sections, from start to end; 11 unless given."
    ),
]
_SECTIONS = 11
_PEAK_KEYS = ("peak", "peak_error", "peak_x", "peak_time")


def show_sections(
    run: Run,
    model: Model,
    links: list[str],
    n: int | None,
    split: str | None,
    csv: Path | None,
    as_json: bool,
) -> None:
    """Prints and writes what is inside these links."""
    from linkwise._core import InputError
    from linkwise.io.complaint import shown
    from linkwise.loads import section_margins, section_summary
    from linkwise.loads.sections import elastic_links
    from linkwise.scenario import section_ratings_in

    if split not in (None, "motion"):
        raise InputError(f"--split: {shown(split or '')} does not go with --sections; use motion")
    every = elastic_links(model)
    if links == ["all"] and "all" not in every:
        links = every
        if not links:
            raise InputError("--sections all: the machine has no flexible links; leave it out")
    count = _SECTIONS if n is None else n
    allowed = section_ratings_in(str(run.dataset.attrs.get("scenario", "")))
    found, made, rows = [], [], []
    for link in dict.fromkeys(links):
        summary = section_summary(run, link, count, model)
        records = _peaks(summary)
        if link in allowed:
            margins = section_margins(summary, allowed[link])
            for record in records:
                if record["quantity"] in margins["quantity"].values:
                    own = margins.sel(quantity=record["quantity"])
                    record |= {key: float(own[key]) for key in ("rating", "use", "margin")}
        if split is not None:
            _add_causes(run, model, link, count, records)
        along = _along(summary)
        found.append({"link": link, "peaks": records, "along": along})
        rows += [{"link": link, **row} for row in along]
        made += [_peak_table(link, records, split), _along_table(link, summary)]
    if csv is not None:
        write_csv(rows, csv)
    warnings = [*run.warnings, *_missed(run)]
    if as_json:
        about = {"run": str(run.path), "extremes": "of the samples", "sections": found}
        print_json(about | {"warnings": warnings})
        return
    screen = console()
    for one in made:
        screen.print(one)
    say_warnings(warnings)
    if csv is not None:
        screen.print(f"Written: {csv}", markup=False)


def _missed(run: Run) -> list[dict[str, str]]:
    """A warning where joint loads, and so what is inside, peak between the samples."""
    from linkwise.loads.extremes import missed_peaks

    missed = missed_peaks(run, None)
    said = f"loads inside links are of the samples: {missed[0]}" if missed else ""
    return [{"element": "samples", "text": said}] if missed else []


def _peaks(summary: xr.Dataset) -> list[dict[str, Any]]:
    from linkwise.loads.section_summary import LONG_NAMES

    columns = {key: summary[key].values for key in _PEAK_KEYS}
    low, high = summary["minimum"].values.min(axis=0), summary["maximum"].values.max(axis=0)
    units = summary["quantity_units"].values
    return [
        {
            "quantity": str(name),
            "long_name": LONG_NAMES[str(name)],
            "unit": str(units[k]),
            **{key: float(values[k]) for key, values in columns.items()},
            "minimum": float(low[k]),
            "maximum": float(high[k]),
        }
        for k, name in enumerate(summary["quantity"].values)
    ]


def _add_causes(run: Run, model: Model, link: str, n: int, records: list[dict[str, Any]]) -> None:
    """What each cause adds to the peaks of components."""
    import numpy as np

    from linkwise.loads import section_split

    shares = section_split(run, link, n, model)
    times, x = shares["time"].values, shares["x"].values
    for record in records:
        if record["quantity"] not in shares["component"].values:
            continue
        at = int(np.argmin(np.abs(times - record["peak_time"])))
        place = int(np.argmin(np.abs(x - record["peak_x"])))
        own = shares.sel(component=record["quantity"]).values[at, :, place]
        record["causes"] = dict(zip(shares["cause"].values.tolist(), own.tolist(), strict=True))


def _along(summary: xr.Dataset) -> list[dict[str, Any]]:
    """One record per section and quantity."""
    keys = ("minimum", "minimum_time", "maximum", "maximum_time")
    columns = {key: summary[key].values for key in keys}
    units = summary["quantity_units"].values
    return [
        {
            "x": float(x),
            "quantity": str(name),
            "unit": str(units[k]),
            **{key: float(values[s, k]) for key, values in columns.items()},
        }
        for s, x in enumerate(summary["x"].values)
        for k, name in enumerate(summary["quantity"].values)
    ]


def _peak_table(link: str, records: list[dict[str, Any]], split: str | None) -> Any:
    rated = any("rating" in record for record in records)
    causes = next((list(record["causes"]) for record in records if "causes" in record), [])
    headings = ["peak", "± beam's coordinates", "at x [m]", "at [s]", "smallest", "largest"]
    headings += ["allowed", "use"] if rated else []
    title = (
        f"Inside {text(link)}, of the samples; inboard part on outboard part, in the axes of the "
    )
    title += "bent section, tension is a negative fx"
    if split is not None:
        title += "; by what the motion needs at the peak"
    if records[-1]["quantity"] != "stress":
        title += "; no stress: the section's outer sizes are not known"
    made = table(title, [("", "left"), *((name, "right") for name in [*headings, *causes])])
    for record in records:
        cells = [number(record["peak"]), number(record["peak_error"], 1)]
        cells += [number(record[key]) for key in ("peak_x", "peak_time", "minimum", "maximum")]
        if rated:
            use = f"{100 * record['use']:.1f} %" if "use" in record else ""
            cells += [number(record["rating"]) if use else "", use]
        cells += [number(record["causes"][name]) if "causes" in record else "" for name in causes]
        style = "red" if record.get("margin", 0.0) < 0 else ""
        name = f"{record['long_name']} {record['quantity']} [{record['unit']}]"
        if record["quantity"] == "stress":
            name = f"{record['long_name']} [Pa]"
        made.add_row(name, *cells, style=style)
    return made


def _along_table(link: str, summary: xr.Dataset) -> Any:
    names = [str(name) for name in summary["quantity"].values]
    units = summary["quantity_units"].values
    headings = [f"{name} [{unit}]" for name, unit in zip(names, units, strict=True)]
    columns = [("x [m]", "right"), *((heading, "right") for heading in headings)]
    made = table(f"Along {text(link)}, smallest .. largest", columns)
    low, high = summary["minimum"].values, summary["maximum"].values
    for s, x in enumerate(summary["x"].values):
        pairs = zip(low[s], high[s], strict=True)
        made.add_row(number(float(x)), *(f"{number(a, 3)} .. {number(b, 3)}" for a, b in pairs))
    return made
