"""What each stop test leaves: true error against the direct solution, cold start, rigid chains.

    python benchmarks/stop_tests.py [-o benchmarks/results]

Writes stop_tests.md. Each cell: the true relative error of the constraint forces in the A-norm, and
the iterations, at a tolerance of 1e-7. Chains and loads as in iterations.py; the direct solution is
refined.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from iterations import system

import linkwise as lw

TOLERANCE = 1e-7
MOST_ITERATIONS = 50_000
CHAINS = (
    ("spherical", "straight", 16),
    ("spherical", "bent", 16),
    ("alternating hinges", "straight", 32),
    ("random hinges", "bent", 32),
    ("parallel hinges", "straight", 32),
)
SOLVERS = (
    "jacobi",
    "gauss_seidel",
    "sor",
    "chebyshev",
    "conjugate_gradient",
    "rs_conjugate_gradient",
    "two_level",
)


def cell(made: lw.ConstraintSystem, exact, solver: str, stop: str) -> str:
    f, report = made.solve(solver, tolerance=TOLERANCE, stop=stop, max_iterations=MOST_ITERATIONS)
    error = made.energy_norm(f - exact) / made.energy_norm(exact)
    count = f"> {report.iterations}" if report.outcome != "converged" else str(report.iterations)
    return f"{error:.1e} ({count})"


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("-o", "--output", type=Path, default=Path(__file__).parent / "results")
    arguments.add_argument("--seed", type=int, default=0)
    asked = arguments.parse_args()
    rules = [rule["name"] for rule in lw.stop_rules()]
    lines = [
        "# What a tolerance of 1e-7 leaves",
        "",
        "`python benchmarks/stop_tests.py`: true relative error in the A-norm (iterations), cold",
        f"start. Counts marked > reached the limit of {MOST_ITERATIONS}.",
        "",
        "| rigid chain | solver | " + " | ".join(f"`{rule}`" for rule in rules) + " |",
        "|---" * (2 + len(rules)) + "|",
    ]
    for kind, pose, n in CHAINS:
        made = system(kind, pose, n, asked.seed)
        exact, _ = made.solve("thomas", solver_options={"refinement_steps": 4})
        for solver in SOLVERS:
            found = " | ".join(cell(made, exact, solver, rule) for rule in rules)
            lines.append(f"| {kind}, {pose}, N = {n} | `{solver}` | {found} |")
            print(lines[-1], flush=True)
    asked.output.mkdir(parents=True, exist_ok=True)
    (asked.output / "stop_tests.md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
