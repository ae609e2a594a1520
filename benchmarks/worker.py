"""A worker process: times one engine through Python. `python -m benchmarks.worker ENGINE BYTES`

It answers the requests of benchmarks/cpp/worker.cpp, with accelerations already in our coordinates,
and one more. Time is that of the wall clock and, as "cpu", that of the process's threads together.
    simulate METHOD DURATION SETTING FILE  -> {"cpu": ..., "evaluations": ...}, q at FILE
"""

from __future__ import annotations

import contextlib
import gc
import json
import os
import sys
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from benchmarks.engines.base import Contestant, Field
from benchmarks.engines.table import BY_NAME
from benchmarks.timing import timed


class Worker:
    def __init__(self, engine: str, requests: TextIO) -> None:
        self.engine = BY_NAME[engine]
        self.requests = requests
        self.field: Field | None = None

    def line(self) -> str:
        return self.requests.readline().rstrip("\n")

    def loaded(self) -> Field:
        if self.field is None:
            raise RuntimeError("nothing is built")
        return self.field

    def contestant(self) -> Contestant:
        method = self.line()
        for c in self.loaded().contestants:
            if c.offer.method == method:
                return c
        raise RuntimeError(f"no method {method!r} here")

    def clear(self) -> dict[str, Any]:
        self.field = None
        gc.collect()
        return {}

    def build(self) -> dict[str, Any]:
        self.field = self.engine.build(Path(self.line()))
        return {
            "states": self.field.states.count,
            "contestants": [asdict(c.offer) for c in self.field.contestants],
            "simulators": [
                {"method": s.method, "fixed_step": s.fixed_step} for s in self.field.simulators
            ],
        }

    def check(self) -> dict[str, Any]:
        contestant, field = self.contestant(), self.loaded()
        rows = field.states.rows()[:: contestant.offer.systems]
        found = np.vstack([np.atleast_2d(np.array(contestant.evaluate(*row))) for row in rows])
        field.to_ours(found).tofile(self.line())
        return {}

    def time(self) -> dict[str, Any]:
        contestant, calls = self.contestant(), int(self.line())
        rows, evaluate = self.loaded().states.rows(), contestant.evaluate
        count = len(rows)

        def run() -> None:
            for k in range(calls):
                evaluate(*rows[k % count])

        return asdict(timed(run)[1])

    def simulate(self) -> dict[str, Any]:
        method, duration, setting, file = (self.line() for _ in range(4))
        for simulator in self.loaded().simulators:
            if simulator.method == method:
                motion = simulator.simulate(float(duration), float(setting))
                motion.q.tofile(file)
                return {"cpu": motion.cpu_seconds, "evaluations": motion.evaluations}
        raise RuntimeError(f"no integrator {method!r} here")

    def memory(self) -> dict[str, Any]:
        use = memory_use()
        states = self.field.states if self.field else None
        use["states"] = states.q.nbytes + states.v.nbytes + states.tau.nbytes if states else 0
        return use

    def answer(self, request: str) -> dict[str, Any]:
        requests: dict[str, Callable[[], dict[str, Any]]] = {
            "clear": self.clear,
            "build": self.build,
            "check": self.check,
            "time": self.time,
            "simulate": self.simulate,
            "memory": self.memory,
        }
        try:
            return requests[request]()
        except MemoryError:
            return {"error": "out of memory"}
        except Exception as error:
            text = " ".join(str(error).split()) or type(error).__name__
            return {"error": "out of memory" if "bad_alloc" in text else text}


def memory_use() -> dict[str, Any]:
    """Bytes that this process holds, and the most that it held."""
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
    except OSError:  # no Linux: the peak alone, which may be that of the parent process
        import resource

        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return {"resident": peak, "peak": peak}
    kilobytes = {line.split(":")[0]: line.split()[1] for line in lines if line.endswith("kB")}
    return {
        "resident": int(kilobytes["VmRSS"]) * 1024,
        "peak": int(kilobytes["VmHWM"]) * 1024,
    }


def limit_memory(most: int) -> None:
    """The system's memory may run out all the same; then it is this process that has to go."""
    import resource

    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("1000")
    resource.setrlimit(resource.RLIMIT_DATA, (most, most))


def main() -> None:
    limit_memory(int(sys.argv[2]))
    # Engines print to stdout; the answers must not be among that.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    worker = Worker(sys.argv[1], sys.stdin)
    while request := worker.line():
        print(json.dumps(worker.answer(request)), file=answers, flush=True)


if __name__ == "__main__":
    main()
