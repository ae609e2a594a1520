"""Long fuzzing, and single inputs again.

    python -m tests.fuzz [--inputs 1000000] [--jobs 2] [--kinds urdf,mjcf] [--first 0]
    python -m tests.fuzz KIND NUMBER

The first form runs inputs of all kinds in worker processes with a bound on their memory, and ends
a worker that takes too long for one input, so that crashes and hangs are found, too. It prints each
finding with its kind and number, and what was run. The second form runs one input in this process
and leaves its files in ./fuzz-input.
"""

from __future__ import annotations

import argparse
import faulthandler
import multiprocessing
import os
import random
import re
import resource
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1])]
# One input is judged on one thread, and workers are many already.
os.environ.setdefault("LINKWISE_THREADS", "1")

MEMORY = 4 << 30
FUSE = 30.0
#: How many of a hundred inputs are of a kind; those of stored runs take longest.
SHARES = {"urdf": 24, "mjcf": 20, "scenario": 14, "table": 14, "model-bytes": 13, "call": 14}
SHARES["stored-run"] = 1


def plan(kinds, first, count):
    """Kind and number of each input, the kinds mixed in their shares."""
    wheel = [kind for kind in kinds for _ in range(SHARES[kind])]
    random.Random(0).shuffle(wheel)
    for number in range(first, first + count):
        yield wheel[number % len(wheel)], number


def work(pipe, inputs, folder):
    """Runs inputs, and says of each when it begins and what it found."""
    import warnings

    from fuzz import inputs as made
    from fuzz.judge import judge

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    faulthandler.enable()
    warnings.simplefilter("ignore")
    os.chdir(folder)
    for kind, number in inputs:
        pipe.send((kind, number, None))
        named, action = made.make(kind, number, Path(folder))
        found = judge(action, named)
        unknown = set(os.listdir(folder)) - made.FILES
        if unknown and not found:
            found = f"left files behind: {sorted(unknown)[:5]}"
        if found:
            pipe.send((kind, number, found))
    pipe.send((None, None, None))


class Worker:
    """A process and what it last said."""

    def __init__(self, inputs):
        self.folder = tempfile.TemporaryDirectory(prefix="fuzz-")
        self.pipe, child = multiprocessing.Pipe(duplex=False)
        self.process = multiprocessing.Process(target=work, args=(child, inputs, self.folder.name))
        self.process.start()
        child.close()
        self.current, self.since, self.done, self.ended = None, time.monotonic(), 0, False

    def receive(self):
        """Findings since the last call; `ended` when nothing more will come."""
        found = []
        try:
            while self.pipe.poll(0):
                kind, number, text = self.pipe.recv()
                if kind is None:
                    self.ended = True
                elif text is None:
                    self.done += 1
                    self.current, self.since = (kind, number), time.monotonic()
                else:
                    found.append((kind, number, text))
        except EOFError:
            code = self.process.join() or self.process.exitcode
            if not self.ended:
                found.append((*(self.current or ("start", 0)), f"worker ended with code {code}"))
            self.ended = True
        running = self.current is not None and not self.ended
        if running and time.monotonic() - self.since > FUSE:
            self.process.kill()
            found.append((*self.current, f"takes longer than {FUSE:g} s"))
            self.ended = True
        if self.ended:
            self.process.join()
            self.folder.cleanup()
        return found


def run(kinds, first, count, jobs):
    """Counts and findings of `count` inputs."""
    inputs = plan(kinds, first, count)
    workers, findings, done = [], [], 0
    shown, started = Counter(), time.monotonic()
    while True:
        while len(workers) < jobs:
            batch = [pair for pair, _ in zip(inputs, range(2000), strict=False)]
            if not batch:
                break
            workers.append((Worker(batch), batch))
        if not workers:
            return done, findings
        time.sleep(0.05)
        for entry in list(workers):
            worker, batch = entry
            for finding in worker.receive():
                findings.append(finding)
                key = re.sub(r"[\d.e+-]+", "#", finding[2])[:80]
                shown[key] += 1
                if shown[key] <= 3:
                    print(*finding, flush=True)
            if worker.ended:
                workers.remove(entry)
                done += worker.done
                rest = batch[worker.done :]
                if rest:
                    workers.append((Worker(rest), rest))
                elif done % 20_000 < 2000:
                    rate = done / (time.monotonic() - started)
                    print(f"{done} inputs, {len(findings)} findings, {rate:.0f}/s", flush=True)


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
        from fuzz import inputs as made
        from fuzz.judge import judge

        folder = Path("fuzz-input").resolve()
        folder.mkdir(exist_ok=True)
        os.chdir(folder)
        named, action = made.make(given.kind, given.number or 0, folder)
        print(judge(action, named) or "no finding")
        return 0
    done, findings = run(given.kinds.split(","), given.first, given.inputs, given.jobs)
    print(f"{done} inputs from {given.first} on, {len(findings)} findings")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
