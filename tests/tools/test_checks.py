"""The checks of tools/ find what they are for, and find nothing in this repository."""

import importlib.util
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def load_tool(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / "tools" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


layers = load_tool("check_layers")
sources = load_tool("check_sources")


def write(root, path, text):
    file = root / path
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    return path


@pytest.mark.parametrize(
    ("path", "include", "problem"),
    [
        ("src/linkwise/solve/a.cpp", '"linkwise/model/model.hpp"', "must not see layer model"),
        ("src/linkwise/constraint/a.hpp", '"linkwise/solve/b.hpp"', "must not see layer solve"),
        ("src/linkwise/base/a.hpp", '"linkwise/simd/lanes.hpp"', "must not see layer simd"),
        ("tests/cpp/solve/test_a.cpp", '"linkwise/joints/b.hpp"', "must not see layer joints"),
        ("src/linkwise/simulate/a.cpp", '"linkwise/magic/b.hpp"', "no layer magic"),
        ("src/linkwise/simulate/a.cpp", "<linkwise/base/error.hpp>", "write it as"),
        ("src/linkwise/simulate/a.cpp", "<cvodes/cvodes.h>", "only src/linkwise/integrate"),
        ("src/linkwise/integrate/a.cpp", "<nvector/nvector_serial.h>", "integrate/sundials"),
        ("src/linkwise/model/a.cpp", "<nanobind/nanobind.h>", "only bindings"),
        ("src/linkwise/linear/a.cpp", "<Eigen/Dense>", "unknown third party"),
        ("src/linkwise/linear/a.cpp", '"block.hpp"', "from the include root"),
    ],
)
def test_a_forbidden_include_is_found(tmp_path, path, include, problem):
    write(tmp_path, path, f"#pragma once\n#include <vector>\n#include {include}\n")
    (violation,) = layers.check(tmp_path)
    assert violation.startswith(f"{path}:3: ")
    assert problem in violation


@pytest.mark.parametrize(
    ("path", "include"),
    [
        ("src/linkwise/dynamics/a.cpp", '"linkwise/solve/b.hpp"'),
        ("src/linkwise/constraint/a.cpp", '"linkwise/linear/block_tree.hpp"'),
        ("src/linkwise/integrate/sundials/a.cpp", "<sunlinsol/sunlinsol_dense.h>"),
        ("bindings/a.cpp", "<nanobind/ndarray.h>"),
        ("bindings/a.cpp", '"linkwise/simulate/simulation.hpp"'),
        ("src/linkwise/simd/a.hpp", "<immintrin.h>"),
        ("tests/cpp/solve/test_a.cpp", "<gtest/gtest.h>"),
    ],
)
def test_an_allowed_include_is_not_reported(tmp_path, path, include):
    write(tmp_path, path, f"#include {include}\n")
    assert layers.check(tmp_path) == []


def test_a_file_outside_the_layers_is_found(tmp_path):
    write(tmp_path, "src/linkwise/util/a.hpp", "\n")
    assert "not in one of the layers" in layers.check(tmp_path)[0]


def test_the_layers_have_no_cycle():
    seen = set()
    for layer, visible in layers.LAYERS.items():
        assert visible <= seen, f"{layer} sees a layer listed after it"
        seen.add(layer)


@pytest.mark.parametrize(
    ("name", "text", "problem"),
    [
        ("long.cpp", "int x;\n" * 601, "601 lines"),
        ("marker.py", "# TO" + "DO: later\n", "leftover marker"),
        ("notes.md", "pip install --extra-index" + "-url https://example.com x\n", "index option"),
        ("fetch.cmake", "https://py" + "pi.org/project\n", "package index"),
        ("open.py", "x = 1", "no newline"),
        ("space.hpp", "int x; \n", "white space"),
        ("uv.lock", "x\n", "lock files"),
    ],
)
def test_a_bad_source_is_found(tmp_path, name, text, problem):
    (violation,) = sources.check(tmp_path, [write(tmp_path, name, text)])
    assert problem in violation


def test_good_sources_are_not_reported(tmp_path):
    write(tmp_path, "long_table.csv", "1\n" * 1000)
    write(tmp_path, "good.py", "x = 1\n")
    (tmp_path / "picture.png").write_bytes(b"\x89PNG\xff\xfe")
    assert sources.check(tmp_path, ["long_table.csv", "good.py", "picture.png"]) == []


def test_this_repository_passes():
    assert layers.check(ROOT) == []
    try:
        paths = sources.tracked_files(ROOT)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a git checkout")
    assert sources.check(ROOT, paths) == []
