"""Every public name says what it needs: its arguments, shapes, units, and what can go wrong."""

import ast
import inspect
import re
from pathlib import Path

import pytest

import linkwise as lw

STUB = ast.parse(Path(lw.__file__).with_name("_core.pyi").read_text(encoding="utf-8"))
#: A shape, such as (..., nv) or (size,); units in brackets, such as [N, N m].
SIZE = r"\w+(?: [+-] \w+)?"
SHAPE = re.compile(rf"\((?:\.\.\.|{SIZE})(?:, ?{SIZE})*,?\)")
UNITS = re.compile(r"\[(?!(?:[a-z]+\d{4}))[^\]]*[A-Za-z][^\]]*\]")
#: Where the formula comes from: a key of references.bib.
SOURCE = re.compile(r"\[[a-z]+\d{4}\b[^\]]*\]|docs/theory/\w+\.md")
OWN = {"Array", "InputError", "NumericsError"}


def members():
    """Every public callable and property: its name, and itself."""
    for name in lw.__all__:
        value = getattr(lw, name)
        if inspect.ismodule(value):
            yield from ((f"{name}.{n}", getattr(value, n)) for n in value.__all__)
            continue
        yield name, value
        if inspect.isclass(value) and not issubclass(value, Exception):
            yield from (
                (f"{name}.{n}", v) for n, v in inspect.getmembers(value) if not n.startswith("_")
            )


MEMBERS = {
    name: member
    for name, member in members()
    if (callable(member) or isinstance(member, property)) and type(member).__module__ != "typing"
}


def text_of(member):
    """The docstring, of a class with that of __init__, without the signatures that bindings add."""
    found = inspect.getdoc(member) or ""
    if inspect.isclass(member):
        found += "\n" + (inspect.getdoc(member.__init__) or "")
    return re.sub(r"^(?:\w+\(.*\) -> .*|\(self\) -> .*)$", "", found, flags=re.MULTILINE).strip()


def stub_functions():
    """What returns an array, by its public name: functions, methods and properties."""
    for node in STUB.body:
        for function in node.body if isinstance(node, ast.ClassDef) else [node]:
            owner = f"{node.name}." if isinstance(node, ast.ClassDef) else ""
            name = f"{owner}{getattr(function, 'name', '')}"
            if isinstance(function, ast.FunctionDef) and name in MEMBERS:
                yield name, function


FUNCTIONS = dict(stub_functions())
ARRAYS = [name for name, f in FUNCTIONS.items() if ast.unparse(f.returns or f) == "Array"]
OF_STATES = [
    name for name, f in FUNCTIONS.items() if {"model", "q"} <= {a.arg for a in f.args.args}
]


@pytest.mark.parametrize("name", sorted(MEMBERS))
def test_it_has_a_docstring(name):
    assert len(text_of(MEMBERS[name])) > 15


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_the_core_names_every_argument(name):
    function = FUNCTIONS[name].args
    arguments = [a.arg for a in [*function.args, *function.kwonlyargs] if a.arg != "self"]
    text = text_of(MEMBERS[name])
    assert [a for a in arguments if not re.search(rf"\b{a}\b", text)] == []


@pytest.mark.parametrize("name", sorted(ARRAYS))
def test_an_array_has_a_shape_and_units(name):
    text = text_of(MEMBERS[name])
    assert SHAPE.search(text) or "(...)" in text, text
    assert UNITS.search(text), text


@pytest.mark.parametrize("name", sorted(OF_STATES))
def test_what_takes_states_says_what_it_refuses(name):
    assert "Raises:\n    InputError: " in text_of(MEMBERS[name])


FORMULAS = (
    "body_jacobian forward_dynamics inverse_dynamics inverse_dynamics_loads joint_loads "
    "joint_loads_by_cause mass_matrix passive_torque ConstraintSystem Spectrum"
)


@pytest.mark.parametrize("name", FORMULAS.split())
def test_a_formula_has_its_source(name):
    text = text_of(MEMBERS[name])
    assert SOURCE.search(text) or "cite their\n" in text, text
