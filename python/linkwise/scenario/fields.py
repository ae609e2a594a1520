"""Numbers of a scenario file: their types and units."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

from pydantic import BeforeValidator, Field, PlainValidator

from linkwise.io.units import check_dimension, parse_quantity


class Quantity(NamedTuple):
    """A number in SI and the dimension that its unit stated, None where no unit was given."""

    value: float
    dimension: str | None


def quantity(value: Any, infinite: bool = False) -> Quantity:
    if isinstance(value, str):
        return Quantity(*parse_quantity(value))
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError("is not a number; give a number or a text such as '30 deg'")
    try:
        number = float(value)
    except OverflowError:
        raise ValueError("is too large for a double; give a smaller number") from None
    if not math.isfinite(number) and not (infinite and math.isinf(number)):
        raise ValueError(f"is {value}, not a finite number; give a finite number")
    return Quantity(number, None)


def quantities(value: Any) -> Quantity | list[Quantity]:
    if isinstance(value, dict):
        raise ValueError(
            "is a table where a number belongs; put quotes around a joint name that holds a dot"
        )
    return [quantity(v) for v in value] if isinstance(value, list) else quantity(value)


def limits(value: Any) -> Quantity | list[Quantity]:
    """As quantities; inf and -inf are no limit."""
    if isinstance(value, list):
        return [quantity(v, infinite=True) for v in value]
    return quantity(value, infinite=True)


def of(*dimensions: str) -> BeforeValidator:
    def convert(value: Any) -> float:
        given = quantity(value)
        check_dimension(given.dimension, *dimensions)
        return given.value

    return BeforeValidator(convert)


def factors(value: Any) -> float | list[float]:
    """A number without a unit, or those of up to four powers."""
    numbers = []
    listed = value if isinstance(value, list) else [value]
    if not 1 <= len(listed) <= 4:
        raise ValueError(
            f"has {len(listed)} numbers; give those of the coordinate and of its powers up to "
            "the fourth"
        )
    for one in listed:
        given = quantity(one)
        check_dimension(given.dimension, "number")
        numbers.append(given.value)
    return numbers if isinstance(value, list) else numbers[0]


def along_or_all(dimension: str) -> PlainValidator:
    """One number, along an axis, or three."""

    def convert(value: Any) -> float | list[float]:
        if isinstance(value, list) and len(value) != 3:
            raise ValueError(f"has {len(value)} numbers; give one along the axis, or three")
        numbers = []
        for one in value if isinstance(value, list) else [value]:
            given = quantity(one)
            check_dimension(given.dimension, dimension)
            numbers.append(given.value)
        return numbers if isinstance(value, list) else numbers[0]

    return PlainValidator(convert)


Scalar = Annotated[Quantity, PlainValidator(quantity)]
Vector = Annotated[Quantity | list[Quantity], PlainValidator(quantities)]
Limit = Annotated[Quantity | list[Quantity], PlainValidator(limits)]
Number = Annotated[float, of("number")]
Factors = Annotated[float | list[float], PlainValidator(factors)]
Time = Annotated[float, of("time"), Field(gt=0)]
Count = Annotated[int, Field(ge=1, lt=2**31)]
Acceleration = Annotated[float, of("acceleration")]
Direction = Annotated[list[Number], Field(min_length=3, max_length=3)]
Point = Annotated[list[Annotated[float, of("length")]], Field(min_length=3, max_length=3)]
Angles = Annotated[list[Annotated[float, of("angle")]], Field(min_length=3, max_length=3)]
