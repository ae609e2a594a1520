"""Writes python/linkwise/_core.pyi, the types of the compiled core; with --check compares only.

nanobind's stubgen reads names, parameters and defaults from the compiled module. The bindings take
and return arrays and rows as plain Python objects; the tables below say which. A parameter, list,
dict or tuple that they do not know is an error, so that nothing is typed as Any by oversight.
"""

from __future__ import annotations

import ast
import re
import sys
from pathlib import Path

STUB = Path(__file__).parents[1] / "python" / "linkwise" / "_core.pyi"

HEADER = '''"""Types of the compiled core, written by tools/make_stub.py."""

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
TARGETS: tuple[str, ...]

'''

# Parameters that a binding takes as a Python object, by their name.
ARRAYS = (
    "acceleration axes axis breakpoints child_point child_rotation child_translation com "
    "directions end external f gravity guess inertia initial joint_load point loop_prescribed "
    "loop_tau offset origin preload prescribed q q0 rotation target tau times translation turn "
    "v v0 value values z"
)
PARAMETERS = dict.fromkeys(ARRAYS.split(), "npt.ArrayLike") | {
    "arg": "Any",  # without a name: what pickling has kept
    "axes": "Any",  # joint axes: one per direction, or none
    "at": "str | Frame",
    "body": "str | int",
    "make_flexible.body": "Any",  # a linkwise.FlexibleBody
    "with_flexible.body": "Any",
    "frame": "str | Frame",
    "samples": "tuple[npt.ArrayLike, npt.ArrayLike]",
    "factors": "Mapping[str, float | Sequence[float]]",
    "fn": "Callable[..., Any]",
    "section": "Any",  # what has area, Iy, Iz and J
    "E": "float | None",
    "G": "float | None",
    "density": "float",
    "damping": "float",
    "bodies": "int",
    "interior_modes": "int",
    "mass": "float",
    "radial": "float | None",
    "axial": "float | None",
    "tilt": "float | None",
    "torsion": "float | None",
    "options": "Any",
    "max_iterations": "int",
    "quantities": "Collection[str]",
    "simulations": "Sequence[Simulation]",
    "solver_options": "Mapping[str, Any]",
    "source": "str",
    "threads": "int",
    "stop": "str",
    "tolerance": "float",
    "joints": "dict[str, dict[str, Any]]",
    "properties": "Any",
}

# Returned Python objects are arrays, but for these.
RETURNS = {
    "assemble": "dict[str, Any]",
    "ConstraintSystem.recover": "tuple[Array, Array]",
    "ConstraintSystem.rows_per_joint": "list[int]",
    "ConstraintSystem.solve": "tuple[Array, Report]",
    "ConstraintSystem.sparse": "Any",
    "DynamicsMethod.evaluate": "tuple[Array, Array, Report]",
    "DynamicsMethod.follow": "dict[str, Any]",
    "Frame.__getstate__": "tuple[str, Array, Array]",
    "Model.beam_lengths": "dict[str, float]",
    "Model.bearing_joints": "list[str]",
    "Model.bearings": "dict[str, dict[str, Any]]",
    "Model.child_link_names": "list[str]",
    "Model.coupling_joints": "list[list[str]]",
    "Model.coupling_names": "list[str]",
    "Model.flexible_links": "dict[str, str]",
    "Model.frame_placement": "tuple[str | None, Array, Array]",
    "Model.joint_labels": "tuple[tuple[tuple[str, str], ...], tuple[tuple[str, str], ...]]",
    "Model.joint_axes": "list[list[tuple[str, tuple[float, float, float]]]]",
    "Model.joint_names": "list[str]",
    "Model.joint_nq": "list[int]",
    "Model.joint_nv": "list[int]",
    "Model.joint_parents": "list[int]",
    "Model.joint_types": "list[str]",
    "Model.link_names": "list[str]",
    "Model.loop_axes": "list[list[tuple[str, tuple[float, float, float]]]]",
    "Model.loop_child_link_names": "list[str]",
    "Model.loop_labels": "tuple[tuple[tuple[str, str], ...], tuple[tuple[str, str], ...]]",
    "Model.loop_names": "list[str]",
    "Model.loop_nv": "list[int]",
    "Model.loop_parent_link_names": "list[str]",
    "Model.loop_slices": "list[tuple[slice, slice]]",
    "Model.loop_types": "list[str]",
    "Model.parent_link_names": "list[str]",
    "Model.welds": "list[tuple[str, str, str]]",
    "Simulation.advance": "dict[str, Any]",
    "Simulation.trace": "dict[str, Any]",
    "forward_dynamics": "Any",
    "beam_properties": "dict[str, dict[str, Any]]",
    "bent_sections": "tuple[Array, Array]",
    "initial_guesses": "list[dict[str, str]]",
    "loop_coordinates": "tuple[Array, Array]",
    "integrators": "list[dict[str, Any]]",
    "measure_serial_part": "dict[str, float]",
    "methods": "list[dict[str, Any]]",
    "numerics": "list[dict[str, Any]]",
    "quantities": "list[dict[str, Any]]",
    "simulate_members": "tuple[dict[str, Any], Array, list[Ending], bool, tuple[int, int, str], "
    "list[tuple[str, str]]]",
    "solver_options": "list[dict[str, Any]]",
    "solvers": "list[dict[str, Any]]",
    "stop_rules": "list[dict[str, str]]",
}

UNSAID = re.compile(r"\b(object|list|dict|tuple|Callable)\b(?!\[)")


def generated() -> str:
    """What stubgen writes about the core that this machine loads."""
    from nanobind.stubgen import StubGen

    import linkwise._core as core

    stub = StubGen(core, include_docstrings=False)
    stub.put(core)
    return str(stub.get())


def exceptions() -> list[ast.stmt]:
    """The core's exceptions, which say that they live in linkwise."""
    import linkwise._core as core

    found = sorted(
        name
        for name, value in vars(core).items()
        if isinstance(value, type) and issubclass(value, Exception)
    )
    text = "".join(f"class {n}({getattr(core, n).__base__.__name__}): ...\n" for n in found)
    return ast.parse(text).body


def said(annotation: ast.expr | None, instead: str | None, where: str) -> ast.expr | None:
    """An annotation with what the tables know in place of a bare object, list, dict or tuple."""
    if annotation is None:
        return ast.parse(instead, mode="eval").body if instead else None
    text = ast.unparse(annotation)
    if UNSAID.search(text):
        if instead is None:
            raise SystemExit(f"{where}: is {text}; say what it is in tools/make_stub.py")
        text = UNSAID.sub(instead, text)
    return ast.parse(text, mode="eval").body


def refine_function(function: ast.FunctionDef, owner: str) -> None:
    name = f"{owner}.{function.name}" if owner else function.name
    arguments = function.args
    every = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
    for argument in every + [a for a in (arguments.vararg, arguments.kwarg) if a is not None]:
        if argument.arg != "self":
            known = PARAMETERS.get(f"{function.name}.{argument.arg}", PARAMETERS.get(argument.arg))
            argument.annotation = said(argument.annotation, known, f"{name}, {argument.arg}")
    returned = ast.unparse(function.returns) if function.returns else ""
    known = RETURNS.get(name, "Array" if "object" in returned else None)
    function.returns = said(function.returns, known, f"{name}, returned")


def refine(text: str) -> str:
    """The stub: one statement after another, in stubgen's order."""
    kept: list[ast.stmt] = exceptions()
    for statement in ast.parse(text).body:
        if isinstance(statement, ast.ClassDef):
            functions = [f for f in statement.body if isinstance(f, ast.FunctionDef)]
            for function in functions:
                refine_function(function, statement.name)
            statement.body = list(functions) or [ast.Expr(ast.Constant(...))]
        elif isinstance(statement, ast.FunctionDef):
            refine_function(statement, "")
        elif isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
            if statement.target.id in ("TYPE_CHECKING", "TARGETS", "__all__"):
                continue
            statement.value = None  # this machine's
        else:
            continue
        kept.append(statement)
    body = ast.unparse(ast.Module(kept, [])).replace(":\n        ...", ": ...")
    body = re.sub(r"\n+", "\n", body.replace(":\n    ...", ": ..."))  # one line per function
    return HEADER + body.replace("\nclass", "\n\nclass") + "\n"


def classes(text: str) -> list[ast.ClassDef]:
    return [s for s in ast.parse(text).body if isinstance(s, ast.ClassDef)]


def same(first: str, second: str) -> bool:
    """Equal but for their layout."""
    return ast.dump(ast.parse(first)) == ast.dump(ast.parse(second))


def main() -> int:
    text = refine(generated())
    if "--check" in sys.argv[1:]:
        if STUB.exists() and same(STUB.read_text(encoding="utf-8"), text):
            return 0
        print(f"{STUB.name} is not what the core has; run python tools/make_stub.py")
        return 1
    STUB.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
