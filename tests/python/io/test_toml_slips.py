"""Slips in scenario files: what is wrong, in which line, and what to write."""

import re

import pytest

import linkwise as lw
from linkwise.scenario import load_scenario

RUN = "[model.chain]\nn_bodies = 3\n[simulate]\nduration = 1\n"


@pytest.fixture
def complaint(tmp_path):
    def call(text):
        path = tmp_path / "s.toml"
        path.write_text(text, encoding="utf-8")
        with pytest.raises(lw.InputError) as caught:
            load_scenario(path)
        return str(caught.value).replace(str(path), "s.toml")

    return call


@pytest.mark.parametrize(
    ("line", "problem", "cure"),
    [
        ("max_step = .5", "a number without a digit before its point (.5)", "write 0.5 for .5"),
        ("max_step = 5.", "a number without a digit behind its point (5.)", "write 1.0 for 1."),
        ("max_step = 5 ms", "a unit outside quotes (5 ms)", 'write "5 ms"'),
        ("max_step = 90deg # a turn", "a unit outside quotes (90deg)", 'write "90deg"'),
        ("max_step = 0,5", "a decimal comma (0,5)", "write 0.5"),
        ("max_step = 05", "a number with a leading zero (05)", "leave the zero out"),
        ("integrator = bdf", "a text without quotes (bdf)", 'write "bdf"'),
        ("stop = \u201cenergy\u201d", "typographic quotes", "straight quotes"),
        ('path = "C:\\Users"', "a backslash in quotes", "write / in paths"),
        ('integrator = "bdf', "a text whose quotes are not closed", 'close them with "'),
        ("work = True", "the word True as a value", "write true"),
        ("step = None", "the word None as a value", "leave the key out"),
        ("integrator: bdf", "a colon between key and value", "write key = value"),
        ("// a comment", "a comment that TOML does not know", "comments begin with #"),
        ("[output", "a table that is not closed", "close it with ]"),
        ("step =", "a key without a value", "write a value behind ="),
    ],
)
def test_a_slip_is_named_with_its_cure(complaint, line, problem, cure):
    said = complaint(f"{RUN}{line}\n")
    assert said.startswith(f"s.toml:5: scenario: is not valid TOML: it has {problem}")
    assert cure in said


def test_other_slips_keep_the_words_of_the_parser(complaint):
    assert re.match(
        r"s\.toml:\d+: scenario: is not valid TOML \(.*\); correct", complaint("a = [1 2]\n")
    )


@pytest.mark.parametrize("text", ['<?xml version="1.0"?><robot name="r"/>', "<mujoco/>"])
def test_a_model_is_no_scenario(complaint, text):
    assert "is a model, not a scenario; write a scenario with model" in complaint(text)


def test_what_a_scenario_lacks(complaint):
    assert complaint('model = "arm.urdf"\n').endswith(
        "simulate: is missing; add [simulate] with duration = ... in s"
    )
    assert complaint("[simulate]\nduration = 1\n").endswith(
        'model: is missing; add model = "FILE", above the first table'
    )
