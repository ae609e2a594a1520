"""What is opened: runs with the model that they hold, models with their appearance."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from test_bearings import door

import linkwise as lw
from linkwise import base
from linkwise.io.urdf_visuals import read_appearance
from linkwise.record.model import GROUP, read_model
from linkwise.view.pose import Pose
from linkwise.view.source import Options, open_source

URDF = """<robot name="arm">
  <material name="blue"><color rgba="0 0 1 1"/></material>
  <link name="base">
    <visual><geometry><mesh filename="package://parts/base.stl" scale="2 2 2"/></geometry></visual>
    <visual><geometry><mesh filename="http://example.org/far.stl"/></geometry></visual>
  </link>
  <link name="upper"><inertial><origin xyz="0 0 0.5"/><mass value="2"/>
    <inertia ixx="0.2" iyy="0.2" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><origin xyz="0 0 0.5" rpy="0 0 1.5707963267948966"/>
      <geometry><box size="0.1 0.2 1"/></geometry><material name="blue"/></visual>
    <visual><geometry><box size="broken"/></geometry></visual>
    <visual><geometry><sphere radius="0.3"/></geometry></visual>
  </link>
  <joint name="elbow" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 1 0"/><limit lower="-1.5" upper="1.5" effort="50" velocity="3"/></joint>
</robot>
"""


@pytest.fixture
def urdf(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(URDF)
    return path


def write_stl(path):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
        "endloop\nendfacet\nendsolid s\n"
    )


def test_run_holds_its_model(run_path, arm):
    held = read_model(run_path)
    assert held.hash == arm.hash
    assert held.joint_names == arm.joint_names


def test_path_of_the_model_file_stays_out_of_the_run(urdf, tmp_path):
    model = lw.load(urdf)
    lw.simulate(model, duration=0.1, output=tmp_path / "run.zarr")
    assert read_model(tmp_path / "run.zarr").source == "arm.urdf"
    assert model.to_bytes().count(str(tmp_path).encode()) > 0
    assert model.to_bytes(source="").count(str(tmp_path).encode()) == 0


def test_run_with_damaged_model_is_refused(run_path, tmp_path):
    copy = tmp_path / "copy.zarr"
    shutil.copytree(run_path, copy)
    for chunk in (copy / GROUP / "description" / "c").iterdir():
        chunk.write_bytes(b"nonsense")
    with pytest.raises(lw.InputError, match="is damaged"):
        read_model(copy)


@pytest.mark.parametrize("content", [b"", b"x", b"\0" * 100, b"\xff" * 100])
def test_bytes_that_are_no_model_are_refused(content):
    with pytest.raises(lw.InputError):
        lw.Model.from_bytes(content)


def test_recording_gives_the_samples_of_the_run(run_path, arm, monkeypatch):
    monkeypatch.setattr(base, "BLOCK_BYTES", 5 * 8 * (arm.nq + 6 * arm.n_joints))
    run = lw.open_run(run_path)
    recording = open_source(run_path, Options()).recording
    assert np.array_equal(recording.times, run.time.values)
    for sample in (0, 7, 3, 40, 39):
        assert np.array_equal(recording.position(sample), run.position.values[sample])
        assert np.array_equal(recording.load(sample), run.joint_load.values[sample])
    peaks = run.peak_loads()
    assert recording.largest == (float(peaks.force.max()), float(peaks.moment.max()))
    times, loads = recording.history(2, 9)
    own = {float(peaks[name][2]) for name in ("force_time", "moment_time")}
    assert set(times) == set(run.time.values[np.linspace(0, 40, 9).astype(int)]) | own
    assert (times[0], times[-1]) == (0.0, 2.0)
    assert np.array_equal(loads[-1], run.joint_load.values[-1, 2])


def test_the_appearance_is_read_and_nothing_is_fetched(urdf, tmp_path):
    appearance = read_appearance(urdf)
    assert appearance.links == ["base", "upper"]
    assert [visual.shape for visual in appearance.visuals] == ["box", "sphere"]
    assert appearance.missing == ["package://parts/base.stl", "http://example.org/far.stl"]
    box = appearance.visuals[0]
    assert box.color == (0, 0, 1, 1)
    assert box.size == (0.1, 0.2, 1)
    assert box.placement == pytest.approx(
        np.array([[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0.5], [0, 0, 0, 1]]), abs=1e-12
    )
    write_stl(tmp_path / "parts" / "base.stl")
    found = read_appearance(urdf).visuals[0]
    assert (found.link, found.path) == ("base", tmp_path / "parts" / "base.stl")
    assert found.size == (2, 2, 2)


def test_roll_pitch_yaw_as_in_the_simulation(tmp_path):
    rpy = "0.3 -0.4 0.5"
    path = tmp_path / "turned.urdf"
    path.write_text(
        URDF.replace('rpy="0 0 1.5707963267948966"', f'rpy="{rpy}"').replace(
            '<joint name="elbow" type="revolute">',
            f'<joint name="elbow" type="revolute"><origin rpy="{rpy}"/>',
        )
    )
    placed = lw.link_poses(lw.load(path), np.zeros(1))[1]
    assert read_appearance(path).visuals[0].placement[:3, :3] == pytest.approx(
        placed[:3, :3], abs=1e-12
    )


def test_run_takes_its_appearance_from_the_file_beside_it(urdf, tmp_path, monkeypatch):
    lw.simulate(lw.load(urdf), duration=0.1, output=tmp_path / "run.zarr")
    assert len(open_source(tmp_path / "run.zarr", Options()).appearance.visuals) == 2
    other = URDF.replace('"base"', '"pedestal"')
    urdf.write_text(other)
    assert open_source(tmp_path / "run.zarr", Options()).appearance.visuals == []
    urdf.unlink()
    assert open_source(tmp_path / "run.zarr", Options()).appearance.visuals == []


def test_missing_meshes_are_told(urdf):
    (note,) = open_source(urdf, Options()).notes
    assert "2 meshes" in note
    assert "--package-dir" in note


def test_scenario_shows_its_model(tmp_path):
    path = tmp_path / "chain.toml"
    path.write_text("[model.chain]\nn_bodies = 3\n[simulate]\nduration = 1\n")
    assert open_source(path, Options()).model.n_joints == 3


def test_scenario_finds_the_appearance_of_its_file(urdf, tmp_path):
    path = Path(tmp_path / "swing.toml")
    path.write_text('model = "arm.urdf"\n[simulate]\nduration = 1\n')
    assert len(open_source(path, Options()).appearance.visuals) == 2


def payload_run(urdf, tmp_path):
    """A run of the arm with 5 kg more than its file has."""
    model = lw.load(urdf).with_payload("upper", mass=5.0)
    lw.simulate(model, duration=0.1, q0=[0.3], output=tmp_path / "run.zarr")
    return model


def test_a_model_file_gives_meshes_alone(urdf, tmp_path):
    model = payload_run(urdf, tmp_path)
    source = open_source(tmp_path / "run.zarr", Options(model=urdf))
    assert source.model.total_mass == model.total_mass == lw.load(urdf).total_mass + 5
    assert len(source.appearance.visuals) == len(read_appearance(urdf, []).visuals)
    run = lw.open_run(tmp_path / "run.zarr")
    recording = source.recording
    recording.causes.choose(["gravity"])
    recording.causes.choose(recording.causes.names)
    np.testing.assert_allclose(
        recording.causes.load(3), run.joint_load[3].values, rtol=1e-9, atol=1e-9
    )


def test_a_run_without_its_model_takes_the_file_s_with_a_warning(urdf, tmp_path):
    payload_run(urdf, tmp_path)
    shutil.rmtree(tmp_path / "run.zarr" / GROUP)
    shutil.rmtree(tmp_path / "run.zarr" / "files")
    with pytest.warns(UserWarning, match="its hash is not that of the model that the run was made"):
        source = open_source(tmp_path / "run.zarr", Options(model=urdf))
    assert source.model.total_mass == lw.load(urdf).total_mass


def test_loads_of_another_machine_are_refused(urdf, tmp_path):
    payload_run(urdf, tmp_path)
    run = lw.open_run(tmp_path / "run.zarr")
    with pytest.raises(lw.InputError, match="masses, frames or joint properties differ; leave it"):
        lw.loads.split(run, "force", lw.load(urdf))
    held = run.load_model()
    again = lw.loads.split(lw.open_run(tmp_path / "run.zarr"), "force", held)
    assert again.identical(lw.loads.split(run, "force"))


def test_a_scenario_starts_in_its_initial_position():
    """The joint that it places is there, and the others have followed."""
    source = open_source("examples/data/watt.toml", Options())
    model = source.model
    angle = np.deg2rad(20)
    assert source.first_position[model.q_slice("left")] == pytest.approx(angle, abs=1e-15)
    assert source.held == ["left"]
    pose = Pose(model, source.held)
    q = pose.assembled(source.first_position, None)
    assert q[model.q_slice("left")] == pytest.approx(angle, abs=1e-12)
    assert np.abs(lw.loop_gaps(model, q)).max() < 1e-12
    assert pose.told.startswith("loops were open; moved to close them: ")
    drawn = open_source("examples/data/watt.urdf", Options())
    np.testing.assert_array_equal(drawn.first_position, model.initial_configuration())


def test_which_loads_are_known_is_opened_with_them(tmp_path):
    model = door("revolute")
    run = lw.simulate(model, duration=0.05, output=tmp_path / "door.zarr")
    source = open_source(run.path, Options())
    np.testing.assert_array_equal(source.known.throughout, run.determinate)
    assert any("dashed arrows" in note for note in source.notes)
    source = open_source("examples/data/watt.urdf", Options())
    assert source.known.throughout.any()
    assert not source.known.throughout.all()
    assert any("hold each other" in note for note in source.notes)
    assert open_source("examples/data/hoist.urdf", Options()).known is None
