"""The report's files, its claims, and the pieces behind them."""

import re
from html.parser import HTMLParser

import numpy as np
import pytest

import linkwise as lw
from linkwise import paper
from linkwise.paper import chains, spectra
from linkwise.paper.arm import DURATION, MANEUVERS, PAPER_PROTOCOL, run_maneuver

VOID = {"meta", "circle", "path", "rect", "br"}


class Checker(HTMLParser):
    """Every element is closed, and nothing is fetched from elsewhere."""

    def __init__(self):
        super().__init__()
        self.open, self.fetched, self.tags = [], [], set()

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        self.fetched += [value for name, value in attrs if name in ("src", "href")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.add(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_the_page_is_complete_and_self_contained(report, results):
    folder, _ = report
    assert sorted(path.name for path in folder.iterdir()) == [
        "index.html",
        "results.json",
        "tables.md",
    ]
    text = (folder / "index.html").read_text(encoding="utf-8")
    checker = Checker()
    checker.feed(text)
    assert checker.open == []
    assert checker.fetched == []
    assert "svg" in checker.tags
    assert "script" not in checker.tags
    assert not re.search(r"\bnan\b|\binf\b|None", text)
    assert text.count("<svg") == 3 * len(results["fig2"])


def test_the_tables_are_markdown_of_the_same_numbers(report, results):
    folder, _ = report
    text = (folder / "tables.md").read_text(encoding="utf-8")
    for line in text.splitlines():
        if line.startswith("| `") and " II " not in line:
            assert line.endswith(" |")
    for row in results["table2"]:
        assert f"`{row['method']}`" in text
    for claim in results["claims"]:
        assert claim["claim"] in text
    assert not re.search(r"\bnan\b|\binf\b|None", text)
    widths = [line.count(" | ") for line in text.splitlines() if line.startswith("| ")]
    assert min(widths) >= 2


def test_every_claim_has_a_verdict_and_a_figure(results):
    assert len(results["claims"]) == 20
    assert len({c["claim"] for c in results["claims"]}) == 20
    for claim in results["claims"]:
        assert claim["verdict"] in ("confirmed", "confirmed in part", "not confirmed")
        assert re.search(r"\d", claim["figure"])
    verdicts = {c["claim"].split(" (")[0]: c["verdict"] for c in results["claims"]}
    assert verdicts["Gauss-Seidel converges twice as fast as Jacobi"] == "confirmed"
    not_parallel = "Gauss-Seidel and SOR are not suitable for macroparallel work"
    assert verdicts[not_parallel] == "not confirmed"


def strip_times(value):
    """`value` without what is a time or follows from times."""
    if isinstance(value, dict):
        timed = ("seconds", "time_", "claims", "run_")
        return {k: strip_times(v) for k, v in value.items() if not any(t in k for t in timed)}
    if isinstance(value, list):
        return [strip_times(item) for item in value]
    return value


def test_results_depend_on_the_seed_alone_apart_from_times(results):
    steps = []
    again = paper.reproduce(quick=True, progress=steps.append)
    assert strip_times(again) == strip_times(results)
    assert [step.done for step in steps] == list(range(steps[0].total))
    assert all(step.what for step in steps)
    other = paper.reproduce(quick=True, seed=1)
    assert strip_times(other)["fig2"] != strip_times(results)["fig2"]
    assert strip_times(other)["table2"] == strip_times(results)["table2"]


def test_the_known_torques_of_the_stand_in():
    model = lw.scenes.srms_3l5d()
    known = {
        2.5: (1434.36, -269.245, -25.997, -0.997, 70.330),
        5.0: (-332.687, -84.312, 152.078, 17.644, -1.882),
        7.5: (-1171.35, 219.757, 3.676, -7.377, -61.717),
    }
    for time, torques in known.items():
        found = lw.inverse_dynamics(model, *MANEUVERS["II"].motion(time))
        np.testing.assert_allclose(found, torques, atol=5.1e-3)
    planar = lw.inverse_dynamics(model, *MANEUVERS["I"].motion(2.5))
    np.testing.assert_allclose(planar, (0, -248.335, -45.900, -1.568, 0), atol=5.1e-4)


def test_a_maneuver_ends_at_rest_where_it_says():
    for maneuver in MANEUVERS.values():
        q, v, a = maneuver.motion([0.0, DURATION])
        np.testing.assert_allclose(q, [maneuver.start, maneuver.end])
        np.testing.assert_allclose(v, 0, atol=1e-15)
        np.testing.assert_allclose(a, 0, atol=1e-15)
        step = 1e-4
        around, rate, change = maneuver.motion([4.0 - step, 4.0, 4.0 + step])
        np.testing.assert_allclose((around[2] - around[0]) / (2 * step), rate[1], atol=1e-8)
        np.testing.assert_allclose((rate[2] - rate[0]) / (2 * step), change[1], atol=1e-8)


def test_both_forms_of_conjugate_gradients_give_the_same_run():
    model = lw.scenes.srms_3l5d()
    two, three = (
        run_maneuver(
            model,
            MANEUVERS["II"],
            PAPER_PROTOCOL,
            solver="conjugate_gradient",
            solver_options={"form": form},
        )
        for form in ("two_term", "three_term")
    )
    assert two["mean_iterations"] == pytest.approx(three["mean_iterations"], abs=0.2)
    # What the stop test leaves differs in its last bits, and the steps follow it.
    assert two["final_error"] == pytest.approx(three["final_error"], abs=1e-4)


def test_table_1_computed_in_numpy_takes_as_many_iterations_as_the_core():
    for maneuver in MANEUVERS.values():
        system = spectra.system_at(maneuver, 3.0)
        model = lw.scenes.srms_3l5d()
        q, v, a = maneuver.motion(3.0)
        core = lw.ConstraintSystem(model, q, v, lw.inverse_dynamics(model, q, v, a))
        _, report = core.solve(
            "conjugate_gradient",
            tolerance=1e-7,
            stop="residual",
            solver_options={"form": "three_term"},
        )
        assert report.iterations == spectra.three_term(system, 1e-7, printed=False)


def test_power_laws_are_fitted_and_followed_as_far_as_they_hold():
    sizes = (2, 4, 8, 16, 32, 64)
    law = chains.fit_exponent(sizes, [3 * n**1.5 for n in sizes])
    assert law == pytest.approx((1.5, 3.0))
    bent = [3 * n**1.5 * (1 if n <= 32 else 2) for n in sizes]
    assert chains.range_of_fit(sizes, bent, law) == (2, 32)
    assert chains.local_exponents(sizes, bent) == pytest.approx([1.5] * 4 + [2.5])


def test_parallel_time_is_that_of_the_equations():
    assert chains.parallel_time(10.0, 2.0, 4, 1.0) == 4.0
    assert chains.parallel_time(10.0, 2.0, 4, 1.3) == pytest.approx(4.6)
