"""Arguments of the wrong type, missing ones and unknown names: one line; models have a value."""

import pickle

import pytest

import linkwise as lw
from helpers.loaded_arm import arm

Q = [0, 0, 0]
CALLS = {
    "type": (lambda m: lw.joint_poses("arm", Q), "joint_poses", "given (str, list)"),
    "missing": (lambda m: lw.mass_matrix(m), "mass_matrix", "given (Model)"),
    "unknown": (lambda m: lw.joint_loads(m, Q, Q, metod="x"), "joint_loads", "metod: str"),
    "method": (lambda m: m.joint_index(3), "Model.joint_index", "given (int)"),
    "no mass": (lambda m: m.with_payload("hand"), "Model.with_payload", "given (str)"),
    "bytes": (lambda m: lw.Model.from_bytes("x"), "from_bytes", "given (str)"),
    "frame": (lambda m: lw.Frame(), "Frame", "given ()"),
    "builder": (lambda m: lw.ModelBuilder(3), "ModelBuilder", "given (int)"),
    "link": (lambda m: lw.ModelBuilder().add_link(3), "ModelBuilder.add_link", "given (int)"),
    "solve": (lambda m: lw.ConstraintSystem(m, Q).solve(3), "ConstraintSystem.solve", "(int)"),
}


@pytest.mark.parametrize("call", CALLS)
def test_one_line_says_what_is_taken_and_what_was_given(call):
    use, name, given = CALLS[call]
    with pytest.raises(TypeError) as error:
        use(arm())
    text = str(error.value)
    assert "\n" not in text
    assert text.startswith(f"{name}(): takes (")
    assert given in text
    assert "object" not in text
    assert "linkwise._core" not in text


def test_other_complaints_stay_as_they_are():
    with pytest.raises(lw.InputError, match="joint 'elbo' does not exist"):
        arm().joint_index("elbo")
    with pytest.raises(lw.InputError, match="q holds text"):
        lw.joint_poses(arm(), "text")
    assert arm().joint_index(name="elbow") == 1


def test_models_are_equal_by_what_they_are():
    model = arm()
    again = pickle.loads(pickle.dumps(model))
    assert model == again
    assert hash(model) == hash(again)
    assert {model: 1}[again] == 1
    assert model == arm()
    other = model.with_payload("hand", mass=1e-9, inertia=[[0.0] * 3] * 3)
    assert model != other
    assert model != "arm"
    assert model is not None


REFUSED = {
    "model": (lambda m: lw.simulate("arm.urdf", duration=1), "model: is a str; give a linkwise"),
    "models": (lambda m: lw.simulate_batch("arm.urdf", duration=1, step=0.1), "model: is a str"),
    "drive name": (lambda m: lw.simulate(m, duration=1, drives={1: 2}), "drives: 1 names no joint"),
    "no drive": (
        lambda m: lw.simulate(m, duration=1, drives={m.joint_names[0]: None}),
        "None given; give a drive",
    ),
    "loops": (lambda m: lw.simulate(m, duration=1, loop_position=[1]), "loop_position: [1] given"),
    "progress": (lambda m: lw.simulate(m, duration=1, progress=3), "progress: 3 given"),
    "output": (lambda m: lw.simulate(m, duration=1, output=3), "output: is a int; give a path"),
    "bytes": (lambda m: lw.simulate(m, duration=1, output=b"r.zarr"), "output: is a bytes"),
    "NUL": (lambda m: lw.simulate(m, duration=1, output="a\0b"), "NUL character"),
    "file": (lambda m: lw.load(None), "model file: is a NoneType; give a path"),
    "run": (lambda m: lw.open_run(3), "run: is a int; give a path"),
    "table": (lambda m: lw.simulate(m, duration=0.01).to_csv(None), "path: is a NoneType"),
    "folder": (lambda m: lw.load("arm.urdf", package_dirs="/none"), "'/none' is not a directory"),
}


@pytest.mark.parametrize("call", REFUSED)
def test_what_cannot_be_meant_is_input_that_is_wrong(call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    use, said = REFUSED[call]
    with pytest.raises(lw.InputError) as error:
        use(arm())
    assert said in str(error.value)
    assert "\n" not in str(error.value)
    assert list(tmp_path.iterdir()) == []


def test_a_tolerance_finer_than_doubles_is_said():
    chain = lw.scenes.chain(2)
    run = lw.simulate(chain, duration=0.1, q0=[1, 1], tolerance=1e-16)
    assert [w["element"] for w in run.warnings] == ["tolerance"]
    assert "held to 1.4e-14 of each number" in run.warnings[0]["text"]
    assert lw.simulate(chain, duration=0.1, q0=[1, 1], tolerance=1e-13).warnings == []
