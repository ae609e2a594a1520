"""Names and lengths of the functions of a source file, found without a compiler."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from source_text import blanked, cpp_code

#: The end of a function's head: arguments, qualifiers, a return type or member initialisers.
QUALIFIERS = r"(?:\s*(?:const|noexcept|override|final|mutable|requires\b[^;{}]*|&&?))*"
HEAD = re.compile(rf"\){QUALIFIERS}\s*(?:->[^;{{}}]*|:\s[^;]*[)}}]\s*)?$")
#: What opens a block whose functions are counted one by one.
SCOPE = re.compile(
    r"(?:^|[;}>:\s])(?:namespace|class|struct|union|enum|extern)\b(?!\s+\w+\s*[,>=])"
)
NAME = re.compile(r"(operator\s*[^\w\s]+|[~\w]+(?:::[~\w]+)*)\s*\(")
PREPROCESSOR = re.compile(r"^[ \t]*#(?:\\\n|[^\n])*", re.MULTILINE)


def python_functions(text: str) -> Iterator[tuple[int, str, int]]:
    """First line, name and number of lines of every function, its docstring not counted."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            lines = (node.end_lineno or node.lineno) - node.lineno + 1
            if ast.get_docstring(node) is not None:
                lines -= (node.body[0].end_lineno or 0) - node.body[0].lineno + 1
            yield node.lineno, node.name, lines


def closing_brace(code: str, opening: int) -> int:
    """Position of the brace that closes the one at `opening`, or the end of the text."""
    depth = 0
    for match in re.finditer(r"[{}]", code[opening:]):
        depth += 1 if match[0] == "{" else -1
        if depth == 0:
            return opening + match.start()
    return len(code)


def cpp_functions(text: str) -> Iterator[tuple[int, str, int]]:
    """First line, name and number of lines of every function of a namespace or class.

    Lambdas and local classes count to the function around them; a braced table is no function.
    """
    code = PREPROCESSOR.sub(lambda match: blanked(match[0]), cpp_code(text))
    start = at = 0  # of the statement, and where the search for its next brace goes on
    while brace := re.compile(r"[{};]").search(code, at):
        at = brace.end()
        if brace[0] != "{":
            start = at
            continue
        head = code[start : brace.start()]
        if HEAD.search(head):
            end = closing_brace(code, brace.start())
            name = NAME.search(head)
            first = code.count("\n", 0, start + (name.start() if name else 0)) + 1
            yield first, name[1] if name else "lambda", code.count("\n", 0, end) + 2 - first
            start = at = end + 1
        elif SCOPE.search(head) and head.count("(") == head.count(")") and "=" not in head:
            start = at
        else:  # an initialiser: the statement goes on behind it
            at = closing_brace(code, brace.start()) + 1


def functions(path: str, text: str) -> Iterator[tuple[int, str, int]]:
    if path.endswith((".cpp", ".hpp", ".cu", ".h")):
        yield from cpp_functions(text)
    elif path.endswith(".py"):
        yield from python_functions(text)
