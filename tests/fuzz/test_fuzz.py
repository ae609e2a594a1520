"""Some inputs of every kind; `python -m tests.fuzz` runs as many as there is time for."""

import os

import pytest

import linkwise as lw

from . import __main__ as runner
from . import calls, inputs
from .judge import judge

COUNTS = {"urdf": 700, "mjcf": 500, "sdf": 400, "scenario": 300, "table": 500, "model-bytes": 1500}
COUNTS |= {"call": 1500, "stored-run": 12}


@pytest.mark.parametrize("kind", inputs.KINDS)
def test_a_result_or_one_line(kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    findings = []
    for number in range(COUNTS[kind]):
        named, action = inputs.make(kind, number, tmp_path)
        found = judge(action, named)
        if found:
            findings.append(f"python -m tests.fuzz {kind} {number}: {found}")
    assert not findings, "\n".join(findings[:5])
    assert set(os.listdir(tmp_path)) <= inputs.FILES


@pytest.mark.parametrize("kind", inputs.KINDS)
def test_an_input_is_made_from_its_kind_and_number(kind, tmp_path):
    """The same files again, so that a finding can be looked at."""
    seen = []
    for _ in range(2):
        inputs.make(kind, 7, tmp_path)
        files = sorted(p for p in tmp_path.rglob("*") if p.is_file() and not p.is_symlink())
        seen.append([p.read_bytes() for p in files])
    assert seen[0] == seen[1]


#: Of the public names: what files are read by, tables without arguments, modules, results and
#: exceptions, and what `_driven`, `_system`, `_evaluated`, `_frame` and `_built` make.
OTHERWISE = {
    *("load", "load_scenario", "run_scenario", "open_run", "sweep", "drives", "loads", "scenes"),
    *("methods", "solvers", "integrators", "initial_guesses", "stop_rules", "solver_options"),
    *("numerics", "quantities", "ForwardDynamicsResult", "InverseDynamicsResult", "Note"),
    *("Report", "Spectrum", "Run"),
    *("Progress", "InputError", "NumericsError", "SimulationError", "SimulationInterrupted"),
    *("ModelWarning", "Drive", "Free", "Locked", "ConstraintSystem", "DynamicsMethod", "Frame"),
    *("Model", "ModelBuilder", "Indeterminacy", "Assembly", "Section", "FlexibleBody", "flexible"),
}


def test_every_public_function_is_called():
    """What is new belongs into a table of `calls`."""
    assert set(lw.__all__) == {*calls.CALLS, *calls.DRIVES, *OTHERWISE}
    methods = {n for n in dir(lw.Model) if n[0] != "_" and callable(getattr(lw.Model, n))}
    assert methods - {"neutral_configuration", "initial_configuration", "from_bytes"} == {
        *calls.METHODS
    }
    assert {name for name in lw.loads.__all__ if name.islower()} == {
        *calls.LOADS,
        "margins",
        "section_margins",
    }


def test_damage_is_found():
    """The judge knows what must not be."""
    assert judge(lambda: None) is None
    assert "ZeroDivisionError" in judge(lambda: 1 / 0)
    assert "not finite" in judge(lambda: inputs.must_be_finite(float("nan"), "x"))
    assert "does not name" in judge(lambda: lw.load("none.urdf"), "other.urdf")


def test_crashes_hangs_and_findings_are_told_apart(monkeypatch):
    """Of ten inputs one ends its process, one never ends, one fails; the others are run, too."""

    def make(kind, number, folder):
        actions = {3: lambda: os._exit(5), 5: lambda: _forever(), 7: lambda: 1 / 0}
        return None, actions.get(number, lambda: None)

    monkeypatch.setattr(runner.made, "make", make)
    monkeypatch.setattr(runner, "FUSE", 0.5)
    done, findings = runner.run(["table"], range(10), jobs=2)
    assert done == {"table": 10}
    assert sorted(number for _, number, _ in findings) == [3, 5, 7]
    texts = {number: text for _, number, text in findings}
    assert texts[3] == "ended by 5"
    assert texts[5].startswith("takes longer than 0.5 s")
    assert texts[7].startswith("ZeroDivisionError")


def _forever():
    while True:
        pass
