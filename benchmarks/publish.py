"""Measures this machine and puts the tables where they are read.

    python benchmarks/publish.py NAME [--no-run]

Writes benchmarks/results/NAME (bench.json, bench.md, figures) by `linkwise bench`, and there too
what instructions.py, many_simulations.py and huge_chains.py beside this file find; then replaces
the text between the marks <!-- bench-table --> in README.md and <!-- bench-targets -->,
<!-- many-simulations --> and <!-- huge-chains --> in docs/benchmarking.md. With --no-run it takes
the results that are there.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from pathlib import Path

from linkwise.bench.report import short_table, target_table
from linkwise.bench.run import Result, read, run_bench, write

ROOT = Path(__file__).resolve().parents[1]
#: Scripts beside this one that write NAME.md into a folder; the first has no table of its own in
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
        f"{c['processor']}, {c['cores']} cores, one used; {peers}. "
        f"Everything: [results/{name}]({folder}/{name}/bench.md)."
    )


def put(path: Path, mark: str, new: str) -> None:
    path.write_text(replaced(path.read_text(encoding="utf-8"), mark, new), encoding="utf-8")
    print(f"{path.relative_to(ROOT)}: {mark}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", help="of the machine: benchmarks/results/NAME")
    parser.add_argument("--no-run", action="store_true", help="take the results that are there")
    arguments = parser.parse_args()
    folder = ROOT / "benchmarks" / "results" / arguments.name
    if not arguments.no_run:
        say = lambda message: print(message, file=sys.stderr)  # noqa: E731
        write(run_bench(sources=ROOT, say=say), folder)
        for name in OTHERS:
            say(f"{name}.py")
            script = ROOT / "benchmarks" / f"{name}.py"
            subprocess.run([sys.executable, script, "-o", folder], check=True)
    result = read(folder / "bench.json")
    table = short_table(result.rows)
    line = conditions_line(result, arguments.name, "benchmarks/results")
    put(ROOT / "README.md", "bench-table", f"{table}\n\n{line}")
    line = conditions_line(result, arguments.name, "../benchmarks/results")
    performance = ROOT / "docs" / "benchmarking.md"
    put(performance, "bench-targets", f"{target_table(result.targets)}\n\n{line}")
    for name in OTHERS[1:]:
        text = (folder / f"{name}.md").read_text(encoding="utf-8")
        put(performance, name.replace("_", "-"), text.rpartition("`python")[0])


if __name__ == "__main__":
    main()
