"""Prints a number beside the one it must agree with, and ends the example where they disagree."""

from __future__ import annotations


def check(what: str, found: float, expected: float, tolerance: float, unit: str = "") -> None:
    """Print both numbers; stop the program unless they agree to `tolerance`, in their own unit."""
    error = abs(found - expected)
    verdict = "ok" if error <= tolerance else "WRONG"
    unit = f" {unit}" if unit else ""
    print(
        f"{what}: {found:.10g}{unit}, expected {expected:.10g}{unit} "
        f"(difference {error:.1e}, allowed {tolerance:.0e}): {verdict}"
    )
    if verdict != "ok":
        raise SystemExit(1)
