"""What the commands print, write and return."""

import os
import re
import sys

import numpy as np
import pytest

import linkwise as lw
from linkwise.cli import demo
from linkwise.cli.progress import describe
from linkwise.loads.limits import beyond_limits
from linkwise.simulation.time_loop import Progress

# -- demo ----------------------------------------------------------------------------------------


def test_demo_prints_peaks_and_where_the_results_are(linkwise):
    result = linkwise("demo")
    assert result.code == 0
    assert result.err == ""
    assert "Results: run.zarr" in result.out
    peaks = lw.open_run("run.zarr").peak_loads()
    rows = {line.split()[0]: line.split()[1:] for line in result.out.splitlines() if line.strip()}
    for joint in peaks.joint.values:
        force, _, moment, _ = map(float, rows[joint])
        assert force == pytest.approx(float(peaks.force.sel(joint=joint)), rel=1e-3)
        assert moment == pytest.approx(float(peaks.moment.sel(joint=joint)), rel=1e-3)


def test_demo_follows_its_plan_within_the_arms_torques(linkwise):
    assert linkwise("demo", "--output", "slew.zarr").code == 0
    run = lw.open_run("slew.zarr")
    assert run.outcome == "converged"
    # Applied open loop, an error of the tolerance in the rates grows with the time of 10 s.
    bound = 3 * demo.TOLERANCE * demo.DURATION
    np.testing.assert_allclose(run.position[-1], demo.END, atol=bound)
    np.testing.assert_allclose(run.velocity[-1], 0, atol=bound)
    effort = lw.scenes.srms().effort_limit
    assert np.all(np.abs(run.drive_torque) < effort)
    assert np.all(np.abs(run.drive_torque).max("time") > 0)


def test_demo_keeps_earlier_results(linkwise):
    first, second = linkwise("demo", "--json"), linkwise("demo", "--json")
    assert first.json["run"] == "run.zarr"
    assert second.json["run"] == "run-2.zarr"
    assert sorted(os.listdir()) == ["run-2.zarr", "run.zarr"]
    assert [peak["joint"] for peak in first.json["peak_loads"]] == lw.scenes.srms().joint_names
    assert first.json["peak_loads"] == second.json["peak_loads"]
    assert first.json["outcome"] == "converged"


# -- inspect -------------------------------------------------------------------------------------


def test_inspect_shows_joints_bodies_and_what_was_merged(linkwise, arm):
    result = linkwise("inspect", arm)
    assert result.code == 0
    assert "4 links in 2 moving bodies, 2 degrees of freedom" in result.out
    assert "3.5 kg" in result.out
    lines = result.out.splitlines()
    elbow = next(line for line in lines if line.strip().startswith("elbow"))
    for text in ("revolute", " y ", "-1.5 .. 1.5", "50", "(ground)", "upper", "2.5"):
        assert text in elbow
    assert any("merge" in line and "plate" in line and "glue" in line for line in lines)
    assert "[red]slider[/red]" in result.out  # names are no markup


def test_inspect_json_has_everything(linkwise, arm):
    found = linkwise("inspect", arm, "--json").json
    model = lw.load(arm)
    assert (found["nq"], found["nv"], found["bodies"], found["links"]) == (2, 2, 2, 4)
    assert found["hash"] == model.hash
    assert found["total_mass"] == 3.5
    assert found["gravity"] == [0, 0, -9.81]
    elbow, slide = found["joints"]
    assert elbow == {
        "joint": "elbow",
        "type": "revolute",
        "axes": [{"kind": "revolute", "axis": [0, 1, 0]}],
        "parent": None,
        "body": "upper",
        "mass": 2.5,
        "degrees_of_freedom": 1,
        "lower": [-1.5],
        "upper": [1.5],
        "effort": [50],
        "velocity": [3],
        "armature": [0],
        "damping": [0],
        "friction": [0],
        "friction_velocity": [0.01],
        "stiffness": [0],
        "rest_position": [0],
        "limit_stiffness": [0],
        "limit_damping": [0],
    }
    assert slide["parent"] == "upper"
    assert slide["axes"][0]["kind"] == "prismatic"
    assert [note["element"] for note in found["notes"] if note["level"] == "merge"] == ["plate"]


def test_inspect_json_has_no_infinities(linkwise, tmp_path):
    path = tmp_path / "swing.toml"
    path.write_text("[model.chain]\nn_bodies = 2\n[simulate]\nduration = 1\n")
    found = linkwise("inspect", path, "--json").json
    assert found["joints"][0]["lower"] == [None]


def test_inspect_floating_base(linkwise, tmp_path):
    text = '<robot name="box"><link name="box"><inertial><mass value="1"/><inertia ixx="1" iyy="1" '
    text += 'izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
    path = tmp_path / "box.urdf"
    path.write_text(text)
    found = linkwise("inspect", path, "--floating-base", "--json").json
    assert (found["nq"], found["nv"]) == (7, 6)
    assert found["joints"][0]["type"] == "floating"


def test_inspect_shortens_long_models(linkwise, tmp_path):
    path = tmp_path / "long.toml"
    path.write_text("[model.chain]\nn_bodies = 500\n[simulate]\nduration = 1\n")
    assert "link_500" not in linkwise("inspect", path).out
    assert "the first 60 of 500" in linkwise("inspect", path).out
    assert "link_500" in linkwise("inspect", path, "--all").out


# -- run -----------------------------------------------------------------------------------------


def test_run_writes_results_named_like_the_scenario(linkwise, scenario):
    result = linkwise("run", scenario())
    assert result.code == 0
    assert result.err == ""
    assert "Results: swing.zarr" in result.out
    run = lw.open_run("swing.zarr")
    assert run.sizes["time"] == 51
    assert float(run.position.sel(joint="elbow")[0]) == 0.3
    assert np.all(run.velocity.sel(joint="slide") == 0)
    assert linkwise("run", scenario(), "--json").json["run"] == "swing-2.zarr"


@pytest.mark.skipif(sys.platform != "linux", reason="names of files are text elsewhere")
def test_names_of_files_may_be_no_text(linkwise, arm):
    name = os.fsdecode(b"arm\xe9.urdf")
    arm.rename(name)
    result = linkwise("inspect", name)
    assert result.code == 0
    assert result.out.startswith("arm (arm?.urdf): ")


FREE = (('kind = "locked"', 'kind = "free"'), ("duration = 0.5", "duration = 2"))


def test_run_names_joints_that_leave_their_limits(linkwise, scenario):
    result = linkwise("run", scenario(*FREE), "--json")
    run = lw.open_run("swing.zarr")
    assert abs(run.position.sel(joint="elbow")).max() < 1.5
    q = run.position.sel(joint="slide").values
    row = {"joint": "slide", "lower": 0.0, "upper": 0.2, "farthest": float(q.min())}
    row["since"] = float(run.time.values[np.argmax(q < 0)])
    assert result.json["beyond_limits"] == [row]
    said = linkwise("run", scenario(*FREE), "-o", "again.zarr").out
    assert "Beyond their limits, which exert no force: slide (0 .. 0.2) gets to -17" in said
    assert "Beyond" not in linkwise("run", scenario(), "-o", "within.zarr").out


def test_limits_with_stops_are_not_left():
    builder = lw.ModelBuilder("fall", gravity=(0, 0, -9.81))
    builder.add_link("ground")
    for name, stiffness in (("stopped", 1e4), ("free", 0.0)):
        builder.add_link(name + "_body", mass=1.0, inertia=np.eye(3))
        builder.add_joint(
            name,
            "prismatic",
            "ground",
            name + "_body",
            axis=(0, 0, 1),
            lower=-0.1,
            upper=0.1,
            limit_stiffness=stiffness,
        )
    run = lw.simulate(builder.build(), duration=1.0, every=0.01)
    assert [row["joint"] for row in beyond_limits(run)] == ["free"]


def test_run_output_named_by_hand_is_replaced(linkwise, scenario):
    for duration in ("0.5", "0.25"):
        path = scenario(("duration = 0.5", f"duration = {duration}"))
        assert linkwise("run", path, "-o", "mine.zarr").code == 0
    assert lw.open_run("mine.zarr").sizes["time"] == 26
    assert "swing.zarr" not in os.listdir()


def test_run_output_of_the_scenario(linkwise, scenario, tmp_path):
    path = scenario(("every = 0.01", 'every = 0.01\npath = "named.zarr"'))
    assert linkwise("run", path).code == 0
    assert lw.open_run(tmp_path / "named.zarr").completed


def test_run_json(linkwise, scenario):
    found = linkwise("run", scenario(), "--json").json
    assert found["outcome"] == "converged"
    assert found["samples"] == 51
    assert found["total_steps"] > 0
    run = lw.open_run(found["run"])
    peak = found["peak_loads"][0]
    assert peak["joint"] == "elbow"
    assert peak["force"] == float(run.peak_loads().force[0])


def test_run_without_loads_still_reports(linkwise, scenario):
    path = scenario(("every = 0.01", 'every = 0.01\nquantities = ["position"]'))
    assert linkwise("run", path, "--json").json["peak_loads"] == []
    assert "Simulated 0.5 s" in linkwise("run", path).out


def test_failed_simulation_is_reported_and_kept(linkwise, scenario):
    """A torque table that jumps to values without bounds: the integrator gives up."""
    times = [f"{t},{0 if t < 0.25 else 1e300}" for t in (0, 0.1, 0.2, 0.25, 0.5)]
    with open("push.csv", "w") as file:
        file.write("\n".join(["time,elbow", *times]) + "\n")
    path = scenario(
        ("[simulate]", '[drive.elbow]\nkind = "torque"\ntable = "push.csv"\n[simulate]')
    )
    result = linkwise("run", path)
    assert result.code == 1
    assert "stopped at t = 0.2" in result.complaint
    assert "Results: swing.zarr" in result.out
    run = lw.open_run("swing.zarr")
    assert not run.completed
    assert run.time[-1] >= 0.15
    found = linkwise("run", path, "--json")
    assert found.code == 1
    assert found.json["outcome"] == run.outcome
    assert found.json["message"]


def test_progress_line():
    line = describe(Progress(2.5, 10.0, 5.0, 100, 200))
    assert line == "t = 2.500 of 10 s   0.5 x real time   0:15 left"
    assert "-:--" in describe(Progress(0.0, 10.0, 0.1, 0, 0))
    assert "1:23:20 left" in describe(Progress(1.0, 2.0, 5000.0, 0, 0))


def test_helps_show_what_stands_in_square_brackets(linkwise):
    """Which the terminal takes for markup, unless it is told otherwise."""
    import typer.main

    from linkwise.cli.main import app

    told = 0
    for name, command in typer.main.get_command(app).commands.items():
        shown = " ".join(linkwise(name, "--help").out.replace("│", " ").split())
        for option in command.params:
            for bracket in re.findall(r"\[[^\]]*\]", getattr(option, "help", None) or ""):
                told += 1
                assert bracket in shown, (name, bracket)
    assert told >= 2
