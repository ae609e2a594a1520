"""Which compiled variant of the core is imported."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from linkwise import _core

V2 = "cx16 lahf_lm popcnt sse4_1 sse4_2 ssse3"
V3 = V2 + " abm avx avx2 bmi1 bmi2 f16c fma movbe xsave"
V4 = V3 + " avx512bw avx512cd avx512dq avx512f avx512vl"
EVERY_LEVEL = ("v4", "v3", "v2")


@pytest.fixture
def machine(monkeypatch):
    """Pretends to be a CPU with some features and a build with some targets."""

    def pretend(flags, built=EVERY_LEVEL, architecture="x86_64"):
        monkeypatch.setattr(_core, "_cpu_flags", lambda: frozenset(flags.split()))
        monkeypatch.setattr(_core.platform, "machine", lambda: architecture)
        names = {f"linkwise._core_{target}" for target in built}
        monkeypatch.setattr(
            _core.importlib.util, "find_spec", lambda name: name if name in names else None
        )

    return pretend


@pytest.mark.parametrize(
    ("flags", "expected"),
    [
        (V4, "v4"),
        (V3, "v3"),
        (V3.replace("fma", ""), "v2"),
        (V4.replace("avx512dq", ""), "v3"),
        (V4.replace("avx2", ""), "v2"),
        (V2, "v2"),
        ("", "v2"),
    ],
)
def test_the_best_level_that_the_cpu_has_is_chosen(machine, flags, expected):
    machine(flags)
    assert _core._choose(None) == expected


def test_a_native_build_comes_first(machine):
    machine(V2, built=("native", "v2"))
    assert _core._choose(None) == "native"


def test_other_architectures_use_the_generic_build(machine):
    machine("fp asimd", built=("generic",), architecture="aarch64")
    assert _core._choose(None) == "generic"


def test_the_environment_can_ask_for_a_lower_level(machine):
    machine(V4)
    assert _core._choose("v2") == "v2"


@pytest.mark.parametrize(
    ("flags", "built", "asked", "message"),
    [
        (V3, EVERY_LEVEL, "v4", r"needs CPU features that this machine lacks \(avx512bw, "),
        (V3, ("v2", "v3"), "v4", "is not in this build, which has v3, v2"),
        (V3, EVERY_LEVEL, "sse9", "is not a CPU target; use generic, native, v2, v3, v4"),
        (V2, ("v3", "v4"), None, "this CPU supports none of them"),
        (V3, (), None, "the compiled core is missing"),
    ],
)
def test_what_cannot_be_imported_is_said_plainly(machine, flags, built, asked, message):
    machine(flags, built)
    with pytest.raises(ImportError, match=message):
        _core._choose(asked)


def test_cpu_flags_are_read_from_cpuinfo(tmp_path):
    file = tmp_path / "cpuinfo"
    file.write_text("processor\t: 0\nflags\t\t: fpu avx2 fma\n\nprocessor\t: 1\nflags\t\t: fpu\n")
    assert _core._cpu_flags(str(file)) == {"fpu", "avx2", "fma"}
    assert _core._cpu_flags(str(tmp_path / "absent")) == frozenset()


def test_every_built_target_of_this_machine_imports_and_names_itself():
    usable = [t for t in _core.TARGETS if _usable(t)]
    assert usable
    for target in usable:
        output = subprocess.run(
            [sys.executable, "-c", "from linkwise import _core; print(_core.cpu_target)"],
            env={**os.environ, "LINKWISE_CPU": target},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        assert output.strip() == target


def _usable(target):
    spec = _core.importlib.util.find_spec(f"linkwise._core_{target}")
    return spec is not None and not _core._unsupported(target)


# -- what the other targets compute ----------------------------------------------------------------

ROOT = Path(__file__).parents[2]
OTHERS = [t for t in _core.TARGETS if _usable(t) and t != _core.cpu_target]
CHECKED = (
    "python/test_properties.py",
    "python/test_properties_motion.py",
    "python/test_batches.py",
    "python/test_threads.py",
    "python/test_batch_simulation.py",
    "crosscheck",
)

EVALUATE = """
import sys
import numpy as np
import linkwise as lw

rng = np.random.default_rng(4)
found = {}
for name, model in {
    "chain": lw.scenes.chain(30, axes="random"),
    "long chain": lw.scenes.chain(300, axes="random"),
    "tree": lw.scenes.tree(63, axes="random"),
    "spherical": lw.scenes.chain(5, joint="spherical"),
    "arm": lw.scenes.srms(),
}.items():
    q = np.array([model.neutral_configuration()] * 19)
    q += 0.3 * rng.standard_normal(q.shape)
    v, tau = 0.3 * rng.standard_normal((2, 19, model.nv))
    methods = ["articulated_body", "constraint_force", "composite_rigid_body"]
    for method in methods[: 2 if model.nv > 100 else 3]:  # long mass matrices are ill-conditioned
        result = lw.forward_dynamics(model, q, v, tau, method=method, full=True)
        found[f"{name} {method} accelerations"] = result.acceleration
        found[f"{name} {method} loads"] = result.joint_load
    found[f"{name} torques"] = lw.inverse_dynamics(model, q, v, tau)
    found[f"{name} one state"] = lw.forward_dynamics(model, q[0], v[0], tau[0])
    run = lw.simulate_batch(model, q0=q, v0=v, duration=0.02, every=0.01, step=0.002)
    found[f"{name} simulated"] = run.joint_load.values
np.savez(sys.argv[1], **found)
"""


def in_target(target, *command):
    return subprocess.run(
        [sys.executable, *command],
        env={**os.environ, "LINKWISE_CPU": target},
        capture_output=True,
        text=True,
        cwd=ROOT,
    )


@pytest.mark.skipif(not OTHERS, reason="the build has one CPU target for this machine")
@pytest.mark.parametrize("target", OTHERS)
def test_the_tests_of_correctness_hold_for_every_target(target):
    files = [str(ROOT / "tests" / name) for name in CHECKED]
    done = in_target(target, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-n0", *files)
    assert done.returncode == 0, done.stdout[-4000:]
    assert " passed" in done.stdout


@pytest.mark.skipif(not OTHERS, reason="the build has one CPU target for this machine")
@pytest.mark.parametrize("target", OTHERS)
def test_targets_agree_to_rounding(target, tmp_path):
    for name in (_core.cpu_target, target):
        done = in_target(name, "-c", EVALUATE, str(tmp_path / f"{name}.npz"))
        assert done.returncode == 0, done.stderr
    here, there = (np.load(tmp_path / f"{name}.npz") for name in (_core.cpu_target, target))
    assert set(here) == set(there)
    for name in here:
        scale = np.abs(here[name]).max()
        assert scale > 0
        np.testing.assert_allclose(there[name], here[name], rtol=0, atol=1e-9 * scale, err_msg=name)


def test_public_names_are_those_of_the_compiled_module():
    assert "InputError" in _core.__all__
    assert _core.InputError.__module__ == "linkwise"
    assert issubclass(_core.InputError, ValueError)
    assert _core.lanes in (2, 4, 8)
