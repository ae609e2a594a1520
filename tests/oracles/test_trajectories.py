"""Motions with published or closed-form end points, at three tolerances and by two methods.

The error after a time may exceed the tolerance by the motion's own sensitivity, which each case
states as `growth`: error <= growth * tolerance. It must also fall with the tolerance.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from helpers.machines import babyboot, free_body, pendulum, rod_chain, rod_tip
from helpers.motion import final_state

LOOSE_TO_TIGHT = (1e-5, 1e-7, 1e-9)


@dataclass(frozen=True)
class Case:
    name: str
    build: Callable
    time: float
    expected: tuple
    observe: Callable
    q0: tuple | None = None
    v0: tuple | None = None
    tolerances: tuple = LOOSE_TO_TIGHT
    growth: float = 100.0
    digits: float = 2e-12  # to which the expected values are known
    recursion_only: bool = False  # a point mass has no inverse inertia; the plate is its equal


def position(q, v):
    return np.r_[np.cos(q[0]), np.sin(q[0])]


def tip(q, v):
    return rod_tip(q)


def spin(q, v):
    return v[3:]


def swing(distance, time, expected, **options):
    point = distance == 1.0
    name = f"pendulum {'point' if point else 'plate'} {time:.3g} s"
    build = lambda: pendulum(distance)  # noqa: E731
    return Case(name, build, time, expected, position, q0=(np.pi,), recursion_only=point, **options)


def rods(n, time, expected, **options):
    return Case(f"{n} rods {time} s", lambda: rod_chain(n), time, expected, tip, **options)


def tumble(w0, time, expected, **options):
    v0 = (0.0, 0.0, 0.0, *w0)
    return Case(f"free body {w0} {time:.3g} s", free_body, time, expected, spin, v0=v0, **options)


CASES = [
    # Simple pendulum of 1 m let go at (-1, 0), as in the IFToMM benchmark A01; its period is
    # 4 K(sin 45 deg) / sqrt(g), Jacobi's sn gives the positions.
    *(
        swing(distance, *row, growth=100 * max(1.0, row[0]))
        for distance in (1.0, 0.6)
        for row in [
            (1.0, (0.986291751131875, -0.165010853125541)),
            (2.36784194757624, (-1.0, 0.0)),
            (5.0, (-0.942305435043757, -0.334754338414001)),
            (10.0, (-0.275087462576117, -0.961419205099125)),
        ]
    ),
    # Uniform rods let go horizontally: tips by DOP853 at 1e-13 on an independent recursion.
    rods(2, 1.0, (-1.662115135816, -1.041466637193)),
    rods(2, 2.0, (0.313524776450, -1.914746617562)),
    rods(4, 1.0, (-1.001231213963, -3.607961551270)),
    rods(4, 2.0, (-3.458328190813, -0.360124130094)),
    rods(8, 2.0, (-7.053037104546, -3.715189421428)),
    rods(16, 2.0, (-4.237321684486, -13.655358748431)),
    rods(32, 1.0, (30.530246507830, -4.905000000057)),
    rods(32, 2.0, (20.786156943233, -19.620593568616)),
    # Euler's equations for I = (1, 2, 3) near the middle axis; the period is that of sn(t).
    tumble((1e-3, 1.0, 1e-3), 10.0, (-0.117326383720, 0.993093912822, 0.067743339935)),
    tumble((1e-3, 1.0, 1e-3), 55.06168110659, (1e-3, 1.0, 1e-3), growth=1000),
    tumble((0.1, 1.0, 0.1), 5.0, (-0.597270050276, 0.808250262631, 0.354368693575)),
    # Chaotic: Kane's babyboot with the values of Drake's multibody benchmarks.
    Case(
        "babyboot 10 s",
        babyboot,
        10.0,
        (np.radians(-61.312983340691), np.radians(-929.47789677244)),
        lambda q, v: q,
        q0=(np.pi / 2, np.radians(1.0)),
        tolerances=(1e-7, 1e-9, 1e-11),
        growth=5e7,
        digits=1e-8,
    ),
]


def errors(case, method):
    model = case.build()
    for tolerance in case.tolerances:
        q, v = final_state(
            model, case.time, q0=case.q0, v0=case.v0, tolerance=tolerance, method=method
        )
        yield float(np.abs(case.observe(q, v) - case.expected).max())


@pytest.mark.parametrize(
    ("case", "method"),
    [
        pytest.param(case, method, id=f"{case.name}-{method}".replace(" ", "_"))
        for case in CASES
        for method in ("articulated_body", "constraint_force")
        if not (case.recursion_only and method == "constraint_force")
    ],
)
def test_end_point(case, method):
    found = list(errors(case, method))
    for tolerance, error in zip(case.tolerances, found, strict=True):
        assert error <= case.growth * tolerance + case.digits, found
    # Four decades of tolerance bring at least two and a half of accuracy.
    assert found[-1] <= 3e-3 * found[0] + case.digits, found
