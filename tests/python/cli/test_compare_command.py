"""`linkwise compare`."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

import linkwise as lw

SCENARIO = """
[model]
path = "arm.urdf"
[simulate]
duration = 2.0
[drive.elbow]
kind = "torque"
value = [3.0]
"""


@pytest.fixture
def quick(linkwise):
    """Runs the command on few states."""
    return lambda *arguments: linkwise("compare", *arguments, "--states", "4", "--limit", "0.5")


def test_every_method_solver_and_guess_is_compared(quick, arm):
    result = quick(arm, "--json")
    assert result.code == 0
    assert result.err == ""
    found = result.json
    assert found["unknowns"] == 10
    assert found["condition_estimate"] > 1
    assert 0 < found["spectral_radius"] < 1
    rows = {(r["method"], r["solver"], r["initial_guess"]): r for r in found["rows"]}
    for solver in lw.solvers():
        guesses = [""] if solver["kind"] == "direct" else [g["name"] for g in lw.initial_guesses()]
        for guess in guesses:
            row = rows["constraint_force", solver["name"], guess]
            assert row["outcome"] == "converged"
            assert row["error"] < 1e-4
            assert (row["mean_iterations"] is None) == (solver["kind"] == "direct")
            assert (row["error_estimate"] is None) == (solver["kind"] == "direct")
            assert row["error_is_bound"] == (solver["kind"] == "iterative")
    assert {method["name"] for method in lw.methods()} == {method for method, _, _ in rows}
    times = [r["seconds"] for r in found["rows"] if r["outcome"] == "converged"]
    assert times == sorted(times)


def test_the_table_shows_all_rows_for_people(quick, arm):
    result = quick(arm)
    assert result.code == 0
    for solver in lw.solvers():
        assert solver["name"] in result.out
    assert "10 unknowns" in result.out
    assert "own" in result.out
    assert "bound" in result.out
    assert "converged" in result.out


def test_a_scenario_is_followed(quick, arm, tmp_path):
    (tmp_path / "lift.toml").write_text(SCENARIO)
    result = quick("lift.toml", "--json")
    assert result.code == 0
    assert result.json["motion"] == "the scenario's motion"
    assert result.json["states"] == 4


def test_a_chart_is_written_as_svg(quick, arm, tmp_path):
    result = quick(arm, "--plot", "chart.svg", "--json")
    assert result.code == 0
    text = (tmp_path / "chart.svg").read_text()
    ElementTree.fromstring(text)
    for solver in lw.solvers():
        assert solver["name"] in text


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (("--plot", "chart.png"), ("chart.png", "SVG", ".svg")),
        (("--stop", "soon"), ("soon", "known", "energy_norm")),
        (("--tolerance", "0"), ("tolerance", "above 0")),
        (("--limit", "0"), ("--limit",)),
    ],
)
def test_wrong_arguments_are_refused_in_one_line(linkwise, arm, arguments, parts):
    result = linkwise("compare", arm, *arguments)
    assert result.code == 2
    for part in parts:
        assert part in result.complaint


def test_a_scenario_says_itself_how_its_model_is_loaded(linkwise, arm, tmp_path):
    (tmp_path / "lift.toml").write_text(SCENARIO)
    result = linkwise("compare", "lift.toml", "--floating-base")
    assert result.code == 2
    assert "scenario" in result.complaint


def test_of_closed_loops_each_reason_is_said_once(quick):
    """All solvers of one method do not apply for one reason."""
    result = quick(Path(__file__).parents[3] / "examples" / "data" / "watt.urdf")
    assert result.code == 0
    assert result.out.count("takes trees, and this machine has closed loops") == 1
    assert "twisted, cyclic_reduction" in result.out
    assert result.out.count("method global_projection takes none") == 1
