"""How much of a mean number of iterations is chance: the same runs at tolerances close by.

The integrator chooses its steps by an error estimate, in which the remaining error of every
solution shows. A tolerance changed by a few percent changes nothing that matters except the steps,
and with them how often the cubic guess misses. Only what remains the same can be said of a scheme.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from linkwise import scenes
from linkwise.paper.arm import MANEUVERS, PAPER_PROTOCOL, run_maneuver
from linkwise.paper.published import STAND_IN_MEAN_ITERATIONS, TABLE_2

FACTORS = tuple(np.linspace(0.95, 1.05, 11))


def spread(advance: Callable[[str], None]) -> list[dict[str, Any]]:
    """One row per scheme and maneuver, under the paper's protocol."""
    model = scenes.srms_3l5d()
    rows = []
    for name in TABLE_2:
        advance(f"spread of the counts: {name}")
        for column, maneuver in enumerate(MANEUVERS.values()):
            found = [
                run_maneuver(
                    model,
                    maneuver,
                    replace(PAPER_PROTOCOL, tolerance=factor * PAPER_PROTOCOL.tolerance),
                    solver=name,
                )
                for factor in FACTORS
            ]
            counts = [row["mean_iterations"] for row in found]
            errors = [row["final_error"] for row in found]
            rows.append(
                {
                    "method": name,
                    "maneuver": maneuver.name,
                    "least_mean_iterations": min(counts),
                    "median_mean_iterations": float(np.median(counts)),
                    "most_mean_iterations": max(counts),
                    "least_final_error": min(errors),
                    "most_final_error": max(errors),
                    "stand_in_mean_iterations": STAND_IN_MEAN_ITERATIONS[name][column],
                }
            )
    return rows


def count() -> int:
    """How often `advance` will be called."""
    return len(TABLE_2)
