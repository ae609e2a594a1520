"""What users and files wrote reaches a terminal as text, in any encoding, and never controls it."""

import os
import subprocess
import sys

import pytest

import linkwise as lw
from linkwise.base import printable
from linkwise.cli.output import console, table
from linkwise.cli.run import show_run

EVIL = "\x1b]0;owned\x07\x1b[31m\x9b2J\u202ered\x7f"
CONTROLS = [chr(code) for code in [*range(32), *range(127, 160), 0x202E, 0x200B, 0xDC80]]


def controls(text):
    return [c for c in text if not c.isprintable() and c != "\n"]


@pytest.mark.parametrize("character", CONTROLS)
def test_what_controls_a_terminal_is_escaped(character):
    shown = printable(f"a{character}b")
    assert shown.isprintable()
    assert shown[0] == "a"
    assert shown[-1] == "b"
    assert len(shown) > 2


def test_other_text_stays():
    assert printable("Gelenk [1] :key: 關節") == "Gelenk [1] :key: 關節"


def test_results_are_printed_in_one_safe_place(capsys):
    screen = console()
    made = table(EVIL, [(EVIL, "left")])
    made.add_row(EVIL)
    screen.print(made)
    screen.print(EVIL)
    said = capsys.readouterr().out
    assert not controls(said)
    assert said.count("owned") == 4


def test_attributes_of_a_run(capsys):
    run = lw.simulate(lw.scenes.chain(2), duration=0.01)
    for name in ("method", "solver", "message", "model"):
        run.dataset.attrs[name] = EVIL
    show_run(run, as_json=False)
    said = capsys.readouterr().out
    assert "owned" in said
    assert not controls(said)


def test_complaints_of_the_core(linkwise, arm):
    arm.write_text(arm.read_text().replace('name="slide"', 'name="&#x9b;2Jslide"'))
    link = '<limit lower="0"'
    arm.write_text(arm.read_text().replace(link, '<limit lower="1"'))
    result = linkwise("inspect", arm)
    assert result.code == 2
    assert "slide" in result.err
    assert not controls(result.err)


def test_output_path_of_a_scenario(linkwise, tmp_path, scenario):
    path = scenario(("[output]", '[output]\npath = "a\\u001b[31m\\u009b.zarr"'))
    result = linkwise("run", path)
    assert result.code == 0
    assert "a\\x1b[31m\\x9b.zarr" in result.out
    assert not controls(result.out + result.err)


def test_a_run_shows_itself_without_controlling_the_terminal():
    run = lw.simulate(lw.scenes.chain(1), duration=0.01)
    run.dataset.attrs["model"] = run.dataset.attrs["method"] = EVIL
    assert not controls(repr(run))


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252", "utf-8"])
def test_names_that_the_output_cannot_encode(tmp_path, arm, encoding):
    arm.write_text(arm.read_text().replace('"elbow"', '"關節\u0416"'), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", "from linkwise.cli import main; main()", "inspect", arm.name],
        cwd=tmp_path,
        env={**os.environ, "PYTHONIOENCODING": encoding},
        capture_output=True,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == b""
    assert ("關節\u0416" if encoding == "utf-8" else "???") in done.stdout.decode(encoding)


@pytest.mark.parametrize("character", [chr(27), chr(10), chr(127), chr(0x9B), chr(0x85)])
def test_what_the_core_says_in_python(character):
    model = lw.scenes.chain(1)
    with pytest.raises(lw.InputError) as caught:
        model.joint_index(f"a{character}b 關節")
    assert str(caught.value).isprintable()
    assert "關節" in str(caught.value)
    builder = lw.ModelBuilder(f"a{character}b")
    builder.add_link("l", mass=1, inertia=[[1, 0, 0], [0, 1, 0], [0, 0, 1]])
    builder.set_floating_base()
    assert repr(builder.build()).isprintable()
