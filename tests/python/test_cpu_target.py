"""Which compiled variant of the core is imported."""

import os
import subprocess
import sys

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


def test_public_names_are_those_of_the_compiled_module():
    assert "InputError" in _core.__all__
    assert _core.InputError.__module__ == "linkwise"
    assert issubclass(_core.InputError, ValueError)
    assert _core.lanes in (2, 4, 8)
