"""`linkwise loads --at`: joint loads at a frame of any link, and what fixed joints carry."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from linkwise.cli.output import console, number, print_json, say_warnings, table, text, write_csv

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
    typer.Option(help="With --at LINK: about this point of it [m] instead of its origin."),
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
    higher = higher_between(run, records)
    if csv is not None:
        write_csv(records, csv)
    if as_json:
        about = {key: found.attrs[key] for key in ("frame", "point", "convention")}
        about["extremes"] = "of the samples"
        warnings = [*run.warnings, *higher]
        print_json({"run": str(run.path), "at": about, "loads": records, "warnings": warnings})
        return
    screen = console()
    screen.print(_table_at(records, found.attrs))
    say_warnings([*run.warnings, *higher])
    if csv is not None:
        screen.print(f"Written: {csv}", markup=False)


def higher_between(run: Run, records: list[dict[str, Any]]) -> list[dict[str, str]]:
    """Warnings where forces, which are as large at any point, peak higher between the samples."""
    from linkwise.loads import peak_loads

    peaks = peak_loads(run)
    force = dict(zip(peaks["joint"].values.tolist(), peaks["force"].values.tolist(), strict=True))
    at_samples = {r["joint"]: r["peak"] for r in records if r["quantity"] == "force"}
    higher = [j for j, size in at_samples.items() if force.get(j, 0.0) > 1.001 * size]
    # A fixed joint hangs on one that moves, whose peak it may share.
    inside = [j for j in force if force[j] > 1.001 * _sampled_force(run, j)]
    fixed = [j for j in at_samples if j not in force]
    if not higher and not (fixed and inside):
        return []
    worst = max(higher or inside, key=lambda j: force[j])
    return [
        {
            "element": f"joint {worst!r}",
            "text": f"force peaks between the samples, at {force[worst]:.4g} N; what stands here "
            "is of the samples: simulate with more of them (every)",
        }
    ]


def _sampled_force(run: Run, joint: str) -> float:
    from linkwise.base import lengths

    load = run.dataset["joint_load"].sel(joint=joint).values
    return float(lengths(load[..., :3]).max())


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
                }
            )
    return records


def _table_at(records: list[dict[str, Any]], about: dict[str, str]) -> Any:
    by_joint: dict[str, list[dict[str, Any]]] = {}
    for record in records:
        by_joint.setdefault(record["joint"], []).append(record)
    where = f"{about['frame']}, about {about['point']}"
    title = f"Largest loads at the samples, inboard on outboard body; {where}"
    if len(by_joint) == 1:
        headings = [("quantity", "left"), ("peak", "right"), ("at [s]", "right")]
        headings += [(name, "right") for name in ("minimum", "maximum")]
        result = table(text(f"{records[0]['joint']}: {title}"), headings)
        for record in records:
            keys = ("peak", "peak_time", "minimum", "maximum")
            cells = [number(record[key]) for key in keys]
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
            f"{number(r['peak'])} @ {number(r['peak_time'])}"
            if r["quantity"] in timed
            else number(r["peak"])
            for r in row
        ]
        result.add_row(text(name), *shown)
    return result
