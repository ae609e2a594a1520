"""Instructions and time a body of one evaluation: what a method asks of the processor.

    python benchmarks/instructions.py [-o benchmarks/results] [--sizes 7 30 300]

Runs the C++ worker of `linkwise bench`, which must have been compiled by it, with its chains and
methods: once as it is, for the time (of the processor, the best of seven), and under valgrind, for
the instructions (two counts that differ in the number of calls alone are subtracted). Instructions
a nanosecond, divided by the clock in GHz, are instructions a cycle: near the width of the
processor, a method is bound by its instructions, far below by the latency of its recursion or by
memory. Writes instructions.json and instructions.md.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from linkwise.bench.compiling import compile_worker
from linkwise.bench.engines.table import BY_NAME
from linkwise.bench.machine import random_chain, random_states
from linkwise.bench.process import MOST_MEMORY
from linkwise.bench.race import write_case

ROOT = Path(__file__).resolve().parents[1]
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


def markdown(rows: list[dict[str, Any]]) -> str:
    lines = [
        "| | bodies | instructions a body | ns a body | instructions a ns |",
        "|---|---:|---:|---:|---:|",
    ]
    lines += [
        f"| {row['engine']} {row['method']}{', loads' if row['loads'] else ''} "
        f"| {row['n_bodies']} | {row['instructions_per_body']:.0f} | {row['ns_per_body']:.0f} "
        f"| {row['instructions_per_ns']:.1f} |"
        for row in rows
    ]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path(__file__).parent / "results")
    parser.add_argument("--sizes", type=int, nargs="+", default=[7, 30, 300])
    arguments = parser.parse_args()
    compiled = compile_worker(sources=ROOT, build=None, only_if_ready=True, say=print)
    if compiled.program is None:
        raise SystemExit(f"no C++ worker: {compiled.reason}")
    if not shutil.which("valgrind"):
        raise SystemExit("there is no valgrind here")
    rows = []
    for n in arguments.sizes:
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
                        print(f"chain of {n}: {engine} {offer['method']}", file=sys.stderr)
                        rows.append(measure(compiled.program, engine, folder, offer, n))
    arguments.output.mkdir(parents=True, exist_ok=True)
    text = markdown(rows)
    about = json.dumps({"flags": compiled.flags, "rows": rows}, indent=1)
    (arguments.output / "instructions.json").write_text(about + "\n", encoding="utf-8")
    (arguments.output / "instructions.md").write_text(
        f"{text}\n\n`python benchmarks/instructions.py`\n", encoding="utf-8"
    )
    print(text)


if __name__ == "__main__":
    main()
