"""The types of the compiled core: that they are those of the core, and that values have them."""

from collections.abc import Mapping, Sequence
from typing import Any, get_args, get_origin

import make_stub
import numpy as np
import numpy.typing as npt
import pytest

import linkwise as lw
from linkwise import _core

SPACE = vars(_core) | {
    "Any": Any,
    "Array": npt.NDArray[np.float64],
    "Mapping": Mapping,
    "Sequence": Sequence,
}


@pytest.fixture(scope="module")
def text():
    return make_stub.refine(make_stub.generated())


def test_the_stub_is_that_of_the_core(text):
    assert make_stub.same(make_stub.STUB.read_text(encoding="utf-8"), text)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("def mass_matrix(", "def mass_matrices("),
        ("def n_joints(self) -> int", "def n_joints(self) -> float"),
        ("def mass_matrix(model: Model, q: npt.ArrayLike", "def mass_matrix(model: Model"),
    ],
)
def test_a_name_a_type_and_a_parameter_count(text, old, new):
    assert old in text
    assert not make_stub.same(text.replace(old, new), text)


@pytest.mark.parametrize(
    ("function", "where"),
    [
        ("def f(unheard_of: object) -> None: ...", "f, unheard_of"),
        ("def f(threads: int) -> list: ...", "f, returned"),
        ("class A:\n    def f(self) -> dict[str, tuple]: ...", "A.f, returned"),
    ],
)
def test_what_the_tables_do_not_know_is_an_error(function, where):
    with pytest.raises(SystemExit, match=where):
        make_stub.refine(function)


def fits(value, kind):
    origin, arguments = get_origin(kind), get_args(kind)
    if kind is Any:
        return True
    if origin is np.ndarray:
        return isinstance(value, np.ndarray) and value.dtype == np.float64
    if origin is tuple:
        return len(value) == len(arguments) and all(map(fits, value, arguments))
    if origin is list:
        return isinstance(value, list) and all(fits(one, arguments[0]) for one in value)
    if origin is dict:
        return all(fits(k, arguments[0]) and fits(v, arguments[1]) for k, v in value.items())
    return isinstance(value, kind)


@pytest.mark.parametrize("name", ["Model", "ConstraintSystem", "ForwardDynamicsResult", "Report"])
def test_values_have_the_types_of_the_stub(text, name):
    model = lw.scenes.ssrms()
    q, v = model.neutral_configuration(), np.ones(model.nv)
    result = lw.forward_dynamics(model, q, v, method="constraint_force", full=True)
    system = lw.ConstraintSystem(model, q, v)
    made = {r.__class__.__name__: r for r in (model, system, result, result.report)}[name]
    stub = next(c for c in make_stub.classes(text) if c.name == name)
    properties = [f for f in stub.body if isinstance(getattr(type(made), f.name), property)]
    assert len(properties) >= 3
    for function in properties:
        kind = eval(make_stub.ast.unparse(function.returns), SPACE)
        assert fits(getattr(made, function.name), kind), function.name


@pytest.mark.parametrize(
    "name", ["methods", "solvers", "integrators", "initial_guesses", "stop_rules", "solver_options"]
)
def test_tables_have_the_types_of_the_stub(name):
    assert fits(getattr(_core, name)(), eval(make_stub.RETURNS[name]))


def test_systems_and_methods_return_what_the_stub_says():
    model = lw.scenes.chain(3)
    q = np.zeros(model.nq)
    system, method = lw.ConstraintSystem(model, q), lw.DynamicsMethod(model)
    for name, value in (
        ("ConstraintSystem.solve", system.solve()),
        ("ConstraintSystem.recover", system.recover(np.zeros(system.size))),
        ("DynamicsMethod.evaluate", method.evaluate(0.0, q)),
        ("DynamicsMethod.follow", method.follow([0.0, 1e-3], np.stack([q, q]))),
    ):
        assert fits(value, eval(make_stub.RETURNS[name], SPACE)), name
