"""Machines as every engine can build them, and states in one convention for all.

Joints are revolute, prismatic, or one floating base. Coordinates follow Pinocchio: a floating base
has position and quaternion (x, y, z, w) in q, its velocity in its own axes, linear first.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module, metadata
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import linkwise as lw
from linkwise._core import Model, ModelBuilder

Array = npt.NDArray[np.float64]
EARTH = (0.0, 0.0, -9.81)


@dataclass(frozen=True)
class Body:
    """A link and its inboard joint; the link's frame is the joint's."""

    parent: int  # index, -1: ground
    joint: str  # revolute, prismatic, floating
    axis: Array  # (3,)
    rotation: Array  # (3, 3) joint axes in the parent's frame, columns
    translation: Array  # (3,) m
    mass: float
    com: Array  # (3,) m
    inertia: Array  # (3, 3) about the centre of mass


@dataclass(frozen=True)
class Machine:
    """Bodies depth first, every parent before its children, as most engines number them anyway."""

    name: str
    bodies: tuple[Body, ...]  # none: too many for the peers
    model: Model
    gravity: tuple[float, float, float] = EARTH
    reach: float = 1.0  # of random angles and rates [rad, rad/s]

    @property
    def n_bodies(self) -> int:
        return int(self.model.n_joints)  # peers count a moving link without mass as well

    @property
    def floating(self) -> bool:
        return bool(self.bodies) and self.bodies[0].joint == "floating"


@dataclass(frozen=True)
class States:
    """q (n, nq), v (n, nv), tau (n, nv)."""

    q: Array
    v: Array
    tau: Array

    @property
    def count(self) -> int:
        return len(self.q)

    def rows(self) -> list[tuple[Array, Array, Array]]:
        return list(zip(self.q, self.v, self.tau, strict=True))

    def write(self, path: Path) -> None:
        header = np.array([self.count, self.q.shape[1], self.v.shape[1]], dtype=float)
        with path.open("wb") as file:
            for part in (header, self.q, self.v, self.tau):
                file.write(np.ascontiguousarray(part).tobytes())

    @staticmethod
    def read(path: Path) -> States:
        values = np.fromfile(path)
        count, nq, nv = (int(x) for x in values[:3])
        q, v, tau = np.split(values[3:], np.cumsum([count * nq, count * nv]))
        return States(q.reshape(count, nq), v.reshape(count, nv), tau.reshape(count, nv))


def random_states(machine: Machine, count: int) -> States:
    """Joint angles and rates within the machine's reach; a floating base has any attitude."""
    rng = np.random.default_rng(735)
    nv = machine.model.nv
    q, v, tau = rng.uniform(-machine.reach, machine.reach, (3, count, nv))
    if machine.floating:
        quaternion = rng.normal(size=(count, 4))
        quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
        q = np.hstack([q[:, :3], quaternion, q[:, 6:]])
        tau[:, :6] = 0
    return States(q, v, tau)


def random_chain(n: int) -> Machine:
    """Rods of 1 kg and 1 m on revolute joints with random placements: the motion is spatial."""
    rng = np.random.default_rng(1993)
    mass, com, inertia = 1.0, np.array([0.1, 0, -0.5]), np.diag([0.084, 0.084, 0.00125])
    translation = np.array([0.3, 0.0, -1.0])
    bodies = []
    builder = ModelBuilder(f"chain of {n}")
    builder.add_link("ground")
    parent = "ground"
    for k, quaternion in enumerate(rng.normal(size=(n, 4))):
        here = translation if k else np.zeros(3)
        rotation = _rotation(quaternion)
        z = np.array([0.0, 0.0, 1.0])
        bodies.append(Body(k - 1, "revolute", z, rotation, here, mass, com, inertia))
        builder.add_link(f"link{k}", mass=mass, com=com, inertia=inertia)
        builder.add_joint(
            f"joint{k}", "revolute", parent, f"link{k}", translation=here, rotation=rotation
        )
        parent = f"link{k}"
    return Machine(f"chain of {n}", tuple(bodies), builder.build())


def hanging_chain(n: int, *, peers: bool = True) -> Machine:
    """Rods on joints about y and x in turn, gently bent: long chains of random angles are balls."""
    model = lw.scenes.chain(n)
    bodies: list[Body] = []
    if peers:
        across, along = (3 * 0.05**2 + 1) / 12, 0.05**2 / 2
        com, inertia = np.array([0.0, 0.0, -0.5]), np.diag([across, across, along])
        axes, down = (np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])), np.array([0.0, 0, -1])
        for k in range(n):
            here = down if k else np.zeros(3)
            bodies.append(Body(k - 1, "revolute", axes[k % 2], np.eye(3), here, 1.0, com, inertia))
    return Machine(f"hanging chain of {n}", tuple(bodies), model, reach=0.1)


def _rotation(quaternion: Array) -> Array:
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


@dataclass(frozen=True)
class Robot:
    name: str
    folder: str  # in example-robot-data
    file: str
    floating: bool = False


ROBOTS = (
    Robot("iiwa", "iiwa_description", "iiwa14.urdf"),
    Robot("xArm7", "xarm_description", "xarm7.urdf"),
    Robot("Panda", "panda_description", "panda.urdf"),
    Robot("UR5", "ur_description", "ur5_robot.urdf"),
    Robot("ANYmal", "anymal_b_simple_description", "anymal.urdf", floating=True),
    Robot("Talos", "talos_data", "talos_reduced.urdf", floating=True),
)


class RobotMissingError(Exception):
    """Why a robot is not in this comparison."""


def robot_file(robot: Robot) -> Path:
    try:
        files = metadata.files("example-robot-data") or []
    except metadata.PackageNotFoundError:
        raise RobotMissingError("pip install example-robot-data has it") from None
    for entry in files:
        if entry.name == robot.file and robot.folder in entry.parts:
            return Path(str(entry.locate()))
    version = metadata.version("example-robot-data")
    raise RobotMissingError(f"example-robot-data {version} does not have it")


def load_robot(robot: Robot) -> Machine:
    """Ours from the file, as users get it; the peers' from Pinocchio's own reading of it."""
    path = robot_file(robot)
    try:
        pin: Any = import_module("pinocchio")
    except ImportError:
        raise RobotMissingError(
            "Pinocchio (pip install pin), which reads the file, is missing"
        ) from None
    root = (pin.JointModelFreeFlyer(),) if robot.floating else ()
    theirs = pin.buildModelFromUrdf(str(path), *root)
    model = lw.load(
        path, floating_base=robot.floating, joint_order="pinocchio", mimic="independent"
    )
    ours = list(model.joint_names)[1 if robot.floating else 0 :]
    if list(theirs.names)[2 if robot.floating else 1 :] != ours:
        raise RobotMissingError("its joints are in another order in Pinocchio")
    bodies = [_body(pin, theirs, k) for k in range(1, theirs.njoints)]
    return Machine(robot.name, tuple(bodies), model)


def _body(pin: Any, model: Any, index: int) -> Body:
    joint, place, inertia = model.joints[index], model.jointPlacements[index], model.inertias[index]
    kind, axis = "floating", np.zeros(3)
    if joint.nv == 1:
        data = joint.createData()
        joint.calc(data, pin.neutral(model), np.zeros(model.nv))
        linear, angular = np.split(np.asarray(data.S).reshape(6), 2)
        kind, axis = ("revolute", angular) if np.any(angular) else ("prismatic", linear)
        if np.any(angular) and np.any(linear):
            raise RobotMissingError(f"joint {model.names[index]} is neither revolute nor prismatic")
    elif joint.nv != 6 or index != 1:
        raise RobotMissingError(f"joint {model.names[index]} has {joint.nv} degrees of freedom")
    return Body(
        int(model.parents[index]) - 1,
        kind,
        axis,
        np.array(place.rotation),
        np.array(place.translation),
        float(inertia.mass),
        np.array(inertia.lever),
        np.array(inertia.inertia),
    )


def write_machine(machine: Machine, folder: Path) -> None:
    """The files that workers build from: machine.txt for the peers, linkwise.model for us."""
    (folder / "linkwise.model").write_bytes(machine.model.__getstate__())
    if not machine.bodies:
        return
    lines = [_numbers(machine.gravity), str(len(machine.bodies))]
    for b in machine.bodies:
        upper = b.inertia[np.triu_indices(3)]
        parts = (b.axis, b.rotation.ravel(), b.translation, [b.mass], b.com, upper)
        lines.append(f"{b.parent} {b.joint} " + " ".join(_numbers(part) for part in parts))
    (folder / "machine.txt").write_text("\n".join(lines) + "\n")


def _numbers(values: Sequence[float] | Array) -> str:
    return " ".join(repr(float(x)) for x in values)


def read_model(folder: Path) -> Model:
    """Ours, out of a case folder."""
    model = Model.__new__(Model)
    model.__setstate__((folder / "linkwise.model").read_bytes())
    return model


def read_bodies(folder: Path) -> tuple[tuple[float, ...], list[Body]]:
    """Gravity and bodies, out of a case folder."""
    lines = (folder / "machine.txt").read_text().splitlines()
    bodies = []
    for line in lines[2:]:
        parent, joint, *numbers = line.split()
        axis, rotation, translation, mass, com, upper = np.split(
            np.array(numbers, dtype=float), np.cumsum([3, 9, 3, 1, 3])
        )
        inertia = np.empty((3, 3))
        inertia[np.triu_indices(3)] = upper
        inertia.T[np.triu_indices(3)] = upper
        bodies.append(
            Body(
                int(parent),
                joint,
                axis,
                rotation.reshape(3, 3),
                translation,
                float(mass[0]),
                com,
                inertia,
            )
        )
    return tuple(float(x) for x in lines[0].split()), bodies


def states_for(n_bodies: int, *, most: int = 64) -> int:
    """Enough states that caches do not know them, few enough that long chains fit in memory."""
    return max(2, min(most, math.ceil(2_000_000 / n_bodies)))
