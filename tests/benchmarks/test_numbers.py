"""From turns to ratios, from points to times at an error, from rows to targets and tables."""

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks import timing
from benchmarks.cases.simulation import Point, give_up, time_at
from benchmarks.compiling import _flags
from benchmarks.engines.table import BY_NAME
from benchmarks.peers import Result, read, write
from benchmarks.report import cell, markdown, short_table, significant
from benchmarks.rows import Row, compare, settle
from benchmarks.sessions import CPP, FULL, PYTHON, Session, Workers
from benchmarks.targets import targets


def row(engine, samples=(), *, method="auto", case="single", n=7, arena=CPP, **more):
    made = Row(case, f"chain of {n}", n, engine, arena, method, **more)
    made.samples = list(samples)
    settle(made)
    return made


def test_ratios_are_of_medians_and_their_spread_is_of_turns():
    ours, world = row("linkwise", [100, 110, 300]), row("pinocchio", [330, 330, 930], method="w")
    local = row("pinocchio", [220, 220, 620], method="l")
    compare([ours, world, local], ours)
    assert ours.ratio == 1
    assert world.ratio == pytest.approx(330 / 110)
    assert local.ratio == pytest.approx(220 / 110)
    # The third turn was slow for all alike: the ratios of the turns hardly see it.
    assert local.ratio_spread == pytest.approx((np.mean([2, 620 / 300]), np.mean([2.2, 620 / 300])))
    assert ours.against_pinocchio == pytest.approx(220 / 110)
    assert world.against_pinocchio == pytest.approx(220 / 330)


def test_rows_without_turns_have_no_ratio():
    ours, failed = row("linkwise", [100]), row("dart", failure="takes more than 10 s")
    compare([ours, failed], ours)
    assert failed.ratio is None
    assert failed.ns_per_body is None
    assert cell(failed) == "failed"


def points(*pairs):
    return [
        Row("simulation", "arm", 7, "x", PYTHON, "m", figures={"error": e, "seconds": s})
        for e, s in pairs
    ]


def test_time_at_an_error_is_straight_in_logarithms():
    line = points((1e-4, 1.0), (1e-6, 10.0), (1e-8, 100.0))
    assert time_at(line, 1e-6) == pytest.approx(10)
    assert time_at(line, 1e-7) == pytest.approx(10 * 10**0.5)
    assert time_at(line, 1e-2) == 1.0  # more accurate than asked: never faster than measured
    assert time_at(line, 1e-9) is None


def test_points_that_another_one_beats_do_not_count():
    line = points((1e-4, 1.0), (1e-3, 5.0), (1e-8, 100.0), (1e-7, 300.0))
    assert time_at(line, 1e-6) == pytest.approx(10)


def test_what_fails_is_not_asked_for_more_accuracy():
    session, other = object(), object()
    points = [
        Point(Row("simulation", "arm", 7, "x", PYTHON, method), b, method, setting)
        for b, method, setting in [
            (session, "m", 1e-4),
            (session, "m", 1e-6),
            (session, "n", 1e-8),
            (other, "m", 1e-8),
            (session, "m", 1e-8),
            (session, "m", 1e-10),
        ]
    ]
    points[1].row.failure = "takes more than 20 s"
    points[4].seconds.append(1.0)
    give_up(points[1], points)
    found = [point.row.failure for point in points]
    assert found[5] == "not tried, for 1e-06 takes more than 20 s"
    assert found[0] == found[2] == found[3] == found[4] == ""


def test_memory_is_forecast_from_the_two_largest_sizes():
    workers = Workers(8 * 2**30, None, FULL, print)
    engine = BY_NAME["dart"]
    session = Session(workers, engine, PYTHON, None)
    workers._sizes[engine.name, PYTHON] = {30: 5, 100: 10_000_000, 300: 90_000_000}
    assert workers.forecast(engine, PYTHON, 3000) == pytest.approx(9e9, rel=1e-6)  # quadratic
    workers._sizes[engine.name, PYTHON][7] = 0  # a machine that took no page more
    workers._sizes[engine.name, PYTHON][310] = 0
    assert workers.forecast(engine, PYTHON, 3000) == pytest.approx(9e9, rel=1e-6)
    assert "would need 8 GiB" in session.too_big(3000)
    assert session.too_big(1000) == ""
    session.failed(1000)
    assert session.too_big(1000) == ""
    assert session.too_big(2000) == "not tried: 1,000 are too many already"
    workers.begin_family()
    assert session.too_big(3000) == ""


def everything():
    """The rows of an imaginary run, 4 and 2.5 times as fast as Pinocchio."""
    rows = []
    for n in (7, 30, 300, 1000, 3000):
        rows += [
            row("linkwise", [50.0], n=n),
            row("linkwise", [50.0], n=n, method="articulated_body"),
            row("linkwise", [80.0], n=n, method="constraint_force + thomas"),
            row("linkwise", [40.0], n=n, method="pieces"),
            row("linkwise", [350.0], n=n, arena=PYTHON),
            row("linkwise", [30.0], n=n, method="auto, no loads"),  # no match for what has loads
            row("linkwise", [130.0], n=n, method="auto, no loads", arena=PYTHON),
            row("pinocchio", [200.0], n=n, method="local"),
            row("pinocchio", [220.0], n=n, method="world"),
            row("drake", [2400.0], n=n, arena=PYTHON),
        ]
    rows += [
        row("linkwise", [500.0], case="memory", n=1000, arena=PYTHON),
        row("linkwise", [600.0], case="memory", n=100_000, arena=PYTHON),
    ]
    rows[-1].figures["bytes_per_body"] = 2100.0
    rows[-1].figures["build_seconds"] = rows[-2].figures["build_seconds"] = 0.5
    rows[-2].figures["bytes_per_body"] = 2500.0
    rows += [
        row("linkwise", [30.0], case="threads", n=1000, arena=PYTHON, method="2 threads", threads=2)
    ]
    rows[-1].figures.update(speedup=1.9, same_bits=True)
    for engine, slower in (("linkwise", 1), ("mujoco", 7)):
        for error, seconds in ((1e-5, 0.001), (1e-11, 0.1)):
            made = row(engine, case="simulation", arena=PYTHON)
            made.figures.update(error=error, seconds=seconds * slower, duration=1.0)
            rows.append(made)
    return rows


def test_targets_compare_what_they_say():
    found = {t.work: t for t in targets(everything())}

    def check(start, measured, reached):
        target = next(t for work, t in found.items() if work.startswith(start))
        assert target.measured == pytest.approx(measured)
        assert target.reached is reached

    check("one system, one core, N = 7, articulated_body", 4.0, True)
    check("one system, one core, N = 30, constraint_force", 2.5, True)
    check("one chain of 300", 5.0, False)  # the best of ours, "pieces", against Pinocchio's at 300
    check("one chain of 1,000", 60.0, True)
    check("a chain of 100,000, ns per body", 1.2, True)
    check("a chain of 100,000, memory", 2100.0, False)
    check("two threads on one chain of 1,000", 1.9, True)
    check("accelerations, loads and a report of a 7-joint arm from Python", 2.1, False)
    check("accelerations of a 7-joint arm from Python", 0.7, True)
    check("whole simulation of a chain of 7 to an error of 1e-08", 7.0, True)
    check('method "auto"', 1.25, False)
    missing = next(t for work, t in found.items() if work.startswith("a chain of 1,000,000"))
    assert missing.measured is None
    assert missing.reached is None


CONDITIONS = {
    "processor": "P",
    "cores": 2,
    "load_average": [0.1, 0.2, 0.3],
    "system": "Linux",
    "python": "3.11",
    "linkwise": "0.1",
    "cpu_target": "v3",
    "packages": {"pin": "4.1.0", "drake": None},
    "missing": ["dart"],
    "flags": {"linkwise": "c++ -O3"},
    "no_cpp": "",
    "memory_limit": 1,
}


def test_the_report_names_what_lost_what_failed_and_what_is_missing():
    rows = everything()
    rows.append(row("pinocchio", n=3000, failure="would need 80 GiB of memory"))
    rows.append(Row("robots", "iiwa", 0, "linkwise", CPP, "", failure="not in the package"))
    result = Result(rows, targets(rows), CONDITIONS)
    text = result.markdown
    assert "not installed: DART" in text
    assert "Pinocchio auto [C++]: chain of 3000: would need 80 GiB of memory" in text
    assert "linkwise: iiwa: not in the package" in text
    assert "**not reached**" in text
    assert "| Pinocchio local [C++] | 200 ± 0 %" in text
    assert "c++ -O3" in text
    short = short_table(rows)
    assert "| Drake, from Python | 2,400 |" in short
    assert "| Pinocchio | 200 |" in short
    assert "| **linkwise**, loads of all joints included | 50 | 50 |" in short


def test_a_written_run_is_read_back(tmp_path):
    rows = everything()
    rows[0].figures["odd"] = float("nan")
    result = Result(rows, targets(rows), CONDITIONS)
    written = write(result, tmp_path / "new" / "folder")
    assert {"bench.json", "bench.md"} <= {path.name for path in written}
    stored = json.loads(written[0].read_text())
    assert stored["rows"][0]["figures"]["odd"] is None
    for key in ("case", "n_bodies", "engine", "method", "threads", "ns_per_body", "ratio"):
        assert key in stored["rows"][0]
    again = read(written[0])
    assert again.markdown == markdown(again.rows, result.targets, CONDITIONS)
    for found, expected in zip(again.targets, result.targets, strict=True):
        assert (found.work, found.reached) == (expected.work, expected.reached)
        assert found.measured == (expected.measured and pytest.approx(expected.measured, rel=1e-5))


def test_figures_are_drawn_from_rows(tmp_path):
    pytest.importorskip("matplotlib")
    rows = everything()
    drawn = [
        path for path in write(Result(rows, [], CONDITIONS), tmp_path) if path.suffix == ".svg"
    ]
    assert [path.stem for path in drawn] == ["single", "simulation_1"]
    text = drawn[0].read_text()
    assert "linkwise pieces" in text
    write(Result(rows, [], CONDITIONS), tmp_path)
    assert drawn[0].read_text() == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(0, "0"), (0.0123456, "0.0123"), (5.678, "5.68"), (123.4, "123"), (117086.3, "117,086")],
)
def test_three_digits_without_exponents(value, text):
    assert significant(value) == text


def test_flags_keep_what_changes_the_code():
    command = (
        "sh -I/a -isystem /b -DNDEBUG -O3 -march=native -Wall -fPIC -std=c++20 "
        "--param=max-completely-peel-times=40 -o x.o -c /c/linkwise_side.cpp"
    )
    kept = _flags(command).split(" ", 1)[1]
    for flag in ("-O3", "-march=native", "-DNDEBUG", "--param=max-completely-peel-times=40"):
        assert flag in kept
    for noise in ("-Wall", "-fPIC", "/b", "-c"):
        assert noise not in kept.split()


def test_every_study_goes_by_the_same_clock():
    folder = Path(timing.__file__).parent
    clocks = ("perf_counter", "process_time", "monotonic", "time.time(", "chrono", "clock()")
    found = {
        path.relative_to(folder).as_posix()
        for suffix in ("py", "hpp", "cpp")
        for path in folder.rglob(f"*.{suffix}")
        if any(clock in path.read_text() for clock in clocks)
    }
    assert found == {"timing.py", "cpp/timing.hpp"}


def test_the_clock_returns_what_the_call_returns_and_counts_its_work():
    result, taken = timing.timed(lambda: sum(range(2_000_000)))
    assert result == 1_999_999_000_000
    assert taken.seconds > 0
    assert taken.cpu > 0
    calls = []
    timing.least_cpu(lambda: calls.append(None), turns=3)
    assert len(calls) == 3
