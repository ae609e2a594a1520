"""`linkwise loads --at`: joint loads at a frame of any link, and what fixed joints carry."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from linkwise.cli.output import (
    console,
    in_brackets,
    meaning_of_brackets,
    number,
    print_json,
    say_warnings,
    table,
    text,
    write_csv,
)

if TYPE_CHECKING:
    import xarray as xr

    from linkwise._core import Model
    from linkwise.results import Run

AtOption = Annotated[
    str | None,
    typer.Option(
        "--at",
        metavar="LINK|child|parent|world",
        help="Loads at and in the frame of any link, at the samples; with -j also of fixed joints "
        "whose links are merged, such as force sensors.",
    ),
]
PointOption = Annotated[
    tuple[float, float, float] | None,
    typer.Option(help=r"With --at LINK: about this point of it \[m] instead of its origin."),
]


def show_at(
    run: Run,
    model: Model,
    at: str,
    point: tuple[float, float, float] | None,
    joints: list[str] | None,
    csv: Path | None,
    as_json: bool,
) -> None:
    """Prints and writes the largest loads of the joints at one frame."""
    from linkwise._core import Frame
    from linkwise.loads import in_frame

    found = in_frame(run, at if point is None else Frame(at, point), joint=joints, model=model)
    records = records_at(found)
    between = peaks_between(run, records)
    if csv is not None:
        write_csv(records, csv)
    if as_json:
        about = {key: found.attrs[key] for key in ("frame", "point", "convention")}
        about["extremes"] = "of the samples"
        warnings = [*run.warnings, *between]
        print_json({"run": str(run.path), "at": about, "loads": records, "warnings": warnings})
        return
    screen = console()
    screen.print(_table_at(records, found.attrs))
    say_warnings([*run.warnings, *between])
    if csv is not None:
        screen.print(f"Written: {csv}", markup=False)


def peaks_between(run: Run, records: list[dict[str, Any]]) -> list[dict[str, str]]:
    """A warning where the loads of these joints peak between the samples."""
    from linkwise.loads.extremes import missed_peaks
    from linkwise.loads.samples import joint_names

    asked = {record["joint"] for record in records}
    # A fixed joint hangs on ones that move, whose peaks it may share.
    missed = missed_peaks(run, asked if asked <= set(joint_names(run)) else None)
    if not missed:
        return []
    # Forces are as large at any point; moments are not.
    worst = next((one for one in missed if one.quantity == "force"), missed[0])
    text = f"{worst}; what stands here is of the samples: simulate with more of them (every)"
    return [{"element": "samples", "text": text}]


def records_at(found: xr.DataArray) -> list[dict[str, Any]]:
    """One record per joint and quantity of loads (time, joint, component)."""
    import numpy as np

    from linkwise.base import COMPONENTS, HALVES

    times, load = found["time"].values, found.values
    halves = {
        name: np.linalg.norm(load[..., k : k + 3], axis=-1)
        for k, (name, _, _) in zip((0, 3), HALVES, strict=True)
    }
    each = {name: load[..., k] for k, name in enumerate(COMPONENTS)}
    known = records_known(found)
    records = []
    for j, joint in enumerate(found["joint"].values.tolist()):
        for name, values in (halves | each).items():
            column = values[:, j]
            k = int(np.argmax(np.abs(column)))
            records.append(
                {
                    "joint": joint,
                    "quantity": name,
                    "unit": "N m" if name in ("moment", *COMPONENTS[3:]) else "N",
                    "peak": float(column[k]),
                    "peak_time": float(times[k]),
                    "minimum": float(column.min()),
                    "maximum": float(column.max()),
                    **({} if known is None else {"determinate": bool(known[name][j])}),
                }
            )
    return records


def records_known(found: xr.DataArray) -> dict[str, Any] | None:
    """Whether rigid bodies determine each of the quantities, by joint; None where all are."""
    from linkwise.base import COMPONENTS, HALVES

    if "determinate" not in found.coords:
        return None
    known = found["determinate"].values
    of_halves = {
        name: known[:, k : k + 3].all(axis=1)
        for k, (name, _, _) in zip((0, 3), HALVES, strict=True)
    }
    return of_halves | {name: known[:, k] for k, name in enumerate(COMPONENTS)}


def _table_at(records: list[dict[str, Any]], about: dict[str, str]) -> Any:
    by_joint: dict[str, list[dict[str, Any]]] = {}
    for record in records:
        by_joint.setdefault(record["joint"], []).append(record)
    where = f"{about['frame']}, about {about['point']}"
    title = f"Largest loads at the samples, inboard on outboard body; {where}"
    title += meaning_of_brackets(records)
    if len(by_joint) == 1:
        headings = [("quantity", "left"), ("peak", "right"), ("at [s]", "right")]
        headings += [(name, "right") for name in ("minimum", "maximum")]
        result = table(text(f"{records[0]['joint']}: {title}"), headings)
        for record in records:
            keys = ("peak", "peak_time", "minimum", "maximum")
            cells = [number(record[key]) for key in keys]
            cells = [
                cell if key == "peak_time" else in_brackets(cell, record)
                for key, cell in zip(keys, cells, strict=True)
            ]
            result.add_row(f"{record['quantity']} [{record['unit']}]", *cells)
        return result
    first = next(iter(by_joint.values()))
    timed = {"force", "moment"}
    headings = [("joint", "left")]
    for record in first:
        when = " @ s" if record["quantity"] in timed else ""
        headings.append((f"{record['quantity']} [{record['unit']}]{when}", "right"))
    result = table(text(title), headings)
    for name, row in by_joint.items():
        shown = [
            in_brackets(number(r["peak"]), r)
            + (f" @ {number(r['peak_time'])}" if r["quantity"] in timed else "")
            for r in row
        ]
        result.add_row(text(name), *shown)
    return result
