"""Numbers with units."""

import math
import re

import pytest

from linkwise.io.numbers import parse_number
from linkwise.io.units import UNITS, check_dimension, parse_quantity


@pytest.mark.parametrize(
    ("text", "value", "dimension"),
    [
        ("30 deg", math.pi / 6, "angle"),
        ("30deg", math.pi / 6, "angle"),
        ("-30°", -math.pi / 6, "angle"),
        ("0.3 rad", 0.3, "angle"),
        ("5 mm", 0.005, "length"),
        ("2 Nm", 2.0, "moment"),
        ("2 N m", 2.0, "moment"),
        ("2 N*m", 2.0, "moment"),
        ("2 N·m", 2.0, "moment"),
        ("50 g cm2", 5e-6, "inertia"),
        ("120 mN m", 0.12, "moment"),
        ("3 N·cm", 0.03, "moment"),
        ("2 kN/mm", 2e6, "stiffness"),
        ("36 km/h", 10.0, "velocity"),
        ("60 rpm", 2 * math.pi, "angular velocity"),
        ("9.81 m/s^2", 9.81, "acceleration"),
        ("9.81 m/s²", 9.81, "acceleration"),
        ("1e3 N/mm", 1e6, "stiffness"),
        ("1 Nm/deg", 180 / math.pi, "angular stiffness"),
        ("2e-1 h", 720.0, "time"),
        (" 7 ", 7.0, None),
    ],
)
def test_quantities(text, value, dimension):
    number, given = parse_quantity(text)
    assert number == pytest.approx(value, rel=1e-15)
    assert given == dimension


def test_every_unit_is_read_as_written():
    for name, unit in UNITS.items():
        assert parse_quantity(f"2 {name}") == (2 * unit.factor, unit.dimension)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("thirty deg", "'thirty deg' is not a number"),
        ("", "a number is missing"),
        ("nan rad", "'nan rad' is not a number"),
        ("1e400 m", "'1e400' is too large for a double"),
        ("3 parsec", "unknown unit 'parsec'; known units: rad, deg, "),
        ("1" * 200 + " m", "is not a number"),
    ],
)
def test_what_is_no_quantity(text, problem):
    with pytest.raises(ValueError, match=re.escape(problem)):
        parse_quantity(text)


def test_dimensions_are_checked():
    check_dimension(None, "angle")
    check_dimension("angle", "angle")
    with pytest.raises(ValueError, match="a unit of length where an angle belongs; use one of rad"):
        check_dimension("length", "angle")


@pytest.mark.parametrize("text", ["0x10", "1,5", "1.2.3", "--1", "1e", "e1", ".", "+", "\uff11"])
def test_what_is_no_number(text):
    with pytest.raises(ValueError, match="is not a number"):
        parse_number(text)


@pytest.mark.parametrize("text", ["1", "+1", "1.", ".5", "-1.5e-3", "1E5", " 2\n"])
def test_what_is_a_number(text):
    assert parse_number(text) == float(text)
