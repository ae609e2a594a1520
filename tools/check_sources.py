"""Checks every tracked text file: lengths of files and functions, leftovers, package indexes.

Run from anywhere: python tools/check_sources.py [repository]. Prints one line per violation and
exits with status 1 when there is any.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from function_lengths import functions
from source_text import run_check

LONGEST = 600
LONGEST_FUNCTION = 80
CODE = {".cpp", ".hpp", ".cu", ".h", ".py", ".pyi", ".cmake", ".sh", ".toml"}

#: A name of a package index would tie the project to one network; lock files record them too.
#: (The patterns are put together so that this file does not match them.)
FORBIDDEN = {
    r"python" r"hosted\.org|\bpy" r"pi\.(org|python\.org)": "package index",
    r"index" r"-url\b|INDEX" r"_URL\b|--find" r"-links\b": "package index option",
    r"\b(TO" r"DO|FIX" r"ME|XX" r"X)\b": "leftover marker",
}
FORBIDDEN_FILES = {"uv.lock", "pylock.toml", "poetry.lock", "Pipfile.lock"}


def check_text(path: str, text: str) -> list[str]:
    violations = []
    lines = text.splitlines()
    file = Path(path)
    is_code = file.suffix in CODE or file.name == "CMakeLists.txt"
    if is_code and len(lines) > LONGEST:
        violations.append(f"{path}: {len(lines)} lines, at most {LONGEST} are allowed; split it")
    violations += [
        f"{path}:{number}: {name} has {length} lines, at most {LONGEST_FUNCTION} are allowed"
        for number, name, length in functions(path, text)
        if length > LONGEST_FUNCTION
    ]
    for number, line in enumerate(lines, start=1):
        for pattern, what in FORBIDDEN.items():
            if re.search(pattern, line):
                violations.append(f"{path}:{number}: {what}: {line.strip()[:80]}")
    if text and not text.endswith("\n"):
        violations.append(f"{path}: no newline at the end")
    if is_code and any(line != line.rstrip() for line in lines):
        violations.append(f"{path}: white space at the end of a line")
    return violations


def check(root: Path, paths: list[str]) -> list[str]:
    violations = []
    for path in paths:
        file = root / path
        if file.name in FORBIDDEN_FILES:
            violations.append(f"{path}: lock files record package indexes; remove it")
            continue
        if not file.is_file():
            continue
        try:
            text = file.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue
        violations += check_text(path, text)
    return violations


if __name__ == "__main__":
    sys.exit(run_check("check_sources", check))
