"""Forces of large gain are as right as the motion: stops, springs, drives, dampers, friction."""

import numpy as np
import pytest

import linkwise as lw
from linkwise.loads.extremes import extremes_of

MASS, LENGTH, G = 0.1, 0.5, 9.81
INERTIA = MASS * (1 / 12 + LENGTH**2)


def rod(upper=0.0, **properties):
    """Level at 0, from where it falls on."""
    builder = lw.ModelBuilder("rod")
    builder.add_link("ground")
    inertia = np.diag([1e-5, MASS / 12, MASS / 12])
    builder.add_link("rod", mass=MASS, com=(LENGTH, 0, 0), inertia=inertia)
    axis = (0, 1, 0)
    builder.add_joint("hinge", "revolute", "ground", "rod", axis=axis, upper=upper, **properties)
    return builder.build()


def hardest_push(run):
    """Of the stop, from the accelerations."""
    return MASS * G * LENGTH - INERTIA * float(extremes_of(run, "acceleration").minimum[0])


def blow(stiffness, damping, start):
    """The largest force of a stop at 0, where gravity is nothing beside it.

    I u du/dx = -k x (1 + d u) is integrated over u, from the speed of the fall on.
    """
    speed = np.sqrt(2 * MASS * G * LENGTH * np.sin(-start) / INERTIA)
    if damping == 0:
        return np.sqrt(stiffness * INERTIA) * speed
    u = speed * np.linspace(0, 1, 200_001) ** 2
    held = damping * u - np.log1p(damping * u)
    depth = np.sqrt(2 * INERTIA / stiffness * (held[-1] - held)) / damping
    return (stiffness * depth * (1 + damping * u)).max()


@pytest.mark.parametrize("integrator", ["auto", "bdf", "esdirk", "runge_kutta_8"])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize(
    ("stiffness", "damping"), [(1e8, 0), (1e8, 1), (1e9, 1e3), (1e8, 1e5), (1e10, 1e5)]
)
def test_a_blow_on_a_stop(stiffness, damping, tolerance, integrator):
    model = rod(limit_stiffness=stiffness, limit_damping=damping)
    for start in (-1.0, -0.31):
        options = {"q0": [start], "tolerance": tolerance, "integrator": integrator}
        run = lw.simulate(model, times=[0.6], **options)
        assert hardest_push(run) == pytest.approx(blow(stiffness, damping, start), rel=1e-2)
        assert not [note for note in run.warnings if note["element"] == "forces"]


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6])
def test_the_second_joint_falls_on_a_stop(tolerance):
    """Against a far tighter run; the inertia that the stop feels is that of a moving chain."""
    builder = lw.ModelBuilder("two rods")
    builder.add_link("ground")
    for name in ("upper", "lower"):
        builder.add_link(name, mass=1.0, com=(0, 0, -0.5), inertia=np.diag([0.08, 0.08, 0.001]))
    stop = {"lower": -0.2, "upper": 0.2, "limit_stiffness": 1e9, "limit_damping": 1e3}
    axis = (0, 1, 0)
    builder.add_joint("first", "revolute", "ground", "upper", axis=axis)
    at = (0, 0, -1)
    builder.add_joint("second", "revolute", "upper", "lower", axis=axis, translation=at, **stop)
    options = {"q0": [1.0, 0.1], "times": [0.5]}
    model = builder.build()
    found, truth = (lw.simulate(model, **options, tolerance=t).dataset for t in (tolerance, 1e-10))
    for name in ("acceleration", "joint_load"):
        got, right = (
            np.fmax(abs(x[f"extreme_{name}"]).sel(extreme="maximum"), 0).values
            for x in (found, truth)
        )
        np.testing.assert_allclose(got, right, rtol=2e-2, atol=1e-3 * right.max())


SPRING = 1.0


def wheel(top, stiffness):
    """Swings between -1 and 1, once in 2 pi seconds, were it not for the stop."""
    builder = lw.ModelBuilder("wheel", gravity=(0, 0, 0))
    builder.add_link("ground")
    builder.add_link("wheel", mass=1.0, inertia=np.eye(3))
    axis = (0, 0, 1)
    stop = {"upper": top, "limit_stiffness": stiffness}
    builder.add_joint("hinge", "revolute", "ground", "wheel", axis=axis, stiffness=SPRING, **stop)
    return builder.build()


@pytest.mark.parametrize("stiffness", [1.0, 1e2, 1e4, 1e6])
@pytest.mark.parametrize("beyond", [1e-2, 1e-3, 1e-4])
def test_a_stop_that_is_grazed(stiffness, beyond):
    """As deep as energy says: w^2 (a^2 - x^2) = (k / I) (x - b)^2 at the turn x, once per swing."""
    top = 1 - beyond
    model = wheel(top, stiffness)
    # (1 + k) x^2 - 2 k b x + k b^2 - 1 = 0
    a, b, c = 1 + stiffness, -2 * stiffness * top, stiffness * top**2 - 1
    turn = (-b + np.sqrt(b * b - 4 * a * c)) / (2 * a)
    for phase in np.linspace(1.0, 2.0, 9):
        start = {"q0": [-np.cos(phase)], "v0": [np.sin(phase)]}
        run = lw.simulate(model, duration=3.0, **start, tolerance=1e-5)
        seen = float(extremes_of(run, "position").maximum[0])
        depth = max(seen, run.position.values.max()) - top
        assert depth == pytest.approx(turn - top, rel=2e-2, abs=1e-5)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6])
@pytest.mark.parametrize(
    ("properties", "drive"),
    [
        ({}, lw.PD(1e8, 1e4, -0.5)),
        ({"stiffness": 1e8, "damping": 1e4, "rest_position": -0.5}, None),
        ({"damping": 1e8}, None),
        ({"friction": 2.0, "friction_velocity": 1e-8}, None),
    ],
)
def test_what_holds_still_holds_the_weight(properties, drive, tolerance):
    """The acceleration that is left, against that of the fall."""
    options = {"q0": [-0.5], "tolerance": tolerance, "drives": {"hinge": drive} if drive else None}
    run = lw.simulate(rod(upper=9.0, **properties), times=np.linspace(0, 1, 201), **options)
    fall = MASS * G * LENGTH * np.cos(0.5) / INERTIA
    left = np.abs(run.acceleration.values[20:, 0])
    assert left.max() < 1e-2 * fall


def test_what_rounding_leaves_is_said():
    options = {"times": [0.1], "q0": [-0.5]}
    run = lw.simulate(rod(), **options, drives={"hinge": lw.PD(1e16, 1e9, -0.5)})
    (note,) = [note for note in run.warnings if note["element"] == "forces"]
    assert "joint 'hinge'" in note["text"]
    assert "softer" in note["text"]
    run = lw.simulate(rod(), **options, drives={"hinge": lw.PD(1e6, 1e3, -0.5)})
    assert not [note for note in run.warnings if note["element"] == "forces"]


@pytest.mark.parametrize("options", [{}, {"integrator": "runge_kutta_4", "step": 1e-4}])
def test_springs_of_what_falls_freely_carry_nothing_and_raise_no_warning(options):
    """What rounding makes of the weight is no force to be known."""
    rng = np.random.default_rng(0)
    builder = lw.ModelBuilder("falling")
    builder.add_link("world")
    for k, mass in enumerate((2, 2, 2, 0.05)):
        com, inertia = 0.1 * rng.normal(size=3), np.diag([1e-3, 2e-3, 2.5e-3])
        builder.add_link(f"l{k}", mass=mass, com=com, inertia=inertia)
    builder.add_joint("base", "floating", "world", "l0")
    for k in range(1, 4):
        place = {"translation": 0.3 * rng.normal(size=3), "axis": rng.normal(size=3)}
        springs = {"stiffness": 1e3, "damping": 0.1}
        builder.add_joint(f"j{k}", "revolute", f"l{k - 1}", f"l{k}", **place, **springs)
    model = builder.build()
    q0 = model.neutral_configuration()
    q0[3:7] = np.array([0.1, -0.7, 0.5, 0.5])
    run = lw.simulate(model, duration=0.5, q0=q0, **options)
    assert np.abs(run.joint_load.values).max() < 1e-8
    assert "the force of" not in run.attrs.get("warnings", "")
