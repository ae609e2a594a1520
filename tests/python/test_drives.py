"""Drives: their checks, and which call of the core each of them makes."""

import math

import numpy as np
import pytest

from linkwise._core import InputError
from linkwise.drives import PD, Free, Locked, Spring, Table, Torque, Wrench, as_drive, as_wrench


class Recorder:
    """Stands for a core Simulation and keeps what it is told."""

    def __init__(self):
        self.calls = []

    def __getattr__(self, name):
        return lambda *args, **kwargs: self.calls.append((name, args, kwargs))


def call_of(drive, name="elbow"):
    recorder = Recorder()
    drive.apply(recorder, name)
    (call,) = recorder.calls
    return call


TABLE = Table([0, 1, 2], [[5], [6], [7]], "cubic")


def test_torque():
    name, (joint, value), options = call_of(Torque(3))
    assert (name, joint, options) == ("drive_torque", "elbow", {})
    np.testing.assert_array_equal(value, [3])
    _, (_, value), _ = call_of(Torque([1, 2, 3]))
    np.testing.assert_array_equal(value, [1, 2, 3])


def test_torque_of_a_table_and_of_a_function():
    name, (joint, times, values), options = call_of(Torque(TABLE))
    assert (name, joint, options) == ("drive_torque_table", "elbow", {"interpolation": "cubic"})
    np.testing.assert_array_equal(times, [0, 1, 2])
    np.testing.assert_array_equal(values, [[5], [6], [7]])

    def function(t, q, v):
        return -v

    assert call_of(Torque(function)) == ("drive_torque_callable", ("elbow", function), {})


def test_pd():
    assert call_of(PD(100, 10, 0.5)) == ("drive_pd", ("elbow", 100.0, 10.0, 0.5), {})
    name, (joint, kp, kd, times, values), options = call_of(PD(kp=100, kd=10, target=TABLE))
    assert (name, joint, kp, kd) == ("drive_pd_table", "elbow", 100.0, 10.0)
    assert options == {"interpolation": "cubic"}
    np.testing.assert_array_equal(times, [0, 1, 2])
    np.testing.assert_array_equal(values, [5, 6, 7])


def test_spring_locked_free():
    assert call_of(Spring(50, 1, rest=0.2)) == ("drive_pd", ("elbow", 50.0, 1.0, 0.2), {})
    assert call_of(Locked()) == ("drive_locked", ("elbow",), {})
    assert call_of(Free()) == ("drive_free", ("elbow",), {})


def test_wrench():
    name, (body, value), options = call_of(Wrench([1, 2, 3, 4, 5, 6], axes="frame"), "hand")
    assert (name, body, options) == ("wrench", "hand", {"axes": "frame"})
    np.testing.assert_array_equal(value, [1, 2, 3, 4, 5, 6])
    table = Table([0, 1], np.ones((2, 6)))
    name, (_, times, values), options = call_of(Wrench(table))
    assert (name, values.shape) == ("wrench_table", (2, 6))
    assert options == {"interpolation": "linear", "axes": "world"}
    np.testing.assert_array_equal(times, [0, 1])
    name, (_, function), options = call_of(Wrench(math.sin))
    assert (name, function, options) == ("wrench_callable", math.sin, {"axes": "world"})


def test_shorthands():
    assert isinstance(as_drive(3.0), Torque)
    assert isinstance(as_drive(TABLE), Torque)
    assert isinstance(as_drive(lambda t, q, v: 0.0), Torque)
    drive = Locked()
    assert as_drive(drive) is drive
    assert isinstance(as_wrench([0] * 6), Wrench)
    wrench = Wrench([0] * 6)
    assert as_wrench(wrench) is wrench


def test_tables_keep_their_own_copy():
    times = np.array([0.0, 1.0])
    table = Table(times, [1, 2])
    times[0] = 5
    np.testing.assert_array_equal(table.times, [0, 1])
    assert table.values.shape == (2, 1)
    with pytest.raises(ValueError, match="read-only"):
        table.values[0] = 3


def test_table_from_csv(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("time,a,b\n0,1,2\n1,3,4\n")
    np.testing.assert_array_equal(Table.from_csv(path).values, [[1, 2], [3, 4]])
    np.testing.assert_array_equal(Table.from_csv(path, "b").values, [[2], [4]])
    table = Table.from_csv(path, ["b", "a"], interpolation="cubic")
    np.testing.assert_array_equal(table.values, [[2, 1], [4, 3]])
    assert table.interpolation == "cubic"
    with pytest.raises(InputError, match=r"t\.csv:1: column 'c': does not exist; "):
        Table.from_csv(path, "c")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Torque(float("nan")), "torque: not finite; give finite numbers in SI units"),
        (lambda: Torque("3"), "torque holds text; give a float64 array"),
        (lambda: PD(-1, 0), "pd kp: is negative (-1); give a value >= 0"),
        (lambda: PD(1, math.inf), "pd kd: not finite; give finite numbers in SI units"),
        (lambda: PD([1, 2], 0), "pd kp: has shape (2,); give one number"),
        (
            lambda: PD(1, 1, Table([0, 1], np.ones((2, 2)))),
            "pd target: the table has several columns; name one",
        ),
        (lambda: Spring(1, -2), "spring damping: is negative (-2); give a value >= 0"),
        (lambda: Wrench([1, 2, 3]), "wrench: shape (3,); give six components fx fy fz nx ny nz"),
        (
            lambda: Wrench(Table([0, 1], [1, 2])),
            "wrench: shape (1,); give six components fx fy fz nx ny nz",
        ),
        (
            lambda: Wrench([0] * 6, axes="hand"),
            "wrench axes: 'hand' is unknown; use world or frame",
        ),
        (lambda: Table([0], [1]), "table times: shape (1,); give (n,) with n >= 2"),
        (
            lambda: Table([0, 1], [1, 2, 3]),
            "table values: shape (3,) for 2 times; give (2,) or (2, k)",
        ),
        (lambda: Table([0, 2, 1], [1, 2, 3]), "table times: 1 s after 2 s; give increasing times"),
        (
            lambda: Table([0, 1], [1, np.nan]),
            "table values: not finite; give finite numbers in SI units",
        ),
        (
            lambda: Table([0, 1], [1, 2], "quintic"),
            "table interpolation: 'quintic' is unknown; use linear or cubic",
        ),
    ],
)
def test_bad_values(make, message):
    with pytest.raises(InputError) as caught:
        make()
    assert str(caught.value) == message
