"""Checks that what the documents link to exists: files, pictures, headings.

Run from anywhere: python tools/check_documents.py [repository]. Prints one line per violation and
exits with status 1 when there is any. Addresses on the network are not looked at.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

from source_text import run_check

FENCE = re.compile(r"^(```|~~~).*?^\1\s*$", re.MULTILINE | re.DOTALL)
CODE = re.compile(r"`[^`\n]*`")
COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
LINK = re.compile(r"!?\[[^\]]*\]\(\s*([^)\s]+)[^)]*\)")
TAG = re.compile(r"<(?:img|a)\b[^>]*?\b(?:src|href)=\"([^\"]+)\"")
HEADING = re.compile(r"^#{1,6}\s+(.+?)\s*#*\s*$", re.MULTILINE)
ELSEWHERE = re.compile(r"[a-z][a-z0-9+.-]*:", re.IGNORECASE)


def blank(pattern: re.Pattern[str], text: str) -> str:
    """The text without what the pattern matches, lines kept."""
    return pattern.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)


def links(text: str) -> Iterator[tuple[int, str]]:
    """Line number and target of every link and picture outside code."""
    for pattern in (FENCE, COMMENT, CODE):
        text = blank(pattern, text)
    for pattern in (LINK, TAG):
        for match in pattern.finditer(text):
            yield text.count("\n", 0, match.start()) + 1, match[1]


def anchors(text: str) -> set[str]:
    """The names that headings get, as GitHub makes them; repeated ones are numbered."""
    names: set[str] = set()
    for match in HEADING.finditer(blank(FENCE, text)):
        plain = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", match[1]).replace("`", "").lower()
        name = first = re.sub(r"[^\w\- ]", "", plain).replace(" ", "-")
        number = 0
        while name in names:
            number += 1
            name = f"{first}-{number}"
        names.add(name)
    return names


def check_link(root: Path, path: str, target: str) -> str | None:
    """What is wrong with one link, or None."""
    if ELSEWHERE.match(target):
        return None
    name, _, anchor = target.partition("#")
    if name.startswith("/"):
        return "is absolute; write it relative to the document"
    file = (root / path).parent / name if name else root / path
    if not file.resolve().is_relative_to(root.resolve()):
        return "leaves the repository"
    if not file.exists():
        return "does not exist"
    if anchor and file.suffix == ".md" and anchor not in anchors(file.read_text(encoding="utf-8")):
        return f"has no heading #{anchor}"
    return None


def check(root: Path, paths: list[str]) -> list[str]:
    return [
        f"{path}:{line}: {target}: {problem}"
        for path in paths
        if path.endswith(".md")
        for line, target in links((root / path).read_text(encoding="utf-8"))
        if (problem := check_link(root, path, target))
    ]


if __name__ == "__main__":
    sys.exit(run_check("check_documents", check))
