"""What was ignored at reading is seen wherever loads are seen, once in each place."""

import json
import re
import warnings

import numpy as np
import pytest

import linkwise as lw
from linkwise.notes import MOST_LINES, recorded_warnings

# An inertia that no body has: a warning of the core, of every reader.
ARM = """<robot name="arm"><link name="base"/>
  <link name="upper"><inertial><origin xyz="0 0 0.5"/><mass value="2"/>
    <inertia ixx="0.2" iyy="0.2" izz="0.9" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="elbow" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 1 0"/><limit lower="-9" upper="9" effort="50" velocity="3"/></joint>
</robot>"""
SOUND = ARM.replace('"0.9"', '"0.1"')
SCENARIO = """model = "arm.urdf"
[simulate]
duration = 0.02
[initial]
position.elbow = 0.3
"""


def odd(joints):
    """A chain whose links all have that inertia."""
    builder = lw.ModelBuilder("odd\x1b")
    builder.add_link("link_0")
    for k in range(joints):
        inertia = [[0.2, 0, 0], [0, 0.2, 0], [0, 0, 0.9]]
        builder.add_link(f"link_{k + 1}", mass=2, com=(0, 0, 0.5), inertia=inertia)
        builder.add_joint(f"j{k}", "revolute", f"link_{k}", f"link_{k + 1}", axis=(0, 1, 0))
    return builder.build()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.urdf").write_text(ARM)
    (tmp_path / "sound.urdf").write_text(SOUND)
    (tmp_path / "run.toml").write_text(SCENARIO)
    return tmp_path


@pytest.fixture
def expected(folder):
    """What the reader found, as `element` and `text`."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        notes = lw.load(folder / "arm.urdf").notes
    found = [{"element": n.element, "text": n.text} for n in notes if n.level == "warning"]
    assert [entry["element"] for entry in found] == ["upper"]
    return found


def told(call):
    """The ModelWarnings of a call, with what it returned."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        returned = call()
    return [w for w in caught if issubclass(w.category, lw.ModelWarning)], returned


# -- Python --------------------------------------------------------------------------------------


def test_load_warns_once_for_each_note_at_its_caller(folder, expected):
    found, model = told(lambda: lw.load("arm.urdf"))
    (warned,) = found
    assert str(warned.message) == f"arm.urdf: upper: {expected[0]['text']}"
    assert warned.filename == __file__
    # What was said at reading is not said again.
    assert told(lambda: lw.simulate(model, duration=0.01))[0] == []
    assert told(lambda: lw.load("sound.urdf"))[0] == []


def test_simulate_warns_of_what_no_reader_said():
    model = odd(2)
    found, _ = told(lambda: lw.simulate(model, duration=0.01))
    assert [str(w.message).split(": ")[1] for w in found] == ["link_1", "link_2"]
    assert {w.filename for w in found} == {__file__}
    assert str(found[0].message).startswith("odd\\x1b: ")  # no control character gets through


def test_batch_warns_and_keeps_the_warnings_of_all_its_machines():
    machines = [odd(1).with_link("link_1", mass=2, inertia=0.1 * np.eye(3)), odd(1)]
    assert [n for n in machines[0].notes if n.level == "warning"] == []
    found, batch = told(lambda: lw.simulate_batch(machines, step=1e-3, duration=0.01))
    assert [w.filename for w in found] == [__file__]
    assert [entry["element"] for entry in lw.Run(batch).warnings] == ["link_1"]


@pytest.mark.parametrize("processes", [1, 2])
def test_sweep_warns_once_for_all_members(folder, expected, capfd, processes):
    axes = {"initial.position.elbow": [0.1, 0.2, 0.3]}
    found, swept = told(lambda: lw.sweep("run.toml", axes, processes=processes))
    (warned,) = found
    assert warned.filename == __file__
    assert lw.Run(swept.sel(member=1)).warnings == expected
    assert "ModelWarning" not in capfd.readouterr().err  # of a member's process


def test_scenario_warns_once_and_its_cure_is_silent(folder, expected):
    found, run = told(lambda: lw.run_scenario("run.toml"))
    assert [w.filename for w in found] == [__file__]
    assert run.warnings == expected
    (folder / "cured.toml").write_text(
        SCENARIO + "[link.upper]\nmass = 2\ncom = [0, 0, 0.5]\ninertia = [0.2, 0.2, 0.1]\n"
    )
    found, run = told(lambda: lw.run_scenario("cured.toml"))
    assert (found, run.warnings) == ([], [])


# -- the stored run and what is made of it -------------------------------------------------------


def test_stored_run_and_exports_keep_the_warnings(folder, expected):
    import h5netcdf

    lw.run_scenario("run.toml", output="run.zarr")
    run = lw.open_run("run.zarr")
    assert run.warnings == expected
    assert f"warning     upper: {expected[0]['text']}" in repr(run)
    run.to_netcdf("run.nc")
    with h5netcdf.File("run.nc") as file:
        assert json.loads(file.attrs["warnings"]) == expected
    for made in (lw.loads.summary(run), run.peak_loads()):
        assert recorded_warnings(made.attrs) == expected
    assert str(folder) not in run.attrs["warnings"]


def test_runs_without_the_attribute_and_damaged_ones_have_no_warnings(folder):
    run = lw.simulate(odd(1), duration=0.01)
    assert len(run.warnings) == 1
    for held in (None, "[", "{}", '["text"]', '[{"text": "x"}]', "[" * 100_000):
        other = run.dataset.copy()
        del other.attrs["warnings"]
        if held is not None:
            other.attrs["warnings"] = held
        assert lw.Run(other).warnings == []
        assert "warning" not in repr(lw.Run(other))


def test_sound_machine_has_none(folder):
    run = lw.simulate(lw.load("sound.urdf"), duration=0.01)
    assert run.attrs["warnings"] == "[]"
    assert "warning" not in repr(run)


# -- the command line ----------------------------------------------------------------------------

COMMANDS = {
    "run": ("run", "run.toml", "-o", "new.zarr"),
    "sweep": ("sweep", "run.toml", "--set", "initial.position.elbow=[0, 1]", "--processes", "1"),
    "loads": ("loads", "old.zarr"),
    "compare": ("compare", "arm.urdf", "--states", "2", "--limit", "0.01"),
    "view model": ("view", "arm.urdf", "--export", "view.html"),
    "view run": ("view", "old.zarr", "--export", "view.html"),
}


@pytest.mark.filterwarnings("always::linkwise.notes.ModelWarning")
@pytest.mark.parametrize("command", COMMANDS)
def test_command_says_it_once_and_in_json(linkwise, folder, expected, command):
    if command.startswith("view"):
        pytest.importorskip("viser")
    told(lambda: lw.run_scenario("run.toml", output="old.zarr"))
    shown = linkwise(*COMMANDS[command])
    assert shown.code == 0
    lines = [line for line in shown.err.splitlines() if "upper" in line]
    assert lines == [f"linkwise: warning: upper: {expected[0]['text']}"]
    assert expected[0]["text"] not in shown.out
    found = linkwise(*COMMANDS[command], "--json")
    assert found.json["warnings"] == expected
    assert "upper" not in found.err


def test_many_warnings_are_shortened_on_the_screen_alone(linkwise, folder):
    lw.simulate(odd(MOST_LINES + 3), duration=0.001, output="many.zarr")
    lines = linkwise("loads", "many.zarr").err.splitlines()
    assert len(lines) == MOST_LINES + 1
    assert lines[-1] == "linkwise: warning: and 3 more; all are in --json and run.warnings"
    assert len(linkwise("loads", "many.zarr", "--json").json["warnings"]) == MOST_LINES + 3


# -- pages ---------------------------------------------------------------------------------------


def test_report_and_view_show_them_as_text(linkwise, folder):
    pytest.importorskip("plotly")
    from linkwise.view.panel import headline
    from linkwise.view.source import Options, open_source

    (folder / "arm.urdf").write_text(ARM.replace('"upper"', '"&lt;b>upper"'))
    lw.run_scenario("run.toml", output="run.zarr")
    assert linkwise("loads", "run.zarr", "--html", "report.html").code == 0
    head = (folder / "report.html").read_text().partition("<h2>Peaks</h2>")[0]
    assert re.search("<h2>Warnings of the model</h2>.*&lt;b&gt;upper", head)
    for target in ("run.zarr", "arm.urdf"):
        assert "warning: &lt;b&gt;upper: " in headline(open_source(target, Options()))


def test_sound_report_has_no_warnings(linkwise, folder):
    pytest.importorskip("plotly")
    lw.simulate(lw.load("sound.urdf"), duration=0.01, output="run.zarr")
    assert linkwise("loads", "run.zarr", "--html", "report.html").err == ""
    assert "Warnings of the model" not in (folder / "report.html").read_text()
