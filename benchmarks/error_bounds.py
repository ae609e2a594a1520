"""What checked iterative solvers leave where slow modes hide: true error over the tolerance.

    python -m benchmarks error_bounds [-o DIR]

Chains and a tree of rods at rest in a random pose, with gravity; the thinner a rod, the slower the
modes that turn it about its axis. Per row the largest true error over the tolerance, of what ended
`converged`: of the constraint forces in the A-norm, against a refined direct solution, and of the
accelerations in the kinetic-energy norm, against the articulated-body recursion; each relative to
its own size. The bound over the true error of the forces is the geometric mean. The rest did not
converge within its iterations, and said so.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import linkwise as lw
from benchmarks import study

TOLERANCE = 1e-3
SCENES = ("random", "alternating", "parallel", "tree")
SIZES = (10, 100, 1000)
RATIOS = (1e-2, 1e-4, 1e-6, 1e-9)
SOLVERS = (
    "conjugate_gradient",
    "rs_conjugate_gradient",
    "symmetric_stair_conjugate_gradient",
    "block_schwarz_conjugate_gradient",
    "two_level",
    "lagged_thomas",
    "jacobi",
    "gauss_seidel",
    "red_black_gauss_seidel",
    "sor",
    "red_black_sor",
    "chebyshev",
)
#: Of these few converge at all on rods, and each takes 20,000 iterations to say so.
BASIC = SOLVERS[6:]
HEAD = f"""# True errors at a tolerance of {TOLERANCE:g}

Inertia ratio: of a rod about its axis to that across. Chains about random, alternating and parallel
axes and a tree, of {", ".join(map(str, SIZES))} rods; basic iterations on {SIZES[0]} rods.

"""


def machine(scene: str, n: int, ratio: float) -> lw.Model:
    radius = float(np.sqrt(ratio / 6))
    if scene == "tree":
        return lw.scenes.tree(n, radius=radius)
    return lw.scenes.chain(n, axes=scene, radius=radius)


def errors(model: lw.Model, solver: str) -> tuple[str, float, float, float]:
    """The outcome; the errors of forces and accelerations over the tolerance; bound over error."""
    q = np.random.default_rng(0).uniform(-1, 1, model.nv)
    made = lw.ConstraintSystem(model, q)
    exact, _ = made.solve("thomas", solver_options={"refinement_steps": 2})
    expected = lw.forward_dynamics(model, q, None, method="articulated_body")
    f, report = made.solve(solver, tolerance=TOLERANCE)
    acceleration, _ = made.recover(f)
    forces = made.energy_norm(f - exact) / made.energy_norm(exact)
    off, size = (lw.kinetic_energy(model, q, a) for a in (acceleration - expected, expected))
    motion = float(np.sqrt(off / size))
    effectivity = report.error_estimate / forces if forces > 0 else np.inf
    return report.outcome, forces / TOLERANCE, motion / TOLERANCE, effectivity


def main() -> None:
    asked = study.parser(__doc__).parse_args()
    rows: list[dict[str, str]] = []
    for solver in SOLVERS:
        for ratio in RATIOS:
            sizes = SIZES[:1] if solver in BASIC else SIZES
            found = [errors(machine(s, n, ratio), solver) for s in SCENES for n in sizes]
            good = np.array([row[1:] for row in found if row[0] == "converged"]).reshape(-1, 3)
            row = {"solver": f"`{solver}`", "inertia ratio": f"{ratio:g}"}
            row["converged"] = f"{len(good)} of {len(found)}"
            for k, name in enumerate(("forces", "accelerations")):
                row[name] = f"{good[:, k].max():.1g}" if len(good) else ""
            # Below rounding a ratio of the two says nothing.
            seen = good[good[:, 0] > 1e-6, 2]
            row["bound / error"] = f"{np.exp(np.log(seen).mean()):.1f}" if len(seen) else ""
            row["least"] = f"{seen.min():.3f}" if len(seen) else ""
            rows.append(row)
            study.say(" ".join(row.values()))
    columns: dict[str, Any] = {name: lambda r, name=name: r[name] for name in rows[0]}
    study.write(asked.output, "error_bounds", HEAD + study.table(rows, columns, left=2), rows)
