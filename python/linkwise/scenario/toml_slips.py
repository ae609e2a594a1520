"""Usual slips in TOML files, and how each is cured."""

from __future__ import annotations

import re

from linkwise.io.complaint import shorten

_BOOLEANS = {"yes": "true", "on": "true", "no": "false", "off": "false", "none": None, "null": None}


def diagnose(text: str, line: int | None) -> tuple[str, str] | None:
    """What is wrong and how it is cured, of a text that the parser refused at ``line``."""
    start = text.lstrip()[:200].lower()
    if start.startswith(("<?xml", "<robot", "<mujoco", "<sdf", "<!--")):
        return "is a model, not a scenario", (
            'write a scenario with model = "FILE" and [simulate] duration, or look at the model: '
            "linkwise inspect, linkwise view"
        )
    if start.startswith("{"):
        return "is JSON", "write it as TOML: key = value under [table]"
    said = text.split("\n")[line - 1][:2000] if line and line <= text.count("\n") + 1 else ""
    _, equals, value = said.partition("=")
    if not equals:
        return _without_equals(said)
    return _of_value(value.partition("#")[0].strip().rstrip(","))


def _without_equals(said: str) -> tuple[str, str] | None:
    bare = said.strip()
    if re.fullmatch(r"[\w.\"'-]+\s*:\s*\S.*", bare):
        return "has a colon between key and value", "write key = value"
    if bare.startswith(("//", ";", "%")):
        return "has a comment that TOML does not know", "comments begin with #"
    if bare.startswith("[") and not bare.endswith("]"):
        return "has a table that is not closed", "close it with ]"
    return None


def _of_value(value: str) -> tuple[str, str] | None:
    shown = shorten(value, 60)
    number = r"[+-]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
    if not value:
        return "has a key without a value", "write a value behind ="
    if re.search(r"(?<![\w.\"'])[+-]?\.\d", value) and not value.startswith(('"', "'")):
        return f"has a number without a digit before its point ({shown})", "write 0.5 for .5"
    if re.search(r"\d\.(?!\d)", value) and not value.startswith(('"', "'")):
        return f"has a number without a digit behind its point ({shown})", "write 1.0 for 1."
    if re.fullmatch(rf"{number}\s*[a-zA-Z°µ%][\w°*/^ ²]*", value):
        return f"has a unit outside quotes ({shown})", f'write "{shown}"'
    if re.fullmatch(r"\d+,\d+", value):
        return f"has a decimal comma ({shown})", f"write {value.replace(',', '.')}"
    if re.fullmatch(r"[+-]?0\d[\d.]*", value):
        return f"has a number with a leading zero ({shown})", "leave the zero out"
    if any(mark in value for mark in "\u201c\u201d\u2018\u2019"):
        return "has typographic quotes", 'write straight quotes, "'
    if value[0] == '"' and "\\" in value:
        return f"has a backslash in quotes ({shown})", "write / in paths, or single quotes"
    if value[0] in "\"'" and value.count(value[0]) % 2:
        return f"has a text whose quotes are not closed ({shown})", f"close them with {value[0]}"
    if value.lower() in _BOOLEANS or value in ("True", "False"):
        meant = _BOOLEANS.get(value.lower(), value.lower())
        return f"has the word {value} as a value", (
            f"write {meant}" if meant else "leave the key out"
        )
    if re.fullmatch(r"[A-Za-z_./][^\"'\[\]{}]*", value):
        return f"has a text without quotes ({shown})", f'write "{shown}"'
    return None
