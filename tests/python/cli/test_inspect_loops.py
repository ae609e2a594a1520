"""`linkwise inspect` of a machine whose loops close where it is drawn."""

from helpers.press_sdf import PRESS


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
