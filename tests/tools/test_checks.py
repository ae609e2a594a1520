"""The checks of tools/ find what they are for, and find nothing in this repository."""

import subprocess
from pathlib import Path

import check_layers as layers
import check_sources as sources
import import_graph
import pytest
from function_lengths import functions
from source_text import tracked_files

ROOT = Path(__file__).parents[2]


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
        ("long_function.py", "def f():\n" + "    x = 1\n" * 80, ":1: f has 81 lines"),
        ("long_function.cpp", "namespace n {\nint f() {\n" + "\n" * 80 + "}\n}\n", ":2: f has 82"),
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


CPP = """#define ODD(x) { x
namespace linkwise {
// int in_a_comment() {
constexpr Row table[] = {
    {"a{", make(1)},
};
template <class F>
struct Thing : Base<f(3)> {
    explicit Thing(int n = {}) : Base(n), a_{n}, b_{n, {1}} {
        auto nested = [&](int x) { return x; };
    }
    bool operator()(double x) const noexcept
    {
        if (x > 1'000.0) { return '{' == '}'; }
        return true;
    }
    int size = int{3};
};
auto Thing<int>::trail(int n) -> std::array<int, 2> { return {n, n}; }
}  // namespace linkwise
TEST(Suite, Name) {
    const char* text = R"({ not a brace)";
}
"""


def test_functions_of_a_cpp_file_are_found_with_their_lengths():
    assert list(functions("a.cpp", CPP)) == [
        (9, "Thing", 3),
        (12, "operator()", 5),
        (19, "trail", 1),
        (21, "TEST", 3),
    ]


def test_a_docstring_does_not_lengthen_a_function():
    text = 'def f():\n    """One\n\n    two.\n    """\n    return lambda: 1\n'
    assert list(functions("a.py", text)) == [(1, "f", 2)]


def test_a_circle_of_includes_is_found(tmp_path):
    write(tmp_path, "src/linkwise/base/a.hpp", '#include "linkwise/base/b.hpp"\n')
    write(tmp_path, "src/linkwise/base/b.hpp", '#include "linkwise/base/c.hpp"\n')
    write(tmp_path, "src/linkwise/base/c.hpp", '#include "linkwise/base/a.hpp"\n')
    write(tmp_path, "src/linkwise/base/d.hpp", '#include "linkwise/base/a.hpp"\n')
    (violation,) = layers.check_circles(tmp_path)
    assert "includes go in a circle" in violation
    assert "c.hpp" in violation
    assert "d.hpp" not in violation


@pytest.mark.parametrize(
    "late",
    [
        "from linkwise.one import a",
        "def f():\n    from linkwise import one",
        "if TYPE_CHECKING:\n    from . import one",
        "import linkwise.one as o",
    ],
)
def test_a_circle_of_imports_is_found(tmp_path, late):
    write(tmp_path, "python/linkwise/__init__.py", "import linkwise.one, linkwise.two\n")
    write(tmp_path, "python/linkwise/one.py", "import linkwise as lw\nfrom .two import b\n")
    write(tmp_path, "python/linkwise/two.py", f"{late}\n")
    (violation,) = layers.check_circles(tmp_path)
    assert violation == "linkwise.one: imports go in a circle: linkwise.one, linkwise.two"


@pytest.mark.parametrize(
    ("path", "text", "problem"),
    [
        ("loads/a.py", 'import importlib\nx = importlib.import_module("b")\n', ":2: imports by"),
        ("loads/a.py", "from importlib import import_module\n", ":1: imports by a name"),
        ("loads/a.py", '__import__("linkwise.plot")\n', ":1: imports by a name"),
        ("loads/a.py", "def f():\n    from linkwise import plot\n", ":2: linkwise.plot: import"),
        ("loads/a.py", "def f():\n    from ..plot import b\n", ":2: linkwise.plot.b: import"),
        ("loads/a.py", "def f():\n    import lxml.etree\n", ":2: lxml.etree: import it"),
    ],
)
def test_a_hidden_import_is_found(tmp_path, path, text, problem):
    write(tmp_path, f"python/linkwise/{path}", text)
    (violation,) = layers.check_hidden_imports(tmp_path)
    assert problem in violation


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("__init__.py", "from importlib import import_module\n"),
        ("cli/a.py", "def f():\n    from linkwise.loads import b\n    import rich\n"),
        ("loads/a.py", "def f():\n    from html import escape\n    import scipy.signal\n"),
        ("loads/a.py", "def f():\n    from linkwise.loads.peaks import summary\n"),
        ("loads/a.py", "from linkwise.plot import b\n"),
    ],
)
def test_an_import_in_sight_is_not_reported(tmp_path, path, text):
    write(tmp_path, f"python/linkwise/{path}", text)
    assert layers.check_hidden_imports(tmp_path) == []


def test_arrows_leave_out_what_is_seen_through_another():
    graph = {"top": {"middle", "base"}, "middle": {"base"}, "base": set(), "alone": {"base"}}
    assert import_graph.arrows(graph) == [
        "base",
        "alone  -> base",
        "middle -> base",
        "top    -> middle",
    ]


def test_a_stale_picture_of_the_layers_is_found(tmp_path):
    write(tmp_path, "src/linkwise/base/a.hpp", "\n")
    marked = "<!-- arrows -->\n{}<!-- /arrows -->\n"
    write(tmp_path, "ARCHITECTURE.md", marked.format(layers.picture(tmp_path)))
    assert layers.check_picture(tmp_path) == []
    write(tmp_path, "ARCHITECTURE.md", marked.format("```text\nold\n```\n"))
    (violation,) = layers.check_picture(tmp_path)
    assert "arrows are not the code's" in violation


def test_this_repository_passes():
    assert layers.check(ROOT) == []
    assert layers.check_circles(ROOT) == []
    assert layers.check_hidden_imports(ROOT) == []
    assert layers.check_picture(ROOT) == []
    try:
        paths = tracked_files(ROOT)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a git checkout")
    assert sources.check(ROOT, paths) == []
