"""`linkwise sweep`: one scenario with many values."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from linkwise.cli.output import (
    FAILED,
    JsonOption,
    bracketed,
    console,
    meaning_of_brackets,
    number,
    print_json,
    say_warnings,
    table,
    text,
)

if TYPE_CHECKING:
    import xarray as xr


def sweep(
    scenario: Annotated[Path, typer.Argument(metavar="SCENARIO", help="Scenario file (TOML).")],
    axis: Annotated[
        list[str],
        typer.Option(
            "--set",
            "-s",
            metavar="KEY=[VALUES]",
            help="A key of the scenario and its values, in TOML; may be repeated, all combinations "
            "are run. Example: payload.box.mass=[0, 5, 10]",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Where to write all runs (a NetCDF file)."),
    ] = None,
    processes: Annotated[
        int | None, typer.Option(help="How many run side by side; one per processor by default.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Simulate a SCENARIO with every combination of values, side by side."""
    from linkwise._core import InputError
    from linkwise.io.writing import check_file
    from linkwise.notes import recorded_warnings
    from linkwise.record.export import write_netcdf
    from linkwise.scenario import parse_axis
    from linkwise.simulation.sweep import sweep as run_sweep

    axes = {}
    for key, values in map(parse_axis, axis):
        if key in axes:
            raise InputError(f"--set {key}: is given twice; put all values into one list")
        axes[key] = values
    if output is not None:
        check_file(output)
    found = run_sweep(scenario, axes, processes=processes)
    if output is not None:
        write_netcdf(found, output)
    records = member_records(found, list(axes))
    ignored = recorded_warnings(found.attrs)
    if as_json:
        where = None if output is None else str(output)
        print_json({"output": where, "members": records, "warnings": ignored})
    else:
        screen = console()
        screen.print(_member_table(records, list(axes)))
        say_warnings(ignored)
        if output is not None:
            screen.print(f"Written: {output}", markup=False)
    if any(record["outcome"] != "converged" for record in records):
        raise typer.Exit(FAILED)


def member_records(found: xr.Dataset, keys: list[str]) -> list[dict[str, Any]]:
    """Per member its values, how it went, and the largest force and moment and where."""
    import numpy as np

    from linkwise.base import HALVES
    from linkwise.loads import peak_loads

    peaks = peak_loads(found) if "joint_load" in found else None
    records = []
    for k in range(found.sizes["member"]):
        member = found.isel(member=k)
        record: dict[str, Any] = {key: member[key].values.tolist() for key in keys}
        record["outcome"] = str(member["outcome"].values)
        for half, _, _ in HALVES:
            if peaks is None:
                continue
            own = peaks[half].isel(member=k).values
            known = np.ones(own.shape, dtype=np.bool_)
            if f"{half}_determinate" in peaks:
                known = peaks[f"{half}_determinate"].isel(member=k).values
                record[f"largest_{half}_determinate"] = bool(known.any())
            # What is one choice of many is not ranked among the others; NaN: there are no samples.
            at = int(np.where(known, own, -1.0 if known.any() else own).argmax())
            record |= {
                f"largest_{half}": float(own[at]),
                f"{half}_joint": str(found["joint"].values[at]),
            }
        records.append(record)
    return records


def _member_table(records: list[dict[str, Any]], keys: list[str]) -> Any:
    columns = [(text(key), "right") for key in keys]
    columns += [("outcome", "left"), ("force [N]", "right"), ("joint", "left")]
    columns += [("moment [N m]", "right"), ("joint", "left")]
    title = "Largest joint loads of each member"
    halves = [f"largest_{half}" for half in ("force", "moment")]
    title += meaning_of_brackets(records, *(f"{half}_determinate" for half in halves))
    made = table(title, columns)
    for record in records:
        values = [v if isinstance(v, str) else number(v) for v in (record[key] for key in keys)]
        made.add_row(
            *(text(v) for v in values),
            record["outcome"],
            bracketed({halves[0]: float("nan")} | record, halves[0]),
            text(record.get("force_joint", "")),
            bracketed({halves[1]: float("nan")} | record, halves[1]),
            text(record.get("moment_joint", "")),
        )
    return made
