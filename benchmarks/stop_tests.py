"""What each stop test leaves: true error against the direct solution, cold start, rigid chains.

    python -m benchmarks stop_tests [-o DIR]

Each cell: the true relative error of the constraint forces in the A-norm, and
the iterations, at a tolerance of 1e-7. Chains and loads as in iterations.py; the direct solution is
refined.
"""

from __future__ import annotations

from typing import Any

import linkwise as lw
from benchmarks import study
from benchmarks.iterations import system

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


HEAD = f"""# What a tolerance of 1e-7 leaves

True relative error in the A-norm (iterations), cold start. Counts marked > reached the limit of
{MOST_ITERATIONS}.

"""


def cell(made: lw.ConstraintSystem, exact: Any, solver: str, stop: str) -> str:
    f, report = made.solve(solver, tolerance=TOLERANCE, stop=stop, max_iterations=MOST_ITERATIONS)
    error = made.energy_norm(f - exact) / made.energy_norm(exact)
    count = f"> {report.iterations}" if report.outcome != "converged" else str(report.iterations)
    return f"{error:.1e} ({count})"


def main() -> None:
    parser = study.parser(__doc__)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    rules = [rule["name"] for rule in lw.stop_rules()]
    rows: list[dict[str, str]] = []
    for kind, pose, n in CHAINS:
        made = system(kind, pose, n, asked.seed)
        exact, _ = made.solve("thomas", solver_options={"refinement_steps": 4})
        for solver in SOLVERS:
            row = {"rigid chain": f"{kind}, {pose}, N = {n}", "solver": f"`{solver}`"}
            row |= {f"`{rule}`": cell(made, exact, solver, rule) for rule in rules}
            rows.append(row)
            study.say(" ".join(row.values()))
    columns: dict[str, Any] = {name: lambda r, name=name: r[name] for name in rows[0]}
    text = HEAD + study.table(rows, columns, left=len(columns))
    study.write(asked.output, "stop_tests", text, rows)
