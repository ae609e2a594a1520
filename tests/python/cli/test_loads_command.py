"""`linkwise loads` and `linkwise sweep`: tables, files, and one line for what is wrong."""

import csv
import re

import numpy as np
import pytest

import linkwise as lw
from helpers.machines import stopped_arm, stopped_rod

MOTION = """[drive.elbow]
kind = "motion"
table = "elbow.csv"
[rating.elbow]
radial = "0.1 kN"
torque = 2
[simulate]"""


@pytest.fixture
def scene(scenario, tmp_path):
    times = np.linspace(0, 0.5, 51)
    phase = 4 * np.pi * times
    positions = 0.3 + 0.5 * (phase - np.sin(phase)) / (2 * np.pi)
    rows = [f"{t:.12g},{q:.15g}" for t, q in zip(times, positions, strict=True)]
    (tmp_path / "elbow.csv").write_text("time,elbow\n" + "\n".join(rows) + "\n")
    return scenario(("[simulate]", MOTION))


@pytest.fixture
def run(linkwise, scene):
    assert linkwise("run", scene, "-o", "run.zarr").code == 0
    return "run.zarr"


def test_table(linkwise, run):
    result = linkwise("loads", run)
    assert result.code == 0
    assert "elbow" in result.out
    assert "axial [N] @ s" in result.out
    assert "Against the ratings" in result.out
    assert "±" not in result.out


def test_every_peak_has_its_own_time(linkwise, run):
    """Force and tilting moment peak at different instants, and the row says both."""
    summary = lw.loads.summary(lw.open_run(run))
    times = {float(t) for t in summary.peak_time.sel(joint="elbow").values if np.isfinite(t)}
    assert len(times) > 1
    lines = linkwise("loads", run).out.splitlines()
    row = next(line for line in lines if line.split()[:1] == ["elbow"])
    for quantity in ("force", "moment", "tilting_moment"):
        one = summary.sel(joint="elbow", quantity=quantity)
        assert f"{float(one.peak):.4g} @ {float(one.peak_time):.4g}" in row
    rated = next(line for line in lines if "radial [N]" in line and "elbow" in line)
    radial = summary.sel(joint="elbow", quantity="radial")
    assert f"{float(radial.peak_time):.4g}" in rated.split()


def test_a_model_file_does_not_replace_the_run_s_own(linkwise, scenario):
    """The scenario's payload is not in the file; loads by cause need it."""
    loaded = scenario(("[simulate]", '[payload.box]\nlink = "upper"\nmass = 5\n[simulate]'))
    assert linkwise("run", loaded, "-o", "run.zarr").code == 0
    plain = linkwise("loads", "run.zarr", "--split", "motion", "--json")
    given = linkwise("loads", "run.zarr", "--split", "motion", "--json", "--model", "arm.urdf")
    assert given.json == plain.json
    assert "arm.urdf: is not used, the run holds the model" in given.complaint


def test_json_is_the_summary(linkwise, run):
    found = linkwise("loads", run, "--json", "--split", "force").json
    summary = lw.loads.summary(lw.open_run(run))
    peaks = {(r["joint"], r["quantity"]): r for r in found["peaks"]}
    for (joint, quantity), record in peaks.items():
        row = summary.sel(joint=joint, quantity=quantity)
        assert record["peak"] == float(row.peak)
        assert record["peak_time"] == float(row.peak_time)
        np.testing.assert_array_equal([record[c] for c in row.component.values], row.wrench)
    radial = peaks["elbow", "radial"]
    assert radial["margin"] == pytest.approx(100 / radial["peak"] - 1)
    for share in found["split"]:
        fixed = ("joint", "quantity", "unit", "at_peak", "time", "total", "peak")
        assert share["total"] == pytest.approx(sum(v for k, v in share.items() if k not in fixed))
        assert share["at_peak"]
        assert share["total"] == pytest.approx(share["peak"], rel=1e-6)
        assert share["time"] == peaks[share["joint"], share["quantity"]]["peak_time"]


def test_one_joint_in_full_and_csv(linkwise, run):
    result = linkwise("loads", run, "-j", "elbow", "--csv", "peaks.csv")
    assert "Load of elbow" in result.out
    assert "slide" not in result.out
    with open("peaks.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["joint"] for row in rows} == {"elbow"}
    summary = lw.loads.summary(lw.open_run(run))
    for row in rows:
        at = summary.sel(joint="elbow", quantity=row["quantity"])
        assert float(row["peak"]) == float(at.peak)


def test_certified_peaks_have_bounds(linkwise, run, scene):
    result = linkwise("loads", run, "--certify", scene)
    assert result.code == 0
    assert "±" in result.out
    peaks = linkwise("loads", run, "--certify", scene, "--json").json["peaks"]
    assert all(0 <= r["plus_minus"] < 1e-2 * (1 + abs(r["peak"])) for r in peaks)
    other = scene.with_name("other.toml")
    other.write_text(scene.read_text() + "\n# another\n")
    complaint = linkwise("loads", run, "--certify", other).complaint
    assert "is not the scenario that made the run" in complaint


def test_report(linkwise, run):
    pytest.importorskip("plotly")
    assert linkwise("loads", run, "--html", "report.html").code == 0
    with open("report.html", encoding="utf-8") as file:
        text = file.read()
    assert len(text) < 10e6
    assert "default-src 'none'" in text
    ours = text.replace(re.search(r"<script>/\*\*?.*?</script>", text, re.DOTALL)[0], "")
    assert "http" not in ours.replace("http-equiv", "")
    assert "[red]slider[/red]" not in ours.split("<body>")[1].split("Scenario")[0]
    for title in ("Peaks", "Against the ratings", "Envelopes", "Over time", "Energy and solver"):
        assert title in ours


def test_report_of_ten_joints_and_ten_seconds_is_small(tmp_path):
    pytest.importorskip("plotly")
    from linkwise.plot import write_report

    run = lw.simulate(lw.scenes.chain(10, damping=2.0), duration=10, every=0.01, q0=[0.4] * 10)
    path = write_report(run, tmp_path / "ten.html", {"summary": lw.loads.summary(run)})
    assert 5e6 < path.stat().st_size < 8e6


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["nothing.zarr"], "does not exist"),
        (["run.zarr", "-j", "elbo"], "did you mean 'elbow'"),
        (["run.zarr", "--split", "sorts"], "--split: 'sorts' is unknown; use force or motion"),
        (["run.zarr", "--driven", "elbow"], "--driven: goes with --split motion"),
        (
            ["run.zarr", "--split", "motion", "--driven", "elbow"],
            "machines with closed loops; leave",
        ),
        (["run.zarr", "--csv", "no/where.csv"], "does not exist; create it"),
        (["run.zarr", "--ratings", "bad.toml"], "bad.toml: rating.elbow.radal: unknown key"),
        (["run.zarr", "--ratings", "joint.toml"], "run holds no such joint; did you mean 'elbow'"),
        (["arm.urdf"], "is not a linkwise run"),
    ],
)
def test_wrong_input(linkwise, run, tmp_path, arguments, complaint):
    (tmp_path / "bad.toml").write_text("[rating.elbow]\nradal = 3\n")
    (tmp_path / "joint.toml").write_text("[rating.elbw]\nradial = 3\n")
    result = linkwise("loads", *arguments)
    assert result.code == 2
    assert complaint in result.complaint


@pytest.mark.parametrize(
    ("position", "complaint"),
    [
        (
            lambda t: np.where(t < 0.2, 0.0, 0.1),
            r"the position jumps by about 0\.1\d* near t = 0\.\d+ s",
        ),
        (lambda t: np.abs(t - 0.2), r"the velocity jumps by about 2 near t = 0\.2 s"),
        (
            lambda t: np.maximum(t - 0.2, 0) ** 2,
            r"the acceleration jumps by about 2 near t = 0\.2 s",
        ),
        (lambda t: (40 * t) % (2 * np.pi), r"jumps by one turn .* as numpy\.unwrap does$"),
        (lambda t: 4 * t**3 + 1.2, r"leaves the joint's limits -1\.5 \.\. 1\.5 at t = 0\.\d+ s"),
        (lambda t: np.where(t < 0.4, t, np.nan), "elbow.csv"),
    ],
    ids=["position", "velocity", "acceleration", "turn", "limits", "nan"],
)
def test_motion_tables_that_cannot_be_followed(linkwise, scene, tmp_path, position, complaint):
    times = np.linspace(0, 0.5, 201)
    rows = [f"{t:.12g},{q:.15g}" for t, q in zip(times, position(times), strict=True)]
    (tmp_path / "elbow.csv").write_text("time,elbow\n" + "\n".join(rows) + "\n")
    result = linkwise("run", scene, "-o", "run.zarr")
    assert result.code == 2
    assert re.search(complaint, result.complaint), result.complaint
    assert "elbow" in result.complaint
    assert not (tmp_path / "run.zarr").exists()


def test_a_run_without_loads_says_what_to_record(linkwise, scene):
    scene.write_text(scene.read_text().replace("[output]", '[output]\nquantities = ["position"]'))
    assert linkwise("run", scene, "-o", "run.zarr").code == 0
    result = linkwise("loads", "run.zarr")
    assert result.code == 2
    assert 'record the quantity "joint_load"' in result.complaint


def test_sweep(linkwise, scene):
    axes = ["-s", "payload.box.mass=[0.5, 2]", "-s", "payload.box.link=['upper']"]
    found = linkwise("sweep", scene, *axes, "-o", "all.nc", "--processes", "1", "--json")
    assert found.code == 0
    members = found.json["members"]
    assert [m["payload.box.mass"] for m in members] == [0.5, 2.0]
    for member in members:
        assert member["outcome"] == "converged"
    assert members[1]["largest_force"] > members[0]["largest_force"]
    import xarray as xr

    with xr.open_dataset("all.nc", engine="h5netcdf") as stored:
        assert stored.joint_load.dims[0] == "member"
        assert stored.sizes["member"] == 2
        assert np.isfinite(stored.joint_load).all()


def test_sweep_members_are_runs_of_their_own(scene, tmp_path):
    found = lw.sweep(scene, {"payload.box": [{"link": "upper", "mass": 1.0}]}, processes=1)
    text = scene.read_text() + "\n[payload.box]\nlink = 'upper'\nmass = 1.0\n"
    alone = tmp_path / "alone.toml"
    alone.write_text(text)
    run = lw.run_scenario(alone)
    np.testing.assert_array_equal(found.joint_load.isel(member=0), run.joint_load)


@pytest.mark.parametrize(
    ("axis", "complaint"),
    [
        ("payload.box.mass=3", "is no axis of a sweep"),
        ("simulate.tolerance=[]", "is no axis of a sweep"),
        ("simulate.tolerance=[-1]", "simulate.tolerance"),
        ("simulate.tolerence=[1e-6]", "unknown key; did you mean 'tolerance'"),
        ("initial.position.elbo=[1]", "did you mean 'elbow'"),
        ("a b=[1]", "is not a key"),
    ],
)
def test_wrong_sweeps(linkwise, scene, axis, complaint):
    result = linkwise("sweep", scene, "-s", axis, "--processes", "1")
    assert result.code == 2
    assert complaint in result.complaint


@pytest.fixture
def wrist(linkwise, tmp_path):
    """A run of an arm that holds 1 kg with 0.07 m to the side of a force sensor without mass."""
    (tmp_path / "wrist.urdf").write_text(
        """<robot name="wrist"><link name="arm"/><link name="sensor"/>
        <link name="hand"><inertial><origin xyz="0.07 0 0"/><mass value="1"/>
          <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
        <link name="tip"/>
        <joint name="wrist" type="continuous"><parent link="arm"/><child link="sensor"/></joint>
        <joint name="flange" type="fixed"><parent link="sensor"/><child link="hand"/></joint>
        <joint name="end" type="fixed"><origin xyz="0.07 0 0.5"/><parent link="hand"/>
          <child link="tip"/></joint></robot>"""
    )
    (tmp_path / "hold.toml").write_text(
        'model = "wrist.urdf"\ndrive.wrist.kind = "locked"\nsimulate.duration = 0.1\n'
    )
    assert linkwise("run", "hold.toml", "-o", "hold.zarr").code == 0
    return "hold.zarr"


def test_loads_at_a_link_of_joints_that_are_merged(linkwise, wrist, tmp_path):
    told = linkwise("loads", wrist, "--at", "child", "-j", "flange", "--json").json
    peaks = {row["quantity"]: row["peak"] for row in told["loads"]}
    assert peaks["fz"] == pytest.approx(9.81)
    assert peaks["ny"] == pytest.approx(-0.07 * 9.81)
    shown = linkwise("loads", wrist, "--at", "tip", "--csv", "tip.csv")
    assert "about the frame's origin" in " ".join(shown.out.split())
    rows = list(csv.DictReader((tmp_path / "tip.csv").open()))
    assert [row["joint"] for row in rows] == ["wrist"] * 8
    assert abs(float(rows[6]["peak"])) < 1e-12
    told = linkwise("loads", wrist, "--at", "tip", "--point", "1", "0", "0", "--json").json
    peaks = {row["quantity"]: row["peak"] for row in told["loads"]}
    assert peaks["ny"] == pytest.approx(9.81)


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["-j", "flange"], "joint 'flange': is fixed and its links are merged; add --at child"),
        (["--at", "tp"], "did you mean 'tip'?"),
        (
            ["--at", "tip", "-j", "wrong"],
            "the joints are: wrist, flange, end",
        ),
        (["--at", "tip", "-j", "flang"], "'flang' does not exist; did you mean 'flange'?"),
        (["--at", "tip", "--split", "force"], "--at: goes with --point"),
        (["--point", "1", "0", "0"], "--at: goes with --point"),
        (["--at", "world", "--point", "1", "0", "0"], "link 'world' does not exist"),
    ],
)
def test_what_is_no_frame_is_named(linkwise, wrist, options, complaint):
    result = linkwise("loads", wrist, *options)
    assert result.code == 2
    assert complaint in result.err


def between_lines(linkwise, store, *options):
    said = linkwise("loads", str(store), "--at", "child", *options, "--json").json
    assert said["at"]["extremes"] == "of the samples"
    return [w["text"] for w in said["warnings"] if "between the samples" in w["text"]]


def test_peaks_between_the_samples_are_said_at_other_frames(linkwise, tmp_path):
    """A fall onto a stiff stop: no sample of twelve meets the blow."""
    store = tmp_path / "f.zarr"
    machine = stopped_rod(lower=-1.0, upper=0.5, limit_stiffness=1e6)
    lw.simulate(machine, duration=1.0, every=0.09, output=store)
    peak = float(lw.loads.peak_loads(lw.open_run(store)).force[0])
    (said,) = between_lines(linkwise, store)
    assert f"{peak:.4g} N and" in said


def test_only_the_joints_asked_for_are_warned_of(linkwise, tmp_path):
    """Beside the rod that is stopped hangs one that rests; a plate is fixed to each."""
    builder = lw.ModelBuilder("two")
    builder.add_link("ground")
    for name, com, limits in (
        ("stopped", (1.0, 0, 0), {"lower": -1.0, "upper": 0.5, "limit_stiffness": 1e6}),
        ("resting", (0, 0, -1.0), {}),
    ):
        builder.add_link(name, mass=1.0, com=com, inertia=0.01 * np.eye(3))
        builder.add_link(f"{name} plate", mass=0.1, inertia=0.01 * np.eye(3))
        builder.add_joint(f"{name} hinge", "revolute", "ground", name, axis=(0, 1, 0), **limits)
        builder.add_joint(f"{name} flange", "fixed", name, f"{name} plate", translation=com)
    store = tmp_path / "two.zarr"
    lw.simulate(builder.build(), duration=1.0, every=0.09, output=store)
    assert between_lines(linkwise, store, "-j", "resting hinge") == []
    for options in ([], ["-j", "stopped hinge"], ["-j", "stopped flange"]):
        (said,) = between_lines(linkwise, store, *options)
        assert "'stopped hinge'" in said


@pytest.fixture
def blow(tmp_path):
    """A run whose samples miss most of a blow on a stiff stop."""
    store = tmp_path / "blow.zarr"
    run = lw.simulate(stopped_arm(1e7), duration=1.0, every=0.1, output=store)
    return str(store), lw.loads.peak_loads(run)


def test_the_table_says_whose_peaks_it_shows(linkwise, blow, tmp_path):
    store, peaks = blow
    shown = linkwise("loads", store)
    assert "of the samples" not in shown.out + shown.err
    assert f"{float(peaks.moment.sel(joint='shoulder')):.4g}" in shown.out
    in_full = linkwise("loads", store, "-j", "shoulder")
    assert "rms and duty of the samples" in in_full.out
    assert "mean, RMS and duty are of the samples: moment of joint 'shoulder'" in in_full.err
    told = linkwise("loads", store, "--json").json
    assert told["extremes"] == "along the steps"
    assert any("peaks between the samples" in w["text"] for w in told["warnings"])
    lw.simulate(stopped_arm(1e7), duration=1.0, every=0.1, output=tmp_path / "s", extremes=False)
    for options in ([], ["-j", "shoulder"]):
        assert "of the samples (the run holds no extremes)" in linkwise("loads", "s", *options).out


def test_shares_beside_a_peak_say_so(linkwise, tmp_path):
    """Of machines of many joints the run holds no states at the peaks."""
    lw.simulate(lw.scenes.chain(51), duration=0.3, every=0.3, output=tmp_path / "c.zarr")
    shown = linkwise("loads", "c.zarr", "--split", "force").out
    assert "of loads marked * at the sample beside it" in shown
    assert " * " in shown


def test_the_report_and_the_view_say_what_samples_miss(linkwise, blow, tmp_path):
    pytest.importorskip("plotly")
    from linkwise.view.source import Options, open_source

    store, peaks = blow
    text = f"peaks between the samples, at {float(peaks.moment.sel(joint='shoulder')):.4g} N m"
    assert linkwise("loads", store, "--html", "report.html").code == 0
    written = (tmp_path / "report.html").read_text()
    assert written.count(text) == 2
    assert "Of the whole motion, between the samples too." in written
    source = open_source(store, Options())
    assert any("arrows and colours are of the samples" in n and text in n for n in source.notes)
    times, loads = source.recording.history(0, 500)
    assert np.linalg.norm(loads[:, 3:], axis=1).max() == pytest.approx(float(peaks.moment[0]))
    assert float(times[np.linalg.norm(loads[:, 3:], axis=1).argmax()]) == float(
        peaks.moment_time[0]
    )
