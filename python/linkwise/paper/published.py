"""What the paper itself reports [sharf1993], to be put beside what is measured here."""

from __future__ import annotations

from typing import NamedTuple

MANEUVERS = ("I", "II")


class Row(NamedTuple):
    """A row of Table 2, per maneuver (I, II)."""

    name: str
    accuracy_percent: tuple[float, float]
    mean_iterations: tuple[int, int]
    seconds: tuple[float, float]


# Solver of linkwise -> the paper's row. Seconds are CPU time on a SUN 3/60.
TABLE_2 = {
    "jacobi": Row("PA-Jacobi", (0.05, 0.02), (26, 1483), (12.2, 470.0)),
    "chebyshev": Row("PA-J-SI", (0.03, 0.08), (16, 694), (10.0, 164.0)),
    "conjugate_gradient": Row("PA-J-CG", (0.05, 0.05), (7, 12), (8.8, 8.8)),
    "gauss_seidel": Row("Gauss-Seidel", (0.03, 0.04), (14, 197), (9.0, 63.0)),
    "sor": Row("SOR", (0.03, 0.05), (10, 150), (8.6, 39.0)),
}

# An independent computation of the stand-in arm, SRMS-3L5D, under the same protocol with another
# implementation of Adams' method: mean iterations in maneuvers I and II.
STAND_IN_MEAN_ITERATIONS = {
    "jacobi": (22.5, 1613.0),
    "chebyshev": (81.0, 83.0),
    "conjugate_gradient": (5.1, 8.6),
    "gauss_seidel": (12.0, 367.0),
    "sor": (42.0, 51.0),
}

# Fig. 2(a): CPU time of a solution ~ N^exponent, by degrees of freedom per joint.
TIME_EXPONENT = {1: 1.12, 2: 1.17}

# Eq. (21): share of the parallel time lost to communication and scheduling.
PARALLEL_OVERHEAD = 1.3

# Section 5: tolerance of the iteration over that of the integrator.
TOLERANCE_RATIO = 0.1
INTEGRATOR_TOLERANCE = 1e-6
