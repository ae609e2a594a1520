"""Checks that every key cited in sources and documents is in references.bib, and that none is idle.

A citation is a key in brackets, [featherstone2008, ch. 7] or [luh1980; featherstone2008], or a key
alone in quotes, which is how the tables of methods and solvers name theirs. Run from anywhere:
python tools/check_references.py [repository]. Prints one line per violation and exits with status 1
when there is any.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

from source_text import run_check

BIBLIOGRAPHY = "references.bib"
KEY = re.compile(r"[a-z]+(?:1[6-9]|20)\d\d[a-z]?")
#: What looks like a key, well spelt or not: a word, perhaps with hyphens, and a year.
LIKE_A_KEY = r"[A-Za-z][A-Za-z-]*(?:1[6-9]|20)\d\d[a-z]?"
BRACKETS = re.compile(r"\[\s*(" + LIKE_A_KEY + r"\b[^\[\]]*)\](?!\()")
QUOTES = re.compile(r'"(' + LIKE_A_KEY + r')"')
SEPARATOR = re.compile(r"[;,]")
COMMENT_MARK = re.compile(r"\n\s*(?://+[!/]?|#+)")
SUFFIXES = {".cpp", ".hpp", ".cu", ".py", ".md", ".toml", ".txt"}
#: This tool and its test speak of keys that nobody cites.
EXCEPT = {"tools/check_references.py", "tests/tools/test_check_documents.py"}


def citations(text: str) -> Iterator[tuple[int, str]]:
    """Line number and key, or what looks like one, of every citation in a text."""
    for match in BRACKETS.finditer(text):
        line = text.count("\n", 0, match.start()) + 1
        for part in SEPARATOR.split(COMMENT_MARK.sub(" ", match[1])):
            words = part.split()
            if words and re.fullmatch(LIKE_A_KEY, words[0]):
                yield line, words[0]
    for match in QUOTES.finditer(text):
        yield text.count("\n", 0, match.start()) + 1, match[1]


def entries(bibliography: str) -> list[str]:
    return re.findall(r"^@\w+\{([^,\s]+),", bibliography, flags=re.MULTILINE)


def check(root: Path, paths: list[str]) -> list[str]:
    keys = entries((root / BIBLIOGRAPHY).read_text(encoding="utf-8"))
    violations = [
        f"{BIBLIOGRAPHY}: key {key} is not author and year, such as sharf1993"
        for key in keys
        if not KEY.fullmatch(key)
    ]
    violations += [
        f"{BIBLIOGRAPHY}: key {key} is there twice" for key in set(keys) if keys.count(key) > 1
    ]
    cited = set()
    for path in paths:
        file = root / path
        if file.suffix not in SUFFIXES or path in EXCEPT or not file.is_file():
            continue
        for line, key in citations(file.read_text(encoding="utf-8")):
            cited.add(key)
            if key not in keys:
                violations.append(f"{path}:{line}: [{key}] is not in {BIBLIOGRAPHY}")
    violations += [f"{BIBLIOGRAPHY}: {key} is cited nowhere" for key in keys if key not in cited]
    return violations


if __name__ == "__main__":
    sys.exit(run_check("check_references", check))
