"""Machines whose motion is published, and where they start; most have closed loops."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from linkwise._core import InputError, ModelBuilder
from linkwise.scenes.chain import check_bodies, check_count

if TYPE_CHECKING:
    from linkwise._core import Model

Array = npt.NDArray[np.float64]
_DOWN = (0.0, -9.81, 0.0)
_Z = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Benchmark:
    """A machine, where it starts, and what drives it.

    model: the machine; q0: (nq,) [rad, m]; v0: (nv,) [rad/s, m/s]; drives: for `simulate`, per
    joint a torque [N m] or a function of time, the joint's coordinate and its rate.
    """

    model: Model
    q0: Array
    v0: Array
    drives: dict[str, float | Callable[[float, Array, Array], Any]] = field(default_factory=dict)


def benchmark(name: str, *, n: int = 2) -> Benchmark:
    """A machine of the literature on closed loops, as published.

    name:
        "pendulum" (A01 of the IFToMM benchmarks): a point mass of 1 kg on a rod of 1 m without
        mass, let go at (-1, 0);
        "four_bars" (A02): n four-bar linkages in a row, of rods of 1 m and 1 kg, upright, moving
        to the right at 1 m/s;
        "andrews" (A03, and the test set for IVP solvers): Andrews' squeezing mechanism, seven
        bodies and a spring [hairer1996];
        "bricard" (A04): Bricard's six hinges, whose axes let five rods move although counting says
        that they cannot;
        "flyball_governor" (A05): Watt's governor, whose slider hangs on two stiff springs and
        dampers; its shaft starts at 2 pi rad/s;
        "slider_crank": the rigid slider-crank of [simeon1996], its crank at 150 rad/s;
        "stewart": a platform of 100 kg on six legs, each universal, prismatic and spherical;
        "biped": a pelvis on two legs in flight, hip of three axes and knee, whose feet two cranks
        on each shank turn by two rods, as many walking robots have them, in round numbers.
    n: linkages of "four_bars".

    "A01" to "A05" are names of the same machines.

    A planar machine moves in x, y. Every joint that closes a loop is closed where it starts.
    Raises InputError for another name or n, MemoryError where there is no room for n.
    """
    check_count("n", n)
    check_bodies(2 * n + 1)
    name = _NUMBERED.get(name, name)
    if name not in _MAKERS:
        raise InputError(f"benchmark {name!r:.60} is unknown; known: {', '.join(_MAKERS)}")
    return four_bars(n) if name == "four_bars" else _MAKERS[name]()


def pendulum() -> Benchmark:
    builder = ModelBuilder("pendulum", gravity=_DOWN)
    builder.add_link("ground")
    builder.add_link("bob", mass=1.0, com=(-1, 0, 0))
    builder.add_joint("pin", "revolute", "ground", "bob", axis=_Z)
    return _at_rest(builder.build())


def _thin(axis: int, mass: float, length: float, width: float = 0.0) -> Array:
    """Central inertia (3, 3) [kg m2] of a bar along an axis with a square section."""
    across = mass * (length**2 + width**2) / 12
    moments = [across, across, across]
    moments[axis] = mass * width**2 / 6
    return np.diag(moments)


def four_bars(n: int) -> Benchmark:
    """Drawn upright, where q is zero."""
    builder = ModelBuilder("four_bars", gravity=_DOWN)
    builder.add_link("ground")
    width = 0.1  # has no part in a planar motion, but bodies have inertia about each axis
    upright, lying = _thin(1, 1.0, 1.0, width), _thin(0, 1.0, 1.0, width)
    upright[2, 2] = lying[2, 2] = 1 / 12  # that of a thin rod
    rates: dict[str, float] = {}
    for k in range(n + 1):
        rod, bar = f"rod_{k}", f"bar_{k}"
        builder.add_link(rod, mass=1.0, com=(0, 0.5, 0), inertia=upright)
        builder.add_joint(f"A{k}", "revolute", "ground", rod, translation=(k, 0, 0), axis=_Z)
        rates[f"A{k}"] = -1.0
        if k < n:
            builder.add_link(bar, mass=1.0, com=(0.5, 0, 0), inertia=lying)
            builder.add_joint(f"B{k}", "revolute", rod, bar, translation=(0, 1, 0), axis=_Z)
            rates[f"B{k}"] = 1.0
        if k > 0:
            builder.add_loop(
                f"C{k}",
                "revolute",
                rod,
                f"bar_{k - 1}",
                translation=(0, 1, 0),
                child_translation=(1, 0, 0),
                axis=_Z,
            )
    return _moving(builder.build(), {}, rates)


#: [hairer1996], section VII.7: lengths [m] and what turns with them.
_A, _B, _C = (-0.06934, -0.00227), (-0.03635, 0.03273), (0.014, 0.072)
#: Per body its joint, what it hangs on, where, mass [kg], centre of mass [m], inertia about it, and
#: the joint's angle at the start.
_ANDREWS: tuple[tuple[str, str, str, Any, float, Any, float, float], ...] = (
    ("beta", "ground", "K1", (0, 0), 0.04325, (0.00092, 0), 2.194e-6, -0.06171389001427645),
    ("Theta", "K1", "K2", (0.007, 0), 0.00365, (-0.0115, 0), 4.410e-7, 0.0),
    ("gamma", "ground", "K3", _B, 0.02373, (0.01043, -0.01874), 5.255e-6, 0.4552798191630704),
    ("delta", "ground", "K5", _A, 0.07050, (0.02308, 0.00916), 1.169e-5, 0.48736497954384255),
    ("Phi", "K5", "K4", (0.04, 0), 0.00706, (0, -0.00579), 5.667e-7, 0.22266839016588588),
    ("epsilon", "ground", "K7", _A, 0.05498, (-0.00449, -0.01228), 1.912e-5, 1.2305474445498212),
    ("Omega", "K7", "K6", (0, -0.04), 0.00706, (0.00579, 0), 5.667e-7, -0.22266839016588588),
)
#: Where the bodies end that meet K2 at its end.
_ANDREWS_ENDS = {"K3": (0.0, -0.035), "K4": (0.0, -0.02), "K6": (0.02, 0.0)}


def andrews() -> Benchmark:
    builder = ModelBuilder("andrews", gravity=(0, 0, 0))
    builder.add_link("ground")
    start = {}
    for joint, parent, body, at, mass, center, inertia, angle in _ANDREWS:
        builder.add_link(body, mass=mass, com=(*center, 0), inertia=np.eye(3) * inertia)
        builder.add_joint(joint, "revolute", parent, body, translation=(*at, 0), axis=_Z)
        start[joint] = angle
    for body, end in _ANDREWS_ENDS.items():
        builder.add_loop(
            f"K2_{body}",
            "revolute",
            "K2",
            body,
            translation=(-0.028, 0, 0),
            child_translation=(*end, 0),
            axis=_Z,
        )
    made = _moving(builder.build(), start, {})
    return Benchmark(made.model, made.q0, made.v0, {"beta": 0.033, "gamma": _andrews_spring})


def _andrews_spring(time: float, position: Array, velocity: Array) -> float:
    """Torque [N m] about B of the spring from C to a point of K3."""
    s, c = np.sin(position[0]), np.cos(position[0])
    arm = np.array([0.02 * c + 0.018 * s, 0.02 * s - 0.018 * c])
    pull = np.array(_C) - _B - arm
    length = np.hypot(*pull)
    force = pull * (4530 * (length - 0.07785) / length)
    return float(arm[0] * force[1] - arm[1] * force[0])


def bricard() -> Benchmark:
    """Drawn where it starts, at rest; P0 and P5 are on the ground."""
    points = np.array(
        [(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)], dtype=float
    )
    along = np.roll(points, -1, axis=0) - points  # e_i, from P_i to the next
    builder = ModelBuilder("bricard", gravity=_DOWN)
    builder.add_link("ground")
    for i in range(5):
        rod, before = f"rod_{i}", f"rod_{i - 1}" if i else "ground"
        axis = int(np.argmax(np.abs(along[i])))
        inertia = _thin(axis, 1.0, 1.0, 0.1)
        builder.add_link(rod, mass=1.0, com=along[i] / 2, inertia=inertia)
        hinge = np.cross(along[i - 1], along[i])
        where = along[i - 1] if i else points[0]
        builder.add_joint(f"P{i}", "revolute", before, rod, translation=where, axis=hinge)
    builder.add_loop(
        "P5",
        "revolute",
        "rod_4",
        "ground",
        translation=along[4],
        child_translation=points[5],
        axis=np.cross(along[4], along[5]),
    )
    return _at_rest(builder.build())


def flyball_governor() -> Benchmark:
    """Drawn where it starts, the shaft along z; bars of a square section of 1 cm, 3,000 kg/m3."""
    builder = ModelBuilder("flyball_governor")
    builder.add_link("ground")
    bar, ball, length, width = 0.3, 5.0, 1.0, 0.01
    builder.add_link("shaft", mass=bar, com=(0, 0, 0.5), inertia=_thin(2, bar, length, width))
    builder.add_joint("bearing", "revolute", "ground", "shaft", axis=_Z)
    builder.add_link("slider", mass=3.0, inertia=np.eye(3) * 3.0 * 0.1**2 / 6)
    builder.add_joint("guide", "prismatic", "shaft", "slider", translation=(0, 0, 0.5), axis=_Z)
    sunk = np.deg2rad(30)
    for name, side in (("right", 1.0), ("left", -1.0)):
        along = np.array([side * np.cos(sunk), 0, -np.sin(sunk)])
        across = np.eye(3) - np.outer(along, along)
        center = (bar * length / 2 + ball * length) / (bar + ball)
        moments = bar * (length**2 + width**2) / 12 * across
        moments += bar * width**2 / 6 * np.outer(along, along)
        moments += (bar * (center - length / 2) ** 2 + ball * (center - length) ** 2) * across
        arm, hinge = f"{name}_arm", (side * 0.05, 0, 1.0)
        builder.add_link(arm, mass=bar + ball, com=center * along, inertia=moments)
        builder.add_joint(
            f"{name}_hinge", "revolute", "shaft", arm, translation=hinge, axis=(0, 1, 0)
        )
        builder.add_spring(
            f"{name}_spring",
            "slider",
            arm,
            length=0.5,
            point=(side * 0.05, 0, 0),
            child_point=length / 2 * along,
            stiffness=8e5,
            damping=4e4,
        )
    return _moving(builder.build(), {}, {"bearing": 2 * np.pi})


def slider_crank() -> Benchmark:
    """Stretched out along x; without gravity, as published."""
    crank, rod = 0.15, 0.30
    builder = ModelBuilder("slider_crank", gravity=(0, 0, 0))
    builder.add_link("ground")
    for name, mass, center, moment in (
        ("crank", 0.36, crank / 2, 0.002727),
        ("rod", 0.151104, rod / 2, 0.0045339259),
        ("slider", 0.075552, 0.0, 1e-4),
    ):
        builder.add_link(name, mass=mass, com=(center, 0, 0), inertia=np.eye(3) * moment)
    builder.add_joint("crank_pin", "revolute", "ground", "crank", axis=_Z)
    builder.add_joint("knee", "revolute", "crank", "rod", translation=(crank, 0, 0), axis=_Z)
    builder.add_joint(
        "guide", "prismatic", "ground", "slider", translation=(crank + rod, 0, 0), axis=(1, 0, 0)
    )
    builder.add_loop("wrist", "revolute", "slider", "rod", child_translation=(rod, 0, 0), axis=_Z)
    crank_rate = 150.0
    rates = {"crank_pin": crank_rate, "knee": -crank_rate * (1 + crank / rod)}
    return _moving(builder.build(), {}, rates)


def stewart() -> Benchmark:
    """Drawn where it starts, its platform level at 1 m; legs of 5 kg below and 3 kg above."""
    builder = ModelBuilder("stewart")
    builder.add_link("ground")
    pairs = np.repeat(np.arange(3) * 2 * np.pi / 3, 2)
    side = np.tile([-1.0, 1.0], 3)
    feet = _ring(1.0, pairs + side * 0.2, 0.0)
    heads = _ring(0.6, pairs + side * (np.pi / 3 - 0.2), 1.0)
    corners = heads - (0, 0, 1)  # from the platform's centre
    moments = np.diag([9.0, 9.0, 18.0])
    builder.add_link("platform", mass=100.0, com=-corners[0], inertia=moments)
    for i, (foot, head) in enumerate(zip(feet, heads, strict=True)):
        length = float(np.linalg.norm(head - foot))
        tube, piston = f"tube_{i}", f"piston_{i}"
        turned = _along(head - foot)
        builder.add_link(tube, mass=5.0, com=(0, 0, 0.3), inertia=_thin(2, 5.0, 0.6, 0.06))
        builder.add_link(piston, mass=3.0, com=(0, 0, -0.3), inertia=_thin(2, 3.0, 0.6, 0.04))
        builder.add_joint(
            f"foot_{i}",
            "universal",
            "ground",
            tube,
            translation=foot,
            rotation=turned,
            axes=[(1, 0, 0), (0, 1, 0)],
        )
        builder.add_joint(
            f"leg_{i}", "prismatic", tube, piston, translation=(0, 0, length), axis=_Z
        )
        if i == 0:
            builder.add_joint("head_0", "spherical", piston, "platform", rotation=turned.T)
        else:
            builder.add_loop(
                f"head_{i}",
                "spherical",
                piston,
                "platform",
                rotation=turned.T,
                child_translation=corners[i] - corners[0],
            )
    return _at_rest(builder.build())


#: Of each leg, hip to foot: joint, its axes, height on the body before [m], mass [kg], height of
#: its centre [m], length [m].
_LEG: tuple[tuple[str, list[tuple[float, float, float]], float, float, float, float], ...] = (
    ("hip_yaw", [_Z], 0.0, 1.0, 0.0, 0.1),
    ("hip_roll", [(1, 0, 0)], 0.0, 1.0, 0.0, 0.1),
    ("hip_pitch", [(0, 1, 0)], 0.0, 5.0, -0.15, 0.4),
    ("knee", [(0, 1, 0)], -0.4, 3.0, -0.15, 0.4),
    ("ankle", [(0, 1, 0), (1, 0, 0)], -0.4, 1.0, -0.05, 0.1),
)
_BIPED_RATES = {"hip_yaw": 0.5, "hip_roll": -0.3, "hip_pitch": 1.0, "knee": -1.5}


def biped() -> Benchmark:
    """Drawn upright, with cranks level and rods along the shank; the legs swing apart."""
    builder = ModelBuilder("biped")
    builder.add_link("ground")
    builder.add_link("pelvis", mass=15.0, com=(0, 0, 0.1), inertia=np.diag([0.2, 0.15, 0.2]))
    builder.add_joint("pelvis", "floating", "ground", "pelvis", translation=(0, 0, 0.9))
    rates: dict[str, float] = {}
    for side, name in ((1.0, "left"), (-1.0, "right")):
        inner = "pelvis"
        for joint, axes, below, mass, center, length in _LEG:
            body, at = f"{name}_{joint}_link", (0, 0.1 * side if inner == "pelvis" else 0, below)
            inertia = _thin(2, mass, length, 0.1)
            builder.add_link(body, mass=mass, com=(0, 0, center), inertia=inertia)
            _turn(builder, f"{name}_{joint}", inner, body, at, axes)
            inner = body
        for end in ("inner", "outer"):
            _add_ankle_rod(builder, name, end, 0.05 if end == "outer" else -0.05)
        rates |= {f"{name}_{joint}": side * rate for joint, rate in _BIPED_RATES.items()}
    return _moving(builder.build(), {}, rates)


def _add_ankle_rod(builder: ModelBuilder, leg: str, end: str, y: float) -> None:
    """A motor's crank on the shank, 0.3 m above the ankle, and the rod from it to the heel."""
    crank, rod = f"{leg}_{end}_crank", f"{leg}_{end}_rod"
    builder.add_link(crank, mass=0.2, com=(-0.025, 0, 0), inertia=np.diag([1e-4, 2e-4, 2e-4]))
    _turn(builder, crank, f"{leg}_knee_link", crank, (0, y, -0.1), [(0, 1, 0)])
    builder.add_link(rod, mass=0.1, com=(0, 0, -0.15), inertia=_thin(2, 0.1, 0.3, 0.01))
    _turn(builder, rod, crank, rod, (-0.05, 0, 0), [(0, 1, 0), (1, 0, 0)])
    builder.add_loop(
        f"{leg}_{end}_heel",
        "spherical",
        f"{leg}_ankle_link",
        rod,
        translation=(-0.05, y, 0),
        child_translation=(0, 0, -0.3),
    )


def _turn(
    builder: ModelBuilder,
    name: str,
    parent: str,
    child: str,
    at: tuple[float, float, float],
    axes: list[tuple[float, float, float]],
) -> None:
    """A hinge, or a universal joint of two axes."""
    if len(axes) == 1:
        builder.add_joint(name, "revolute", parent, child, translation=at, axis=axes[0])
    else:
        builder.add_joint(name, "universal", parent, child, translation=at, axes=axes)


def _ring(radius: float, angles: Array, height: float) -> Array:
    """Points (n, 3) of a circle about z."""
    return np.stack(
        [radius * np.cos(angles), radius * np.sin(angles), np.full(len(angles), height)], axis=1
    )


def _along(direction: Array) -> Array:
    """A rotation (3, 3) whose z is this direction."""
    z = direction / np.linalg.norm(direction)
    x = np.cross((0.0, 1.0, 0.0), z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def _at_rest(model: Model) -> Benchmark:
    return _moving(model, {}, {})


def _moving(model: Model, angles: dict[str, float], rates: dict[str, float]) -> Benchmark:
    """The machine with coordinates and rates by joint; what is not named is at its zero."""
    q0, v0 = np.array(model.initial_configuration()), np.zeros(model.nv)
    for joint, angle in angles.items():
        q0[model.q_slice(joint)] = angle
    for joint, rate in rates.items():
        v0[model.v_slice(joint)] = rate
    return Benchmark(model, q0, v0)


_MAKERS: dict[str, Callable[..., Benchmark]] = {
    "pendulum": pendulum,
    "four_bars": four_bars,
    "andrews": andrews,
    "bricard": bricard,
    "flyball_governor": flyball_governor,
    "slider_crank": slider_crank,
    "stewart": stewart,
    "biped": biped,
}
#: What the IFToMM benchmarks call them.
_NUMBERED = dict(zip(("A01", "A02", "A03", "A04", "A05"), tuple(_MAKERS)[:5], strict=True))
