"""[spring.NAME] of a scenario puts a spring between two points of any model."""

import pytest

import linkwise as lw
from linkwise.scenario import load_scenario

SPRING = """model = "arm.urdf"
[simulate]
duration = 1
[spring.coil]
parent = "base"
child = "lower"
length = "20 cm"
point = [0, 0, "10 cm"]
stiffness = "2 N/mm"
damping = "5 Ns/m"
"""


def test_a_scenario_gives_one(arm):
    path = arm.with_name("run.toml")
    path.write_text(SPRING)
    model = load_scenario(path).load_model()
    assert (model.loop_names, model.loop_types, model.loop_nv) == (["coil"], ["spring"], [6])
    assert model.loop_axes == [[]]
    want = lw.load(arm).with_spring(
        "coil", "base", "lower", length=0.2, point=(0, 0, 0.1), stiffness=2000, damping=5
    )
    assert model.hash == want.hash
    assert lw.Model.from_bytes(model.to_bytes()).hash == want.hash


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"20 cm"', "-1", "spring.coil.length: "),
        ('"2 N/mm"', '"2 Nm/rad"', "spring.coil.stiffness: "),
        ('"lower"', '"lowr"', "spring.coil.child: the model has no link 'lowr'; did you mean"),
        ("damping", "dampin", "spring.coil.dampin: unknown key; did you mean 'damping'?"),
        ("damping", "armature = 1 #", "spring.coil.armature: unknown key"),
        ('length = "20 cm"', "", "spring.coil.length: is missing"),
    ],
)
def test_what_is_wrong_is_one_line(arm, complaint, old, new, said):
    path = arm.with_name("run.toml")
    path.write_text(SPRING.replace(old, new, 1))
    message = complaint(lambda p: load_scenario(p).load_model(), path)
    assert message.startswith(f": {said}"), message
