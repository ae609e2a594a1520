#!/usr/bin/env python3
"""How often the stated bounds of peak loads hold, on a hundred and fifty-eight machines.

    python tools/bounds_coverage.py [--tolerances 1e-4 1e-5 1e-6] [--kind NAME] [--json FILE]

What is true is another integrator's run at 1e-10. Prints, per kind of scene and tolerance, how many
peaks of how many are outside their bounds, each of them, and the largest error in units of its
bound. Minutes; a part of the scenes belongs to the tests (tests/python/loads/test_bounds.py).
"""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from helpers import odd_scenes
from helpers.bound_scenes import KINDS, coverage, robots


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tolerances", nargs="+", type=float, default=[1e-4, 1e-5, 1e-6])
    parser.add_argument("--kind", help="only scenes of this kind")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    warnings.simplefilter("ignore")  # of the robots' own files
    kinds = {**KINDS, "robots": robots(), **odd_scenes.KINDS}
    found: list[dict[str, Any]] = []
    print("| scenes | " + " | ".join(f"{t:g}" for t in options.tolerances) + " | largest |")
    print("|---|" + "---|" * (len(options.tolerances) + 1))
    for kind, scenes in kinds.items():
        if options.kind not in (None, kind):
            continue
        cells, largest = [], 0.0
        for tolerance in options.tolerances:
            missed = total = 0
            for name, scene in scenes.items():
                covered, peaks, worst = coverage(scene, tolerance)
                row = {"kind": kind, "scene": name, "tolerance": tolerance, "peaks": peaks}
                found.append(row | {"missed": peaks - covered, "largest": worst})
                missed, total, largest = (
                    missed + peaks - covered,
                    total + peaks,
                    max(largest, worst),
                )
                if covered < peaks:
                    print(f"missed: {name} at {tolerance:g}: {row | found[-1]}", file=sys.stderr)
            cells.append(f"{missed} of {total}")
        print(f"| {len(scenes)} {kind} | " + " | ".join(cells) + f" | {largest:.2f} |", flush=True)
    missed, total = (sum(row[key] for row in found) for key in ("missed", "peaks"))
    print(f"{missed} of {total} peaks missed")
    if options.json:
        options.json.write_text(json.dumps(found, indent=1))
    return 1 if missed else 0


if __name__ == "__main__":
    raise SystemExit(main())
