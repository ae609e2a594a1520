"""Exceptions of the package survive pickling and copying, and so come back from other processes."""

import copy
import multiprocessing
import pickle
import sys
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest

import linkwise as lw


def fail(output=None):
    """A simulation that needs more steps than it may take."""
    return lw.simulate(
        lw.scenes.chain(2), duration=1, q0=[1, 1], numerics={"max_steps": 1}, output=output
    )


def refuse():
    return lw.forward_dynamics(lw.scenes.chain(2), [0.0, np.nan], [0.0, 0.0])


def caught(function, *arguments):
    with pytest.raises(Exception) as info:  # noqa: PT011, each is looked at below
        function(*arguments)
    return info.value


def every_exception():
    """Each public exception, as it is raised or as its constructor makes it."""
    failed = caught(fail)
    assert type(failed) is lw.SimulationError
    refused = caught(refuse)
    assert type(refused) is lw.InputError
    return [
        failed,
        refused,
        lw.SimulationInterrupted("interrupted at t = 1 s", failed.run),
        lw.NumericsError("no solution"),
        lw.ModelWarning("the link has no mass"),
    ]


def test_every_public_exception_is_tried():
    public = {
        name
        for name in lw.__all__
        if isinstance(getattr(lw, name), type) and issubclass(getattr(lw, name), BaseException)
    }
    assert public == {type(error).__name__ for error in every_exception()}


@pytest.mark.parametrize(
    "again", [lambda e: pickle.loads(pickle.dumps(e)), copy.copy, copy.deepcopy]
)
def test_exceptions_round_trip(again):
    for error in every_exception():
        back = again(error)
        assert type(back) is type(error)
        assert str(back) == str(error)
        if hasattr(error, "run"):
            assert back.run.outcome == error.run.outcome
            np.testing.assert_array_equal(back.run.position, error.run.position)


def test_stored_run_comes_along(tmp_path):
    back = pickle.loads(pickle.dumps(caught(fail, tmp_path / "run.zarr")))
    assert back.run.path == tmp_path / "run.zarr"
    assert back.run.sizes["time"] == 1


@pytest.mark.skipif(sys.platform == "win32", reason="no fork here")
def test_pool_hands_the_exception_over():
    fork = multiprocessing.get_context("fork")
    with fork.Pool(1) as pool, pytest.raises(lw.SimulationError, match="stopped at t = "):
        pool.apply_async(fail).get(timeout=120)


def test_executor_hands_the_exception_over():
    spawn = multiprocessing.get_context("spawn")
    with (
        ProcessPoolExecutor(1, mp_context=spawn) as pool,
        pytest.raises(lw.SimulationError) as info,
    ):
        pool.submit(fail).result(timeout=120)
    assert info.value.run.sizes["time"] == 1


def values_of(result):
    """The public properties of a result of the core, arrays as lists."""
    found = {n: getattr(result, n) for n in dir(result) if not n.startswith("_")}
    return {n: v.tolist() if isinstance(v, np.ndarray) else v for n, v in found.items()}


@pytest.mark.parametrize(
    "again", [lambda e: pickle.loads(pickle.dumps(e)), copy.copy, copy.deepcopy]
)
def test_results_of_the_core_round_trip(again):
    model = lw.scenes.chain(3)
    full = lw.forward_dynamics(
        model, [0.1, 0.2, 0.3], [1, 2, 3], method="constraint_force", full=True
    )
    builder = lw.ModelBuilder("m")
    for name in "ab":
        builder.add_link(name, mass=1.0, inertia=np.eye(3))
    builder.add_joint("weld", "fixed", "a", "b")
    (note, *_) = builder.build().notes
    back = again(full)
    assert repr(back.report) == repr(full.report)
    for result in (full.report, note, lw.ConstraintSystem(model, [0, 0, 0]).spectrum()):
        assert values_of(again(result)) == values_of(result)
    for name in ("acceleration", "joint_load", "constraint_force"):
        np.testing.assert_array_equal(getattr(back, name), getattr(full, name))
