"""Random trees of every joint type: a hypothesis strategy draws the shape, a seed the numbers."""

from dataclasses import dataclass, replace

import numpy as np
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import linkwise as lw

JOINT_TYPES = (
    "revolute",
    "continuous",
    "prismatic",
    "helical",
    "cylindrical",
    "universal",
    "spherical",
    "planar",
    "floating",
    "composite",
)


@dataclass(frozen=True)
class Joint:
    name: str
    type: str
    parent: int  # index of the parent joint, -1 the ground
    translation: np.ndarray
    rotation: np.ndarray
    options: dict  # axis, axes, pitch
    mass: float
    com: np.ndarray
    inertia: np.ndarray
    armature: float = 0.0


@dataclass(frozen=True)
class Tree:
    joints: tuple[Joint, ...]
    gravity: np.ndarray
    seed: int

    def build(self, order=None):
        """The tree as a model; `order` adds the joints (parents first) in another sequence."""
        builder = lw.ModelBuilder("random tree", gravity=tuple(self.gravity))
        builder.add_link("ground")
        for k in range(len(self.joints)) if order is None else order:
            joint = self.joints[k]
            parent = self.joints[joint.parent].name + "_link" if joint.parent >= 0 else "ground"
            link = joint.name + "_link"
            builder.add_link(link, mass=joint.mass, com=joint.com, inertia=joint.inertia)
            builder.add_joint(
                joint.name,
                joint.type,
                parent,
                link,
                translation=joint.translation,
                rotation=joint.rotation,
                armature=joint.armature,
                **joint.options,
            )
        return builder.build()

    def moved(self, rotation, translation):
        """The same machine and gravity, everything rotated then shifted in the world."""
        moved = (
            replace(
                joint,
                rotation=rotation @ joint.rotation,
                translation=rotation @ joint.translation + translation,
            )
            if joint.parent < 0
            else joint
            for joint in self.joints
        )
        return replace(self, joints=tuple(moved), gravity=rotation @ self.gravity)

    def rng(self):
        return np.random.default_rng([self.seed, 7])


def random_rotation(rng):
    return Rotation.from_quat(rng.standard_normal(4)).as_matrix()


def random_axis(rng):
    axis = rng.standard_normal(3)
    return tuple(axis / np.linalg.norm(axis))


def random_options(kind, rng):
    if kind == "universal":
        first, second = random_axis(rng), random_axis(rng)
        if abs(np.dot(first, second)) > 0.9:  # nearly parallel axes are a bad mechanism
            second = tuple(np.roll(second, 1))
        return {"axes": [first, second]}
    if kind == "composite":
        # Three freedoms whose axes stay independent at any coordinates the tests draw.
        x, y, _ = random_rotation(rng).T
        return {"axes": [("revolute", tuple(x)), ("prismatic", tuple(x)), ("revolute", tuple(y))]}
    if kind in ("spherical", "floating"):
        return {}
    options = {"axis": random_axis(rng)}
    return options | {"pitch": 0.2} if kind == "helical" else options


def random_body(rng):
    """Mass, mass centre and a physical inertia: second moments first, so the triangle holds."""
    mass = rng.uniform(0.3, 3.0)
    turn, moments = random_rotation(rng), mass * rng.uniform(0.05, 0.3, 3) ** 2
    inertia = turn @ np.diag(moments.sum() - moments) @ turn.T
    return mass, 0.3 * rng.standard_normal(3), (inertia + inertia.T) / 2


def make_tree(types, parents, seed, *, gravity=(0.4, -0.3, -9.6)):
    rng = np.random.default_rng(seed)
    joints = []
    for k, (kind, parent) in enumerate(zip(types, parents, strict=True)):
        mass, com, inertia = random_body(rng)
        joints.append(
            Joint(
                f"{kind}{k}",
                kind,
                parent,
                0.5 * rng.standard_normal(3),
                random_rotation(rng),
                random_options(kind, rng),
                mass,
                com,
                inertia,
            )
        )
    return Tree(tuple(joints), np.asarray(gravity, float), seed)


@st.composite
def trees(draw, max_joints=8, types=JOINT_TYPES, floating_base=False, **options):
    n = draw(st.integers(1, max_joints))
    kinds = [draw(st.sampled_from(types)) for _ in range(n)]
    parents = [draw(st.integers(0 if floating_base and k else -1, k - 1)) for k in range(n)]
    if floating_base:
        kinds[0] = "floating"
    return make_tree(kinds, parents, draw(st.integers(0, 2**16)), **options)


def random_configuration(model, rng, shape=(), spread=1.0):
    """Random coordinates (*shape, nq) with unit quaternions."""
    q = spread * rng.standard_normal((*shape, model.nq))
    for joint, kind in zip(model.joint_names, model.joint_types, strict=True):
        if kind in ("spherical", "floating"):
            at = model.q_slice(joint)
            quaternion = slice(at.stop - 4, at.stop)
            q[..., quaternion] /= np.linalg.norm(q[..., quaternion], axis=-1, keepdims=True)
    return q
