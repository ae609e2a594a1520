"""Scenario files (TOML): a machine, its drives, how to simulate it and what to record.

Read as untrusted input, like everything in :mod:`linkwise.io`; a package of its own because it
brings models, drives and results together.
"""

from linkwise.scenario.read import (
    Scenario,
    load_ratings,
    load_scenario,
    parse_axis,
    ratings_in,
    section_ratings_in,
    variant,
)

__all__ = [
    "Scenario",
    "load_ratings",
    "load_scenario",
    "parse_axis",
    "ratings_in",
    "section_ratings_in",
    "variant",
]
