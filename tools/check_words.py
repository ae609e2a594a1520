"""Checks the words of comments, docstrings and documents.

What they name as a file exists, and what a comment of the core names as a function or a member; the
words that CONTRIBUTING.md asks to avoid do not occur, nor do the identifiers that the glossary has
better words for. Run from anywhere: python
tools/check_words.py [repository]. Prints one line per violation and exits with status 1 when there
is any.
"""

from __future__ import annotations

import io
import re
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path

from source_text import CPP, cpp_code, prose, run_check

#: A file with a name of its own. Placeholders are written in capitals: NAME.hpp.
FILE = re.compile(r"(?<![\w./*{<-])((?:[\w.-]+/)*[a-z_][\w-]*\.(?:hpp|cpp|py|md|cmake|bib))\b(?!/)")
FOLDER = re.compile(
    r"(?<![\w./-])((?:src|bindings|python/linkwise|tests|tools|docs|benchmarks|examples)/"
    r"[a-z][\w/-]*\w)(?![\w/.*<{-])"
)
LINE_START = re.compile(r"\n\s*(?://[/!<]*|#:?|\")?")
PLACEHOLDER = re.compile(r"(?:^|/)[A-Z]+$")
#: A function or a data member in a comment of a C++ source: solve(), Model::load_index(), q_.
MEMBER = re.compile(r"\b([A-Za-z]\w+)\(\)|\b([a-z]\w*_)(?![\w{])")
LINK_TARGET = re.compile(r"\]\([^)\s]*\)")

COUNT = r"one|none|two|three|four|five|six|some|few|dozen|once|twice|an?|\d[\d,]*(?:\.\d+)?"
UNIT = (
    r"ns|[µu]s|ms|s|nanoseconds?|microseconds?|milliseconds?|bytes?|KB|MB|numbers?|instructions?"
    r"|cycles?|operations?|flops|multiplications?|products?|rows?|columns?|iterations?|evaluations?"
    r"|calls?|reciprocals?"
)
THING = (
    r"body|joint|link|lane|step|run|call|solve|state|evaluation|member|sample|iteration|row|column"
    r"|block|hinge|path|piece|system|core|thread|chain|machine|element|file|folder|degree"
    r")\b(?!\s+(?:may|can|must|has|is|takes|computes)\b"
)
#: What a number and its unit may be taken of besides, where nothing but "per" can be meant.
PART = r"(?:\d+ [x\u00d7] \d+ )?(?:node|loop|knot|hub)\b"
JOINING = (
    r"an?|the|and|are|as|at|be|by|for|from|has|have|if|in|into|is|it|makes?|need|needs|of|on|or|so"
    r"|takes?|than|that|to|when|where|which|with|without|was|were|but|not|per|between|over"
)
#: Phrases that a reader stumbles over, and what to write instead.
BANNED = {
    rf"\b(?:{COUNT})(?:\s+(?!(?:{JOINING})\b)[a-z][\w-]*)?\s+an?\s+(?:{THING})": 'write "per"',
    rf"\b(?:{UNIT})\s+an?\s+(?:{THING})": 'write "per"',
    rf"\b(?:{UNIT})\s+an?\s+(?:{PART})": 'write "per"',
    r"(?<![Tt]here\s)\b(?:is|are|was)\s+none\b(?!\s+of)": 'write "there is no ..."',
}
#: Parts of identifiers that are no terms of the field.
IDENTIFIERS = {"gift", "gifts", "seat", "seats", "pit", "pits", "wish", "wishes", "look", "looks"}
WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
NAME = re.compile(r"[A-Za-z_]\w*")
#: History may name what is gone; this tool and its test speak of what they forbid.
EXCEPT = {"CHANGELOG.md", "tools/check_words.py", "tests/tools/test_check_words.py"}


def line_of(text: str, match: re.Match[str]) -> int:
    return text.count("\n", 0, match.start()) + 1


def file_names(text: str) -> Iterator[tuple[int, str]]:
    """Line number and name of every file and folder of the repository that a text names."""
    for pattern in (FILE, FOLDER):
        for match in pattern.finditer(text):
            if not PLACEHOLDER.search(match[1]):
                yield line_of(text, match), match[1]


def check_file_names(path: str, text: str, known: set[str]) -> list[str]:
    folder = path.rpartition("/")[0]
    return [
        f"{path}:{number}: {name}: there is no such file"
        for number, name in file_names(text)
        if f"/{name}" not in known and f"/{folder}/{name}" not in known
    ]


def check_members(path: str, said: str, known: set[str]) -> list[str]:
    if Path(path).suffix not in CPP:
        return []
    return [
        f"{path}:{line_of(said, match)}: {match[0]}: there is no such function or member"
        for match in MEMBER.finditer(said)
        if (match[1] or match[2]) not in known
    ]


def names_of(root: Path, paths: list[str]) -> set[str]:
    """All identifiers of the repository's C++ and Python sources."""
    found: set[str] = set()
    for path in paths:
        if Path(path).suffix in CPP | {".py"}:
            text = (root / path).read_text(encoding="utf-8")
            found.update(NAME.findall(cpp_code(text) if Path(path).suffix in CPP else text))
    return found


def endings(paths: list[str]) -> set[str]:
    """Every way to name a tracked file or its folders, from any folder on, with a leading slash."""
    found = set()
    for path in paths:
        parts = path.split("/")
        for end in range(1, len(parts) + 1):
            found.update("/" + "/".join(parts[start:end]) for start in range(end))
    return found


def check_phrases(path: str, text: str) -> list[str]:
    """Anywhere in a file: comments, documents, and what programs say."""
    flat = LINE_START.sub(lambda match: " " * len(match[0]), text)  # phrases go over line ends
    return [
        f"{path}:{line_of(text, match)}: {' '.join(match[0].split())}: {remedy}"
        for pattern, remedy in BANNED.items()
        for match in re.finditer(pattern, flat)
    ]


def identifiers(path: str, text: str) -> Iterator[tuple[int, str]]:
    suffix = Path(path).suffix
    if suffix in CPP:
        code = cpp_code(text)
        for match in NAME.finditer(code):
            yield line_of(code, match), match[0]
    elif suffix == ".py":
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type == tokenize.NAME:
                yield token.start[0], token.string


def check_identifiers(path: str, text: str) -> list[str]:
    return [
        f"{path}:{number}: {name}: give it the field's name"
        for number, name in identifiers(path, text)
        if name != "look_at" and IDENTIFIERS & {word.lower() for word in WORD.findall(name)}
    ]


def check(root: Path, paths: list[str]) -> list[str]:
    violations, known, names = [], endings(paths), names_of(root, paths)
    for path in paths:
        if Path(path).suffix not in CPP | {".py", ".md"} or path in EXCEPT:
            continue
        text = (root / path).read_text(encoding="utf-8")
        said = LINK_TARGET.sub("]", prose(path, text))  # check_documents looks at links
        violations += check_file_names(path, said, known)
        violations += check_members(path, said, names)
        violations += check_phrases(path, text)
        violations += check_identifiers(path, text)
    return violations


if __name__ == "__main__":
    sys.exit(run_check("check_words", check))
