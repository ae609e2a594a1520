"""The C++ worker, compiled once: benchmarks/cpp, with the peers found."""

from __future__ import annotations

import hashlib
import json
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import Any

from benchmarks.study import ROOT

PROGRAM = Path("benchmarks") / "cpp" / "linkwise_bench"
_SOURCES = ("src", "benchmarks/cpp", "cmake", "CMakeLists.txt")


@dataclass(frozen=True)
class Compiled:
    """The program, or why there is none."""

    program: Path | None
    reason: str = ""
    engines: frozenset[str] = frozenset()
    flags: dict[str, str] = field(default_factory=dict)  # compiler and flags of each engine's part


def cache_folder() -> Path:
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    key = hashlib.sha256(str(ROOT).encode()).hexdigest()[:8]
    return Path(base) / "linkwise" / f"bench-{key}"


def compile_worker(
    *, build: Path | None, only_if_ready: bool, say: Callable[[str], object]
) -> Compiled:
    """Brings the program up to date. `only_if_ready`: takes it only if it is already."""
    build = build or cache_folder()
    program = build / PROGRAM
    if only_if_ready:
        if not program.is_file():
            return Compiled(None, "not compiled yet: run once without --quick")
        if program.stat().st_mtime < newest():
            return Compiled(None, "older than its sources: run once without --quick")
        return _inspect(build)
    for tool in ("cmake", os.environ.get("CXX", "c++")):
        if not shutil.which(tool):
            return Compiled(None, f"there is no {tool} here")
    say(f"compiling the C++ worker in {build} (some minutes the first time)")
    generator = ["-G", "Ninja"] if shutil.which("ninja") else []
    if (build / "CMakeCache.txt").exists():
        generator = []  # it stays what it was
    configure = [
        *("cmake", "-S", str(ROOT), "-B", str(build), *generator),
        *("-DCMAKE_BUILD_TYPE=Release", "-DLINKWISE_CPU_TARGETS=native"),
        *("-DLINKWISE_BUILD_BENCHMARKS=ON", *peers()),
    ]
    make = ["cmake", "--build", str(build), "--target", "linkwise_bench", "--parallel"]
    for command in (configure, [*make, str(os.cpu_count() or 1)]):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            log = build / "bench.log"
            log.parent.mkdir(parents=True, exist_ok=True)
            log.write_text(done.stdout + done.stderr)
            return Compiled(None, f"compiling failed, see {log}")
    return _inspect(build)


def newest() -> float:
    """When the youngest source was changed."""
    files = [
        file
        for name in _SOURCES
        for file in ((ROOT / name).rglob("*") if (ROOT / name).is_dir() else [ROOT / name])
    ]
    return max((file.stat().st_mtime for file in files if file.is_file()), default=0.0)


def peers() -> list[str]:
    """Where CMake finds the peers' headers and libraries: in the wheels of this environment."""
    prefixes = [str(folder) for p in sys.path if (folder := Path(p) / "cmeel.prefix").is_dir()]
    found = [f"-DCMAKE_PREFIX_PATH={';'.join(prefixes)}"] if prefixes else []
    try:
        files = metadata.files("mujoco") or []
    except metadata.PackageNotFoundError:
        return found
    for entry in files:
        if entry.name.startswith(("libmujoco.so", "libmujoco.")) and len(entry.parts) == 2:
            library = Path(str(entry.locate()))
            found.append(f"-DMUJOCO_LIBRARY={library}")
            found.append(f"-DMUJOCO_INCLUDE={library.parent / 'include'}")
            break
    return found


def _inspect(build: Path) -> Compiled:
    """Which engines are in the program, and the flags they were compiled with."""
    commands: list[dict[str, Any]] = []
    database = build / "compile_commands.json"
    if database.is_file():
        commands = json.loads(database.read_text())
    flags = {}
    for entry in commands:
        name = Path(entry["file"]).name
        if name.endswith("_side.cpp"):
            flags[name.removesuffix("_side.cpp")] = _flags(entry["command"])
    return Compiled(build / PROGRAM, "", frozenset(flags), flags)


def _flags(command: str) -> str:
    """Compiler and what changes the code; not the folders and warnings."""
    words = shlex.split(command)
    kept = [
        word
        for word in words[1:]
        if word.startswith(("-O", "-m", "-f", "-std", "--param", "-DNDEBUG"))
        and not word.startswith(("-fPIC", "-fvisibility", "-fdiagnostics"))
    ]
    return " ".join([_compiler(words[0]), *dict.fromkeys(kept)])


def _compiler(path: str) -> str:
    done = subprocess.run([path, "--version"], capture_output=True, text=True, check=False)
    return done.stdout.splitlines()[0] if done.stdout else Path(path).name
