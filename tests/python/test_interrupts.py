"""Ctrl-C while the core computes: long calls end soon, and what was computed is kept."""

import os
import signal
import threading
import time

import numpy as np
import pytest

import linkwise as lw


class Press:
    """Presses Ctrl-C once, some time after the start of the block."""

    def __init__(self, after=0.5):
        self._timer = threading.Timer(after, os.kill, (os.getpid(), signal.SIGINT))

    def __enter__(self):
        self._timer.start()
        return self

    def __exit__(self, *_):
        self._timer.cancel()


def ends_soon(call, error, limit=15.0):
    """The exception; a call that Ctrl-C does not reach would take hours."""
    started = time.monotonic()
    with Press(), pytest.raises(error) as caught:
        call()
    assert time.monotonic() - started < limit
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    return caught.value


@pytest.mark.parametrize("integrator", ["adams", "bdf", "runge_kutta_4", "semi_implicit_euler"])
def test_very_many_tiny_steps_between_two_samples(integrator):
    model = lw.scenes.chain(3)
    fixed = integrator in ("runge_kutta_4", "semi_implicit_euler")
    options = {"step": 1e-9} if fixed else {"max_step": 1e-9}
    error = ends_soon(
        lambda: lw.simulate(
            model,
            times=[0.0, 1e-8, 1000.0],
            q0=[0.1, 0.2, 0.3],
            integrator=integrator,
            **options,
        ),
        lw.SimulationInterrupted,
    )
    assert error.run.outcome == "interrupted"
    np.testing.assert_array_equal(error.run.time, [0.0, 1e-8])


def test_inside_a_users_function():
    model = lw.scenes.chain(3)
    error = ends_soon(
        lambda: lw.simulate(
            model,
            times=[0.0, 1e-8, 1000.0],
            integrator="runge_kutta_4",
            step=1e-9,
            drives={"joint_1": lambda t, q, v: 0.1},
        ),
        lw.SimulationInterrupted,
    )
    np.testing.assert_array_equal(error.run.time, [0.0, 1e-8])


@pytest.mark.parametrize("threads", [1, 2])
def test_a_batch_of_simulations(threads):
    model = lw.scenes.chain(3)
    error = ends_soon(
        lambda: lw.simulate_batch(
            model,
            q0=np.full((50, 3), 0.3),
            times=[0.0, 1e-8, 1000.0],
            step=1e-9,
            threads=threads,
        ),
        lw.SimulationInterrupted,
    )
    run = error.run
    assert set(run.dataset.outcome.values) == {"interrupted"}
    assert np.isfinite(run.position.isel(time=0)).all()
    assert np.isnan(run.position.isel(time=2)).all()


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("method", ["auto", "composite_rigid_body"])
def test_a_large_batch_of_states(method, threads):
    model = lw.scenes.chain(50)
    q = np.zeros((20_000, 50))

    def compute():
        for _ in range(100_000):  # in Python too: a call may end before the key is pressed
            lw.forward_dynamics(model, q, q, method=method, threads=threads)

    ends_soon(compute, KeyboardInterrupt)


def test_a_handler_that_does_not_raise_does_not_stop():
    calls = []
    previous = signal.signal(signal.SIGINT, lambda *_: calls.append(1))
    try:
        with Press(after=0.2):
            run = lw.simulate(
                lw.scenes.chain(3), duration=0.5, every=0.5, integrator="runge_kutta_4", step=2e-6
            )
    finally:
        signal.signal(signal.SIGINT, previous)
    assert run.completed
    assert calls
