"""The check of words finds stale file names and the phrases that it bans, and nothing else."""

import subprocess
from pathlib import Path

import check_words as words
import pytest
import source_text

ROOT = Path(__file__).parents[2]


def check(root, path, text):
    for name, content in {"src/linkwise/base/error.hpp": "", path: text}.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(content)
    return words.check(root, ["src/linkwise/base/error.hpp", path])


@pytest.mark.parametrize(
    ("path", "text", "problem"),
    [
        ("a.cpp", "// See base/errors.hpp.\n", ":1: base/errors.hpp: there is no such file"),
        ("a.md", "In `src/linkwise/bases/error`.\n", "src/linkwise/bases/error: there is no"),
        ("a.py", '"""One.\n\nSee error.cpp\n"""\n', "a.py:3: error.cpp"),
        ("a.md", "It takes 97 ns a body.\n", "ns a body: write"),
        ("a.md", "It takes one dispatch a\nrun.\n", "one dispatch a run: write"),
        ("a.hpp", "// one reciprocal\n// a joint\n", "one reciprocal a joint: write"),
        ("a.py", 'print("2000 bytes a link")\n', "2000 bytes a link"),
        ("a.hpp", "// 50 multiplications a 5 x 5 node\n", "multiplications a 5 x 5 node: write"),
        ("a.md", "It holds three rows a loop.\n", "rows a loop: write"),
        ("a.hpp", "// As Solver::solve_least().\n", "solve_least(): there is no such function"),
        ("a.hpp", "// tree_w_ and\nint w_;\n", "tree_w_: there is no such function or member"),
        ("a.md", "where b is none.\n", "is none: write"),
        ("a.cpp", "struct GiftOf {};\n", "GiftOf: give it the field's name"),
        ("a.py", "first_seat = 1\n", "first_seat: give it"),
    ],
)
def test_a_bad_word_is_found(tmp_path, path, text, problem):
    assert any(problem in violation for violation in check(tmp_path, path, text))


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("a.cpp", "// See base/error.hpp and NAME.hpp.\nint pitch, outlook;\n"),
        ("a.md", "`src/linkwise/base`, <https://example.org/b/c.py>, `my_robot.urdf`\n"),
        ("a.md", "There is none. One is a body; two of a joint; 30 frames a second.\n"),
        ("a.hpp", "// As of Solver::solve(), into w_; A~_is and P_n.\nint w_, solve(int);\n"),
        ("a.md", "how many samples a call computes, how many iterations a solve may take\n"),
        ("a.md", "```text\nmissing.py\n```\n[page](missing.md)\n"),
        ("a.py", '# It looks like a gift.\nx = "missing.py"\ncamera.look_at = 1\n'),
    ],
)
def test_good_words_pass(tmp_path, path, text):
    assert check(tmp_path, path, text) == []


def test_comments_keep_their_lines():
    text = 'int a; // one\nconst char* s = "// none";\n/* two\nthree */ int b;\n'
    lines = [line.strip() for line in source_text.cpp_comments(text).splitlines()]
    assert lines == ["one", "", "two", "three"]


def test_this_repository_passes():
    try:
        paths = source_text.tracked_files(ROOT)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a git checkout")
    assert words.check(ROOT, paths) == []
