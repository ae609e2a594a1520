"""Who uses whom: includes between C++ files, imports between Python modules; circles and arrows."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath

Graph = dict[str, set[str]]
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
SUFFIXES = {".hpp", ".cpp", ".cu", ".h"}
PACKAGE = "python/linkwise"
#: What imports a module by a string, which no reader of imports sees.
BY_NAME = {"import_module", "__import__"}


def includes(path: Path) -> Iterator[tuple[int, str, str]]:
    """Line number, opening mark and target of every include."""
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        if match := INCLUDE.match(line):
            yield number, match[1], match[2]


def include_graph(root: Path) -> Graph:
    """Files of the core and of the bindings, by the files that they include."""
    graph: Graph = {}
    for folder in ("src", "bindings"):
        for file in sorted((root / folder).rglob("*")):
            if file.suffix in SUFFIXES:
                targets = {target for _, _, target in includes(file)}
                found = {
                    near for target in targets for near in (f"src/{target}", f"bindings/{target}")
                }
                graph[file.relative_to(root).as_posix()] = {
                    n for n in found if (root / n).is_file()
                }
    return graph


def import_graph(root: Path) -> Graph:
    """Modules of the Python package, by those that they import: at the top, late, or for types.

    The package itself is left out: it names what it offers and imports it when it is asked for.
    """
    top = root / PACKAGE
    files = {_module(file, top): file for file in sorted(top.rglob("*.py"))}
    files.pop("linkwise", None)
    graph: Graph = {}
    for module, file in files.items():
        package = module if file.name == "__init__.py" else module.rpartition(".")[0]
        named = set(_imported(ast.parse(file.read_text(encoding="utf-8")), package))
        nearest = {_nearest(name, files) for name in named}
        graph[module] = {name for name in nearest if name and name != module}
    return graph


def late_imports(file: Path, package: str) -> Iterator[tuple[int, str]]:
    """Line number and module of every import inside a function, and "" for an import by a name."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            for inner in ast.walk(node):
                if isinstance(inner, ast.Import | ast.ImportFrom):
                    yield inner.lineno, next(_imported(ast.Module([inner], []), package))
        elif isinstance(node, ast.Attribute | ast.Name | ast.alias):
            name = node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")
            name = node.name if isinstance(node, ast.alias) else name
            if name in BY_NAME:
                yield node.lineno, ""


def _module(file: Path, top: Path) -> str:
    parts = file.relative_to(top.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _imported(tree: ast.Module, package: str) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            parts = package.split(".")
            near = parts[: len(parts) + 1 - node.level] if node.level else []
            base = ".".join([*near, *([node.module] if node.module else [])])
            yield from (f"{base}.{name.name}" for name in node.names)


def _nearest(name: str, files: Mapping[str, Path]) -> str | None:
    """The module that a dotted name lies in."""
    while name and name not in files:
        name = name.rpartition(".")[0]
    return name or None


def circles(graph: Graph) -> list[list[str]]:
    """Groups of nodes that reach each other."""
    reach = {node: reachable(graph, node) for node in graph}
    groups = {
        tuple(sorted(other for other in reach[node] if node in reach.get(other, ())))
        for node in graph
    }
    return sorted(list(group) for group in groups if group)


def reachable(graph: Graph, start: str) -> set[str]:
    """What can be reached from a node by one arrow or more."""
    seen: set[str] = set()
    waiting = list(graph.get(start, ()))
    while waiting:
        if (node := waiting.pop()) not in seen:
            seen.add(node)
            waiting += graph.get(node, ())
    return seen


def rooms(graph: Graph, depth: int) -> Graph:
    """The graph of folders at some depth of the path, or of packages at some depth of the name."""

    def room(name: str) -> str:
        parts = PurePosixPath(name).parts if "/" in name else tuple(name.split("."))
        return parts[min(depth, len(parts) - 1)]

    found: Graph = {}
    for name, targets in graph.items():
        found.setdefault(room(name), set()).update(room(target) for target in targets)
    return {name: targets - {name} for name, targets in found.items()}


def arrows(graph: Graph) -> list[str]:
    """One line per node, lowest first: what it uses and does not see through another one."""
    reach = {node: reachable(graph, node) for node in graph}
    order = sorted(graph, key=lambda node: (len(reach[node]), node))
    width = max(map(len, graph), default=0)
    lines = []
    for node in order:
        seen = set().union(*(reach[other] for other in graph[node] if node not in reach[other]))
        direct = sorted(graph[node] - seen, key=order.index)
        lines.append(f"{node:{width}} -> {', '.join(direct)}" if direct else node)
    return lines
