"""What the checks share: the text of sources by code and by comments, and how they report."""

from __future__ import annotations

import io
import re
import subprocess
import sys
import tokenize
from collections.abc import Callable
from pathlib import Path

CPP = {".cpp", ".hpp", ".cu", ".h"}
#: A comment, a raw string, a string, or a character of C++; a digit separator is none of them.
CPP_TOKEN = re.compile(
    r"//[^\n]*|/\*.*?\*/"
    r'|R"(?P<mark>[^(\s]*)\(.*?\)(?P=mark)"'
    r'|"(?:\\.|[^"\\\n])*"'
    r"|(?<![0-9a-fA-F])'(?:\\.|[^'\\\n])+'",
    re.DOTALL,
)


def tracked_files(root: Path) -> list[str]:
    """Paths of all files that git tracks or would track."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    output = subprocess.run(command, cwd=root, check=True, capture_output=True, text=True).stdout
    return sorted(name for name in output.split("\0") if name and (root / name).is_file())


def run_check(name: str, check: Callable[[Path, list[str]], list[str]]) -> int:
    """Prints what a check finds in the repository given, or in this one; the exit status."""
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent.parent
    return report(name, check(root, tracked_files(root)))


def report(name: str, violations: list[str]) -> int:
    print(*violations, sep="\n", end="\n" if violations else "")
    print(f"{name}: {len(violations)} violations")
    return 1 if violations else 0


def blanked(text: str) -> str:
    """As many spaces as the text has characters; its line breaks stay."""
    return re.sub(r"[^\n]", " ", text)


def cpp_code(text: str) -> str:
    """C++ with comments, strings and characters blanked."""
    return CPP_TOKEN.sub(lambda match: blanked(match[0]), text)


def cpp_comments(text: str) -> str:
    """The comments of a C++ source, without their marks; every line stays where it is."""
    kept, end = [], 0
    for match in CPP_TOKEN.finditer(text):
        kept.append(blanked(text[end : match.start()]))
        comment = match[0].startswith(("//", "/*"))
        kept.append(
            re.sub(r"(^|\n) *(//+[!/<]*|/\*+)|\*/", r"\1", match[0])
            if comment
            else blanked(match[0])
        )
        end = match.end()
    return "".join([*kept, blanked(text[end:])])


def python_comments(text: str) -> str:
    """The comments and docstrings of a Python source; every line stays where it is."""
    lines = [""] * (text.count("\n") + 2)
    first_of_statement = True
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            lines[token.start[0]] += token.string.lstrip("#: ")
        elif token.type == tokenize.STRING and first_of_statement:
            for number, line in enumerate(token.string.splitlines(), start=token.start[0]):
                lines[number] += line
        if token.type in {tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT}:
            first_of_statement = True
        elif token.type not in {tokenize.COMMENT, tokenize.NL, tokenize.ENCODING}:
            first_of_statement = False
    return "\n".join(lines[1:])


def prose(path: str, text: str) -> str:
    """What a file says in words: a document without its code blocks, comments of a source."""
    suffix = Path(path).suffix
    if suffix in CPP:
        return cpp_comments(text)
    if suffix in {".py", ".pyi"}:
        return python_comments(text)
    if suffix == ".md":
        return re.sub(r"^```.*?^```", lambda m: blanked(m[0]), text, flags=re.M | re.S)
    return ""
