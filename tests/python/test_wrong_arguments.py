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
