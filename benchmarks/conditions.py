"""What a measurement depends on: machine, versions, flags."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
from importlib import metadata
from pathlib import Path
from typing import Any

from benchmarks.compiling import Compiled
from benchmarks.engines.table import ENGINES
from benchmarks.study import ROOT
from linkwise import _core
from linkwise.record.provenance import versions


def processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def commit() -> str:
    """The sources' commit, with a + when they differ from it; empty where Git does not tell."""
    if not (ROOT / ".git").exists() or not shutil.which("git"):
        return ""
    told = []
    for command in (["rev-parse", "--short", "HEAD"], ["status", "--porcelain", "-uno", "src"]):
        done = subprocess.run(
            ["git", *command], cwd=ROOT, capture_output=True, text=True, check=False
        )
        if done.returncode != 0:
            return ""
        told.append(done.stdout.strip())
    return told[0] + ("+" if told[1] else "")


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
