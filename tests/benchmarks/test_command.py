"""`python -m benchmarks peers` as a whole, with small machines, and its mistakes."""

import json
import sys

import pytest

from benchmarks import __main__ as program
from benchmarks.cases import memory, simulation, single, threads
from benchmarks.engines.table import BY_NAME
from benchmarks.sessions import Workers


@pytest.fixture
def bench(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["benchmarks", "peers", *map(str, arguments)])
        code = 0
        try:
            program.main()
        except SystemExit as end:
            code = end.code
        return code, *capsys.readouterr()

    return call


@pytest.fixture
def small(monkeypatch):
    """A run of seconds: ours and, where it is installed, MuJoCo."""
    monkeypatch.setattr(single, "QUICK_SIZES", (2, 4))
    monkeypatch.setattr(memory, "QUICK_SIZES", (20, 60))
    monkeypatch.setattr(threads, "QUICK_SIZES", (40,))
    monkeypatch.setattr(threads, "ARM_STATES", 16)
    monkeypatch.setattr(simulation, "QUICK_TOLERANCES", (1e-4, 1e-6))
    monkeypatch.setattr(simulation, "QUICK_STEPS", (1e-2,))
    engines = (BY_NAME["linkwise"], BY_NAME["mujoco"])
    made = Workers.__init__
    monkeypatch.setattr(
        Workers, "__init__", lambda self, *a, **k: made(self, *a, **{**k, "engines": engines})
    )


def test_a_small_run(bench, small):
    names = "single,memory,threads,simulation"
    code, out, err = bench("--quick", "--cases", names, "-o", "results")
    assert code == 0
    assert "no C++ side: not compiled yet" in err
    for heading in ("One evaluation of a chain", "Very long chains", "Several threads", "Targets"):
        assert f"## {heading}" in out
    with open("results/bench.json", encoding="utf-8") as file:
        stored = json.load(file)
    rows = [row for row in stored["rows"] if row["case"] == "single"]
    ours = [row for row in rows if row["engine"] == "linkwise" and row["method"] == "auto"]
    assert [row["n_bodies"] for row in ours] == [2, 4]
    for row in ours:
        assert row["ratio"] == 1
        assert row["loads"]
        assert row["ns_per_body"] > 0
        assert row["spread"][0] <= row["ns_per_body"] <= row["spread"][1]
    ends = [row["figures"] for row in stored["rows"] if row["case"] == "simulation"]
    assert all(figures["seconds"] > 0 for figures in ends)
    assert stored["conditions"]["processor"]
    assert stored["conditions"]["no_cpp"]


def test_json_is_all_that_is_on_stdout(bench, small):
    code, out, _ = bench("--quick", "--cases", "single", "--json")
    assert code == 0
    assert {"conditions", "rows", "targets"} == set(json.loads(out))


def test_an_unknown_case_is_named(bench):
    code, out, err = bench("--cases", "single,sinlge")
    assert code == 2
    assert out == ""
    assert "case 'sinlge' is unknown; known: single, robots" in err
    assert err.count("\n") == 1


def test_an_output_that_is_a_file_is_refused_before_measuring(bench, tmp_path):
    (tmp_path / "taken").write_text("mine")
    code, _, err = bench("--quick", "-o", "taken")
    assert code == 2
    assert "taken is no folder" in err
    assert (tmp_path / "taken").read_text() == "mine"
