"""Pinocchio: its articulated-body algorithm in both conventions; SciPy's integrators around it."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.engines.base import Contestant, Field, Motion, Offer, Simulator
from benchmarks.machine import Array, Body, States, read_bodies
from benchmarks.timing import timed


def build(folder: Path) -> Field:
    pin: Any = import_module("pinocchio")
    model = _model(pin, folder)
    data = model.createData()
    states = States.read(folder / "pinocchio.states")

    def aba(convention: Any) -> Callable[[Array, Array, Array], Array]:
        return lambda q, v, tau: pin.aba(model, data, q, v, tau, convention)

    conventions = {"aba, world": pin.Convention.WORLD, "aba, local": pin.Convention.LOCAL}
    simulators = []
    if model.nq == model.nv:
        simulators = [
            _simulator(aba(pin.Convention.LOCAL), states, name) for name in ("DOP853", "LSODA")
        ]
    return Field(
        states,
        [Contestant(Offer(name), aba(convention)) for name, convention in conventions.items()],
        simulators,
    )


def _joint(pin: Any, body: Body) -> Any:
    """The joint that Pinocchio's own URDF reader takes."""
    if body.joint == "floating":
        return pin.JointModelFreeFlyer()
    letter = "R" if body.joint == "revolute" else "P"
    for k, name in enumerate("XYZ"):
        if np.array_equal(body.axis, np.eye(3)[k]):
            return getattr(pin, f"JointModel{letter}{name}")()
    general = {"R": pin.JointModelRevoluteUnaligned, "P": pin.JointModelPrismaticUnaligned}
    return general[letter](body.axis)


def _model(pin: Any, folder: Path) -> Any:
    gravity, bodies = read_bodies(folder)
    model = pin.Model()
    model.gravity.linear = np.array(gravity)
    ids: list[int] = []
    for k, body in enumerate(bodies):
        parent = ids[body.parent] if body.parent >= 0 else 0
        place = pin.SE3(body.rotation, body.translation)
        ids.append(model.addJoint(parent, _joint(pin, body), place, f"joint{k}"))
        inertia = pin.Inertia(body.mass, body.com, body.inertia)
        model.appendBodyToJoint(ids[-1], inertia, pin.SE3.Identity())
    return model


def _simulator(
    aba: Callable[[Array, Array, Array], Array], states: States, method: str
) -> Simulator:
    from scipy.integrate import solve_ivp

    nv = states.v.shape[1]
    tau = np.zeros(nv)

    def rates(_t: float, y: Array) -> Array:
        return np.concatenate([y[nv:], aba(y[:nv], y[nv:], tau)])

    def simulate(duration: float, setting: float) -> Motion:
        y0 = np.concatenate([states.q[0], states.v[0]])
        options = {"t_eval": [duration], "rtol": setting, "atol": setting}
        found, taken = timed(lambda: solve_ivp(rates, (0.0, duration), y0, method, **options))
        if not found.success:
            raise RuntimeError(str(found.message))
        return Motion(np.array(found.y[:nv, -1]), taken.cpu, int(found.nfev))

    return Simulator(f"SciPy {method}", False, simulate)
