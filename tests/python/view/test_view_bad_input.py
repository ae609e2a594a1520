"""`linkwise view` with wrong input: one line on stderr, exit code 2."""

import socket

import pytest

import linkwise as lw


def refuse(result, *parts):
    assert result.code == 2
    assert result.out == ""
    assert result.err.startswith("linkwise: ")
    assert result.err.count("\n") == 1
    for part in parts:
        assert part in result.err


def test_port_in_use(linkwise, run_path):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        refuse(
            linkwise("view", run_path, "--no-open", "--port", port), str(port), "in use", "--port"
        )


@pytest.mark.parametrize("port", ["-1", "65536"])
def test_number_that_is_no_port(linkwise, run_path, port):
    refuse(linkwise("view", run_path, "--no-open", "--port", port), port, "is not a port")


@pytest.mark.parametrize("host", ["192.0.2.1", "no.such.host.invalid"])
def test_host_that_is_not_this_machine(linkwise, run_path, host):
    refuse(linkwise("view", run_path, "--no-open", "--port", 0, "--host", host), host)


def test_folder_that_is_not_a_run(linkwise, tmp_path):
    (tmp_path / "folder").mkdir()
    refuse(linkwise("view", "folder", "--export", "a.html"), "folder", "not a linkwise run")


def test_nothing_there(linkwise):
    refuse(linkwise("view", "nowhere.urdf", "--export", "a.html"), "nowhere.urdf")


@pytest.mark.parametrize(
    ("quantities", "parts"),
    [
        (["joint_load"], ["holds no position", "record"]),
        (["position"], ["holds no joint_load", "record", "--no-loads"]),
    ],
)
def test_run_without_positions_or_loads(linkwise, tmp_path, quantities, parts):
    lw.simulate(lw.scenes.chain(2), duration=0.1, record=quantities, output=tmp_path / "r.zarr")
    refuse(linkwise("view", "r.zarr", "--export", "a.html"), "r.zarr", *parts)
    assert not (tmp_path / "a.html").exists()


def test_run_of_some_joints(linkwise, tmp_path):
    lw.simulate(
        lw.scenes.chain(3), duration=0.1, record={"joints": ["joint_2"]}, output=tmp_path / "r.zarr"
    )
    refuse(linkwise("view", "r.zarr", "--export", "a.html"), "1 of 3", "record all joints")


def test_model_of_another_machine(linkwise, run_path, tmp_path):
    (tmp_path / "other.toml").write_text("[model.chain]\nn_bodies = 6\n[simulate]\nduration = 1\n")
    refuse(
        linkwise("view", run_path, "--model", "other.toml", "--export", "a.html"),
        "other.toml",
        "no joint 'shoulder_yaw'",
    )


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (["--color", "size_"], ["--color", "use size or rating"]),
        (["--color", "rating"], ["there are no ratings", "--ratings"]),
        (["--ratings", "wrong.toml"], ["'elbow_pich'", "did you mean 'elbow_pitch'"]),
        (["--ratings", "nowhere.toml"], ["nowhere.toml"]),
        (["--cause", "grvity"], ["'grvity'", "use gravity, velocity"]),
        (["--cause", "external"], ["'external'", "the run has none; it has velocity, drive"]),
        (["--cause", "gravity", "--no-loads"], ["--no-loads"]),
    ],
)
def test_loads_that_cannot_be_shown(linkwise, run_path, tmp_path, arguments, parts):
    (tmp_path / "wrong.toml").write_text("[rating.elbow_pich]\nradial = 3\n")
    refuse(linkwise("view", run_path, "--export", "a.html", *arguments), *parts)
    assert not (tmp_path / "a.html").exists()


def test_causes_of_a_run_that_lacks_what_they_need(linkwise, tmp_path):
    kept = ["position", "joint_load"]
    lw.simulate(lw.scenes.chain(2), duration=0.1, record=kept, output=tmp_path / "r.zarr")
    result = linkwise("view", "r.zarr", "--export", "a.html", "--cause", "gravity")
    refuse(result, "'gravity'", 'record the quantity "velocity"')


def test_causes_of_a_model(linkwise, tmp_path):
    (tmp_path / "c.toml").write_text("[model.chain]\nn_bodies = 2\n[simulate]\nduration = 1\n")
    result = linkwise("view", "c.toml", "--export", "a.html", "--cause", "gravity")
    refuse(result, "c.toml", "causes go with a run")


def test_model_option_with_a_model(linkwise, tmp_path):
    (tmp_path / "c.toml").write_text("[model.chain]\nn_bodies = 2\n[simulate]\nduration = 1\n")
    refuse(linkwise("view", "c.toml", "--model", "c.toml", "--export", "a.html"), "--model")


@pytest.mark.parametrize(
    ("name", "part"), [("a.txt", ".html"), ("no/such/a.html", "does not exist")]
)
def test_export_that_cannot_be_written(linkwise, run_path, name, part):
    refuse(linkwise("view", run_path, "--export", name), name, part)
