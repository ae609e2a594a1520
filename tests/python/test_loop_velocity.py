"""A machine starts with given rates of joints that close loops: what follows, against finite
differences of closed positions, a minimum with a constraint, and what contradicts itself."""

from pathlib import Path

import numpy as np
import pytest

import linkwise as lw
from linkwise.scenario import load_scenario

FOOT, HEAD = np.array([0.6, 0, -0.8]), np.array([2.4, 0, 0.35])  # of the cylinder, m
ELBOW, AXIS = np.array([5.5, 0, 0]), (0, -1, 0)
RAISED, PUSHED = 0.5, 0.13  # rad, m/s


def excavator() -> lw.Model:
    """Boom and stick; the cylinder between its barrel and its rod closes the loop."""
    builder = lw.ModelBuilder("excavator")
    builder.add_link("machine")
    for name, mass, length in (("boom", 1800.0, 5.5), ("stick", 900.0, 2.9)):
        inertia = np.diag([1, 1, 1]) * mass * length**2 / 12
        builder.add_link(name, mass=mass, com=(length / 2, 0, 0.1), inertia=inertia)
    for name, mass in (("barrel", 60.0), ("rod", 40.0)):
        builder.add_link(name, mass=mass, com=(0.4, 0, 0), inertia=np.diag([0.1, 5, 5]))
    builder.add_joint("boom_pin", "revolute", "machine", "boom", axis=AXIS)
    builder.add_joint("stick_pin", "revolute", "boom", "stick", translation=ELBOW, axis=AXIS)
    builder.add_joint("foot", "revolute", "machine", "barrel", translation=FOOT, axis=AXIS)
    builder.add_joint("head", "revolute", "boom", "rod", translation=HEAD, axis=AXIS)
    builder.add_loop("cylinder", "prismatic", "barrel", "rod", axis=(1, 0, 0))
    return builder.build()


def length_of(boom: float) -> float:
    """Of the cylinder, from the triangle that it makes with the boom."""
    c, s = np.cos(boom), np.sin(boom)
    return float(np.linalg.norm([c * HEAD[0] - s * HEAD[2], s * HEAD[0] + c * HEAD[2]] - FOOT[::2]))


def start(model: lw.Model) -> np.ndarray:
    """Closed, with the boom raised."""
    q = np.array(model.initial_configuration())
    c, s = np.cos(RAISED), np.sin(RAISED)
    way = np.array([c * HEAD[0] - s * HEAD[2], s * HEAD[0] + c * HEAD[2]]) - FOOT[::2]
    angle = np.arctan2(way[1], way[0])
    q[model.q_slice("boom_pin")], q[model.q_slice("stick_pin")] = RAISED, -1.2
    q[model.q_slice("foot")], q[model.q_slice("head")] = angle, angle - RAISED
    return lw.assemble(model, q, hold=["boom_pin", "stick_pin"]).q


def swing(middle: float) -> lw.Motion:
    """At 0.4 rad/s at first."""
    return lw.Motion(lambda t: (middle + 0.4 * np.sin(t), 0.4 * np.cos(t), -0.4 * np.sin(t)))


def rate_of(model: lw.Model, v: np.ndarray, joint: str) -> float:
    return float(v[model.v_slice(joint)][0])


def test_the_rate_of_a_cylinder_against_differences_of_its_length() -> None:
    model = excavator()
    q = start(model)
    found = lw.assemble(model, q, hold=["stick_pin"], loop_velocity={"cylinder": PUSHED})
    assert lw.loop_coordinates(model, found.q, found.v)[1][0] == pytest.approx(PUSHED, rel=1e-13)
    h = 1e-5
    gain = (length_of(RAISED + h) - length_of(RAISED - h)) / (2 * h)  # m per rad
    assert rate_of(model, found.v, "boom_pin") == pytest.approx(PUSHED / gain, rel=1e-9)
    assert rate_of(model, found.v, "stick_pin") == 0  # held
    # All joints: positions closed at lengths a little apart.
    apart = [
        lw.assemble(model, q, hold=["stick_pin"], loop_position={"cylinder": length + sign * h}).q
        for length in [float(lw.loop_coordinates(model, q, np.zeros(model.nv))[0][0])]
        for sign in (-1, 1)
    ]
    np.testing.assert_allclose(found.v, PUSHED * (apart[1] - apart[0]) / (2 * h), atol=1e-8)


def test_the_rest_takes_the_least_kinetic_energy() -> None:
    """The stick is free: of all rates with that of the cylinder those that are nearest to v0."""
    model = excavator()
    q = start(model)
    v0 = np.array([0.02, -0.3, 0.1, 0.05])
    found = lw.assemble(model, q, v0, loop_velocity={"cylinder": PUSHED}).v
    H = lw.mass_matrix(model, q)
    still = lw.assemble(model, q, hold=["stick_pin"], loop_velocity={"cylinder": PUSHED}).v
    stick = np.eye(model.nv)[model.v_slice("stick_pin")][0]  # the one way to move with it kept
    share = stick @ H @ (v0 - still) / (stick @ H @ stick)
    np.testing.assert_allclose(found, still + share * stick, rtol=1e-10, atol=1e-13)


def test_a_run_starts_with_it_and_says_so_of_rates_that_were_asked_for() -> None:
    model = excavator()
    q, given = start(model), {"cylinder": [PUSHED]}
    run = lw.simulate(model, duration=0.02, every=0.01, q0=q, loop_velocity=given)
    assert run["loop_velocity"].values[0, 0] == pytest.approx(PUSHED, rel=1e-12)
    length = run["loop_position"].values[:, 0]
    assert length[1] - length[0] == pytest.approx(0.01 * PUSHED, rel=0.2)
    assert not [w for w in run.warnings if "rates that keep" in w["text"]]
    asked = np.array([9.0, 0, 0, 0])
    run = lw.simulate(model, duration=0.01, q0=q, v0=asked, loop_velocity=given)
    (text,) = [w["text"] for w in run.warnings if "rates that keep" in w["text"]]
    assert "'boom_pin' is 0.141 instead of 9" in text
    assert "stick" not in text


def test_with_a_given_motion_of_another_joint() -> None:
    model = excavator()
    moved = {"stick_pin": swing(-1.2)}
    run = lw.simulate(
        model, duration=0.01, q0=start(model), drives=moved, loop_velocity={"cylinder": PUSHED}
    )
    assert float(run.velocity.sel(dof="stick_pin").values[0]) == pytest.approx(0.4)
    assert run["loop_velocity"].values[0, 0] == pytest.approx(PUSHED, rel=1e-12)
    moved = {"boom_pin": swing(RAISED)}
    with pytest.raises(lw.InputError, match=r"rates of 'boom_pin' and 'cylinder' contradict each"):
        lw.simulate(
            model, duration=0.01, q0=start(model), drives=moved, loop_velocity={"cylinder": PUSHED}
        )


def test_held_joints_keep_their_rates_where_they_can() -> None:
    """The boom follows its cylinder; the stick, held behind it, stays."""
    model = excavator()
    q = start(model)
    found = lw.assemble(
        model, q, hold=["boom_pin", "stick_pin"], loop_velocity={"cylinder": PUSHED}
    )
    assert rate_of(model, found.v, "boom_pin") > 0.01
    assert rate_of(model, found.v, "stick_pin") == 0
    assert found.released == ()


def test_positions_and_rates_of_a_loop_joint_together() -> None:
    model = excavator()
    q = start(model)
    at = {"cylinder": float(lw.loop_coordinates(model, q, np.zeros(4))[0][0]) + 0.1}
    found = lw.assemble(model, q, loop_position=at, loop_velocity={"cylinder": PUSHED})
    here, rate = lw.loop_coordinates(model, found.q, found.v)
    assert here[0] == pytest.approx(at["cylinder"], abs=1e-12)
    assert rate[0] == pytest.approx(PUSHED, rel=1e-12)


def test_several_axes() -> None:
    """A ball that closes a loop of two hinges and a slider spins as it is told to."""
    builder = lw.ModelBuilder("ball")
    builder.add_link("ground")
    body = {"mass": 1.0, "inertia": np.diag([0.1, 0.2, 0.3])}
    builder.add_link("arm", **body, com=(0.3, 0, 0))
    builder.add_link("ball", **body)
    builder.add_joint("free", "floating", "ground", "arm")
    builder.add_joint("pin", "revolute", "arm", "ball", translation=(0.5, 0, 0), axis=(0, 0, 1))
    builder.add_loop("socket", "spherical", "ground", "ball", translation=(0.5, 0, 0))
    model = builder.build()
    asked = [0.3, -0.2, 0.7]
    found = lw.assemble(model, loop_velocity={"socket": asked})
    np.testing.assert_allclose(
        lw.loop_coordinates(model, found.q, found.v)[1], asked, rtol=1e-12, atol=1e-13
    )
    with pytest.raises(lw.InputError, match=r"'socket' .*has 3 rates; 1 are given"):
        lw.assemble(model, loop_velocity={"socket": 0.3})


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"boom_pin": 1.0}, "'boom_pin' is no joint that closes a loop; rates of joints of the"),
        ({"cylinder": [1.0, 2.0]}, "has 1 rates; 2 are given"),
        ({"cylinder": float("nan")}, "give finite rates"),
    ],
)
def test_what_is_refused(given, text) -> None:
    with pytest.raises(lw.InputError, match=text) as error:
        lw.assemble(excavator(), start(excavator()), loop_velocity=given)
    assert "\n" not in str(error.value)


def test_rates_that_contradict_each_other() -> None:
    """Three bars and three given turns; and a crank in its dead centre."""
    machine = lw.scenes.benchmark("four_bars", n=2)
    given = {"C1": 0.3, "C2": 5.0}
    alone = lw.assemble(machine.model, machine.q0, loop_velocity={"C1": 0.3})
    assert np.abs(alone.v).max() > 0.1
    with pytest.raises(lw.InputError, match=r"rates of 'C1' and 'C2' contradict each other") as e:
        lw.assemble(machine.model, machine.q0, loop_velocity=given)
    assert "give fewer of them" in str(e.value)
    with pytest.raises(lw.InputError, match=r"loop_velocity: 'C1'.* has a given motion"):
        lw.simulate(
            machine.model,
            duration=0.01,
            q0=machine.q0,
            drives={"C1": lw.Locked()},
            loop_velocity={"C1": 0.3},
        )
    with pytest.raises(lw.InputError, match=r"assemble='exact' takes all rates from v0"):
        lw.simulate(
            machine.model,
            duration=0.01,
            q0=machine.q0,
            v0=machine.v0,
            numerics={"assemble": "exact"},
            loop_velocity={"C1": 0.3},
        )


def test_a_spring_between_points_takes_none() -> None:
    builder = lw.ModelBuilder("hung")
    builder.add_link("ground")
    builder.add_link("arm", mass=1.0, com=(0.5, 0, 0), inertia=np.diag([0.1, 0.1, 0.1]))
    builder.add_joint("pin", "revolute", "ground", "arm", axis=(0, 1, 0))
    builder.add_spring("spring", "ground", "arm", length=0.3, stiffness=10.0, point=(0, 0, 1))
    with pytest.raises(lw.InputError, match="'spring' is no joint that closes a loop"):
        lw.assemble(builder.build(), loop_velocity={"spring": 1.0})


def test_a_scenario(tmp_path) -> None:
    text = 'model = "watt.urdf"\n[initial.position]\nleft = 0.3\n[initial.velocity]\n'
    text += 'lower = "10 deg/s"\n[simulate]\nduration = 0.01\n'
    watt = Path(__file__).parents[2] / "examples" / "data" / "watt.urdf"
    (tmp_path / "watt.urdf").write_bytes(watt.read_bytes())
    (tmp_path / "watt.toml").write_text(text)
    scenario = load_scenario(tmp_path / "watt.toml")
    arguments = scenario.simulate_arguments(scenario.load_model())
    assert arguments["loop_velocity"] == {"lower": [pytest.approx(np.radians(10))]}
    run = lw.run_scenario(tmp_path / "watt.toml")
    assert run["loop_velocity"].values[0, 0] == pytest.approx(np.radians(10), rel=1e-12)
    assert float(run.position.sel(coordinate="left").values[0]) == pytest.approx(0.3, abs=1e-12)
    (tmp_path / "watt.toml").write_text(text.replace("10 deg/s", "10 mm/s"))
    with pytest.raises(lw.InputError, match=r"initial\.velocity\.lower"):
        lw.run_scenario(tmp_path / "watt.toml")
