"""`linkwise loads`: what the joints of a run carry: table, CSV, JSON, report."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from linkwise.cli.loads_at import AtOption, PointOption, show_at
from linkwise.cli.loads_inside import CountOption, SectionsOption, show_sections
from linkwise.cli.output import (
    JsonOption,
    console,
    in_brackets,
    meaning_of_brackets,
    number,
    print_json,
    say_warnings,
    table,
    text,
    whose,
    write_csv,
)

if TYPE_CHECKING:
    import xarray as xr

    from linkwise._core import Model
    from linkwise.loads.rating import Rating
    from linkwise.results import Run

DrivenOption = Annotated[
    list[str] | None,
    typer.Option(
        help="With --split motion, of closed loops: a joint that drives the machine; may be "
        "repeated. All that have drives in the run unless given.",
    ),
]

_MOST_JOINTS = 40
_MOST_LINKS = 8
_SHOWN = ("force", "axial", "radial", "moment", "tilting_moment", "torque", "drive_power")


def loads(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Run that linkwise wrote (a folder).")],
    joint: Annotated[
        list[str] | None,
        typer.Option("--joint", "-j", help="Only this joint, in full; may be repeated."),
    ] = None,
    at: AtOption = None,
    point: PointOption = None,
    sections: SectionsOption = None,
    n: CountOption = None,
    split: Annotated[
        str | None,
        typer.Option(
            "--split",
            metavar="force|motion",
            help="What each cause adds at the peaks: the acting forces, or what the motion needs.",
        ),
    ] = None,
    driven: DrivenOption = None,
    ratings: Annotated[
        Path | None,
        typer.Option(
            help=r"TOML file with \[rating.JOINT] tables; those of the run's scenario by default."
        ),
    ] = None,
    certify: Annotated[
        Path | None,
        typer.Option(
            metavar="SCENARIO|RUN",
            help="Bounds the integration error: the run's scenario, to be simulated again 100 "
            "times tighter, or a run made that way.",
        ),
    ] = None,
    csv: Annotated[Path | None, typer.Option(help="Also write the table as a CSV file.")] = None,
    html: Annotated[
        Path | None, typer.Option(help="Also write an interactive report, one file, for offline.")
    ] = None,
    model: Annotated[
        Path | None, typer.Option(help="Model file, for runs that do not hold their model.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Peak loads of a RUN's joints, or inside its flexible links: by cause, against ratings."""
    from linkwise._core import InputError
    from linkwise.io.writing import check_file
    from linkwise.loads.sections import elastic_links
    from linkwise.results import open_run

    for written in filter(None, (csv, html)):
        check_file(written)
    opened = open_run(run)
    if at is not None or point is not None:
        if any((split, driven, ratings, certify, html, sections)) or at is None:
            raise InputError("--at: goes with --point, --joint, --csv, --model and --json alone")
        show_at(opened, machine_of(opened, model), at, point, joint, csv, as_json)
        return
    machine = machine_of(opened, model)
    if sections or n is not None:
        if any((joint, driven, ratings, certify, html)) or not sections:
            raise InputError("-n: goes with --sections, and that with --split, --csv, --json alone")
        show_sections(opened, machine, sections, n, split, csv, as_json)
        return
    _check_joints(opened, machine, joint or ())
    found = collect(opened, machine, rating_tables(opened, ratings), certify, as_json)
    shares = peak_shares(opened, machine, split, driven) if split or driven else []
    records = peak_records(found, joint)
    if csv is not None:
        write_csv(records, csv)
    if html is not None:
        from linkwise.plot import write_report

        write_report(opened, html, found, machine)
    sampled = joint or csv or as_json  # whose mean, RMS and duty are of the samples
    ignored = opened.warnings + (sampling_warnings(opened, joint) if sampled else [])
    extremes, elastic = found["summary"].attrs["extremes"], elastic_links(machine)
    if as_json:
        about = {"run": str(run), "extremes": extremes, "peaks": records, "split": shares}
        print_json(about | ({"flexible": elastic} if elastic else {}) | {"warnings": ignored})
        return
    made = [*tables(records, shares, joint, extremes), *_flexible(elastic)]
    _show(made, ignored, [csv, html])


def _check_joints(run: Run, model: Model, joints: Sequence[str]) -> None:
    """InputError where the run has no loads of one of the joints."""
    from linkwise._core import InputError
    from linkwise.io.complaint import shown
    from linkwise.loads.samples import joint_position

    for name in joints:
        if any(name == weld for weld, _, _ in model.welds):
            raise InputError(
                f"joint {shown(name)}: is fixed and its links are merged; "
                "add --at child for its load"
            )
        joint_position(run, name)


def _flexible(links: list[str]) -> list[str]:
    """A line that names flexible links and says how to see what is inside."""
    if not links:
        return []
    named = ", ".join(map(text, links[:_MOST_LINKS])) + (", ..." if links[_MOST_LINKS:] else "")
    return [f"Flexible: {named}. --sections {text(links[0])}: the loads inside it"]


def _show(made: list[Any], ignored: list[dict[str, str]], written: list[Path | None]) -> None:
    screen = console()
    for one in made:
        screen.print(one)
    say_warnings(ignored)
    for path in written:
        if path is not None:
            screen.print(f"Written: {path}", markup=False)


def sampling_warnings(run: Run, joints: list[str] | None) -> list[dict[str, str]]:
    """What mean, RMS and duty do not hold."""
    from linkwise.loads.extremes import missed_peaks

    missed = missed_peaks(run, joints)
    text = f"mean, RMS and duty are of the samples: {missed[0]}" if missed else ""
    return [{"element": "samples", "text": text}] if missed else []


def machine_of(run: Run, file: Path | None) -> Model:
    """The machine of the run itself, of a file only where the run does not hold it."""
    from linkwise.cli.output import say
    from linkwise.io.load import load
    from linkwise.loads.samples import held_model, model_of

    own = held_model(run)
    if file is None:
        return run.load_model()
    if own is not None:
        say(f"{file}: is not used, the run holds the model that it was made with")
        return own
    return model_of(run, load(file))


def rating_tables(run: Run, path: Path | None) -> dict[str, Rating]:
    """Ratings of the file, or of the scenario that the run keeps."""
    from linkwise.scenario import load_ratings, ratings_in

    if path is not None:
        return load_ratings(path)
    return ratings_in(str(run.dataset.attrs.get("scenario", "")))


def tighter_run(run: Run, path: Path, quiet: bool) -> Run:
    """The run at `path`, or the scenario there simulated again at a tighter tolerance."""
    import json

    from linkwise._core import InputError
    from linkwise.cli.progress import live_progress
    from linkwise.loads.certainty import TIGHTER
    from linkwise.results import open_run
    from linkwise.scenario import load_scenario
    from linkwise.simulation.simulate import simulate

    if os.path.isdir(path):
        return open_run(path)
    scenario = load_scenario(path)
    if scenario.text != run.dataset.attrs.get("scenario"):
        raise InputError(
            f"{str(path)!r}: is not the scenario that made the run; give that one, or a tighter run"
        )
    machine = scenario.load_model()
    arguments = scenario.simulate_arguments(machine)
    used = json.loads(run.dataset.attrs["options"])
    tighter = {"step_tolerance": used["step_tolerance"] / TIGHTER}
    arguments |= {
        "numerics": arguments["numerics"] | tighter,
        "times": run.dataset["time"].values,
        "every": None,
        "duration": None,
        "output": None,
    }
    with live_progress(quiet=quiet) as progress:
        return simulate(machine, **arguments, progress=progress)


def collect(
    run: Run, model: Model, ratings: dict[str, Rating], certify: Path | None, quiet: bool
) -> dict[str, Any]:
    """Summary, bounds (where the run holds enough) and margins (where there are ratings)."""
    from linkwise._core import InputError
    from linkwise.loads import bounds, margins, summary

    peaks = summary(run, model)
    tighter = None if certify is None else tighter_run(run, certify, quiet)
    limits: xr.Dataset | None = None
    try:
        limits = bounds(run, tighter, model)
    except InputError:
        if certify is not None:
            raise
    plus_minus = None if tighter is None or limits is None else limits["plus_minus"]
    left = margins(peaks, ratings, plus_minus) if ratings else None
    return {"summary": peaks, "bounds": limits, "margins": left}


def peak_records(found: dict[str, Any], joints: list[str] | None) -> list[dict[str, Any]]:
    """One record per joint and quantity."""
    summary: xr.Dataset = found["summary"]
    components = [str(c) for c in summary["component"].values]
    units = [str(u) for u in summary["quantity_units"].values]
    first = ("peak", "peak_time")
    last = ("sampling", "missed", "rms", "mean", "minimum", "maximum", "duty")
    columns = {key: summary[key].values for key in first}
    for other, keys in (
        ("bounds", ("algebraic", "integration", "plus_minus")),
        ("margins", ("rating", "use", "margin")),
    ):
        if found[other] is not None:
            columns |= {key: found[other][key].values for key in keys}
    columns |= {key: summary[key].values for key in last}
    columns |= {name: summary["wrench"].values[..., c] for c, name in enumerate(components)}
    records = []
    for j, name in enumerate(summary["joint"].values.tolist()):
        if joints and name not in joints:
            continue
        for k, quantity in enumerate(summary["quantity"].values.tolist()):
            if math.isnan(columns["peak"][k, j]):  # no single axis
                continue
            record: dict[str, Any] = {"joint": name, "quantity": quantity, "unit": units[k]}
            record |= {key: float(values[k, j]) for key, values in columns.items()}
            if "determinate" in summary:
                record["determinate"] = bool(summary["determinate"].values[k, j])
                known = summary["wrench_determinate"].values[j]
                record["not_determinate"] = " ".join(
                    c for c, one in zip(components, known, strict=True) if not one
                )
            records.append(record)
    return records


def peak_shares(
    run: Run, model: Model, by: str | None, driven: list[str] | None = None
) -> list[dict[str, Any]]:
    """What each cause adds to the peak force and moment, along them; the shares add up."""
    from linkwise._core import InputError
    from linkwise.base import HALVES
    from linkwise.io.complaint import shown
    from linkwise.loads.causes import CAUSES, split_at_peaks

    if driven and by != "motion":
        raise InputError("--driven: goes with --split motion")
    if by not in CAUSES:
        raise InputError(f"--split: {shown(by or '')} is unknown; use force or motion")
    found = split_at_peaks(run, by, model, driven=driven or None)  # type: ignore[arg-type]
    known = found["determinate"].values if "determinate" in found else None
    columns = {name: found[name].values for name in ("time", "total", "peak")}
    columns |= {str(name): found["share"].sel(cause=name).values for name in found["cause"].values}
    return [
        {
            "joint": name,
            "quantity": quantity,
            "unit": unit,
            "at_peak": bool(found["at_peak"].values[k, j]),
            **({"determinate": bool(known[k, j])} if known is not None else {}),
            **{key: float(values[k, j]) for key, values in columns.items()},
        }
        for k, (quantity, unit, _) in enumerate(HALVES)
        for j, name in enumerate(found["joint"].values.tolist())
    ]


def _with_bound(record: dict[str, Any]) -> str:
    shown = number(record["peak"])
    if math.isfinite(record.get("plus_minus", math.nan)):
        shown += f" ± {number(record['plus_minus'], 1)}"
    return in_brackets(shown, record)


def tables(
    records: list[dict[str, Any]],
    shares: list[dict[str, Any]],
    joints: list[str] | None,
    extremes: str,
) -> list[Any]:
    made = [_joint_table(records, name, whose(extremes)) for name in joints or ()]
    made = made or [_all_joints(records, whose(extremes))]
    rated = [record for record in records if record.get("rating", 0) > 0]
    if rated:
        made.append(_margin_table(rated))
    chosen = [s for s in shares if not joints or s["joint"] in joints]
    if chosen:
        made.append(_share_table(chosen))
    return made


def _by_force(item: tuple[str, dict[str, dict[str, Any]]]) -> tuple[bool, float]:
    """Large forces first, and what is one choice of many behind all others."""
    force = item[1]["force"]
    return not force.get("determinate", True), -force["peak"]


def _all_joints(records: list[dict[str, Any]], some: str) -> Any:
    by_joint: dict[str, dict[str, dict[str, Any]]] = {}
    for record in records:
        by_joint.setdefault(record["joint"], {})[record["quantity"]] = record
    rows = list(by_joint.items())
    title = f"Peak joint loads{some}, inboard on outboard body"
    title += ", in the joint frame at the joint point"
    if len(rows) > _MOST_JOINTS:
        rows = sorted(rows, key=_by_force)[:_MOST_JOINTS]
        title += f" (the {_MOST_JOINTS} largest forces of {len(by_joint)} joints)"
    shown = [name for name in _SHOWN if any(name in found for _, found in rows)]
    units = {r["quantity"]: r["unit"] for r in records}
    title += meaning_of_brackets(records)
    headings = [(f"{name.replace('_', ' ')} [{units[name]}] @ s", "right") for name in shown]
    result = table(title, [("joint", "left"), *headings])
    for name, found in rows:
        cells = [_at_its_time(found[q]) if q in found else "" for q in shown]
        result.add_row(text(name), *cells)
    return result


def _at_its_time(record: dict[str, Any]) -> str:
    """A peak and when: every quantity has its own time."""
    return f"{_with_bound(record)} @ {number(record['peak_time'])}"


def _joint_table(records: list[dict[str, Any]], joint: str, some: str) -> Any:
    from linkwise.base import COMPONENTS

    headings = ["peak", "at [s]", "rms", "minimum", "maximum", "duty", *COMPONENTS]
    columns = [("quantity", "left"), *((name, "right") for name in headings)]
    title = f"Load of {text(joint)}{some}; fx ... nz at the time of each peak"
    title += meaning_of_brackets(record for record in records if record["joint"] == joint)
    result = table(f"{title}, rms and duty of the samples", columns)
    for record in records:
        if record["joint"] != joint:
            continue
        keys = ("peak_time", "rms", "minimum", "maximum", "duty", *COMPONENTS)
        result.add_row(
            f"{record['quantity'].replace('_', ' ')} [{record['unit']}]",
            _with_bound(record),
            *(_or_bracketed(record, key) for key in keys),
        )
    return result


def _or_bracketed(record: dict[str, Any], key: str) -> str:
    shown = number(record[key])
    if key in record.get("not_determinate", "").split():
        return f"({shown})"
    of_quantity = key in ("rms", "minimum", "maximum", "duty")
    return in_brackets(shown, record) if of_quantity else shown


def _of_rating(record: dict[str, Any]) -> list[str]:
    return [f"{100 * record['use']:.1f} %", f"{100 * record['margin']:.1f} %"]


def _margin_table(rated: list[dict[str, Any]]) -> Any:
    headings = [("joint", "left"), ("quantity", "left")]
    headings += [(name, "right") for name in ("peak", "at [s]", "rating", "use", "margin")]
    title = "Against the ratings; the bounds of certified peaks count as load"
    result = table(title + meaning_of_brackets(rated), headings)
    for record in sorted(rated, key=lambda r: (not r.get("determinate", True), -r["use"])):
        style = "red" if record["margin"] < 0 else ""
        result.add_row(
            text(record["joint"]),
            f"{record['quantity'].replace('_', ' ')} [{record['unit']}]",
            _with_bound(record),
            number(record["peak_time"]),
            number(record["rating"]),
            *(in_brackets(shown, record) for shown in _of_rating(record)),
            style=style,
        )
    return result


def _share_table(shares: list[dict[str, Any]]) -> Any:
    fixed = ("joint", "quantity", "unit", "at_peak", "determinate", "time", "total", "peak")
    causes = [key for key in shares[0] if key not in fixed]
    beside = not all(record["at_peak"] for record in shares)
    where = "the peak" if not beside else "the peak, of loads marked * at the sample beside it"
    headings = [("joint", "left"), ("of the peak", "left"), ("at [s]", "right"), ("load", "right")]
    headings += [("peak", "right")] if beside else []
    result = table(
        f"By cause, at {where}, along the load there; the shares add up to it"
        + meaning_of_brackets(shares),
        [*headings, *((name, "right") for name in causes)],
    )
    for record in shares:
        keys = ("time", "total", *(("peak",) if beside else ()), *causes)
        cells = [number(record["time"])]
        cells += [in_brackets(number(record[name]), record) for name in keys[1:]]
        cells[1] += "" if record["at_peak"] else " *"
        result.add_row(text(record["joint"]), f"{record['quantity']} [{record['unit']}]", *cells)
    return result
