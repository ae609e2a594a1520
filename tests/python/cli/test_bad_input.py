"""Wrong input: one line on stderr, exit code 2, nothing written."""

import os
import resource

import pytest

from linkwise import open_run


def refuse(result, *parts):
    assert result.code == 2
    assert result.out == ""
    for part in parts:
        assert part in result.complaint


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (["dance"], ["No such command 'dance'", "see 'linkwise --help'"]),
        (["inspect"], ["Missing argument", "MODEL", "see 'linkwise inspect --help'"]),
        (["run"], ["Missing argument", "SCENARIO"]),
        (["run", "a.toml", "b.toml"], ["unexpected extra argument", "b.toml"]),
        (["demo", "--colour"], ["No such option", "--colour"]),
        (["demo", "--output"], ["--output", "argument"]),
        (["inspect", "nowhere.urdf"], ["nowhere.urdf"]),
        (["run", "nowhere.toml"], ["nowhere.toml"]),
        (["inspect", "."], ["."]),
        (["demo", "-o", "no/such/run.zarr"], ["no/such", "does not exist"]),
    ],
)
def test_wrong_command_lines(linkwise, arguments, parts):
    refuse(linkwise(*arguments), *parts)
    assert os.listdir() == []


def test_no_command_shows_the_help(linkwise):
    result = linkwise()
    assert result.code == 2
    assert "Usage" in result.out + result.err


def test_model_that_is_not_xml(linkwise, arm):
    arm.write_text("not xml <")
    refuse(linkwise("inspect", arm), "arm.urdf")


def test_error_of_a_model_names_the_element(linkwise, arm):
    arm.write_text(arm.read_text().replace('mass value="2"', 'mass value="-2"'))
    refuse(linkwise("inspect", arm), "arm.urdf", "upper", "mass")


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("duration = 0.5", "durration = 0.5", ["durration", "duration"]),
        ("duration = 0.5", "duration = -1", ["simulate.duration"]),
        ("duration = 0.5", "duration = nan", ["simulate.duration"]),
        ("duration = 0.5", "duration = 0.5\ntolerance = 0", ["simulate.tolerance"]),
        ("duration = 0.5", 'duration = 0.5\nintegrator = "adam"', ["adam"]),
        ("duration = 0.5", 'duration = 0.5\nmethod = "magic"', ["magic"]),
        ("position.elbow", "position.elbwo", ["elbwo"]),
        ("[drive.slide]", "[drive.slode]", ["slode"]),
        ("every = 0.01", 'every = 0.01\nquantities = ["loads"]', ["loads"]),
        ("duration = 0.5", "duration = 0.5\nthreads = 5000", ["swing.toml: threads is 5000"]),
        (
            "duration = 0.5",
            'duration = 0.5\nintegrator = "runge_kutta_4"',
            ["swing.toml: ", "runge_kutta_4 needs a fixed step"],
        ),
        ("every = 0.01", "every = 1e-12", ["swing.toml: every: 1e-12 s makes 5e+11 samples"]),
        ('model = "arm.urdf"', 'model = "leg.urdf"', ["leg.urdf"]),
        ('kind = "locked"', 'kind = "torque"\ntable = "t.csv"', ["t.csv"]),
        ("[simulate]", "[simulate", ["swing.toml"]),
    ],
)
def test_wrong_scenarios(linkwise, scenario, old, new, parts):
    path = scenario((old, new))
    refuse(linkwise("run", path), *parts)
    assert sorted(os.listdir()) == ["arm.urdf", "swing.toml"]


def test_inspect_does_not_overrule_a_scenario(linkwise, scenario):
    refuse(linkwise("inspect", scenario(), "--floating-base"), "scenario says itself")


@pytest.mark.parametrize("output", ["arm.urdf", "results"])
def test_output_that_is_something_else(linkwise, scenario, output):
    os.mkdir("results")
    with open("results/thesis.tex", "w") as file:
        file.write("precious")
    refuse(linkwise("run", scenario(), "-o", output), output, "is not a linkwise run")
    assert os.listdir("results") == ["thesis.tex"]


@pytest.fixture
def largest_file():
    """Files may not grow beyond a size, as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize(
    ("size", "said", "left"),
    [
        (100, "cannot be written (File too large)", False),
        (20_000, "cannot be written further (File too large)", True),
    ],
)
def test_disk_that_is_full(linkwise, scenario, largest_file, size, said, left):
    path = scenario(("every = 0.01", "every = 0.0005"))
    largest_file(size)
    result = linkwise("run", path, "-o", "run.zarr")
    assert result.code == 1
    where = os.path.abspath("run.zarr")
    assert f"output {where!r}: {said}; make room or choose another path" in result.complaint
    assert os.path.exists("run.zarr") == left
    if left:
        assert open_run("run.zarr").sizes["time"] == 0


def test_json_of_a_complaint(linkwise):
    result = linkwise("inspect", "nowhere.urdf", "--json")
    assert result.code == 2
    assert result.json["exit_code"] == 2
    assert result.json["error"] in result.complaint


def test_json_of_a_usage_error(linkwise):
    result = linkwise("run", "--json")
    assert result.code == 2
    assert "Missing argument" in result.json["error"]


def test_control_characters_of_file_names_do_not_reach_the_terminal(linkwise):
    result = linkwise("inspect", "\x1b[31mred\nline.urdf")
    assert result.code == 2
    assert "\x1b" not in result.complaint


def test_unforeseen_errors_are_one_line_too(linkwise, monkeypatch):
    monkeypatch.setattr("linkwise.cli.inspect.load_given", lambda *_: 1 / 0)
    result = linkwise("inspect", "x.urdf")
    assert result.code == 1
    assert "ZeroDivisionError" in result.complaint
