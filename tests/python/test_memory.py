"""What cannot fit into memory is refused before any work, with the estimate."""

import subprocess
import sys

import numpy as np
import pytest

import linkwise as lw

NEEDS = r"needs about [0-9.e+]+ GiB of memory, but [0-9.e+]+ GiB is available; ask for less"


def refused(call, match):
    """Before any work: none of these calls could reach a later refusal in a lifetime."""
    with pytest.raises(MemoryError, match=match):
        call()


def test_results_of_a_batch():
    model = lw.scenes.chain(7)
    many, others = np.zeros((100_000, 1, 7)), np.zeros((1, 100_000, 7))
    refused(
        lambda: lw.forward_dynamics(model, many, others),
        rf"arguments broadcast to leading axes \(100000, 100000\) {NEEDS}",
    )
    long = lw.scenes.chain(300_000)
    refused(
        lambda: lw.mass_matrix(long, np.zeros(300_000)),
        rf"a result of shape \(300000, 300000\) {NEEDS}",
    )


def test_machines_of_too_many_bodies():
    refused(lambda: lw.scenes.chain(2 * 10**9), rf"a machine of 2000000000 bodies {NEEDS}")
    refused(lambda: lw.scenes.tree(2 * 10**9), rf"a machine of 2000000000 bodies {NEEDS}")


def test_recordings(tmp_path):
    model = lw.scenes.chain(10_000)
    times = np.linspace(0, 1, 1_000_000)
    refused(
        lambda: lw.simulate(model, times=times),
        rf"a recording of 1000000 samples in memory \(output= writes them to disk\) {NEEDS}",
    )
    arm = lw.scenes.srms()
    refused(
        lambda: lw.simulate_batch(arm, q0=np.zeros((10_000, arm.nq)), times=times, step=1e-3),
        rf"1000000 samples of 10000 members {NEEDS}",
    )


def test_a_limit_of_steps_is_no_memory():
    """What the limit would allow is not taken beforehand."""
    code = """
import resource
import linkwise as lw
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
model = lw.scenes.chain(5)
system = lw.ConstraintSystem(model, model.neutral_configuration())
print(system.spectrum(max_steps=2**31 - 1).converged)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "True", done.stderr
