"""Worker processes as the run sees them: requests, answers, limits, and how they failed."""

from __future__ import annotations

import contextlib
import json
import os
import resource
import selectors
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

from benchmarks.study import ROOT

_GIB = 2**30
#: No engine gets more, whatever the machine has: what needs more for a mechanism is a finding.
MOST_MEMORY = 8 * _GIB

# One core is one core: numerical libraries must not start threads of their own.
_THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "LINKWISE_THREADS",
)
_ONE_THREAD = dict.fromkeys(_THREAD_VARIABLES, "1")


class WorkerError(Exception):
    """One line: why a request was not answered."""


def memory_limit() -> int:
    """Half of what is free now, and at most `MOST_MEMORY`."""
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
    except OSError:
        return MOST_MEMORY
    available = {line.split(":")[0]: line.split()[1] for line in lines if line}.get("MemAvailable")
    return min(MOST_MEMORY, int(available) * 1024 // 2) if available else MOST_MEMORY


class Worker:
    """A process that answers requests of one or several lines with one line of JSON."""

    def __init__(self, command: Sequence[str], *, memory: int, threads: bool = False) -> None:
        self.memory = self._most = memory
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 (closed by `close`)
        self._buffer = b""
        environment = {**os.environ, **({} if threads else _ONE_THREAD)}
        environment["PYTHONPATH"] = os.pathsep.join(
            [str(ROOT), *filter(None, [environment.get("PYTHONPATH")])]
        )
        self._process = subprocess.Popen(
            [*command, str(memory)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            env=environment,
        )

    def allow(self, memory: int) -> None:
        """Less or again more memory than at its start, but never more than that."""
        self.memory = min(memory, self._most)
        if hasattr(resource, "prlimit") and self.alive:
            limits = (self.memory, self._most)
            resource.prlimit(self._process.pid, resource.RLIMIT_DATA, limits)

    @property
    def alive(self) -> bool:
        return self._process.poll() is None

    def ask(self, *lines: str, timeout: float) -> dict[str, Any]:
        """The answer; WorkerError when there is none in time, the process died, or it says so."""
        stdin = self._process.stdin
        assert stdin is not None
        try:
            stdin.write("".join(f"{line}\n" for line in lines).encode())
            stdin.flush()
        except OSError:
            raise WorkerError(self._last_words()) from None
        line = self._read_line(timeout)
        if line is None:
            self.close()
            raise WorkerError(f"takes more than {timeout:g} s")
        if not line:
            raise WorkerError(self._last_words())
        answer: dict[str, Any] = json.loads(line)
        if "error" in answer:
            text = str(answer["error"])
            if text == "out of memory":
                text = f"needs more than {self.memory / _GIB:.1f} GiB of memory"
                self.close()  # and gives back what it has
            raise WorkerError(text)
        return answer

    def _read_line(self, timeout: float) -> bytes | None:
        """None: not in time; empty: the process closed its end."""
        stdout = self._process.stdout
        assert stdout is not None
        with selectors.DefaultSelector() as selector:
            selector.register(stdout, selectors.EVENT_READ)
            while b"\n" not in self._buffer:
                if not selector.select(timeout):
                    return None
                piece = os.read(stdout.fileno(), 65536)
                if not piece:
                    return b""
                self._buffer += piece
        line, _, self._buffer = self._buffer.partition(b"\n")
        return line

    def _last_words(self) -> str:
        """How a process ended: the signal that killed it, or the last line that it wrote."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(5)
        code = self._process.poll()
        if code is not None and code < 0:
            return f"killed by {signal.Signals(-code).name}"
        self._errors.seek(0)
        lines = self._errors.read().decode(errors="replace").split("\n")
        written = [line.strip() for line in lines if line.strip()]
        return written[-1] if written else f"ended with status {code}"

    def close(self) -> None:
        self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout, self._errors):
            with contextlib.suppress(OSError):
                if stream is not None:
                    stream.close()

    def __enter__(self) -> Worker:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def python_worker(engine: str, *, memory: int, threads: bool = False) -> Worker:
    command = [sys.executable, "-m", "benchmarks.worker", engine]
    return Worker(command, memory=memory, threads=threads)


def compiled_worker(program: Path, engine: str, *, memory: int) -> Worker:
    return Worker([str(program), engine], memory=memory)
