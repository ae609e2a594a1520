"""DART: articulated bodies of a Skeleton."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import coordinates
from benchmarks.engines.base import Contestant, Field, Offer
from benchmarks.machine import Array, States, read_bodies


def build(folder: Path) -> Field:
    dart: Any = import_module("dartpy")
    gravity, bodies = read_bodies(folder)
    skeleton = _skeleton(dart, gravity, bodies)
    ours = States.read(folder / "linkwise.states")
    floating = bodies[0].joint == "floating"
    states = coordinates.to_dart(ours) if floating else ours

    def forward(q: Array, v: Array, tau: Array) -> Array:
        skeleton.setPositions(q)
        skeleton.setVelocities(v)
        skeleton.setForces(tau)
        skeleton.computeForwardDynamics()
        return np.asarray(skeleton.getAccelerations())

    field = Field(states, [Contestant(Offer("aba"), forward)])
    if floating:
        field.to_ours = lambda a: coordinates.from_dart(ours, a)
    return field


def _skeleton(dart: Any, gravity: tuple[float, ...], bodies: list[Any]) -> Any:
    skeleton = dart.dynamics.Skeleton("machine")
    skeleton.setGravity(np.array(gravity))
    made: list[Any] = []
    for body in bodies:
        kind = {"revolute": "Revolute", "prismatic": "Prismatic", "floating": "Free"}[body.joint]
        create = getattr(skeleton, f"create{kind}JointAndBodyNodePair")
        joint, node = create(made[body.parent]) if body.parent >= 0 else create()
        place = dart.math.Isometry3()
        place.set_rotation(body.rotation)
        place.set_translation(body.translation)
        joint.setTransformFromParentBodyNode(place)
        if body.joint != "floating":
            joint.setAxis(body.axis)
        node.setInertia(dart.dynamics.Inertia(body.mass, body.com, body.inertia))
        made.append(node)
    return skeleton
