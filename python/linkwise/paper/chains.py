"""Figures 2 and 3: time and iterations of a solution against the number of bodies."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from linkwise import _core, scenes
from linkwise.paper.arm import DURATION, MOST_ITERATIONS, Maneuver
from linkwise.paper.published import (
    INTEGRATOR_TOLERANCE,
    PARALLEL_OVERHEAD,
    TIME_EXPONENT,
    TOLERANCE_RATIO,
)

if TYPE_CHECKING:
    from linkwise._core import Model

QUICK_SIZES = (2, 3, 4, 6, 8, 12, 16, 24, 32)
FULL_SIZES = (2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512)
#: The sizes that exponents are fitted on: those of a figure about manipulators.
FITTED_SIZES = (2, 16)
#: Steps along a maneuver: as many as Adams' method takes for it at the paper's tolerance.
STEPS = 64
# Inner products and norms of an iteration of J-CG with the paper's stop test, each a sum over all
# bodies: (z, Dz), (z, Az), |f+ - f|, |f+|.
SUMS_AN_ITERATION = 4
# How far a point may lie from the fitted power law and still follow it.
_FIT_TOLERANCE = 0.15
# After the second pass, passes end once this many seconds have gone by.
_TIME_LIMIT = 3.0
# A measurement of the serial part adds about so many numbers, a fraction of a millisecond.
_SERIAL_ADDITIONS, _SERIAL_MEASUREMENTS = 100_000, 9


class Kind(NamedTuple):
    """A kind of chain: equal rods, no gravity, fixed base."""

    name: str
    dof: int
    joint: str
    axes: str

    def model(self, n_bodies: int) -> Model:
        return scenes.chain(n_bodies, joint=self.joint, axes=self.axes, gravity=(0.0, 0.0, 0.0))


KINDS = (
    Kind("1 DOF a joint, parallel axes (planar)", 1, "revolute", "parallel"),
    Kind("1 DOF a joint, alternating axes (spatial)", 1, "revolute", "alternating"),
    Kind("2 DOF a joint (spatial)", 2, "universal", "alternating"),
)
CONTESTANTS: dict[str, dict[str, str]] = {
    "jcg": {"solver": "conjugate_gradient"},
    "recursive": {"method": "articulated_body"},
    "thomas": {"solver": "thomas"},
    "best": {
        "solver": "two_level",
        "initial_guess": "projection",
        "stop": "energy_norm",
    },
}


def chain_maneuver(model: Model, seed: int) -> Maneuver:
    """A slew of all joints from a bent pose to another, the same for equal joints and seeds."""
    rng = np.random.default_rng(seed)
    start = rng.uniform(-0.5, 0.5, model.nq)
    end = start + rng.uniform(-0.5, 0.5, model.nq)
    return Maneuver(f"{model.nq} joints", tuple(start), tuple(end))


def measure(
    model: Model,
    maneuver: Maneuver,
    *,
    method: str = "constraint_force",
    solver: str = "auto",
    initial_guess: str = "cubic",
    stop: str = "paper",
    solutions: int,
) -> dict[str, Any]:
    """Mean time and iterations of a solution along a maneuver, warm-started step by step.

    The states are those of the maneuver itself, at even steps as long as Adams' method takes for
    it on short chains. (Integrated open loop, a long chain is unstable and leaves the maneuver.)
    Of several passes each state keeps its shortest time, because other programs only add to it.
    """
    times = (np.arange(STEPS) + 1) * (DURATION / STEPS)
    q, v, a = maneuver.motion(times)
    tau = _core.inverse_dynamics(model, q, v, a)
    dynamics = _core.DynamicsMethod(
        model,
        method=method,
        solver=solver,
        initial_guess=initial_guess,
        stop=stop,
        tolerance=INTEGRATOR_TOLERANCE * TOLERANCE_RATIO,
        max_iterations=MOST_ITERATIONS,
        threads=1,
    )
    seconds = np.full(STEPS, np.inf)
    started = clock.perf_counter()
    for done in range(max(2, math.ceil(solutions / STEPS))):
        if done >= 2 and clock.perf_counter() - started > _TIME_LIMIT:
            break
        dynamics.reset()
        found = dynamics.follow(times, q, v, tau)
        seconds = np.minimum(seconds, found["seconds"])
    error = _core.kinetic_energy(model, q, found["acceleration"] - a)
    size = _core.kinetic_energy(model, q, a)
    iterations = found["iterations"]
    return {
        "seconds": float(seconds.mean()),
        "mean_iterations": float(iterations.mean()),
        "max_iterations": int(iterations.max()),
        # In the kinetic-energy norm, relative to the largest acceleration.
        "acceleration_error": float(np.sqrt(error.max() / size.max())),
        "outcome": next((o for o in found["outcome"] if o != "converged"), "converged"),
    }


def fit_exponent(sizes: Sequence[int], values: Sequence[float]) -> tuple[float, float]:
    """(exponent, factor) of the power law through the sizes within FITTED_SIZES."""
    pairs = [
        (math.log(n), math.log(y))
        for n, y in zip(sizes, values, strict=True)
        if FITTED_SIZES[0] <= n <= FITTED_SIZES[1] and y > 0
    ]
    slope, offset = np.polyfit([p[0] for p in pairs], [p[1] for p in pairs], 1)
    return float(slope), float(math.exp(offset))


def range_of_fit(
    sizes: Sequence[int], values: Sequence[float], law: tuple[float, float]
) -> tuple[int, int]:
    """The longest run of sizes whose points all lie within 15 % of the power law."""
    best: tuple[int, int] = (0, 0)
    first = None
    for n, y in zip(sizes, values, strict=True):
        if abs(y / (law[1] * n ** law[0]) - 1) > _FIT_TOLERANCE:
            first = None
            continue
        first = n if first is None else first
        if best == (0, 0) or n / first > best[1] / best[0]:
            best = (first, n)
    return best


def local_exponents(sizes: Sequence[int], values: Sequence[float]) -> list[float]:
    """Slope between neighbours on logarithmic axes."""
    n, y = np.log(sizes), np.log(np.maximum(values, 1e-300))
    return [float(slope) for slope in np.diff(y) / np.diff(n)]


def fig2(quick: bool, seed: int, advance: Callable[[str], None]) -> list[dict[str, Any]]:
    """Time and iterations of a solution for chains of every kind; one record per kind."""
    sizes = QUICK_SIZES if quick else FULL_SIZES
    solutions = 4 * STEPS if quick else 1000
    series = []
    for kind in KINDS:
        columns: dict[str, list[Any]] = {"unknowns": []}
        for n in sizes:
            advance(f"figure 2: {kind.name}, {n} bodies")
            model = kind.model(n)
            maneuver = chain_maneuver(model, seed)
            columns["unknowns"].append((6 - kind.dof) * n)
            for name, options in CONTESTANTS.items():
                found = measure(model, maneuver, **options, solutions=solutions)
                for key, value in found.items():
                    columns.setdefault(f"{name}_{key}", []).append(value)
        laws = {
            name: fit_exponent(sizes, columns[f"{name}_seconds"]) for name in ("jcg", "recursive")
        }
        iterations = columns["jcg_mean_iterations"]
        series.append(
            {
                "kind": kind.name,
                "dof": kind.dof,
                "bodies": list(sizes),
                **columns,
                "fitted_on": list(FITTED_SIZES),
                "time_exponent": laws["jcg"][0],
                "time_factor": laws["jcg"][1],
                "time_exponent_published": TIME_EXPONENT[kind.dof],
                "time_exponent_holds": list(
                    range_of_fit(sizes, columns["jcg_seconds"], laws["jcg"])
                ),
                "time_exponents_local": local_exponents(sizes, columns["jcg_seconds"]),
                "time_exponent_recursive": laws["recursive"][0],
                "iteration_exponent": fit_exponent(sizes, iterations)[0],
            }
        )
    return series


def fig3(
    series: Sequence[dict[str, Any]], seed: int, advance: Callable[[str], None]
) -> list[dict[str, Any]]:
    """Equations (20) and (21) with the times of fig2, serial and per-body parts apart."""
    estimates = []
    for kind, record in zip(KINDS, series, strict=True):
        advance(f"figure 3: {kind.name}")
        rows: dict[str, list[float]] = {
            key: [] for key in ("sums", "velocities", "ideal", "realistic", "realistic_joint_state")
        }
        for i, n in enumerate(record["bodies"]):
            model = kind.model(n)
            q, v, _ = chain_maneuver(model, seed).motion(DURATION / 2)
            sums = math.ceil(SUMS_AN_ITERATION * record["jcg_mean_iterations"][i])
            serial = _least_serial_part(model, q, v, sums)
            total = record["jcg_seconds"][i]
            rows["sums"].append(serial["sums"])
            rows["velocities"].append(serial["velocities"])
            rows["ideal"].append(parallel_time(total, serial["sums"], n, 1.0))
            rows["realistic"].append(parallel_time(total, serial["sums"], n, PARALLEL_OVERHEAD))
            rows["realistic_joint_state"].append(
                parallel_time(total, serial["sums"] + serial["velocities"], n, PARALLEL_OVERHEAD)
            )
        estimates.append(
            {
                "kind": kind.name,
                "bodies": record["bodies"],
                "serial_seconds": rows["sums"],
                "velocity_pass_seconds": rows["velocities"],
                "one_processor_seconds": record["jcg_seconds"],
                "parallel_ideal_seconds": rows["ideal"],
                "parallel_realistic_seconds": rows["realistic"],
                "parallel_realistic_joint_state_seconds": rows["realistic_joint_state"],
                "recursive_seconds": record["recursive_seconds"],
            }
        )
    return estimates


def _least_serial_part(
    model: Model, q: npt.ArrayLike, v: npt.ArrayLike, sums: int
) -> dict[str, float]:
    """The shortest of several short measurements of the serial parts."""
    repeats = max(1, _SERIAL_ADDITIONS // (sums * model.n_bodies))
    found = [
        _core.measure_serial_part(model, q, v, sums=sums, repeats=repeats)
        for _ in range(_SERIAL_MEASUREMENTS)
    ]
    return {key: min(part[key] for part in found) for key in ("sums", "velocities")}


def parallel_time(total: float, serial: float, processors: int, overhead: float) -> float:
    """Eqs. (20) (overhead 1) and (21) (overhead 1.3) of [sharf1993]."""
    return overhead * max(0.0, total - serial) / processors + serial


def count(quick: bool) -> int:
    """How often `advance` will be called by fig2 and fig3."""
    return len(KINDS) * (len(QUICK_SIZES if quick else FULL_SIZES) + 1)
