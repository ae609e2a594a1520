"""Measures this machine and puts the tables where they are read.

    python -m benchmarks publish NAME [--no-run]

Writes benchmarks/results/NAME by the studies `peers`, `instructions`, `many_simulations` and
`huge_chains`; then replaces the text between the marks <!-- bench-table --> in README.md and
<!-- bench-targets -->, <!-- many-simulations --> and <!-- huge-chains --> in docs/benchmarking.md.
With --no-run it takes the results that are there: bench.json stays on the machine that wrote it,
the repository keeps the tables.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from pathlib import Path

from benchmarks.peers import Result, read, run_bench, write
from benchmarks.report import at_commit, short_table, target_table
from benchmarks.study import RESULTS, ROOT, say

#: Studies that write NAME.md into a folder; the first has no table of its own in
#: the documents.
OTHERS = ("instructions", "many_simulations", "huge_chains")


def replaced(text: str, mark: str, new: str) -> str:
    """`text` with what is between <!-- mark --> and <!-- /mark --> replaced."""
    pattern = re.compile(rf"(<!-- {mark} -->\n).*?(<!-- /{mark} -->)", re.DOTALL)
    if not pattern.search(text):
        raise SystemExit(f"there is no <!-- {mark} --> ... <!-- /{mark} -->")
    return pattern.sub(lambda found: f"{found[1]}{new.strip()}\n{found[2]}", text)


def conditions_line(result: Result, name: str, folder: str) -> str:
    c = result.conditions
    names = {"pin": "Pinocchio", "mujoco": "MuJoCo", "dartpy": "DART", "drake": "Drake"}
    found = {name: c["packages"].get(package) for package, name in names.items()}
    peers = ", ".join(f"{name} {version}" for name, version in found.items() if version)
    return (
        f"{c['processor']}, {c['cores']} cores, one used; linkwise{at_commit(c)}, {peers}. "
        f"Everything: [results/{name}]({folder}/{name}/bench.md)."
    )


def put(path: Path, mark: str, new: str) -> None:
    path.write_text(replaced(path.read_text(encoding="utf-8"), mark, new), encoding="utf-8")
    print(f"{path.relative_to(ROOT)}: {mark}")


def main() -> None:
    parser = argparse.ArgumentParser(description="Measures this machine, puts the tables.")
    parser.add_argument("name", help="of the machine: benchmarks/results/NAME")
    parser.add_argument("--no-run", action="store_true", help="take the results that are there")
    arguments = parser.parse_args()
    folder = RESULTS / arguments.name
    if not arguments.no_run:
        write(run_bench(), folder)
        for name in OTHERS:
            say(name)
            command = [sys.executable, "-m", "benchmarks", name, "-o", str(folder)]
            subprocess.run(command, check=True, cwd=ROOT)
    if not (folder / "bench.json").is_file():
        raise SystemExit(f"{folder / 'bench.json'} is not here: run without --no-run")
    result = read(folder / "bench.json")
    table = short_table(result.rows)
    line = conditions_line(result, arguments.name, "benchmarks/results")
    put(ROOT / "README.md", "bench-table", f"{table}\n\n{line}")
    line = conditions_line(result, arguments.name, "../benchmarks/results")
    page = ROOT / "docs" / "benchmarking.md"
    put(page, "bench-targets", f"{target_table(result.targets)}\n\n{line}")
    for name in OTHERS[1:]:
        text = (folder / f"{name}.md").read_text(encoding="utf-8")
        put(page, name.replace("_", "-"), text.rpartition("`python")[0])
