"""`python -m benchmarks STUDY [options]`: runs one of the studies."""

from __future__ import annotations

import sys
from importlib import import_module

from linkwise import InputError

STUDIES = (
    "peers",
    "instructions",
    "many_simulations",
    "looped_robots",
    "huge_chains",
    "million_links",
    "closed_loops",
    "elastic_links",
    "iterations",
    "stop_tests",
    "stiff_machines",
    "error_bounds",
    "publish",
)


def main() -> None:
    if len(sys.argv) < 2 or sys.argv[1] not in STUDIES:
        raise SystemExit(f"python -m benchmarks {'|'.join(STUDIES)} [options]")
    study = sys.argv.pop(1)
    try:
        import_module(f"benchmarks.{study}").main()
    except InputError as error:
        print(f"benchmarks: {error}", file=sys.stderr)
        raise SystemExit(2) from None


if __name__ == "__main__":
    main()
