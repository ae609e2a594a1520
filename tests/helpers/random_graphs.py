"""Random machines given as a graph of joints at one closed position, and models of them that differ
in which joints form the tree, in the order of joints, and in units."""

from dataclasses import dataclass, field

import numpy as np

import linkwise as lw
from helpers.random_trees import random_rotation

SPATIAL = ("revolute", "spherical", "cylindrical", "prismatic")


@dataclass
class Units:
    """What one metre, kilogram and second are in the units of a model."""

    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    @property
    def force(self):
        return self.mass * self.length / self.time**2

    def loads(self):
        """(6,) of force and moment."""
        return np.repeat([self.force, self.force * self.length], 3)


SI = Units()


@dataclass
class Edge:
    """A joint between two bodies (0: the ground): point and axes in the world, as drawn."""

    name: str
    kind: str
    ends: tuple[int, int]
    point: np.ndarray
    axes: np.ndarray


@dataclass
class Cut:
    """A model of a graph. sign: by joint -1 where parent and child are swapped."""

    model: lw.Model
    sign: dict[str, float]
    units: Units

    def per_time(self, joint):
        """Scale of rates (nv,) of a joint, times seconds."""
        kinds = {"revolute": [0], "prismatic": [1], "spherical": [0] * 3, "cylindrical": [1, 0]}
        names = [*self.model.joint_names, *self.model.loop_names]
        types = [*self.model.joint_types, *self.model.loop_types]
        return self.units.length ** np.array(kinds[types[names.index(joint)]], dtype=float)


@dataclass
class Graph:
    bodies: list[tuple[float, np.ndarray, np.ndarray]]  # mass, centre of mass, inertia about it
    edges: list[Edge]
    gravity: np.ndarray
    rng: np.random.Generator = field(repr=False)

    def cut(self, order, units=SI):
        """The model whose tree takes the joints in this order as long as they close no loop."""
        leader = list(range(len(self.bodies) + 1))

        def lead(k):
            while leader[k] != k:
                k = leader[k]
            return k

        tree, loops = [], []
        for k in order:
            a, b = (lead(end) for end in self.edges[k].ends)
            (loops if a == b else tree).append(self.edges[k])
            leader[a] = b
        return self._build(tree, loops, units)

    def _build(self, tree, loops, units):
        frames, carried, signs = {0: (np.zeros(3), np.eye(3))}, [], {}
        while tree:
            edge = next(e for e in tree if (e.ends[0] in frames) != (e.ends[1] in frames))
            tree = [e for e in tree if e is not edge]
            parent, child = edge.ends if edge.ends[0] in frames else edge.ends[::-1]
            signs[edge.name] = 1.0 if parent == edge.ends[0] else -1.0
            frames[child] = edge.point, edge.axes
            carried.append((edge, parent, child))
        builder = lw.ModelBuilder("graph", gravity=self.gravity * units.length / units.time**2)
        for k in range(len(self.bodies) + 1):
            builder.add_link(f"b{k}", **self._inertia(k, frames[k], units))
        for edge, parent, child in carried:
            point, axes = placed(edge, frames[parent], units)
            ends = {"translation": point, "rotation": axes, **axis_of(edge)}
            builder.add_joint(edge.name, edge.kind, f"b{parent}", f"b{child}", **ends)
        for edge in loops:
            ends = edge.ends if self.rng.random() < 0.5 else edge.ends[::-1]
            signs[edge.name] = 1.0 if ends == edge.ends else -1.0
            (here, axes), (there, turned) = (placed(edge, frames[end], units) for end in ends)
            places = {"translation": here, "rotation": axes}
            places |= {"child_translation": there, "child_rotation": turned}
            names = f"b{ends[0]}", f"b{ends[1]}"
            builder.add_loop(edge.name, edge.kind, *names, **places, **axis_of(edge))
        return Cut(builder.build(), signs, units)

    def _inertia(self, k, frame, units):
        if k == 0:
            return {}
        mass, center, inertia = self.bodies[k - 1]
        origin, axes = frame
        return {
            "mass": mass * units.mass,
            "com": axes.T @ (center - origin) * units.length,
            "inertia": axes.T @ inertia @ axes * units.mass * units.length**2,
        }


def axis_of(edge):
    return {} if edge.kind == "spherical" else {"axis": (0, 0, 1)}


def placed(edge, frame, units):
    """Point and axes of a joint in a link's frame."""
    origin, axes = frame
    return axes.T @ (edge.point - origin) * units.length, axes.T @ edge.axes


def random_graph(seed, *, planar):
    """planar: hinges with parallel axes, which hold their plane many times over."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 7))
    bodies = []
    for _ in range(count):
        moments = rng.uniform(0.3, 1.0, 3)
        R = random_rotation(rng)
        bodies.append((rng.uniform(0.5, 3.0), rng.standard_normal(3), R @ np.diag(moments) @ R.T))
    pairs = [(int(rng.integers(0, k)), k) for k in range(1, count + 1)]
    for _ in range(int(rng.integers(1, 4))):
        a, b = (int(k) for k in rng.choice(count + 1, 2, replace=False))
        pairs.append((a, b))
    plane = random_rotation(rng)
    edges = []
    for k, ends in enumerate(pairs):
        kind = "revolute" if planar else str(rng.choice(SPATIAL, p=(0.4, 0.4, 0.1, 0.1)))
        axes = plane if planar else random_rotation(rng)
        edges.append(Edge(f"j{k}", kind, ends, rng.standard_normal(3), axes))
    return Graph(bodies, edges, 9.81 * rng.standard_normal(3), rng)


def whole(cut, of_tree, of_loops):
    """By joint what stands in vectors of the tree's and of the loop joints' rates, in SI units and
    in the direction of the graph, per power of time left out."""
    model, found = cut.model, {}
    for name in model.joint_names:
        found[name] = np.asarray(of_tree)[model.v_slice(name)]
    for name, (_, where) in zip(model.loop_names, model.loop_slices, strict=True):
        found[name] = np.asarray(of_loops)[where]
    return {name: cut.sign[name] * own / cut.per_time(name) for name, own in found.items()}


def rates(cut, by_joint):
    """(nv,) of the tree from `whole`."""
    v = np.zeros(cut.model.nv)
    for name in cut.model.joint_names:
        v[cut.model.v_slice(name)] = cut.sign[name] * by_joint[name] * cut.per_time(name)
    return v / cut.units.time


def loads_of(cut, loads):
    """By joint (6,) [N, N m], in the direction of the graph."""
    names = [*cut.model.joint_names, *cut.model.loop_names]
    return {n: cut.sign[n] * loads[k] / cut.units.loads() for k, n in enumerate(names)}
