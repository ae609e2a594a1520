"""The stand-in of the 1993 paper's arm (SRMS-3L5D): inverse-dynamics torques of two manoeuvres,
and the end points that they reach open loop [Sharf & D'Eleuterio 1993; Nguyen & Hughes 1994]."""

import numpy as np
import pytest

import linkwise as lw
from helpers.machines import srms_3l5d
from helpers.motion import final_state

T = 10.0
START = {"planar": (0.0, -0.3, 0.5, -0.2, 0.0), "spatial": (0.2, -0.3, 0.5, -0.2, 0.15)}
END = {"planar": (0.0, -0.8, 1.2, 0.5, 0.0), "spatial": (1.0, -0.8, 1.2, 0.5, 0.6)}
TORQUES = [  # N m, good to one unit of the last digit
    ("planar", 2.5, (0, -248.335, -45.900, -1.568, 0)),
    ("spatial", 2.5, (1434.36, -269.245, -25.997, -0.997, 70.330)),
    ("spatial", 5.0, (-332.687, -84.312, 152.078, 17.644, -1.882)),
    ("spatial", 7.5, (-1171.35, 219.757, 3.676, -7.377, -61.717)),
]


def profile(manoeuvre, t):
    """q, rates and accelerations: s = t/T - sin(2 pi t/T)/(2 pi) from start to end."""
    start, end = np.array(START[manoeuvre]), np.array(END[manoeuvre])
    phase = 2 * np.pi * t / T
    s = t / T - np.sin(phase) / (2 * np.pi)
    rate, acceleration = (1 - np.cos(phase)) / T, 2 * np.pi * np.sin(phase) / T**2
    return start + s * (end - start), rate * (end - start), acceleration * (end - start)


@pytest.mark.parametrize(("manoeuvre", "t", "expected"), TORQUES)
def test_torques(manoeuvre, t, expected):
    torque = lw.inverse_dynamics(srms_3l5d(), *profile(manoeuvre, t))
    for ours, given in zip(torque, expected, strict=True):
        assert abs(ours - given) <= (1e-2 if abs(given) > 1000 else 1e-3)


@pytest.mark.parametrize("manoeuvre", START)
@pytest.mark.parametrize("method", ["articulated_body", "constraint_force"])
def test_open_loop_end_point(manoeuvre, method):
    model = srms_3l5d()

    def drive(joint):
        at = model.v_slice(joint)
        return lw.Torque(lambda t, q, v: lw.inverse_dynamics(model, *profile(manoeuvre, t))[at])

    def miss(tolerance):
        q, _ = final_state(
            model,
            T,
            q0=START[manoeuvre],
            drives={joint: drive(joint) for joint in model.joint_names},
            tolerance=tolerance,
            method=method,
        )
        return np.abs(q - END[manoeuvre]).max()

    # Which steps are taken, and with what sign of their errors, is partly chance.
    around = np.array([0.6, 0.8, 1.0, 1.25, 1.6])
    coarse, fine = [miss(t) for t in 1e-5 * around], [miss(t) for t in 1e-9 * around]
    assert max(coarse) <= 10 * 1e-5
    assert miss(1e-6) <= 10 * 1e-6
    assert max(fine) <= 100 * 1e-9
    # Four decades of tolerance bring at least two and a half of accuracy.
    assert np.median(fine) <= 3e-3 * np.median(coarse)
