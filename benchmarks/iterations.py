"""Iterations of the preconditioned solvers on rigid chains of every kind, from a cold start.

    python -m benchmarks iterations [--sizes 64 256 4096] [-o DIR]

Each cell: iterations until the estimated A-norm error is
1e-10 of the solution, and the true error against the direct solution with refinement. Chains are
equal rods of length 1, mass 1, radius 0.05 on a fixed base; "bent" is by random angles of up to
1 rad; rates, torques and wrenches, hence the right-hand side, are random. Two aims are checked and
printed: two_level takes at most 20 iterations on every chain of 256 and 4096 joints, and
rs_conjugate_gradient at most 0.55 times the iterations of conjugate_gradient, up to a condition of
1e6; beyond, rounding delays both, each in its own way.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import linkwise as lw
from benchmarks import study
from benchmarks.timing import timed

TOLERANCE = 1e-10
SOLVERS = (
    "conjugate_gradient",
    "rs_conjugate_gradient",
    "symmetric_stair_conjugate_gradient",
    "block_schwarz_conjugate_gradient",
    "two_level",
)
KINDS: dict[str, dict[str, Any]] = {
    "spherical": {"joint": "spherical"},
    "parallel hinges": {"joint": "revolute", "axes": "parallel"},
    "alternating hinges": {"joint": "revolute", "axes": "alternating"},
    "random hinges": {"joint": "revolute", "axes": "random"},
}
POSES = ("straight", "bent")
MOST_ITERATIONS = {64: 20_000, 256: 20_000}
MOST_ON_LONG_CHAINS = 2_000
AIM, AIM_SIZES = 20, (256, 4096)
HALVING, HALVING_CONDITION = 0.55, 1e6


def system(kind: str, pose: str, n: int, seed: int) -> lw.ConstraintSystem:
    model = lw.scenes.chain(n, **KINDS[kind])
    rng = np.random.default_rng(seed)
    q = np.array(model.neutral_configuration(), dtype=float)
    if pose == "bent":
        angles = rng.uniform(-1, 1, (n, 3))
        if kind == "spherical":
            q = Rotation.from_rotvec(angles).as_quat().ravel()
        else:
            q = angles[:, 0].copy()
    v, tau = rng.standard_normal(model.nv), rng.standard_normal(model.nv)
    # Without them a planar chain moves in its plane, and the slowest modes, out of it, stay hidden.
    wrenches = rng.standard_normal((model.n_joints, 6))
    return lw.ConstraintSystem(model, q, v, tau, external=wrenches)


def measure(kind: str, pose: str, n: int, seed: int) -> dict[str, Any]:
    made = system(kind, pose, n, seed)
    exact, _ = made.solve("thomas", solver_options={"refinement_steps": 4})
    scale = made.energy_norm(exact)
    most = MOST_ITERATIONS.get(n, MOST_ON_LONG_CHAINS)
    spectrum = made.spectrum()
    row: dict[str, Any] = {
        "kind": kind,
        "pose": pose,
        "bodies": n,
        "unknowns": made.size,
        "condition": spectrum.condition,
        "condition_is_bound": not spectrum.converged,
        "solvers": {},
    }
    for solver in SOLVERS:
        solve = partial(made.solve, solver, tolerance=TOLERANCE, max_iterations=most)
        (f, report), taken = timed(solve)
        row["solvers"][solver] = {
            "iterations": report.iterations,
            "outcome": report.outcome,
            "error": made.energy_norm(f - exact) / scale,
            "seconds": taken.seconds,
        }
    return row


def cell(found: dict[str, Any]) -> str:
    if found["outcome"] == "reached_max_iterations":
        return f"> {found['iterations']}"
    text = f"{found['iterations']} ({found['error']:.0e})"
    return text if found["outcome"] == "converged" else f"{text}, {found['outcome']}"


def condition(row: dict[str, Any]) -> str:
    return ("> " if row["condition_is_bound"] else "") + f"{row['condition']:.1e}"


COLUMNS: dict[str, Any] = {
    "chain": lambda r: f"{r['kind']}, {r['pose']}",
    "N": lambda r: r["bodies"],
    "condition": condition,
    **{f"`{s}`": lambda r, s=s: cell(r["solvers"][s]) for s in SOLVERS},
}
HEAD = """# Iterations by kind of chain

Iterations to an estimated A-norm error of 1e-10 of the solution and, in brackets, the true one;
cold start, rigid rods, random right-hand side. Conditions marked > are lower bounds.
"""


def aims(rows: list[dict[str, Any]]) -> list[str]:
    two_level = [r for r in rows if r["bodies"] in AIM_SIZES]
    worst = max((r["solvers"]["two_level"]["iterations"] for r in two_level), default=0)
    ratios = [
        r["solvers"]["rs_conjugate_gradient"]["iterations"]
        / r["solvers"]["conjugate_gradient"]["iterations"]
        for r in rows
        if r["condition"] < HALVING_CONDITION
    ]
    halved = max(ratios, default=0.0)
    return [
        f"two_level: at most {worst} iterations, aim {AIM}: {'met' if worst <= AIM else 'MISSED'}",
        f"rs_conjugate_gradient: at most {halved:.2f} of conjugate_gradient's, aim {HALVING}: "
        + ("met" if halved <= HALVING else "MISSED"),
    ]


def main() -> None:
    parser = study.parser(__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=[64, 256, 4096])
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    rows = []
    for n in asked.sizes:
        for kind in KINDS:
            for pose in POSES:
                rows.append(measure(kind, pose, n, asked.seed))
                found = {s: cell(r) for s, r in rows[-1]["solvers"].items()}
                study.say(f"N = {n}, {kind}, {pose}: {found}")
    table = study.table(rows, COLUMNS, left=len(COLUMNS))
    text = "\n".join([HEAD, table, "", *(f"- {line}" for line in aims(rows))])
    study.write(asked.output, "iterations", text, rows, tolerance=TOLERANCE, seed=asked.seed)
