"""The report's tables as Markdown, for documents and diffs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from linkwise.paper.report import number

Results = Mapping[str, Any]


def _markdown(title: str, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [f"## {title}", "", "| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def _pairs(rows: Sequence[Mapping[str, Any]], keys: Sequence[str]) -> list[tuple[Any, ...]]:
    """(values of `keys`, row of maneuver I, row of maneuver II)."""
    found: dict[tuple[str, ...], dict[str, Any]] = {}
    for row in rows:
        found.setdefault(tuple(row[key] for key in keys), {})[row["maneuver"]] = row
    return [(key, pair["I"], pair["II"]) for key, pair in found.items()]


def _both(one: Mapping[str, Any], two: Mapping[str, Any], key: str) -> str:
    return " / ".join(
        number(row[key]) if row["outcome"] == "converged" else row["outcome"] for row in (one, two)
    )


def _table2(results: Results, protocol: str, title: str) -> str:
    rows = [row for row in results["table2"] if row["protocol"] == protocol]
    keys = ("mean_iterations", "max_iterations", "evaluations", "final_error")
    return _markdown(
        title,
        ("method", "mean iterations I / II", "most", "evaluations", "error at T [rad]", "[TOL]"),
        [
            (
                f"`{name}`",
                *(_both(one, two, key) for key in keys),
                _both(one, two, "weighted_final_error"),
            )
            for (name,), one, two in _pairs(rows, ("method",))
        ],
    )


def _spread(results: Results) -> str:
    keys = ("least_mean_iterations", "most_mean_iterations", "stand_in_mean_iterations")
    return _markdown(
        "Counts at tolerances within 5 %",
        ("method", "maneuver", "least", "most", "stand-in elsewhere"),
        [
            (f"`{row['method']}`", row["maneuver"], *(number(row[key]) for key in keys))
            for row in results["spread"]
        ],
    )


def _warm_start(results: Results) -> str:
    keys = ("method", "stop", "initial_guess")
    return _markdown(
        "Warm starts",
        ("method", "stop", "guess", "mean iterations I / II", "evaluations", "error at T [rad]"),
        [
            (
                *(f"`{part}`" for part in names),
                *(_both(one, two, k) for k in ("mean_iterations", "evaluations", "final_error")),
            )
            for names, one, two in _pairs(results["warm_start"], keys)
        ],
    )


def _stop_tests(results: Results) -> str:
    keys = ("mean_iterations", "median_error_over_tolerance", "max_error_over_tolerance")
    return _markdown(
        "Stop tests: true error, in the A-norm against the direct solution, over eps",
        ("method", "maneuver", "guess", "stop", "mean iterations", "median", "largest"),
        [
            (
                f"`{row['method']}`",
                row["maneuver"],
                f"`{row['initial_guess']}`",
                f"`{row['stop']}`",
                *(number(row[key]) for key in keys),
            )
            for row in results["stop_tests"]
        ],
    )


def _fig2(results: Results) -> str:
    return _markdown(
        "Figure 2: powers of N",
        ("chain", "time", "paper", "holds on N", "iterations", "recursive"),
        [
            (
                record["kind"],
                f"{record['time_exponent']:.2f}",
                str(record["time_exponent_published"]),
                "{} to {}".format(*record["time_exponent_holds"]),
                f"{record['iteration_exponent']:.2f}",
                f"{record['time_exponent_recursive']:.2f}",
            )
            for record in results["fig2"]
        ],
    )


def _claims(results: Results) -> str:
    return _markdown(
        "Claims",
        ("claim", "verdict", "what we find"),
        [(c["claim"], c["verdict"], c["figure"].replace("|", "\\|")) for c in results["claims"]],
    )


def tables(results: Results) -> str:
    """All tables, one after the other; times are left to results.json."""
    parts = [
        "# The 1993 paper, computed again",
        "",
        f"`linkwise paper{' --quick' if results['quick'] else ''} --seed {results['seed']} -o DIR` "
        f"on {results['made_by']['machine']}, {results['run_seconds']:.0f} s. The page "
        "`index.html` explains each table; `results.json` holds every number.",
        "",
        _claims(results),
        _table2(results, "paper", "Table 2: the paper's protocol"),
        _spread(results),
        _table2(results, "ours", "Table 2: our guess and stop test"),
        _table2(results, "tight", "Table 2: as accurate as the direct solution, eps = 3e-9"),
        _warm_start(results),
        _stop_tests(results),
        _fig2(results),
    ]
    return "\n".join(parts)
