"""What NumPy would turn into numbers although it holds others is refused, everywhere alike."""

from fractions import Fraction

import numpy as np
import pytest
import xarray as xr

import linkwise as lw

N = 2
NOT_NUMBERS = {
    "complex numbers": np.array([0.3, 0.2]) + 5j,
    "masked values": np.ma.masked_array([0.3, 0.2], mask=[1, 0]),
    "masked values ": [np.ma.masked, 0.2],
    "times or dates": np.array(["NaT", "NaT"], "m8[s]"),
    "times or dates ": np.array(["2020-01-01", "2020-01-02"], "M8[s]"),
    "text": np.array(["0.3", "0.2"]),
    "text ": ["0.3", "0.2"],
    "text  ": np.array([b"0.3", b"0.2"]),
    "truth values": np.array([True, False]),
    "records": np.zeros(2, [("a", float)]),
    "objects": np.array([object(), 0.2]),
    "objects ": [Fraction(1, 2), 0.2],
    "objects  ": np.array(["0.3", 0.2], object),
}


@pytest.fixture(scope="module")
def model():
    return lw.scenes.chain(N)


@pytest.fixture(scope="module")
def run(model):
    return lw.simulate(model, duration=0.01, every=0.01)


def link(builder, **options):
    builder.add_link("l", **{"mass": 1.0, "inertia": np.eye(3), **options})


def three(values):
    """Three of the two values, as an array or list of the same kind."""
    if isinstance(values, list):
        return [*values, values[0]]
    return (np.ma if np.ma.isMaskedArray(values) else np).concatenate([values, values[:1]])


USES = {
    "forward_dynamics q": lambda m, _, x: lw.forward_dynamics(m, x, [0, 0]),
    "forward_dynamics v": lambda m, _, x: lw.forward_dynamics(m, [0, 0], x),
    "forward_dynamics tau": lambda m, _, x: lw.forward_dynamics(m, [0, 0], [0, 0], x),
    "inverse_dynamics": lambda m, _, x: lw.inverse_dynamics(m, [0, 0], [0, 0], x),
    "joint_loads": lambda m, _, x: lw.joint_loads(m, x, [0, 0]),
    "mass_matrix": lambda m, _, x: lw.mass_matrix(m, x),
    "simulate q0": lambda m, _, x: lw.simulate(m, duration=0.01, q0=x),
    "simulate v0": lambda m, _, x: lw.simulate(m, duration=0.01, v0=x),
    "simulate times": lambda m, _, x: lw.simulate(m, times=x),
    "duration": lambda m, _, x: lw.simulate(m, duration=x[0]),
    "every": lambda m, _, x: lw.simulate(m, duration=1, every=x[0]),
    "tolerance": lambda m, _, x: lw.forward_dynamics(m, [0, 0], [0, 0], tolerance=x[0]),
    "simulate_batch": lambda m, _, x: lw.simulate_batch(m, step=0.01, duration=0.01, q0=x),
    "torque": lambda m, _, x: lw.Torque(x),
    "gain": lambda m, _, x: lw.PD(kp=x[0], kd=1, target=0),
    "table": lambda m, _, x: lw.Table([0, 1], x),
    "wrench": lambda m, _, x: lw.Wrench(three(x)),
    "com": lambda m, _, x: link(lw.ModelBuilder("m"), com=three(x)),
    "axes": lambda m, _, x: lw.scenes.chain(2, axes=three(x)),
    "mass": lambda m, _, x: lw.scenes.chain(2, mass=x[0]),
    "gravity": lambda m, _, x: lw.scenes.chain(2, gravity=three(x)),
    "point": lambda m, run, x: lw.loads.in_frame(run, "world", point=three(x)),
}


@pytest.mark.parametrize("kind", NOT_NUMBERS)
@pytest.mark.parametrize("use", USES)
def test_refused_in_one_line(model, run, use, kind):
    given = NOT_NUMBERS[kind]
    if kind.startswith("objects"):
        given = np.asarray(given, object)
    with pytest.raises(lw.InputError) as caught:
        USES[use](model, run, given)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", NOT_NUMBERS)
def test_the_kind_is_named(model, kind):
    with pytest.raises(lw.InputError, match=f"^q holds {kind.strip()}; give a float64 array$"):
        lw.forward_dynamics(model, NOT_NUMBERS[kind], [0, 0])


@pytest.mark.parametrize(
    "same",
    [
        [0.25, 0.5],
        (np.float32(0.25), 0.5),
        np.array([0.25, 0.5], np.float16),
        np.array([0.25, 0.5], np.longdouble),
        np.array([0.25, 0.5], ">f8"),
        np.array([0.25, 9, 0.5])[::2],
        np.ma.masked_array([0.25, 0.5]),
        xr.DataArray([0.25, 0.5]),
    ],
)
def test_real_numbers_of_every_kind_are_taken(model, same):
    expected = lw.forward_dynamics(model, np.array([0.25, 0.5]), np.zeros(2))
    np.testing.assert_array_equal(lw.forward_dynamics(model, same, [0, 0]), expected)
    start = lw.simulate(model, duration=0.01, every=0.01, q0=same).position.values[0]
    np.testing.assert_array_equal(start, [0.25, 0.5])


COUNTS = {
    "forward_dynamics": lambda m, n: lw.forward_dynamics(m, [[0, 0]] * 3, [0, 0], threads=n),
    "mass_matrix": lambda m, n: lw.mass_matrix(m, [[0, 0]] * 3, threads=n),
    "joint_loads": lambda m, n: lw.joint_loads(m, [[0, 0]] * 3, [0, 0], threads=n),
    "simulate": lambda m, n: lw.simulate(m, duration=0.01, threads=n),
    "simulate_batch": lambda m, n: lw.simulate_batch(m, step=0.01, duration=0.01, threads=n),
}


@pytest.mark.parametrize("use", COUNTS)
@pytest.mark.parametrize("count", [1.5, 2.0, "2", True, 0, -1, 2**31, 2**70, [2]])
def test_what_is_no_count_of_threads(model, use, count):
    with pytest.raises(lw.InputError, match=r"^threads\b") as caught:
        COUNTS[use](model, count)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("use", COUNTS)
@pytest.mark.parametrize("count", [None, 2, np.int64(2), np.uint8(1)])
def test_counts_of_threads(model, use, count):
    COUNTS[use](model, count)
