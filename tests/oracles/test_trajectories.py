"""Motions with published or closed-form end points, at three tolerances and by two methods.

The error after a time may exceed the tolerance by the motion's own sensitivity, which each case
states as `growth`: error <= growth * tolerance. It must also fall with the tolerance. Which steps
are taken, and with what sign of their errors, is partly chance: hence tolerances around each.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

import linkwise as lw
from helpers.machines import babyboot, free_body, pendulum, rod_chain, rod_tip
from helpers.motion import final_state, simulate

LOOSE_TO_TIGHT = (1e-5, 1e-7, 1e-9)
AROUND = (0.6, 0.8, 1.0, 1.25, 1.6)

# Kane's babyboot with the values of Drake's multibody benchmarks, from qA = 90 deg, qB = 1 deg at
# rest: qA and qB at 1, 2 ... 10 s [rad], by Taylor series of order 24 in 45 digits, to all digits
# given. Drake's value at 10 s differs by 2.4e-8 rad.
BABYBOOT_START = (np.pi / 2, np.radians(1.0))
BABYBOOT_PUBLISHED = np.radians((-61.312983340691, -929.47789677244))
BABYBOOT = np.array(
    [
        (1.422425923996257, 0.03466097959801376),
        (0.9848202489704399, 0.06830309055648509),
        (0.3846754758516676, -1.1104226172665556),
        (-0.18906009313734973, 0.6587953307870361),
        (-0.7888496681723979, -5.725053541771623),
        (-1.2249692214576042, -12.008378142927638),
        (-1.4699803714807321, -17.53160132288257),
        (-1.564937185415937, -22.96084978517267),
        (-1.4031533070356038, -17.153311992191462),
        (-1.0701134366014188, -16.222449647007137),
    ]
)


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
    growth: float = 10.0
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


def babyboot_case(time, **options):
    end = BABYBOOT[time - 1]
    return Case(
        f"babyboot {time} s", babyboot, time, end, lambda q, v: q, q0=BABYBOOT_START, **options
    )


CASES = [
    # Simple pendulum of 1 m let go at (-1, 0), as in the IFToMM benchmark A01; its period is
    # 4 K(sin 45 deg) / sqrt(g), Jacobi's sn gives the positions.
    *(
        swing(distance, *row, growth=10 * max(1.0, row[0]))
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
    tumble((1e-3, 1.0, 1e-3), 55.06168110659, (1e-3, 1.0, 1e-3), growth=200),
    tumble((0.1, 1.0, 0.1), 5.0, (-0.597270050276, 0.808250262631, 0.354368693575), growth=20),
    # Chaotic: over 2 s the tolerance's own digits, over 10 s what the growth of errors leaves.
    babyboot_case(2),
    babyboot_case(10, tolerances=(1e-8, 1e-10, 1e-12), growth=5e6),
]


def errors(case, method):
    model = case.build()
    for tolerance in np.multiply.outer(case.tolerances, AROUND).flat:
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
    found = np.reshape(list(errors(case, method)), (-1, len(AROUND)))
    for tolerance, around in zip(case.tolerances, found, strict=True):
        assert around.max() <= case.growth * tolerance + case.digits, found
    # Four decades of tolerance bring at least two and a half of accuracy.
    loosest, *_, tightest = np.median(found, axis=1)
    assert tightest <= 3e-3 * loosest + case.digits, found


@pytest.mark.parametrize("method", ["articulated_body", "constraint_force"])
def test_errors_of_the_babyboot_grow_as_its_disturbances_do(method):
    """At every second: what one disturbance of the start has grown to, times the tolerance."""
    model = babyboot()

    def angles(tolerance, twist=0.0):
        q0 = np.add(BABYBOOT_START, (0.0, twist))
        _, q, _ = simulate(model, 10.0, every=1.0, q0=q0, tolerance=tolerance, method=method)
        return q[1:]

    small = 1e-9
    grown = np.abs(angles(1e-13, small) - angles(1e-13)).max(axis=1) / small
    sensitivity = np.maximum.accumulate(grown)
    assert sensitivity[-1] > 1e5 * sensitivity[0]  # chaotic
    for tolerance in (1e-8, 1e-9, 1e-10, 1e-11, 1e-12):
        error = np.abs(angles(tolerance) - BABYBOOT).max(axis=1)
        assert np.all(error <= 10 * tolerance * sensitivity), (error / tolerance, sensitivity)
    np.testing.assert_allclose(BABYBOOT[-1], BABYBOOT_PUBLISHED, rtol=0, atol=3e-8)
    np.testing.assert_allclose(angles(1e-13)[-1], BABYBOOT_PUBLISHED, rtol=0, atol=1e-6)


def test_the_babyboot_keeps_its_energy():
    """To the 7e-13 J of the published run."""
    model = babyboot()
    _, q, v = simulate(model, 10.0, every=0.1, q0=BABYBOOT_START, tolerance=1e-13)
    energy = lw.kinetic_energy(model, q, v) + lw.potential_energy(model, q)
    assert np.abs(energy - energy[0]).max() < 7e-13
