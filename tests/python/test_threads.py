"""The same bits for any number of threads, and again when repeated."""

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest

import linkwise as lw

THREADS = (1, 2, 3, 7)


def long_chain(rng):
    model = lw.scenes.chain(3000, axes="random")
    return model, *rng.standard_normal((3, model.nv)) * 0.3


def tree(rng):
    model = lw.scenes.tree(1023, axes="random")
    return model, *rng.standard_normal((3, model.nv)) * 0.3


def arms(rng):
    model = lw.scenes.srms()
    return model, *rng.standard_normal((3, 1003, model.nv))


def accelerations_and_loads(threads, model, q, v, tau, **options):
    result = lw.forward_dynamics(model, q, v, tau, threads=threads, full=True, **options)
    return [result.acceleration, result.joint_load]


def iterative(threads, model, q, v, tau):
    return accelerations_and_loads(
        threads,
        *(model, q, v, tau),
        method="constraint_force",
        solver="conjugate_gradient",
        tolerance=1e-8,
        max_iterations=200,
    )


def inverse(threads, model, q, v, tau):
    return [
        lw.inverse_dynamics(model, q, v, tau, threads=threads),
        lw.inverse_dynamics_loads(model, q, v, tau, threads=threads),
        lw.joint_poses(model, q, threads=threads),
        lw.kinetic_energy(model, q, v, threads=threads),
    ]


def simulation(threads, model, q, v, tau):
    run = lw.simulate(model, q0=q, v0=v, duration=0.02, every=0.01, threads=threads)
    return [run.position.values, run.joint_load.values]


def batch_of_simulations(threads, model, q, v, tau):
    run = lw.simulate_batch(
        model, q0=q, v0=v, tau=tau, duration=0.05, every=0.05, step=0.01, threads=threads
    )
    return [run.position.values, run.joint_load.values]


CASES = {
    "one long chain": (long_chain, accelerations_and_loads),
    "one tree": (tree, accelerations_and_loads),
    "many arms": (arms, accelerations_and_loads),
    "inverse": (arms, inverse),
    "simulation": (long_chain, simulation),
    "batch of simulations": (arms, batch_of_simulations),
}


def digest(arrays):
    sha = hashlib.sha256()
    for array in arrays:
        assert np.isfinite(array).all()
        sha.update(np.ascontiguousarray(array).tobytes())
    return sha.hexdigest()


@pytest.mark.parametrize("case", CASES)
def test_same_bits_for_any_number_of_threads(case, rng):
    machine, evaluate = CASES[case]
    given = machine(rng)
    hashes = {threads: digest(evaluate(threads, *given)) for threads in THREADS}
    assert len(set(hashes.values())) == 1, hashes
    assert digest(evaluate(None, *given)) == hashes[1]
    assert digest(evaluate(2, *given)) == hashes[1]  # with what the calls before left behind


@pytest.mark.parametrize("solver", [s["name"] for s in lw.solvers() if s["kind"] != "direct"])
def test_iterative_solvers_too(solver, rng):
    model = lw.scenes.chain(200, axes="random")
    q, v, tau = rng.standard_normal((3, model.nv)) * 0.3
    hashes = set()
    for threads in THREADS:
        result = lw.forward_dynamics(
            model,
            *(q, v, tau),
            method="constraint_force",
            solver=solver,
            tolerance=1e-4,
            max_iterations=50,
            threads=threads,
            full=True,
        )
        hashes.add(digest([result.acceleration, result.joint_load]))
    assert len(hashes) == 1


def default_threads(value):
    """What a process with LINKWISE_THREADS=value says of a batch that pays for threads."""
    code = (
        "import threading, os, numpy as np, linkwise as lw\n"
        "m = lw.scenes.chain(50)\n"
        "lw.forward_dynamics(m, np.zeros((2000, 50)), np.zeros(50))\n"
        "print(len(os.listdir('/proc/self/task')))\n"
    )
    environment = {**os.environ, "LINKWISE_THREADS": value, "OPENBLAS_NUM_THREADS": "1"}
    return subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True
    )


@pytest.mark.skipif(not os.path.isdir("/proc/self/task"), reason="needs /proc")
def test_linkwise_threads_is_the_default_number():
    alone = int(default_threads("1").stdout)
    assert int(default_threads("3").stdout) == alone + 2
    assert int(default_threads("5").stdout) == alone + 4


@pytest.mark.parametrize("value", ["0", "-2", "many", "2.5", "99999"])
def test_linkwise_threads_that_is_no_number_of_threads(value):
    done = default_threads(value)
    assert done.returncode != 0
    assert f"LINKWISE_THREADS is '{value}'; set a whole number from 1 to" in done.stderr
