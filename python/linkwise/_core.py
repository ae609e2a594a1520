"""The compiled core, in the variant that suits this machine's CPU.

The core is built once per CPU target: ``v2``, ``v3`` and ``v4`` are the levels of x86-64,
``generic`` is any other processor, ``native`` a developer's build for the machine it was built on.
The best one that the CPU supports is imported and all its public names are re-exported here;
``cpu_target`` names it. The environment variable ``LINKWISE_CPU`` asks for one of them instead.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import platform
from typing import TYPE_CHECKING, Any

#: Every target, best first. ``native`` exists only where somebody built it on purpose.
TARGETS = ("native", "v4", "v3", "v2", "generic")

# What each level needs, in the names of /proc/cpuinfo (abm is lzcnt).
_NEEDED = {
    "v2": frozenset({"cx16", "lahf_lm", "popcnt", "sse4_1", "sse4_2", "ssse3"}),
    "v3": frozenset({"abm", "avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "movbe", "xsave"}),
    "v4": frozenset({"avx512bw", "avx512cd", "avx512dq", "avx512f", "avx512vl"}),
}
_NEEDED["v3"] |= _NEEDED["v2"]
_NEEDED["v4"] |= _NEEDED["v3"]


def _cpu_flags(path: str = "/proc/cpuinfo") -> frozenset[str]:
    """Features of this CPU that the operating system has enabled; empty where it does not tell."""
    try:
        with open(path, encoding="ascii", errors="replace") as file:
            for line in file:
                if line.startswith("flags"):
                    return frozenset(line.partition(":")[2].split())
    except OSError:
        pass
    return frozenset()


def _unsupported(target: str) -> list[str]:
    """The features that ``target`` needs and this CPU lacks."""
    if target not in _NEEDED:
        return []
    if platform.machine().lower() not in ("x86_64", "amd64"):
        return ["x86-64"]
    flags = _cpu_flags()
    if not flags and target == "v2":  # the system does not tell: v2 is in every CPU since 2009
        return []
    return sorted(_NEEDED[target] - flags)


def _module_name(target: str) -> str:
    return f"{__package__}._core_{target}"


def _choose(asked: str | None) -> str:
    """The target to import; ImportError with the reason when no target fits."""
    built = [t for t in TARGETS if importlib.util.find_spec(_module_name(t)) is not None]
    if not built:
        raise ImportError(
            "linkwise: the compiled core is missing; install the package (pip install .) instead "
            "of importing it from its source folder"
        )
    if asked:
        if asked not in TARGETS:
            known = ", ".join(sorted(TARGETS))
            raise ImportError(f"linkwise: LINKWISE_CPU={asked} is not a CPU target; use {known}")
        if asked not in built:
            raise ImportError(
                f"linkwise: LINKWISE_CPU={asked} is not in this build, which has "
                f"{', '.join(built)}; unset it or choose one of these"
            )
        missing = _unsupported(asked)
        if missing:
            raise ImportError(
                f"linkwise: LINKWISE_CPU={asked} needs CPU features that this machine lacks "
                f"({', '.join(missing)}); unset it"
            )
        return asked
    for target in built:
        if not _unsupported(target):
            return target
    raise ImportError(
        f"linkwise: this build is for {', '.join(built)} and this CPU supports none of them; "
        "rebuild with pip install . --config-settings=cmake.define.LINKWISE_CPU_TARGETS=native"
    )


def _load() -> Any:
    return importlib.import_module(_module_name(_choose(os.environ.get("LINKWISE_CPU"))))


_module = _load()
__all__ = [name for name in dir(_module) if not name.startswith("_")]
globals().update({name: getattr(_module, name) for name in __all__})

if TYPE_CHECKING:

    def __getattr__(name: str) -> Any: ...
