"""Instructions and time per body of one evaluation: what a method asks of the processor.

    python -m benchmarks instructions [--sizes 7 30 300] [-o DIR]

Runs the C++ worker of `peers`, which must have been compiled by it, with its chains and methods:
once as it is, for the time (of the processor, the best of seven), and under valgrind, for the
instructions (two counts that differ in the number of calls alone are subtracted). Instructions a
nanosecond, divided by the clock in GHz, are instructions a cycle: near the width of the processor,
a method is bound by its instructions, far below by the latency of its recursion or by memory.
"""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from benchmarks import study
from benchmarks.compiling import compile_worker
from benchmarks.engines.table import BY_NAME
from benchmarks.machine import random_chain, random_states
from benchmarks.process import MOST_MEMORY
from benchmarks.race import write_case

STATES = 64
BODIES = 30_000  # in the shorter count: startup must not matter
ENGINES = ("linkwise", "pinocchio")
VALGRIND = ("valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null")


def ask(program: Path, engine: str, *lines: object, under: tuple[str, ...] = ()) -> Any:
    done = subprocess.run(
        [*under, str(program), engine, str(2 * MOST_MEMORY)],
        input="".join(f"{line}\n" for line in lines),
        capture_output=True,
        text=True,
        check=True,
    )
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    for answer in answers:
        if "error" in answer:
            raise SystemExit(f"{engine}: {answer['error']}")
    return answers, done.stderr


def instructions(program: Path, engine: str, folder: Path, method: str, calls: int) -> int:
    request = ("build", folder, "time", method, calls)
    _, said = ask(program, engine, *request, under=VALGRIND)
    found = re.search(r"Collected : (\d+)", said)
    if not found:
        raise SystemExit(f"valgrind counts nothing: {said[-500:]}")
    return int(found[1])


def measure(program: Path, engine: str, folder: Path, offer: dict[str, Any], n: int) -> Any:
    bodies = n * int(offer["systems"])
    calls, method = math.ceil(BODIES / bodies), offer["method"]
    short, long = (instructions(program, engine, folder, method, k * calls) for k in (1, 3))
    turns = 20 * calls
    requests = [line for _ in range(8) for line in ("time", method, turns)]
    answers, _ = ask(program, engine, "build", folder, *requests)
    seconds = min(answer["cpu"] for answer in answers[2:])  # the first one warms up
    each = (long - short) / (2 * calls * bodies)
    ns = 1e9 * seconds / (turns * bodies)
    return {
        "engine": engine,
        "method": method,
        "loads": offer["loads"],
        "n_bodies": n,
        "systems": offer["systems"],
        "instructions_per_body": each,
        "ns_per_body": ns,
        "instructions_per_ns": each / ns,
    }


COLUMNS: study.Columns = {
    "": lambda r: f"{r['engine']} {r['method']}{', loads' if r['loads'] else ''}",
    "bodies": lambda r: r["n_bodies"],
    "instructions per body": lambda r: f"{r['instructions_per_body']:.0f}",
    "ns per body": lambda r: f"{r['ns_per_body']:.0f}",
    "instructions per ns": lambda r: f"{r['instructions_per_ns']:.1f}",
}


def main() -> None:
    parser = study.parser(__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=[7, 30, 300])
    asked = parser.parse_args()
    compiled = compile_worker(build=None, only_if_ready=True, say=study.say)
    if compiled.program is None:
        raise SystemExit(f"no C++ worker: {compiled.reason}")
    if not shutil.which("valgrind"):
        raise SystemExit("there is no valgrind here")
    rows = []
    for n in asked.sizes:
        machine = random_chain(n)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            write_case(machine, random_states(machine, STATES), folder)
            for engine in (e for e in ENGINES if e in compiled.engines):
                if BY_NAME[engine].prepared:
                    BY_NAME[engine].build(folder)  # writes what its C++ side loads
                (built,), _ = ask(compiled.program, engine, "build", folder)
                for offer in built["contestants"]:
                    if offer["threads"] == 1:
                        study.say(f"chain of {n}: {engine} {offer['method']}")
                        rows.append(measure(compiled.program, engine, folder, offer, n))
    text = study.table(rows, COLUMNS)
    study.write(asked.output, "instructions", text, rows, flags=compiled.flags)
