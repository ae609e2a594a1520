"""Checks that the C++ sources include only what their layer may see (ARCHITECTURE.md, layers), that
neither includes nor Python imports go in circles or hide, and that ARCHITECTURE.md shows the true
arrows.

Run from anywhere: python tools/check_layers.py [repository]. Prints one line per violation and
exits with status 1 when there is any. With --arrows it writes the arrows into ARCHITECTURE.md.
"""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path

from import_graph import (
    PACKAGE,
    SUFFIXES,
    arrows,
    circles,
    import_graph,
    include_graph,
    includes,
    late_imports,
    rooms,
)
from source_text import report

#: What each layer may include besides itself. Two columns, numerics and mechanics, meet in
#: dynamics: solve never sees a mechanism, constraint fills the systems of linear without solving.
BASE = {"base", "simd"}
NUMERICS = BASE | {"exec", "linear", "solve"}
MODEL = BASE | {"spatial", "joints", "bodies", "graph", "model"}
MOTION = MODEL | {"kinematics"}
MECHANICS = MOTION | {"forces", "constraint"}
LAYERS = {
    "base": set(),
    "simd": {"base"},
    "exec": BASE,
    "linear": BASE | {"exec"},
    "solve": BASE | {"exec", "linear"},
    "spatial": BASE,
    "joints": BASE | {"spatial"},
    "bodies": BASE | {"spatial", "joints"},
    "graph": {"base"},
    "model": MODEL - {"model"},
    "kinematics": MODEL,
    "forces": MOTION,
    "constraint": MOTION | {"exec", "linear", "forces"},
    "recursion": MOTION | {"exec", "linear", "constraint"},
    "dynamics": NUMERICS | MECHANICS | {"recursion"},
    "integrate": BASE | {"exec"},
    "paper": MOTION,
    "simulate": NUMERICS | MECHANICS | {"recursion", "dynamics", "integrate"},
}

#: Third parties and the only folders that may include them.
THIRD_PARTIES = {
    r"(sundials|cvodes?|arkode|kinsol|idas?|nvector|sunlinsol|sunmatrix|sunnonlinsol)/": (
        "src/linkwise/integrate/sundials"
    ),
    r"(nanobind/|Python\.h)": "bindings",
    r"mpi\.h": "src/linkwise/exec/mpi",
    r"(cuda|cub/|cooperative_groups|thrust/|nccl)": "src/linkwise/exec/cuda",
    r"(gtest|gmock)/": "tests/cpp",
    r"(benchmark|pinocchio|mujoco)/": "benchmarks",
}
#: Headers of the compiler and of POSIX, which any layer may include.
SYSTEM = re.compile(
    r"([a-z_]+intrin|unistd|sched|pthread|cxxabi|sys/(mman|resource|stat|types|wait))\.h|[a-z0-9_]+"
)

#: Packages that a function may import when it is called: optional ones, and slow ones that not
#: every command needs.
LATE_PACKAGES = {
    "h5netcdf",
    "h5py",
    "matplotlib",
    "meshio",
    "mujoco",
    "plotly",
    "rainflow",
    "scipy",
    "skfem",
    "trimesh",
    "viser",
    "websockets",
    "xarray",
    "zarr",
}
#: May import anything late: the command line answers --help before it loads NumPy and the core.
LATE_ROOM = "cli"
#: May import by a string: the public names, and the core for this CPU.
BY_NAME = {f"{PACKAGE}/__init__.py", f"{PACKAGE}/_core.py"}

#: The arrows in ARCHITECTURE.md, a code block between two marks.
ARROWS = re.compile(r"(<!-- arrows -->\n).*?(<!-- /arrows -->)", re.DOTALL)


def layer_of(path: str) -> str | None:
    """The layer whose rules hold for a file; a test of a layer sees what the layer sees."""
    match = re.match(r"(?:src/linkwise|tests/cpp)/([^/]+)/", path)
    return match[1] if match else None


def check_include(path: str, quote: str, target: str) -> str | None:
    """What is wrong with one include, or None."""
    if own := re.match(r"linkwise/([^/]+)/", target):
        layer = layer_of(path)
        if quote == "<":
            return f'write it as #include "{target}"'
        if own[1] not in LAYERS:
            return f"there is no layer {own[1]}"
        if layer is not None and own[1] != layer and own[1] not in LAYERS.get(layer, set()):
            return f"layer {layer} must not see layer {own[1]}"
        return None
    for pattern, folder in THIRD_PARTIES.items():
        if re.match(pattern, target):
            return None if path.startswith(f"{folder}/") else f"only {folder} may include it"
    if quote == "<" and not SYSTEM.fullmatch(target):
        return "unknown third party; give it one folder and add it to tools/check_layers.py"
    if quote == '"' and path.startswith("src/"):
        return 'write it from the include root, as #include "linkwise/..."'
    return None


def check(root: Path) -> list[str]:
    violations = []
    for folder in ("src", "bindings", "tests/cpp", "benchmarks"):
        for file in sorted((root / folder).rglob("*")):
            if file.suffix not in SUFFIXES:
                continue
            path = file.relative_to(root).as_posix()
            if path.startswith("src/linkwise/") and layer_of(path) not in LAYERS:
                violations.append(f"{path}: not in one of the layers {', '.join(LAYERS)}")
            for number, quote, target in includes(file):
                if problem := check_include(path, quote, target):
                    violations.append(f"{path}:{number}: {target}: {problem}")
    return violations


def check_circles(root: Path) -> list[str]:
    graphs = {"includes": include_graph(root), "imports": import_graph(root)}
    return [
        f"{group[0]}: {what} go in a circle: {', '.join(group)}"
        for what, graph in graphs.items()
        for group in circles(graph)
    ]


def check_hidden_imports(root: Path) -> list[str]:
    """Imports stand where a reader of the file's head finds them, with the exceptions above."""
    violations = []
    for file in sorted((root / PACKAGE).rglob("*.py")):
        path, parts = file.relative_to(root).as_posix(), file.relative_to(root / PACKAGE).parts
        room = f"linkwise.{parts[0]}"
        for number, name in late_imports(file, ".".join(["linkwise", *parts[:-1]])):
            if not name:
                if path not in BY_NAME:
                    violations.append(f"{path}:{number}: imports by a name; write the import")
            elif name.partition(".")[0] not in LATE_PACKAGES | sys.stdlib_module_names and not (
                parts[0] == LATE_ROOM or name.startswith(f"{room}.")
            ):
                violations.append(f"{path}:{number}: {name}: import it at the top of the file")
    return violations


def picture(root: Path) -> str:
    """Who sees whom, lowest first, without what is seen through another one."""
    core = {file: to for file, to in include_graph(root).items() if file.startswith("src/")}
    lines = [
        "C++ (src/linkwise)",
        *arrows(rooms(core, 2)),
        "",
        "Python (python/linkwise)",
        *arrows(rooms(import_graph(root), 1)),
    ]
    return "\n".join(["```text", *lines, "```", ""])


def check_picture(root: Path) -> list[str]:
    document = root / "ARCHITECTURE.md"
    if not document.is_file():
        return []
    shown = ARROWS.search(document.read_text(encoding="utf-8"))
    if shown and shown[0] == f"{shown[1]}{picture(root)}{shown[2]}":
        return []
    return ["ARCHITECTURE.md: its arrows are not the code's; run tools/check_layers.py --arrows"]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("repository", nargs="?", type=Path, default=Path(__file__).parent.parent)
    parser.add_argument("--arrows", action="store_true", help="write them into ARCHITECTURE.md")
    arguments = parser.parse_args()
    root = arguments.repository
    if arguments.arrows:
        document = root / "ARCHITECTURE.md"
        text = document.read_text(encoding="utf-8")
        document.write_text(
            ARROWS.sub(lambda m: f"{m[1]}{picture(root)}{m[2]}", text), encoding="utf-8"
        )
    violations = [
        *check(root),
        *check_circles(root),
        *check_hidden_imports(root),
        *check_picture(root),
    ]
    return report("check_layers", violations)


if __name__ == "__main__":
    sys.exit(main())
