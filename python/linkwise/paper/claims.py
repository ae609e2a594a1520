"""The paper's claims one by one, each judged by figures measured here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from linkwise.paper.published import TABLE_2

CONFIRMED = "confirmed"
IN_PART = "confirmed in part"
NOT_CONFIRMED = "not confirmed"

Results = Mapping[str, Any]


def _table2(results: Results, method: str, maneuver: str, protocol: str = "paper") -> Any:
    for row in results["table2"]:
        key = (row["method"], row["maneuver"], row["protocol"])
        if key == (method, maneuver, protocol):
            return row
    raise KeyError((method, maneuver, protocol))


def _both(results: Results, method: str, key: str, protocol: str = "paper") -> tuple[Any, Any]:
    return tuple(_table2(results, method, m, protocol)[key] for m in ("I", "II"))


def _judge(whole: bool, part: bool = False) -> str:
    return CONFIRMED if whole else IN_PART if part else NOT_CONFIRMED


def _best_of_five(results: Results) -> tuple[str, str]:
    its = {name: _both(results, name, "mean_iterations") for name in TABLE_2}
    seconds = {name: _both(results, name, "seconds") for name in TABLE_2}
    fewest = [min(its, key=lambda name: its[name][k]) for k in (0, 1)]
    fastest = [min(seconds, key=lambda name: seconds[name][k]) for k in (0, 1)]
    thomas = _both(results, "thomas", "seconds")
    jcg = seconds["conjugate_gradient"]
    verdict = _judge({*fewest, *fastest} == {"conjugate_gradient"}, fewest[1] == fastest[1])
    return verdict, (
        f"fewest iterations in I: {fewest[0]}, in II: {fewest[1]}; shortest time in I: "
        f"{fastest[0]}, in II: {fastest[1]}. Among all methods it is not: block Thomas takes "
        f"{thomas[0] / jcg[0]:.2f} and {thomas[1] / jcg[1]:.2f} of its time."
    )


def _little_variation(results: Results) -> tuple[str, str]:
    spread = []
    for k, maneuver in enumerate(("I", "II")):
        times = [_both(results, name, "seconds")[k] for name in TABLE_2]
        spread.append((maneuver, max(times) / min(times)))
    text = ", ".join(f"{m}: slowest over fastest {x:.1f}" for m, x in spread)
    published = "the paper's own times: 1.4 and 53"
    return _judge(spread[0][1] < 2, spread[1][1] > 5 * spread[0][1]), f"{text} ({published})"


def _radius_reason(results: Results) -> tuple[str, str]:
    one, two = results["spectra"]
    same = abs(one["radius_greatest"] - two["radius_greatest"]) < 0.01
    return _judge(not same), (
        f"the radius is as close to 1 in I, up to {one['radius_greatest']:.4f}, as in II, up to "
        f"{two['radius_greatest']:.4f}; but the planar motion of I leaves the slow modes, out of "
        f"its plane, at rest: the slowest it excites has {one['excited_radius_greatest']:.3f} "
        f"(II: {two['excited_radius_greatest']:.4f})"
    )


def _gauss_seidel_rate(results: Results) -> tuple[str, str]:
    worst = 0.0
    for row in results["spectra"]:
        at = row["half_way"]
        worst = max(worst, abs(at["gauss_seidel"] - at["jacobi"] ** 2))
    jacobi = _both(results, "jacobi", "mean_iterations")
    gs = _both(results, "gauss_seidel", "mean_iterations")
    ratios = jacobi[0] / gs[0], jacobi[1] / gs[1]
    return _judge(worst < 1e-10), (
        f"spectral radius of Gauss-Seidel = that of Jacobi squared to {worst:.0e}; in the "
        f"simulations Jacobi takes {ratios[0]:.1f} and {ratios[1]:.1f} times the iterations"
    )


def _not_parallel(results: Results) -> tuple[str, str]:
    gap = max(
        abs(row["half_way"][a] - row["half_way"][b])
        for row in results["spectra"]
        for a, b in (
            ("gauss_seidel", "red_black_gauss_seidel"),
            ("sor", "red_black_sor"),
        )
    )
    plain = _both(results, "gauss_seidel", "mean_iterations")
    coloured = _both(results, "red_black_gauss_seidel", "mean_iterations")
    return _judge(gap > 1e-6), (
        f"with every second joint at once (red-black) the spectral radii are the same to {gap:.0e}"
        f", iterations {coloured[0]:.1f} and {coloured[1]:.0f} against {plain[0]:.1f} and "
        f"{plain[1]:.0f}: two parallel half-sweeps an iteration"
    )


def _chebyshev(results: Results) -> tuple[str, str]:
    chebyshev = _both(results, "chebyshev", "mean_iterations")
    gs = _both(results, "gauss_seidel", "mean_iterations")
    close = [max(c / g, g / c) < 2 for c, g in zip(chebyshev, gs, strict=True)]
    return _judge(all(close), any(close)), (
        f"iterations of J-SI with the exact radius {chebyshev[0]:.0f} and {chebyshev[1]:.0f}, of "
        f"Gauss-Seidel {gs[0]:.0f} and {gs[1]:.0f}: its polynomial damps all modes alike, which "
        "costs where the slow ones are at rest (I) and pays where they are not (II)"
    )


def _below_the_limit(results: Results) -> tuple[str, str]:
    shares = []
    for record in results["fig2"]:
        pairs = zip(
            record["bodies"], record["jcg_mean_iterations"], record["unknowns"], strict=True
        )
        share = max((its / dim, n) for n, its, dim in pairs)
        shares.append(f"{record['kind']}: at most {share[0]:.2f} (N = {share[1]})")
    most = [
        max(np.array(record["jcg_mean_iterations"]) / record["unknowns"])
        for record in results["fig2"]
    ]
    return _judge(max(most) < 0.8, min(most) < 0.8), "mean iterations over dim A: " + "; ".join(
        shares
    )


def _similar_accuracy(results: Results) -> tuple[str, str]:
    errors = {name: _both(results, name, "accuracy_percent") for name in TABLE_2}
    thomas = _both(results, "thomas", "accuracy_percent")
    spread = [
        max(e[k] for e in errors.values()) / min(e[k] for e in errors.values()) for k in (0, 1)
    ]
    worst = max(errors, key=lambda name: errors[name][1])
    return _judge(max(spread) < 10, spread[0] < 10), (
        f"largest over smallest error {spread[0]:.1f} in I, {spread[1]:.1f} in II, where {worst} "
        f"ends {errors[worst][1]:.3f} % off against {thomas[1]:.4f} % of the direct solution: "
        "the paper's stop test sees changes, not errors"
    )


def _tolerance_ratio(results: Results) -> tuple[str, str]:
    rows = [r for r in results["tolerance_ratios"] if r["maneuver"] == "II"]
    parts = [
        f"{r['ratio']:g}: {r['evaluations']} evaluations, "
        f"{r['mean_iterations'] * r['evaluations']:.0f} iterations, error {r['final_error']:.0e}"
        for r in rows
    ]
    work = {r["ratio"]: r["mean_iterations"] * r["evaluations"] for r in rows}
    cheapest = min(work, key=lambda ratio: work[ratio])
    return _judge(cheapest == 0.1, cheapest < 1), "J-CG in II, eps/TOL = " + "; ".join(parts)


def _stop_test(results: Results) -> tuple[str, str]:
    slow = [
        r
        for r in results["stop_tests"]
        if r["stop"] == "paper" and r["initial_guess"] == "cubic" and r["maneuver"] == "II"
    ]
    parts = [f"{r['method']} {r['median_error_over_tolerance']:.2g}" for r in slow]
    worst = max(r["median_error_over_tolerance"] for r in slow)
    return _judge(worst < 2, True), (
        "true error over eps in II (median, A-norm): " + ", ".join(parts) + "; in long chains it "
        "is far more (figure 2, acceleration error)"
    )


def _cubic_guess(results: Results) -> tuple[str, str]:
    rows = [
        r
        for r in results["warm_start"]
        if r["method"] == "conjugate_gradient" and r["stop"] == "paper"
    ]
    its = {
        guess: tuple(
            next(
                r["mean_iterations"]
                for r in rows
                if r["initial_guess"] == guess and r["maneuver"] == maneuver
            )
            for maneuver in ("I", "II")
        )
        for guess in dict.fromkeys(r["initial_guess"] for r in rows)
    }
    text = "; ".join(f"{guess} {a:.1f} and {b:.1f}" for guess, (a, b) in its.items())
    better = all(c < z for c, z in zip(its["cubic"], its["zero"], strict=True))
    best = min(its, key=lambda guess: sum(its[guess]))
    return _judge(best == "cubic", better), f"iterations of J-CG in I and II: {text}"


def _exponent(index: int) -> Callable[[Results], tuple[str, str]]:
    def judge(results: Results) -> tuple[str, str]:
        record = results["fig2"][index]
        found, published = record["time_exponent"], record["time_exponent_published"]
        low, high = record["fitted_on"]
        first, last = record["time_exponent_holds"]
        local = record["time_exponents_local"][-3:]
        return _judge(abs(found - published) < 0.1, abs(found - published) < 0.2), (
            f"{record['kind']}: N^{found:.2f} fitted on N = {low} to {high}, within 15 % from "
            f"N = {first} to {last}; local exponents at the long end "
            + ", ".join(f"{x:.2f}" for x in local)
        )

    return judge


def _recursive(results: Results) -> tuple[str, str]:
    exponents = [r["time_exponent_recursive"] for r in results["fig2"]]
    return _judge(max(exponents) < 1.1), "N^" + ", N^".join(f"{x:.2f}" for x in exponents)


def _marginal_growth(results: Results) -> tuple[str, str]:
    parts, growth = [], []
    for record in results["fig3"]:
        times, bodies = record["parallel_realistic_seconds"], record["bodies"]
        upto = max(i for i, n in enumerate(bodies) if n <= 16)
        growth.append(times[upto] / times[0])
        parts.append(f"{record['kind']} {growth[-1]:.1f}")
    return _judge(max(growth) < 2, min(growth) < 3), (
        f"T_P,r from N = {bodies[0]} to {bodies[upto]} grows by: " + "; ".join(parts)
    )


def _speed_up(results: Results) -> tuple[str, str]:
    parts, wins = [], []
    for record in results["fig3"]:
        ratio = np.array(record["recursive_seconds"]) / record["parallel_realistic_seconds"]
        ahead = [n for n, r in zip(record["bodies"], ratio, strict=True) if r > 1]
        wins.append(bool(ahead))
        parts.append(
            f"{record['kind']}: T_R / T_P,r = {ratio[0]:.2f} at N = {record['bodies'][0]}, "
            f"{ratio[-1]:.2f} at {record['bodies'][-1]}"
            + (f", ahead from N = {ahead[0]}" if ahead else ", never ahead")
        )
    return _judge(all(wins), any(wins)), "; ".join(parts)


def _table_1(results: Results) -> tuple[str, str]:
    rows = results["printed_formula"]
    parts = [
        f"{r['maneuver']}: {r['derived']} iterations with (z, A z), "
        + (f"{r['printed']}" if r["printed"] < r["limit"] else f"more than {r['limit']}")
        + " as printed"
        for r in rows
    ]
    return _judge(all(r["printed"] == r["derived"] for r in rows)), "; ".join(parts)


def _direct(results: Results) -> tuple[str, str]:
    thomas, cyclic = (_both(results, n, "seconds") for n in ("thomas", "cyclic_reduction"))
    return NOT_CONFIRMED, (
        "cyclic reduction eliminates every second joint at once, log2 N times; on the arm's three "
        f"joints the runs take {1e3 * cyclic[0]:.2g} and {1e3 * cyclic[1]:.2g} ms against "
        f"{1e3 * thomas[0]:.2g} and {1e3 * thomas[1]:.2g} ms of block Thomas"
    )


def _state(results: Results) -> tuple[str, str]:
    rows = results["state_choice"]
    parts = []
    for own in (r for r in rows if r["state"] == "body_velocities"):
        joint = next(
            r
            for r in rows
            if r["state"] == "joint_rates"
            and (r["method"], r["maneuver"]) == (own["method"], own["maneuver"])
        )
        parts.append(
            f"{own['method']}, {own['maneuver']}: {own['final_error']:.0e} rad off at T against "
            f"{joint['final_error']:.0e} with joint rates, {own['evaluations']} evaluations "
            f"against {joint['evaluations']}, joints part by up to {own['greatest_drift']:.0e} m/s"
        )
    drifts = [r["greatest_drift"] for r in rows]
    return _judge(max(drifts) < 1e-5, max(drifts) < 1e-2), "; ".join(parts)


CLAIMS: tuple[tuple[str, Callable[[Results], tuple[str, str]]], ...] = (
    ("J-CG is the most efficient of the five schemes (section 6)", _best_of_five),
    (
        "Times differ little in Maneuver I and radically in II (section 6)",
        _little_variation,
    ),
    (
        "II is slow because the spectral radius is very close to 1 on that trajectory (section 6)",
        _radius_reason,
    ),
    ("Gauss-Seidel converges twice as fast as Jacobi (section 4)", _gauss_seidel_rate),
    (
        "Gauss-Seidel and SOR are not suitable for macroparallel work (section 4)",
        _not_parallel,
    ),
    ("J-SI is generally comparable to Gauss-Seidel (section 4)", _chebyshev),
    ("Table 1's J-CG, gamma with (z, z) in its denominator", _table_1),
    ("Direct solvers are essentially sequential (section 4)", _direct),
    ("All schemes provide similar accuracy (section 6)", _similar_accuracy),
    ("eps = TOL/10 gives the best overall performance (section 5)", _tolerance_ratio),
    ("The relative change tells the error of the solution (section 5)", _stop_test),
    ("The cubic extrapolation is a reasonable initial guess (section 5)", _cubic_guess),
    (
        "J-CG needs considerably fewer iterations than the dimension of A (section 6)",
        _below_the_limit,
    ),
    ("Time of J-CG ~ N^1.12, one degree of freedom per joint, planar chain", _exponent(0)),
    ("Time of J-CG ~ N^1.12, one degree of freedom per joint, spatial chain", _exponent(1)),
    ("Time of J-CG ~ N^1.17, two degrees of freedom per joint", _exponent(2)),
    ("The recursive method is O(N) (section 6)", _recursive),
    ("T_P,r increases only marginally with N (section 6)", _marginal_growth),
    (
        "J-CG on N processors can outrun the recursive method on one (section 6)",
        _speed_up,
    ),
    (
        "Integrating the bodies' own velocities is a sound choice of the state (section 5)",
        _state,
    ),
)


def judge_all(results: Results) -> list[dict[str, str]]:
    """Every claim with its verdict and the figure behind it."""
    found = []
    for claim, judge in CLAIMS:
        verdict, figure = judge(results)
        found.append({"claim": claim, "verdict": verdict, "figure": figure})
    return found
