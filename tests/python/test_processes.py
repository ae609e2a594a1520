"""Forked children, and interpreters that end while threads compute.

Each script runs in a Python of its own, which must end with exit code 0 and say nothing. None of
them depends on how fast the machine is: only the fuse ends what hangs.
"""

import gc
import subprocess
import sys
import weakref

import numpy as np
import pytest

import linkwise as lw
from linkwise import _core

FUSE = 600  # seconds

BEGIN = """
import os, sys, signal, threading
import numpy as np
import linkwise as lw
arm = lw.scenes.srms(payload_mass=10)
q = np.random.default_rng(0).normal(size=(300, arm.nq))
v = np.zeros(arm.nv)
expected = lw.forward_dynamics(arm, q, v, threads=4)

def is_right():
    return np.array_equal(lw.forward_dynamics(arm, q, v, threads=4), expected) and np.array_equal(
        lw.forward_dynamics(arm, q[0], v), expected[0])

def status_of(child):
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
"""

needs_fork = pytest.mark.skipif(sys.platform == "win32", reason="no fork here")


def run(script, *arguments):
    return subprocess.run(
        [sys.executable, "-X", "faulthandler", "-c", BEGIN + script, *arguments],
        capture_output=True,
        text=True,
        timeout=FUSE,
    )


def ends_well(script, *arguments):
    ended = run(script, *arguments)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "", "")


@needs_fork
@pytest.mark.parametrize("computes", ["", "assert is_right()"])
def test_a_forked_child_ends_normally(computes):
    ends_well(f"""
if (child := os.fork()) == 0:
    {computes or "pass"}
    sys.exit(0)
sys.exit(status_of(child))
""")


@needs_fork
def test_children_forked_while_threads_compute_compute_the_same():
    ends_well("""
stop = False
def spin(states):
    while not stop:
        lw.forward_dynamics(arm, states, v, threads=4)
threads = [threading.Thread(target=spin, args=(states,)) for states in (q[0], q, q[0], q)]
for thread in threads:
    thread.start()
for _ in range(400):
    if (child := os.fork()) == 0:
        signal.alarm(60)
        os._exit(0 if is_right() else 3)
    if code := status_of(child):
        os._exit(abs(code))
stop = True
""")


@needs_fork
def test_workers_of_process_pools():
    ends_well("""
from concurrent.futures import ProcessPoolExecutor
import multiprocessing
def work(_):
    return is_right()
fork = multiprocessing.get_context("fork")
with ProcessPoolExecutor(2, mp_context=fork) as pool:
    assert all(pool.map(work, range(6)))
with fork.Pool(2) as pool:
    assert all(pool.map(work, range(6)))
    pool.close()
    pool.join()
assert is_right()
""")


SPINS = {
    "states": "lw.forward_dynamics(arm, q, v, threads=4)",
    "a long state": "lw.forward_dynamics(chain, np.zeros(chain.nq), np.zeros(chain.nv), threads=4)",
    "arguments to broadcast": "lw.forward_dynamics(arm, q[:2], v)",
    "lists": "lw.forward_dynamics(arm, list(q[0]), list(v))",
    "masked arrays": "lw.forward_dynamics(arm, np.ma.array(q[0]), v)",
    "a drive": "simulate(drives={'joint_1': lambda t, q, v: hold(0.0)})",
    "a motion": "simulate(drives={'joint_1': lw.Motion(lambda t: (hold(t), 1.0, 0.0))})",
    "a wrench": "simulate(wrenches={'link_3': lambda t: [hold(0.0)] * 6})",
    "a drive that fails": "failing()",
    "batches": "lw.simulate_batch(three, q0=np.zeros((16, 3)), duration=1, step=0.01, threads=4)",
}


@pytest.mark.parametrize("spin", SPINS.values(), ids=SPINS.keys())
def test_the_interpreter_ends_while_daemon_threads_compute(spin):
    script = f"""
chain = lw.scenes.chain(3000)
three = lw.scenes.chain(3)
begun = threading.Semaphore(0)
def hold(value):
    sum(range(100))
    return value
def simulate(**given):
    lw.simulate(three, duration=2, every=0.5, **given)
def failing():
    try:
        simulate(drives={{'joint_1': lambda t, q, v: 1 / hold(0)}})
    except ZeroDivisionError:
        pass
def work():
    for _ in iter(int, 1):
        {spin}
        begun.release()
for _ in range(4):
    threading.Thread(target=work, daemon=True).start()
for _ in range(8):
    begun.acquire()
"""
    for _ in range(3):
        ends_well(script)


def test_a_controller_that_keeps_its_own_exception_is_collected():
    class Controller:
        def go(self, model):
            drives = {"joint_1": lambda t, q, v: self.missing}
            try:
                lw.simulate(model, duration=0.1, drives=drives)
            except AttributeError as error:
                self.error = error

    controller = Controller()
    controller.go(lw.scenes.chain(3))
    assert controller.error.__traceback__ is not None
    gone = weakref.ref(controller)
    del controller
    gc.collect()
    assert gone() is None


@pytest.mark.parametrize(
    "setter", ["drive_torque_callable", "drive_motion_callable", "wrench_callable"]
)
def test_functions_that_refer_to_their_own_simulation_are_collected(setter):
    class Function:
        def __call__(self, *_):
            return self.simulation

    function = Function()
    function.simulation = _core.Simulation(lw.scenes.chain(1))
    part = "link_1" if setter == "wrench_callable" else "joint_1"
    getattr(function.simulation, setter)(part, function)
    gone = weakref.ref(function)
    gc.collect()
    assert gone() is function
    del function
    gc.collect()
    assert gone() is None


def test_simulations_are_collected_only_when_nobody_needs_them():
    calls = []

    def drive(t, q, v):
        if not calls:
            gc.collect()
        calls.append(t)
        return 0.0

    ran = lw.simulate(
        lw.scenes.chain(3), q0=[0.1, 0.2, 0.3], duration=0.5, drives={"joint_1": drive}
    )
    chain = {"model": lw.scenes.chain(3), "q0": [0.1, 0.2, 0.3], "duration": 0.5}
    ran = lw.simulate(**chain, drives={"joint_1": drive})
    free = lw.simulate(**chain)
    assert calls
    np.testing.assert_allclose(ran.position, free.position, atol=1e-5)
