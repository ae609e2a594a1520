"""Ctrl-C while the core computes: long calls end soon, and what was computed is kept.

Nothing here depends on how fast the machine is: the key is pressed when the call says that it has
begun, and a call that it does not reach would take hours, so that only the fuse ends it.
"""

import faulthandler
import os
import signal
import sys
import threading

import numpy as np
import pytest

import linkwise as lw
from linkwise import _core

FUSE = 600  # seconds until a call that Ctrl-C does not reach ends the whole process


class Press:
    """Presses Ctrl-C once after `begun` was called, when the main thread lets go of the
    interpreter. Only the core does that: no Python code of the call is interrupted."""

    def __init__(self):
        self._begun = threading.Event()
        self.pressed = threading.Event()
        self._thread = threading.Thread(target=self._press, daemon=True)

    def begun(self, *_):
        sys.setswitchinterval(FUSE)
        self._begun.set()

    def _press(self):
        self._begun.wait()
        os.kill(os.getpid(), signal.SIGINT)
        self.pressed.set()

    def __enter__(self):
        self._interval = sys.getswitchinterval()
        faulthandler.dump_traceback_later(FUSE, exit=True)
        self._thread.start()
        return self

    def __exit__(self, *_):
        sys.setswitchinterval(self._interval)
        faulthandler.cancel_dump_traceback_later()


def ends(call, error):
    """The exception with which call(begun) ends after Ctrl-C."""
    with Press() as press, pytest.raises(error) as caught:
        call(press.begun)
    assert press.pressed.is_set()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    return caught.value


@pytest.mark.parametrize(
    "integrator", ["adams", "bdf", "esdirk", "runge_kutta_4", "semi_implicit_euler"]
)
def test_very_many_tiny_steps_between_two_samples(integrator):
    model = lw.scenes.chain(3)
    times = np.array([0.0, 1e-8, 2e-8, 3e-8, 1000.0])
    fixed = integrator in ("runge_kutta_4", "semi_implicit_euler")
    options = {"step": 1e-9} if fixed else {"max_step": 1e-9}
    error = ends(
        lambda begun: lw.simulate(
            model,
            times=times,
            progress=lambda reached: begun() if reached.time > 0 else None,
            q0=[0.1, 0.2, 0.3],
            numerics={"integrator": integrator, **options},
        ),
        lw.SimulationInterrupted,
    )
    assert error.run.outcome == "interrupted"
    reached = error.run.time.values
    assert 2 <= reached.size < times.size
    np.testing.assert_array_equal(reached, times[: reached.size])


def test_inside_a_users_function():
    pressed = []

    def torque(t, q, v):
        if t > 2e-8 and not pressed:
            pressed.append(t)
            os.kill(os.getpid(), signal.SIGINT)
        return 0.1

    with pytest.raises(lw.SimulationInterrupted) as caught:
        lw.simulate(
            lw.scenes.chain(3),
            times=[0.0, 1e-8, 1000.0],
            numerics={"integrator": "runge_kutta_4", "step": 1e-9},
            drives={"joint_1": lw.Torque(torque, breakpoints=())},
        )
    np.testing.assert_array_equal(caught.value.run.time, [0.0, 1e-8])


@pytest.mark.parametrize("threads", [1, 2])
def test_a_batch_of_simulations(threads, monkeypatch):
    model = lw.scenes.chain(3)
    compute = _core.simulate_members

    def call(begun):
        def begin(*arguments, **options):
            begun()
            return compute(*arguments, **options)

        monkeypatch.setattr(_core, "simulate_members", begin)
        lw.simulate_batch(
            model,
            q0=np.full((50, 3), 0.3),
            times=[0.0, 1e-8, 1000.0],
            step=1e-9,
            threads=threads,
        )

    error = ends(call, lw.SimulationInterrupted)
    run = error.run
    assert set(run.dataset.outcome.values) == {"interrupted"}
    assert np.isfinite(run.position.isel(time=0)).all()
    assert np.isnan(run.position.isel(time=2)).all()


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("method", ["auto", "composite_rigid_body"])
def test_a_large_batch_of_states(method, threads):
    model = lw.scenes.chain(50)
    q = np.zeros((20_000, 50))

    def compute(begun):
        begun()
        while True:  # in Python too: a call may end before the key is pressed
            lw.forward_dynamics(model, q, q, method=method, threads=threads)

    ends(compute, KeyboardInterrupt)


def test_a_handler_that_does_not_raise_does_not_stop():
    calls = []
    previous = signal.signal(signal.SIGINT, lambda *_: calls.append(1))
    try:
        with Press() as press:
            run = lw.simulate(
                lw.scenes.chain(3),
                times=[0.0, 1e-8, 0.5],
                progress=press.begun,
                numerics={"integrator": "runge_kutta_4", "step": 2e-6},
            )
            assert press.pressed.wait(FUSE)
    finally:
        signal.signal(signal.SIGINT, previous)
    assert run.completed
    assert calls
