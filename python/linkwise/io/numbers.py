"""Strict reading of numbers: plain decimal text, finite, and within the range of a double."""

from __future__ import annotations

import math
import re

from linkwise.io.complaint import shorten

_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?\Z")
#: A number with something behind it, as in 2 kg, 90deg, 2.0f, 100%.
_WITH_UNIT = re.compile(
    r"([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)\s*[a-zA-Z%\xb0]+\S*\Z"
)
_NOT_FINITE = re.compile(r"[+-]?(?:nan|inf|infinity)\Z", re.IGNORECASE)
#: What people write instead, and what belongs there.
_HINTS = {
    ",": ", which has a comma: points mark decimals, blanks separate numbers",
    "\u2212": ", its minus is typographic: write -",
    "pi": ", expressions are not computed: write 3.14159265358979 for pi",
}
#: Characters of no width that editors and web pages leave in copied text.
_INVISIBLE = dict.fromkeys((0x200B, 0x200C, 0x200D, 0x2060, 0xFEFF, 0xAD, 0x200E, 0x200F))


def parse_number(text: str) -> float:
    """The number that ``text`` spells.

    Raises ValueError with the problem in words. ``float`` alone would accept nan, infinity,
    underscores and digits of other scripts, and turn 1e400 into infinity.
    """
    stripped = text.translate(_INVISIBLE).strip(" \t\r\n")
    if not stripped:
        raise ValueError("a number is missing")
    if not _NUMBER.match(stripped):
        if _NOT_FINITE.match(stripped):
            raise ValueError(f"'{shorten(stripped)}' is not a finite number")
        hint = next((text for mark, text in _HINTS.items() if mark in stripped), "")
        if not hint and (number := _WITH_UNIT.match(stripped)) and stripped[1:2] not in ("x", "X"):
            hint = f", it has '{shorten(stripped[number.end(1) :].strip())}' behind it: write the "
            hint += "number alone"
        raise ValueError(f"'{shorten(stripped)}' is not a number{hint}")
    value = float(stripped)
    if math.isinf(value):
        raise ValueError(f"'{shorten(stripped)}' is too large for a double")
    return value


def parse_numbers(text: str, count: int) -> list[float]:
    """The ``count`` numbers of a space-separated list; ValueError as for :func:`parse_number`."""
    words = text.split()
    if len(words) != count:
        raise ValueError(f"has {len(words)} numbers instead of {count}")
    return [parse_number(word) for word in words]
