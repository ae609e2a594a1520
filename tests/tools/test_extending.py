"""docs/extending.md says how many files an addition takes: here each one is made, and counted.

tests/extending/NAME.patch adds one throw-away thing. It must still apply, touch as many files as
the table promises, and the compiler must accept every file that it touches. Where
tests/extending/NAME.cpp is beside it, that program uses the addition, and must find nothing wrong.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PATCHES = sorted((ROOT / "tests" / "extending").glob("*.patch"))
COMPILER = os.environ.get("CXX") or shutil.which("g++") or shutil.which("c++")
FLAGS = (
    "-std=c++20",
    "-fsyntax-only",
    "-Wno-psabi",
    "-DLINKWISE_ASSERTIONS=1",
    "-DLINKWISE_LANES=4",
)
#: Sources of the core, and those that programs need beside all that builds a model.
CORE = "src/linkwise"
MORE = [
    f"{CORE}/{name}.cpp"
    for name in (
        "dynamics/known_bodies",
        "dynamics/mobility",
        "dynamics/quantities",
        "forces/passive",
        "kinematics/coupling_states",
        "kinematics/loop_states",
    )
]

pytestmark = pytest.mark.skipif(shutil.which("git") is None, reason="patches need git")


def touched(patch):
    """The files that a patch changes or adds."""
    return re.findall(r"^\+\+\+ b/(\S+)$", patch.read_text(encoding="utf-8"), re.MULTILINE)


def promised():
    """Patch and count of every row of the table that has one."""
    text = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| .*\| \[(\d+)\]\(\.\./tests/extending/(\w+)\.patch\) \|$", text, re.M)
    return {name: int(count) for count, name in rows}


def run(*command, cwd):
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}"
    return done.stdout


def run_program(program, root):
    """Compiles a program with all that builds a model, as one text to be quick, and runs it."""
    layers = ("base", "bodies", "exec", "graph", "model")
    paths = [path for layer in layers for path in sorted((root / CORE / layer).glob("*.cpp"))]
    text = "".join(f'#include "{path}"\n' for path in paths)
    (root / "core.cpp").write_text(text, encoding="utf-8")
    flags = [flag for flag in FLAGS if flag != "-fsyntax-only"]
    sources = (program, *MORE, "core.cpp")
    run(COMPILER, *flags, "-pthread", "-I", "src", *sources, "-o", "program", cwd=root)
    run(root / "program", cwd=root)


@pytest.fixture
def changed(tmp_path):
    """A copy of the sources with a patch applied."""

    def apply(patch):
        for folder in ("src", "bindings", "python"):
            ignored = shutil.ignore_patterns("__pycache__", "*.so")
            shutil.copytree(ROOT / folder, tmp_path / folder, ignore=ignored)
        run("git", "apply", "-C1", str(patch), cwd=tmp_path)
        return tmp_path

    return apply


def test_every_count_has_its_patch():
    assert promised().keys() == {patch.stem for patch in PATCHES}


@pytest.mark.parametrize("patch", PATCHES, ids=lambda patch: patch.stem)
def test_an_addition_takes_as_many_files_as_promised(patch, changed):
    files = touched(patch)
    assert len(files) == promised()[patch.stem], files
    root = changed(patch)
    sources = [name for name in files if name.startswith("src/") and name.endswith(".cpp")]
    assert COMPILER or not sources, "no C++ compiler; set CXX, or install g++"
    for source in sources:
        run(COMPILER, *FLAGS, "-I", "src", source, cwd=root)
    program = patch.with_suffix(".cpp")
    if program.exists():
        assert COMPILER, "no C++ compiler; set CXX, or install g++"
        run_program(program, root)
    for name in files:
        if name.endswith(".py"):
            run(sys.executable, "-m", "py_compile", name, cwd=root)
