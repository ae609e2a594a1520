"""Long fuzzing, and single inputs again.

    python -m tests.fuzz [--inputs 1000000] [--jobs 2] [--kinds urdf,mjcf] [--first 0]
    python -m tests.fuzz KIND NUMBER

The first form runs inputs of all kinds in worker processes with a bound on their memory and on
their time for one input, so that crashes and hangs are found, too. It prints each
finding with its kind and number, and what was run. The second form runs one input in this process
and leaves its files in ./fuzz-input.
"""

from __future__ import annotations

import argparse
import faulthandler
import multiprocessing
import multiprocessing.connection
import os
import random
import re
import resource
import signal
import sys
import tempfile
import time
import warnings
from collections import Counter
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1])]
if __name__ == "__main__":  # one input is judged on one thread, and workers are many already
    os.environ.setdefault("LINKWISE_THREADS", "1")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Before any fork, so that a worker starts at once; linkwise imports these when first needed.
import mujoco  # noqa: E402, F401
import scipy.interpolate  # noqa: E402, F401
import xarray  # noqa: E402, F401
import zarr  # noqa: E402, F401

from fuzz import inputs as made  # noqa: E402, the path above
from fuzz.judge import judge  # noqa: E402

FORK = multiprocessing.get_context("fork")
MEMORY = 4 << 30
#: Seconds of a processor for one input, and seconds after which a worker that does nothing ends.
FUSE, STANDSTILL = 30.0, 600.0
#: Inputs of one process.
BATCH = 5000
#: Stored runs are many small files.
MEMORY_DISK = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
#: How many of a hundred inputs are of a kind; those of stored runs take longest.
SHARES = {
    "urdf": 18,
    "mjcf": 16,
    "sdf": 10,
    "scenario": 14,
    "table": 14,
    "model-bytes": 13,
    "call": 14,
}
SHARES["stored-run"] = 1


def wheel(kinds):
    """The kinds mixed in their shares: the kind of input `n` is at `n` modulo the length."""
    mixed = [kind for kind in kinds for _ in range(SHARES[kind])]
    random.Random(0).shuffle(mixed)
    return mixed


def work(pipe, begun, kinds, numbers, folder):
    """Runs inputs, counts in `begun` those that it began, and sends what it found."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    faulthandler.enable(sys.__stderr__)
    warnings.simplefilter("ignore")
    os.chdir(folder)
    place = Path(folder)
    for number in numbers:
        kind = kinds[number % len(kinds)]
        begun.value += 1
        signal.setitimer(signal.ITIMER_PROF, FUSE)
        named, action = made.make(kind, number, place)
        found = judge(action, named)
        unknown = set(os.listdir(folder)) - made.FILES
        if unknown and not found:
            found = f"left files behind: {sorted(unknown)[:5]}"
        if found:
            pipe.send((kind, number, found))
    signal.setitimer(signal.ITIMER_PROF, 0)
    pipe.send(None)


class Worker:
    """A process that runs some inputs, and what it found."""

    def __init__(self, kinds, numbers):
        self.kinds, self.numbers = kinds, numbers
        self.folder = tempfile.TemporaryDirectory(prefix="fuzz-", dir=MEMORY_DISK)
        self.pipe, child = FORK.Pipe(duplex=False)
        self.begun = FORK.RawValue("q", 0)
        self.seen, self.since, self.ended = 0, time.monotonic(), False
        given = (child, self.begun, kinds, numbers, self.folder.name)
        self.process = FORK.Process(target=work, args=given)
        self.process.start()
        child.close()

    @property
    def rest(self):
        """The numbers that were not begun."""
        return self.numbers[self.begun.value :]

    def receive(self):
        """Findings since the last call; `ended` when nothing more will come."""
        found = []
        try:
            while not self.ended and self.pipe.poll(0):
                said = self.pipe.recv()
                self.ended = said is None
                found += [] if said is None else [said]
        except EOFError:
            self.process.join()
            code, self.ended = self.process.exitcode, True
            slow = f"takes longer than {FUSE:g} s of processor time"
            found.append(self._of_current(slow if code == -signal.SIGPROF else f"ended by {code}"))
        if self.begun.value != self.seen:
            self.seen, self.since = self.begun.value, time.monotonic()
        if not self.ended and time.monotonic() - self.since > STANDSTILL:
            self.process.kill()
            self.ended = True
            found.append(self._of_current(f"stands still for {STANDSTILL:g} s"))
        if self.ended:
            self.process.join()
            self.folder.cleanup()
        return found

    def _of_current(self, text):
        number = self.numbers[max(self.begun.value - 1, 0)]
        return self.kinds[number % len(self.kinds)], number, text


def run(kinds, numbers, jobs):
    """How many of each kind were run, and the findings."""
    kinds = wheel(kinds)
    batches = [numbers[at : at + BATCH] for at in range(0, len(numbers), BATCH)][::-1]
    workers, findings, done = [], [], Counter()
    shown, started, told = Counter(), time.monotonic(), 0
    while True:
        while batches and len(workers) < jobs:
            workers.append(Worker(kinds, batches.pop()))
        if not workers:
            return done, findings
        multiprocessing.connection.wait([worker.pipe for worker in workers], timeout=5)
        for worker in list(workers):
            for finding in worker.receive():
                findings.append(finding)
                key = re.sub(r"[\d.e+-]+", "#", finding[2])[:80]
                shown[key] += 1
                if shown[key] <= 3:
                    print(*finding, flush=True)
            if worker.ended:
                workers.remove(worker)
                ran = worker.numbers[: worker.begun.value]
                done.update(kinds[number % len(kinds)] for number in ran)
                if not ran:
                    raise SystemExit("a worker ended before its first input")
                if worker.rest:
                    batches.append(worker.rest)
        if done.total() - told >= 20_000:
            told = done.total()
            rate = told / (time.monotonic() - started)
            print(f"{told} inputs, {len(findings)} findings, {rate:.0f}/s", flush=True)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("kind", nargs="?", choices=sorted(SHARES))
    parser.add_argument("number", nargs="?", type=int)
    parser.add_argument("--inputs", type=int, default=1_000_000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--kinds", default=",".join(SHARES))
    given = parser.parse_args()
    if given.kind:
        folder = Path("fuzz-input").resolve()
        folder.mkdir(exist_ok=True)
        os.chdir(folder)
        named, action = made.make(given.kind, given.number or 0, folder)
        print(judge(action, named) or "no finding")
        return 0
    numbers = range(given.first, given.first + given.inputs)
    done, findings = run(given.kinds.split(","), numbers, given.jobs)
    parts = ", ".join(f"{count} {kind}" for kind, count in done.most_common())
    print(f"{done.total()} inputs from {given.first} on ({parts}), {len(findings)} findings")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
