"""MuJoCo: `mj_forward` without contacts, constraints and sensors; its Runge-Kutta of order 4."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import coordinates
from benchmarks.engines.base import Contestant, Field, Motion, Offer, Simulator
from benchmarks.machine import Array, States, read_bodies
from benchmarks.timing import timed


def build(folder: Path) -> Field:
    mujoco: Any = import_module("mujoco")
    gravity, bodies = read_bodies(folder)
    model = compiled_model(mujoco, gravity, bodies)
    mujoco.mj_saveModel(model, str(folder / "mujoco.mjb"))
    ours = States.read(folder / "linkwise.states")
    floating = bodies[0].joint == "floating"
    states = coordinates.to_mujoco(ours) if floating else ours
    states.write(folder / "mujoco.states")
    data = mujoco.MjData(model)

    def forward(q: Array, v: Array, tau: Array) -> Array:
        data.qpos, data.qvel, data.qfrc_applied = q, v, tau
        mujoco.mj_forward(model, data)
        return np.asarray(data.qacc)

    field = Field(states, [Contestant(Offer("mj_forward"), forward)])
    if floating:
        field.to_ours = lambda a: coordinates.from_mujoco(ours, a)
    else:
        field.simulators.append(_simulator(mujoco, model, states))
    return field


def compiled_model(mujoco: Any, gravity: tuple[float, ...], bodies: list[Any]) -> Any:
    kinds = {
        "revolute": mujoco.mjtJoint.mjJNT_HINGE,
        "prismatic": mujoco.mjtJoint.mjJNT_SLIDE,
        "floating": mujoco.mjtJoint.mjJNT_FREE,
    }
    spec = mujoco.MjSpec()
    spec.option.gravity = gravity
    flags = mujoco.mjtDisableBit
    spec.option.disableflags = int(
        flags.mjDSBL_CONSTRAINT | flags.mjDSBL_CONTACT | flags.mjDSBL_SENSOR
    )
    made: list[Any] = []
    for k, body in enumerate(bodies):
        parent = made[body.parent] if body.parent >= 0 else spec.worldbody
        quaternion = np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, body.rotation.ravel())
        element = parent.add_body(name=f"body{k}", pos=body.translation, quat=quaternion)
        element.explicitinertial = True
        element.mass, element.ipos = body.mass, body.com
        element.fullinertia = body.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        joint = {} if body.joint == "floating" else {"axis": body.axis}
        element.add_joint(type=kinds[body.joint], **joint)
        made.append(element)
    return spec.compile()


def _simulator(mujoco: Any, model: Any, states: States) -> Simulator:
    def simulate(duration: float, setting: float) -> Motion:
        steps = max(1, round(duration / setting))
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
        model.opt.timestep = duration / steps
        data = mujoco.MjData(model)
        data.qpos, data.qvel = states.q[0], states.v[0]
        _, taken = timed(lambda: mujoco.mj_step(model, data, nstep=steps))
        return Motion(np.array(data.qpos), taken.cpu, 4 * steps)

    return Simulator("RK4", True, simulate)
