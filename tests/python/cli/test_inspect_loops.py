"""`linkwise inspect` of a machine whose loops close where it is drawn."""

from helpers.press_sdf import PRESS

GEARS = """
model = "wheels.urdf"
[coupling.a]
factors = { one = 1, two = 2 }
[coupling.b]
factors = { two = 1, three = 2 }
[coupling.c]
factors = { one = 1, three = -4 }
[simulate]
duration = 1
"""
WHEEL = (
    '<link name="{0}_wheel"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" '
    'ixz="0" iyz="0"/></inertial></link><joint name="{0}" type="continuous"><parent link="frame"/>'
    '<child link="{0}_wheel"/><axis xyz="0 0 1"/></joint>'
)


def test_mobility_and_self_stresses(linkwise, tmp_path):
    """A slider-crank: planar, so that its loop holds the plane three times more than it must."""
    path = tmp_path / "press.sdf"
    path.write_text(PRESS)
    found = linkwise("inspect", path, "--json").json
    assert (found["counted_mobility"], found["mobility"], found["self_stresses"]) == (-2, 1, 3)
    assert found["loops"][0]["gap"]["shift"] < 1e-15
    shown = " ".join(linkwise("inspect", path).out.split())
    said = "1 joint closes a loop: 3 - 5 = -2 degrees of freedom by counting, 1 as drawn"
    assert f"{said}, with 3 self-stresses" in shown


def test_wheels_that_are_geared_in_a_ring(linkwise, tmp_path):
    """Three gears between three wheels, of which two would do."""
    wheels = "".join(WHEEL.format(name) for name in ("one", "two", "three"))
    urdf = f'<robot name="wheels"><link name="frame"/>{wheels}</robot>'
    (tmp_path / "wheels.urdf").write_text(urdf)
    (tmp_path / "gears.toml").write_text(GEARS)
    found = linkwise("inspect", tmp_path / "gears.toml", "--json").json
    assert (found["counted_mobility"], found["mobility"], found["self_stresses"]) == (0, 1, 1)
    shown = " ".join(linkwise("inspect", tmp_path / "gears.toml").out.split())
    said = "3 couplings: 3 - 3 = 0 degrees of freedom by counting, 1 as drawn, with 1 self-stress"
    assert said in shown
    assert "coupling 'c' hold each other; one of them repeats the others" in shown
    (only,) = found["undecided"]
    assert (only["joints"], only["couplings"]) == ({}, ["a", "b", "c"])


def test_misfits_without_effect_are_noted(linkwise, tmp_path):
    """One slider-crank is one planar loop: shims along its axes press, others move it."""
    (tmp_path / "press.sdf").write_text(PRESS)
    scenario = tmp_path / "press.toml"
    scenario.write_text(
        'model = "press.sdf"\n[bearing.drive]\naxial = "1 N/um"\nradial = "1 N/um"\n'
        'offset = ["1 mm", 0, 0]\n[simulate]\nduration = 1\n'
    )
    shown = " ".join(linkwise("inspect", scenario).out.split())
    assert "offset of its bearing along x: nothing holds against it, so it moves" in shown


def test_what_is_undecided_and_what_decides_it(linkwise, tmp_path):
    """A slider-crank holds its plane three times over; a rod on ball joints would not."""
    path = tmp_path / "press.sdf"
    path.write_text(PRESS)
    shown = " ".join(linkwise("inspect", path).out.split())
    assert "Loads that rigid bodies and bearings do not decide" in shown
    assert "hold each other in 2 ways; to decide it, say how stiff their bearings are" in shown
    told = linkwise("inspect", path, "--json").json["undecided"]
    assert sum(one["self_stresses"] for one in told) == 3
    assert all(len(one["remedies"]) == 2 for one in told)
