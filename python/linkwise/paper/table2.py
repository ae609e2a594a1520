"""Table 2: the arm's two maneuvers by every method, under the paper's protocol and under ours."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from linkwise import _core, scenes
from linkwise.paper.arm import (
    MANEUVERS,
    OUR_PROTOCOL,
    PAPER_PROTOCOL,
    TIGHT_PROTOCOL,
    Protocol,
    run_maneuver,
)
from linkwise.paper.published import STAND_IN_MEAN_ITERATIONS, TABLE_2

# Runs shorter than this are repeated for a better time.
_SHORT_RUN = 0.3
_REPEATS = 7


def contestants() -> Iterator[tuple[str, str, Protocol]]:
    """(method, solver, protocol): the paper's five schemes first, then everything else."""
    solvers = {entry["name"]: entry for entry in _core.solvers()}
    paper_first = [*TABLE_2, *(name for name in solvers if name not in TABLE_2)]
    for name in paper_first:
        yield "constraint_force", name, PAPER_PROTOCOL
    for entry in _core.methods():
        if entry["name"] != "constraint_force" and _takes_the_arm(entry["name"]):
            yield entry["name"], "auto", PAPER_PROTOCOL
    for protocol in (OUR_PROTOCOL, TIGHT_PROTOCOL):
        for name in paper_first:
            if solvers[name]["kind"] == "iterative":
                yield "constraint_force", name, protocol


def _takes_the_arm(method: str) -> bool:
    """Some methods are for certain mechanisms only."""
    try:
        _core.DynamicsMethod(scenes.srms_3l5d(), method=method)
    except _core.InputError:
        return False
    return True


def table2(advance: Callable[[str], None]) -> list[dict[str, Any]]:
    """One row per method, maneuver and protocol; `advance` is called before each of them starts."""
    model = scenes.srms_3l5d()
    kinds = {entry["name"]: entry["kind"] for entry in _core.solvers()}
    rows = []
    for method, solver, protocol in contestants():
        name = solver if method == "constraint_force" else method
        for column, maneuver in enumerate(MANEUVERS.values()):
            advance(f"table 2: {name}, maneuver {maneuver.name}, {protocol.name} protocol")
            row = run_maneuver(model, maneuver, protocol, method=method, solver=solver)
            if row["seconds"] < _SHORT_RUN:
                row = run_maneuver(
                    model, maneuver, protocol, method=method, solver=solver, repeats=_REPEATS
                )
            row["kind"] = kinds.get(name, "recursive")
            row["published"] = _published(name, column) if protocol is PAPER_PROTOCOL else None
            rows.append(row)
    return rows


def count() -> int:
    """How often `advance` will be called."""
    return len(MANEUVERS) * sum(1 for _ in contestants())


def _published(name: str, column: int) -> dict[str, Any] | None:
    """The paper's figures for its own arm, and the stand-in's from elsewhere."""
    if name not in TABLE_2:
        return None
    row = TABLE_2[name]
    return {
        "name": row.name,
        "accuracy_percent": row.accuracy_percent[column],
        "mean_iterations": row.mean_iterations[column],
        "seconds": row.seconds[column],
        "stand_in_mean_iterations": STAND_IN_MEAN_ITERATIONS[name][column],
    }
