"""Space manipulators of the literature, on a fixed base, without gravity unless asked for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from linkwise._core import ModelBuilder
from linkwise.scenes.chain import check_size

if TYPE_CHECKING:
    from linkwise._core import Model

WEIGHTLESS = (0.0, 0.0, 0.0)


class _Segment(NamedTuple):
    """A body along x, its inertia about its inboard joint, and that joint."""

    joint: str
    axis: tuple[int, int, int]
    torque: float
    mass: float
    length: float
    inertia: tuple[float, float, float]


# [nguyen1994]: Shuttle Remote Manipulator System. Only inertias about the joint frames are
# published, no first moments, so every centre of mass is taken at the joint.
_SRMS = (
    _Segment("base", (0, 0, 0), np.inf, 63.24, 0.5172, (3.664, 3.803, 0.686)),
    _Segment("shoulder_yaw", (0, 0, 1), 1570, 32.12, 0.3048, (1.115, 1.417, 0.595)),
    _Segment("shoulder_pitch", (0, 1, 0), 1570, 139.35, 6.377, (3.225, 998.63, 997.18)),
    _Segment("elbow_pitch", (0, 1, 0), 1074, 87.42, 7.06, (1.59, 632.9, 632.51)),
    _Segment("wrist_pitch", (0, 1, 0), 470, 8.48, 0.4572, (0.0893, 0.402, 0.402)),
    _Segment("wrist_yaw", (0, 0, 1), 470, 45.94, 0.762, (0.408, 4.68, 4.68)),
    _Segment("wrist_roll", (1, 0, 0), 470, 45.21, 0.6604, (1.903, 3.816, 2.823)),
)

# [nguyen1994]: Space Station Remote Manipulator System, same remarks.
_SSRMS = (
    _Segment("base", (0, 0, 0), np.inf, 243.66, 1.3589, (9.336, 44.413, 44.413)),
    _Segment("shoulder_roll", (1, 0, 0), np.inf, 105.98, 0.7026, (12.19, 12.13, 3.061)),
    _Segment("shoulder_yaw", (0, 0, 1), np.inf, 105.98, 0.5692, (8.088, 3.061, 8.446)),
    _Segment("shoulder_pitch", (0, 1, 0), np.inf, 314.88, 7.11, (15.41, 2094.71, 2103.19)),
    _Segment("elbow_pitch", (0, 1, 0), np.inf, 279.2, 7.11, (9.522, 1966.28, 1966.28)),
    _Segment("wrist_pitch", (0, 1, 0), np.inf, 105.98, 0.5692, (8.305, 3.061, 8.0386)),
    _Segment("wrist_yaw", (0, 0, 1), np.inf, 105.98, 0.7026, (12.13, 12.13, 3.061)),
    _Segment("wrist_roll", (1, 0, 0), np.inf, 243.66, 1.3589, (9.336, 44.41, 44.41)),
)


def srms(
    payload_mass: float = 0.0, *, payload_size: float = 1.0, gravity: Sequence[float] = WEIGHTLESS
) -> Model:
    """The Space Shuttle's arm: six joints, 15 m, torque limits as effort limits [nguyen1994].

    Args:
        payload_mass: of a uniform cube gripped at the tip [kg]; 0: none.
        payload_size: edge of the cube [m].
        gravity: (3,) [m/s2].
    """
    return _arm("srms", _SRMS, payload_mass, payload_size, gravity)


def ssrms(
    payload_mass: float = 0.0, *, payload_size: float = 1.0, gravity: Sequence[float] = WEIGHTLESS
) -> Model:
    """The Space Station's arm: seven joints, 17 m [nguyen1994]. Arguments as in :func:`srms`."""
    return _arm("ssrms", _SSRMS, payload_mass, payload_size, gravity)


def _arm(
    name: str,
    segments: Sequence[_Segment],
    payload_mass: float,
    payload_size: float,
    gravity: Sequence[float],
) -> Model:
    check_size("payload_mass", payload_mass, least=0.0)
    check_size("payload_size", payload_size)
    builder = ModelBuilder(name, gravity=gravity)
    for i, s in enumerate(segments):
        builder.add_link(_link(s), mass=s.mass, inertia=np.diag(s.inertia))
        if i > 0:
            previous = segments[i - 1]
            builder.add_joint(
                s.joint,
                "revolute",
                _link(previous),
                _link(s),
                translation=(previous.length, 0, 0),
                axis=s.axis,
                effort=s.torque,
            )
    if payload_mass > 0:
        cube = np.eye(3) * payload_mass * payload_size**2 / 6
        builder.add_link("payload", mass=payload_mass, com=(payload_size / 2, 0, 0), inertia=cube)
        tip = segments[-1]
        builder.add_joint("grip", "fixed", _link(tip), "payload", translation=(tip.length, 0, 0))
    return builder.build()


def _link(segment: _Segment) -> str:
    return f"{segment.joint}_link" if segment.joint != "base" else "base"


def srms_3l5d(*, gravity: Sequence[float] = WEIGHTLESS) -> Model:
    """Stand-in for the manipulator of [sharf1993]: 3 links, 5 degrees of freedom (SRMS-3L5D).

    Uniform solid rods along x with the lengths and masses of the Shuttle's arm [nguyen1994].
    Shoulder yaw and pitch are one universal joint, elbow pitch a revolute one, wrist pitch and yaw
    universal again: A f = b has 4 + 5 + 4 = 13 unknowns.
    q = (yaw, pitch, elbow, wrist pitch, wrist yaw).
    """
    builder = ModelBuilder("srms_3l5d", gravity=gravity)
    builder.add_link("base")
    rods = (
        ("upper_arm", 6.377, 139.35, 0.17),
        ("lower_arm", 7.06, 87.42, 0.17),
        ("hand", 1.88, 99.63, 0.20),
    )
    for name, length, mass, radius in rods:
        across = mass * (3 * radius**2 + length**2) / 12
        inertia = np.diag([mass * radius**2 / 2, across, across])
        builder.add_link(name, mass=mass, com=(length / 2, 0, 0), inertia=inertia)
    yaw, pitch = (0, 0, 1), (0, 1, 0)
    builder.add_joint("shoulder", "universal", "base", "upper_arm", axes=[yaw, pitch])
    builder.add_joint(
        "elbow", "revolute", "upper_arm", "lower_arm", translation=(6.377, 0, 0), axis=pitch
    )
    builder.add_joint(
        "wrist", "universal", "lower_arm", "hand", translation=(7.06, 0, 0), axes=[pitch, yaw]
    )
    return builder.build()
