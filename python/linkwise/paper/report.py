"""The report: one HTML file with tables and inline SVG, from the results alone."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

from linkwise.paper import notes
from linkwise.plot.charts import Axis, Chart, Line, to_svg

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; max-width: 62rem; margin: 2rem auto;
       padding: 0 1rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.25rem; margin-top: 2.2rem; }
table { border-collapse: collapse; font-size: 13px; margin: .6rem 0; }
th, td { padding: .2rem .55rem; border-bottom: 1px solid #e4e4e4; text-align: right; }
th { border-bottom: 2px solid #999; } td:first-child, th:first-child { text-align: left; }
td.left, th.left { text-align: left; }
.note { color: #555; font-size: 13px; } .scroll { overflow-x: auto; }
.yes { color: #1b7f4d; } .part { color: #8a6d00; } .no { color: #b3321d; }
svg { max-width: 100%; height: auto; }
"""
_VERDICT_CLASS = {"confirmed": "yes", "confirmed in part": "part", "not confirmed": "no"}


def number(value: Any, digits: int = 3) -> str:
    if value is None:
        return ""
    if isinstance(value, (int, str)):
        return str(value)
    if not math.isfinite(value):
        return "-"
    if 10**digits <= abs(value) < 1e5:
        return f"{value:.0f}"
    return f"{value:.{digits}g}" if abs(value) < 1e5 else f"{value:.{digits - 1}e}"


def _iterations(value: float) -> str:
    return f"{value:.1f}" if value < 100 else f"{value:.0f}"


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]], left: Iterable[int] = (0,)) -> str:
    at_left = set(left)

    def cells(tag: str, values: Sequence[str]) -> str:
        return "".join(
            f"<{tag}{' class=left' if i in at_left else ''}>{v}</{tag}>"
            for i, v in enumerate(values)
        )

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    head = f"<tr>{cells('th', [escape(h) for h in heads])}</tr>"
    return f'<div class="scroll"><table><thead>{head}</thead><tbody>{body}</tbody></table></div>'


def _pair(rows: Sequence[Mapping[str, Any]], key: str, text: Any = number) -> str:
    """The values of maneuvers I and II, as the paper prints them."""
    values = [
        text(row[key]) if row["outcome"] == "converged" else escape(row["outcome"]) for row in rows
    ]
    return " / ".join(values)


def _by_method(
    results: Mapping[str, Any], protocol: str
) -> list[tuple[str, list[Mapping[str, Any]]]]:
    grouped: dict[str, list[Mapping[str, Any]]] = {}
    for row in results["table2"]:
        if row["protocol"] == protocol:
            grouped.setdefault(row["method"], []).append(row)
    return list(grouped.items())


def _milliseconds(seconds: float) -> str:
    return number(1e3 * seconds)


def _published_cells(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    if rows[0]["published"] is None:
        return ["", "", "", ""]
    known = [row["published"] for row in rows]
    return [
        " / ".join(str(p["mean_iterations"]) for p in known),
        " / ".join(number(p["stand_in_mean_iterations"]) for p in known),
        " / ".join(number(p["seconds"]) for p in known),
        " / ".join(number(p["accuracy_percent"]) for p in known),
    ]


def _table2_paper(results: Mapping[str, Any]) -> str:
    rows = [
        [
            escape(name),
            _pair(pair, "mean_iterations", _iterations),
            _pair(pair, "max_iterations"),
            _pair(pair, "seconds", _milliseconds),
            _pair(pair, "accuracy_percent"),
            *_published_cells(pair),
        ]
        for name, pair in _by_method(results, "paper")
    ]
    heads = (
        "method",
        "mean iterations I / II",
        "most",
        "time [ms]",
        "accuracy [%]",
        "paper: iterations",
        "stand-in elsewhere",
        "paper: CPU [s]",
        "paper: accuracy [%]",
    )
    return _table(heads, rows)


def _spread(results: Mapping[str, Any]) -> str:
    rows = []
    for one, two in zip(results["spread"][::2], results["spread"][1::2], strict=True):
        spans = [
            f"{_iterations(row['least_mean_iterations'])} to "
            f"{_iterations(row['most_mean_iterations'])}"
            for row in (one, two)
        ]
        known = [number(row["stand_in_mean_iterations"]) for row in (one, two)]
        others = [
            " / ".join(
                _iterations(row["mean_iterations"])
                for row in results["other_codes"]
                if (row["code"], row["method"]) == (code, one["method"])
            )
            for code in ("vode", "lsoda")
        ]
        rows.append([escape(one["method"]), " / ".join(spans), " / ".join(known), *others])
    heads = (
        "method",
        "mean iterations I / II",
        "stand-in elsewhere",
        "VODE, calls",
        "LSODA, calls",
    )
    return _table(heads, rows)


def _table2_of(results: Mapping[str, Any], protocol: str) -> str:
    rows = [
        [
            escape(name),
            _pair(pair, "mean_iterations", _iterations),
            _pair(pair, "max_iterations"),
            _pair(pair, "evaluations"),
            _pair(pair, "seconds", _milliseconds),
            _pair(pair, "accuracy_percent"),
            _pair(pair, "weighted_final_error"),
        ]
        for name, pair in _by_method(results, protocol)
    ]
    heads = (
        *("method", "mean iterations I / II", "most", "evaluations", "time [ms]"),
        *("accuracy [%]", "error [TOL]"),
    )
    return _table(heads, rows)


def _end_point(results: Mapping[str, Any]) -> str:
    """How far the methods end from the known end point, in units of the tolerance."""

    def span(protocol: str, kinds: Sequence[str]) -> str:
        found = [
            row["weighted_final_error"]
            for row in results["table2"]
            if row["protocol"] == protocol and row["kind"] in kinds
        ]
        return f"{min(found):.1f} to {max(found):.1f}"

    return (
        "<p>Distance from the known end point in the norm of the integrator's error test, in units "
        f"of TOL, over both maneuvers: direct solvers {span('paper', ['direct'])}; iterative ones "
        f"{span('paper', ['iterative'])} under the paper's protocol, "
        f"{span('ours', ['iterative'])} under ours, {span('tight', ['iterative'])} under ours with "
        "eps = 3e-9.</p>"
    )


def _fig2(record: Mapping[str, Any]) -> str:
    n = record["bodies"]
    fitted = [record["time_factor"] * x ** record["time_exponent"] * 1e6 for x in n]

    def micro(key: str) -> list[float]:
        return [1e6 * s for s in record[key]]

    times = Chart(
        f"(a) Time of a solution: {record['kind']}",
        Axis("bodies N", log=True),
        Axis("time [us]", log=True),
        (
            Line("J-CG, paper's protocol", n, micro("jcg_seconds")),
            Line(f"N^{record['time_exponent']:.2f}", n, fitted, dashed=True, markers=False),
            Line("recursive (R)", n, micro("recursive_seconds")),
            Line("block Thomas", n, micro("thomas_seconds")),
            Line("two-level CG, projection", n, micro("best_seconds")),
        ),
    )
    iterations = Chart(
        f"(b) Iterations: {record['kind']}",
        Axis("bodies N", log=True),
        Axis("iterations", log=True),
        (
            Line("J-CG, mean", n, record["jcg_mean_iterations"]),
            Line("J-CG, most", n, record["jcg_max_iterations"]),
            Line("dim A", n, record["unknowns"], dashed=True, markers=False),
            Line("two-level CG, mean", n, record["best_mean_iterations"]),
        ),
    )
    first, last = record["time_exponent_holds"]
    text = (
        f"Time of J-CG ~ N<sup>{record['time_exponent']:.2f}</sup>, fitted on N = "
        f"{record['fitted_on'][0]} to {record['fitted_on'][1]} (paper: "
        f"{record['time_exponent_published']}); every point from N = {first} to {last} lies "
        f"within 15 % of it. Iterations ~ N<sup>{record['iteration_exponent']:.2f}</sup>. "
        f"Recursive method ~ N<sup>{record['time_exponent_recursive']:.2f}</sup>."
    )
    heads = (
        *("N", "dim A", "J-CG mean", "most", "J-CG [us]", "R [us]", "block Thomas [us]"),
        *("two-level mean", "two-level [us]", "error J-CG", "error two-level", "error Thomas"),
    )
    rows = [
        [
            str(n[i]),
            str(record["unknowns"][i]),
            _iterations(record["jcg_mean_iterations"][i]),
            str(record["jcg_max_iterations"][i]),
            *(number(1e6 * record[f"{k}_seconds"][i]) for k in ("jcg", "recursive", "thomas")),
            _iterations(record["best_mean_iterations"][i]),
            number(1e6 * record["best_seconds"][i]),
            *(number(record[f"{k}_acceleration_error"][i], 2) for k in ("jcg", "best", "thomas")),
        ]
        for i in range(len(n))
    ]
    return (
        f"<h3>{escape(record['kind'])}</h3><p>{text}</p>"
        + to_svg(times)
        + to_svg(iterations)
        + _table(heads, rows)
    )


def _fig3(record: Mapping[str, Any]) -> str:
    n = record["bodies"]

    def micro(key: str) -> list[float]:
        return [1e6 * s for s in record[key]]

    return to_svg(
        Chart(
            f"Estimated parallel time: {record['kind']}",
            Axis("bodies N = processors", log=True),
            Axis("time [us]", log=True),
            (
                Line("T_CPU, J-CG on one processor", n, micro("one_processor_seconds")),
                Line("T_P,i, eq. (20)", n, micro("parallel_ideal_seconds"), dashed=True),
                Line("T_P,r, eq. (21)", n, micro("parallel_realistic_seconds")),
                Line(
                    "T_P,r, joint coordinates as state",
                    n,
                    micro("parallel_realistic_joint_state_seconds"),
                ),
                Line("T_R, recursive on one processor", n, micro("recursive_seconds")),
                Line("T_serial", n, micro("serial_seconds"), dashed=True),
            ),
        )
    )


def _warm_start(results: Mapping[str, Any]) -> str:
    grouped: dict[tuple[str, str, str], list[Mapping[str, Any]]] = {}
    for row in results["warm_start"]:
        grouped.setdefault((row["method"], row["stop"], row["initial_guess"]), []).append(row)
    rows = [
        [
            *(escape(part) for part in key),
            _pair(pair, "mean_iterations", _iterations),
            _pair(pair, "evaluations"),
            _pair(pair, "final_error"),
        ]
        for key, pair in grouped.items()
    ]
    heads = ("method", "stop", "guess", "mean iterations I / II", "evaluations", "error at T [rad]")
    return _table(heads, rows, left=(0, 1, 2))


def _stop_tests(results: Mapping[str, Any]) -> str:
    rows = [
        [
            escape(row["method"]),
            row["maneuver"],
            escape(row["initial_guess"]),
            escape(row["stop"]),
            _iterations(row["mean_iterations"]),
            number(row["median_error_over_tolerance"], 2),
            number(row["max_error_over_tolerance"], 2),
        ]
        for row in results["stop_tests"]
    ]
    heads = ("method", "maneuver", "guess", "stop", "mean iterations", "error / eps", "largest")
    return _table(heads, rows, left=(0, 1, 2, 3))


def _state_choice(results: Mapping[str, Any]) -> str:
    rows = [
        [
            escape(row["method"]),
            row["maneuver"],
            escape(row["state"].replace("_", " ")),
            number(row["final_error"], 2),
            number(row["greatest_drift"], 2),
            str(row["evaluations"]),
        ]
        for row in results["state_choice"]
    ]
    heads = ("method", "maneuver", "state", "error at T [rad]", "drift [m/s, rad/s]", "evaluations")
    return _table(heads, rows, left=(0, 1, 2))


def _claims(results: Mapping[str, Any]) -> str:
    rows = [
        [
            escape(c["claim"]),
            f'<span class="{_VERDICT_CLASS[c["verdict"]]}">{escape(c["verdict"])}</span>',
            escape(c["figure"]),
        ]
        for c in results["claims"]
    ]
    return _table(("claim", "verdict", "what we find"), rows, left=(0, 1, 2))


def render(results: Mapping[str, Any]) -> str:
    """The whole page."""
    made = results["made_by"]
    heading = (
        "An iterative approach to multibody simulation dynamics: the 1993 paper, computed again"
    )
    parts = [
        "<!doctype html><html lang=en><head><meta charset=utf-8>",
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{heading}</title><style>{_STYLE}</style></head><body><h1>{heading}</h1>",
        notes.INTRODUCTION,
        f'<p class="note">linkwise {escape(made["version"])}, core {escape(made["cpu_target"])}, '
        f"{escape(made['machine'])}, {'quick' if results['quick'] else 'full'} run, seed "
        f"{results['seed']}, {results['run_seconds']:.0f} s.</p>",
        "<h2>Claims</h2>",
        _claims(results),
        "<h2>Table 2: the paper's protocol</h2>",
        _table2_paper(results),
        notes.TABLE2_NOTE,
        "<h3>What of the counts is chance</h3>",
        _spread(results),
        notes.SPREAD_NOTE,
        "<h2>Table 2: our guess and stop test</h2>",
        _table2_of(results, "ours"),
        notes.OURS_NOTE,
        "<h3>As accurate as the direct solution</h3>",
        _table2_of(results, "tight"),
        notes.TIGHT_NOTE,
        _end_point(results),
        "<h2>Figure 2: cost against the number of bodies</h2>",
        notes.FIG2_NOTE,
        *(_fig2(record) for record in results["fig2"]),
        "<h2>Figure 3: estimated parallel time</h2>",
        notes.FIG3_NOTE,
        *(_fig3(record) for record in results["fig3"]),
        "<h2>Warm starts</h2>",
        _warm_start(results),
        "<h2>The state: joint rates or the bodies' own velocities</h2>",
        _state_choice(results),
        "<h2>Stop tests: true error over eps</h2>",
        '<p class="note">A-norm error of the constraint forces against the direct solution, '
        "relative to them and divided by eps = 1e-7: median and largest along each maneuver.</p>",
        _stop_tests(results),
        "</body></html>\n",
    ]
    return "".join(parts)
