"""What the studies share: arguments, processes of their own, tables, files, and where they ran."""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from linkwise import _core
from linkwise.record.provenance import versions

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results"
Columns = Mapping[str, Callable[[Any], object]]


def parser(description: str | None) -> argparse.ArgumentParser:
    made = argparse.ArgumentParser(description=(description or "").splitlines()[0])
    made.add_argument("-o", "--output", type=Path, default=RESULTS, help="folder for the results")
    return made


def say(message: str) -> None:
    print(message, file=sys.stderr)


def in_own_process(study: str, *arguments: object) -> Any:
    """What `python -m benchmarks STUDY ARGUMENTS` prints as JSON: its memory is its own."""
    command = [sys.executable, "-m", "benchmarks", study, *map(str, arguments)]
    return json.loads(subprocess.check_output(command, text=True, cwd=ROOT))


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


def peak_bytes() -> int:
    """The most that this process has held."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def table(rows: Sequence[Any], columns: Columns, *, left: int = 1) -> str:
    """Markdown; the first `left` columns are text, the others numbers."""
    lines = [
        f"| {' | '.join(columns)} |",
        "|" + "---|" * left + "---:|" * (len(columns) - left),
    ]
    lines += [f"| {' | '.join(str(show(row)) for show in columns.values())} |" for row in rows]
    return "\n".join(lines)


def write(folder: Path, study: str, text: str, rows: object, **about: Any) -> None:
    """STUDY.md, which the repository keeps, and STUDY.json with all digits, which it does not."""
    folder.mkdir(parents=True, exist_ok=True)
    about = {"versions": versions(), "cpu_target": _core.cpu_target, **about, "rows": rows}
    (folder / f"{study}.json").write_text(json.dumps(about, indent=1) + "\n", encoding="utf-8")
    at = f" at {commit()}" if commit() else ""
    came = f"`python -m benchmarks {study}`; {processor()}, {cores()} cores; linkwise{at}"
    (folder / f"{study}.md").write_text(f"{text}\n\n{came}\n", encoding="utf-8")
    print(text)
