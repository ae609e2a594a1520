"""What a measurement depends on: machine, versions, flags."""

from __future__ import annotations

import os
import platform
from importlib import metadata
from typing import Any

from benchmarks.compiling import Compiled
from benchmarks.engines.table import ENGINES
from benchmarks.study import commit, cores, processor
from linkwise import _core
from linkwise.record.provenance import versions


def conditions(compiled: Compiled, memory: int) -> dict[str, Any]:
    installed = {engine.package: engine.version for engine in ENGINES[1:]}
    for package in ("numpy", "scipy", "example-robot-data"):
        try:
            installed[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            installed[package] = None
    return {
        "processor": processor(),
        "cores": cores(),
        "load_average": list(os.getloadavg()) if hasattr(os, "getloadavg") else None,
        "system": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
        "linkwise": versions()["linkwise"],
        "commit": commit(),
        "cpu_target": getattr(_core, "cpu_target", None),
        "packages": installed,
        "missing": [e.name for e in ENGINES if not e.installed],
        "flags": compiled.flags,
        "no_cpp": compiled.reason,
        "memory_limit": memory,
    }
