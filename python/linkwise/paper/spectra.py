"""Iteration matrices of the arm, formed densely: their radii, and what a maneuver excites."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from linkwise import _core, scenes
from linkwise.base import Array
from linkwise.paper.arm import DURATION, MANEUVERS, Maneuver

MOST_THREE_TERM = 1000
_STATES = 21
# A mode whose share of the solution's energy is below this is not excited.
_EXCITED = 1e-20


class System(NamedTuple):
    """A f = b with the rows of each joint."""

    A: Array
    b: Array
    blocks: list[slice]

    def block_diagonal(self) -> Array:
        D = np.zeros_like(self.A)
        for rows in self.blocks:
            D[rows, rows] = self.A[rows, rows]
        return D


def system_at(maneuver: Maneuver, time: float) -> System:
    model = scenes.srms_3l5d()
    q, v, a = maneuver.motion(time)
    found = _core.ConstraintSystem(model, q, v, _core.inverse_dynamics(model, q, v, a))
    ends = np.cumsum(found.rows_per_joint)
    blocks = [slice(int(e - n), int(e)) for e, n in zip(ends, found.rows_per_joint, strict=True)]
    return System(found.dense(), found.b, blocks)


def spectral_radius(matrix: Array) -> float:
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def sweep_matrix(system: System, order: list[int], omega: float) -> Array:
    """Iteration matrix of block over-relaxation that visits the joints in `order`."""
    size = system.b.size
    G = np.eye(size)
    for k in order:
        rows = system.blocks[k]
        step = np.eye(size)
        step[rows] -= omega * np.linalg.solve(system.A[rows, rows], system.A[rows])
        G = step @ G
    return G


def radii(system: System) -> dict[str, float]:
    """Spectral radii of the schemes' iteration matrices at one state."""
    n = len(system.blocks)
    jacobi = spectral_radius(
        np.eye(system.b.size) - np.linalg.solve(system.block_diagonal(), system.A)
    )
    omega = 2 / (1 + np.sqrt(1 - jacobi**2))
    base_to_tip = list(range(n))
    red_black = [*range(0, n, 2), *range(1, n, 2)]
    return {
        "jacobi": jacobi,
        "gauss_seidel": spectral_radius(sweep_matrix(system, base_to_tip, 1.0)),
        "red_black_gauss_seidel": spectral_radius(sweep_matrix(system, red_black, 1.0)),
        "optimal_omega": float(omega),
        "sor": spectral_radius(sweep_matrix(system, base_to_tip, omega)),
        "red_black_sor": spectral_radius(sweep_matrix(system, red_black, omega)),
    }


def excited_radius(system: System) -> float:
    """Largest contraction among the modes of 1 - D^-1 A that the solution has a share of."""
    L = np.linalg.cholesky(system.block_diagonal())
    scaled = np.linalg.solve(L, np.linalg.solve(L, system.A).T)
    values, modes = np.linalg.eigh(scaled)
    amplitudes = modes.T @ np.linalg.solve(L, system.b) / values
    energy = values * amplitudes**2
    excited = energy > _EXCITED * energy.sum()
    return float(np.abs(1 - values[excited]).max())


def spectra() -> list[dict[str, Any]]:
    """Per maneuver: the extreme radii over time, and all schemes' radii half way."""
    rows = []
    for maneuver in MANEUVERS.values():
        times = DURATION * (np.arange(_STATES) + 0.5) / _STATES
        systems = [system_at(maneuver, float(t)) for t in times]
        jacobi = [radii(s)["jacobi"] for s in systems]
        excited = [excited_radius(s) for s in systems]
        condition = [_condition(s) for s in systems]
        rows.append(
            {
                "maneuver": maneuver.name,
                "radius_least": min(jacobi),
                "radius_greatest": max(jacobi),
                "excited_radius_greatest": max(excited),
                "condition_greatest": max(condition),
                "half_way": radii(systems[_STATES // 2]),
            }
        )
    return rows


def _condition(system: System) -> float:
    values = np.linalg.eigvals(np.linalg.solve(system.block_diagonal(), system.A)).real
    return float(values.max() / values.min())


def printed_formula(tolerance: float) -> list[dict[str, Any]]:
    """Iterations of Table 1's J-CG from zero, with gamma as derived and as printed."""
    rows = []
    for maneuver in MANEUVERS.values():
        system = system_at(maneuver, DURATION / 3)
        rows.append(
            {
                "maneuver": maneuver.name,
                "derived": three_term(system, tolerance, printed=False),
                "printed": three_term(system, tolerance, printed=True),
                "limit": MOST_THREE_TERM,
            }
        )
    return rows


def three_term(
    system: System, tolerance: float, *, printed: bool, most: int = MOST_THREE_TERM
) -> int:
    """Iterations of J-CG as in Table 1 until the residual has dropped by `tolerance`.

    `printed`: with (z, z) in the denominator of gamma, as the table prints, instead of (z, A z).
    Returns `most` where that never happens.
    """
    D = system.block_diagonal()
    f, f_before = np.zeros_like(system.b), np.zeros_like(system.b)
    gamma_before, zdz_before, rho = 1.0, 1.0, 1.0
    target = tolerance * np.linalg.norm(system.b)
    for k in range(most):
        residual = system.b - system.A @ f
        if np.linalg.norm(residual) <= target:
            return k
        z = np.linalg.solve(D, residual)
        zdz = float(z @ residual)
        gamma = zdz / float(z @ z if printed else z @ system.A @ z)
        if k > 0:
            rho = 1 / (1 - gamma / gamma_before * zdz / zdz_before / rho)
        f, f_before = rho * (gamma * z + f) + (1 - rho) * f_before, f
        gamma_before, zdz_before = gamma, zdz
        if not np.isfinite(f).all():
            return most
    return most
