"""The table of cases names tests that exist."""

import ast
import re
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]


def test_every_case_has_its_test():
    rows = (HERE / "README.md").read_text().splitlines()
    named = [re.fullmatch(r"\|.*\|.*\| `(\S+?)::(\S+?)` \|", row) for row in rows]
    cases = [match.groups() for match in named if match]
    assert len(cases) == sum(row.startswith("| ") for row in rows) - 1  # the head names none
    for file, name in cases:
        tree = ast.parse((ROOT / file).read_text())
        functions = [node.name for node in tree.body if isinstance(node, ast.FunctionDef)]
        assert name in functions, f"{file}::{name}"
