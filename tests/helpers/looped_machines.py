"""Random chains with closed loops, and their equations of motion as one dense system.

The system shares no code with the recursion that eliminates loops: the mass matrix and the bias of
the open tree, and the loops' rows by the Jacobians of frames, whose rate of change is a difference
of Jacobians a short time apart.
"""

from typing import NamedTuple

import numpy as np

import linkwise as lw

#: Directions of the frame on the child that a loop joint holds, of (linear, angular).
HELD = {"spherical": [0, 1, 2], "fixed": [0, 1, 2, 3, 4, 5], "revolute": [0, 1, 2, 3, 4]}


class Machine(NamedTuple):
    """A model, the same without its loops, and a position at which all loops are closed.

    held: for each loop joint the two frames (None: ground) and the directions that it holds.
    """

    model: lw.Model
    tree: lw.Model
    q: np.ndarray
    held: list


def _rotation(rng):
    matrix, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return matrix * np.sign(np.linalg.det(matrix))


def _pose(model, q, link):
    return np.asarray(lw.link_poses(model, q))[model.link_names.index(link)]


def chain(rng, loops, count=9, **properties):
    """Links on random hinges and sliders, and loops (type, parent link, child link)."""
    names = ["base", *(f"link{i}" for i in range(count))]
    builder = lw.ModelBuilder("chain", gravity=(1.0, -2.0, -9.0))
    builder.add_link("base", mass=0)
    for i in range(count):
        A = rng.normal(size=(3, 3))
        builder.add_link(
            f"link{i}",
            mass=rng.uniform(0.5, 2),
            com=rng.normal(size=3) * 0.2,
            inertia=0.1 * (np.trace(A @ A.T) * np.eye(3) - A @ A.T),
        )
        parent = names[i if rng.random() < 0.7 else int(rng.integers(0, i + 1))]
        kind = "prismatic" if i % 4 == 3 else "revolute"
        axis = rng.normal(size=3)
        place = {"translation": rng.normal(size=3), "rotation": _rotation(rng)}
        builder.add_joint(
            f"joint{i}",
            kind,
            parent,
            f"link{i}",
            axis=axis / np.linalg.norm(axis),
            **place,
            **properties,
        )
    tree = builder.build()
    q = rng.normal(size=tree.nq)
    model, held = tree, []
    for k, (kind, parent, child) in enumerate(loops):
        on_parent = np.eye(4)
        on_parent[:3, :3], on_parent[:3, 3] = _rotation(rng), rng.normal(size=3)
        on_child = np.linalg.inv(_pose(tree, q, child)) @ _pose(tree, q, parent) @ on_parent
        model = model.with_loop(
            f"loop{k}",
            kind,
            parent,
            child,
            translation=on_parent[:3, 3],
            rotation=on_parent[:3, :3],
            child_translation=on_child[:3, 3],
            child_rotation=on_child[:3, :3],
            **({"axis": (0, 0, 1)} if kind == "revolute" else {}),
        )
        held.append((parent, on_parent, child, on_child, HELD[kind]))
    return Machine(model, tree, q, held)


def rows(machine, q):
    """K with K v = 0: velocities of the child's frame against the parent's, in its axes."""
    found = []
    for parent, on_parent, child, on_child, held in machine.held:
        own = _pose(machine.tree, q, child) @ on_child
        world = lw.frame_jacobian(
            machine.tree, q, lw.Frame(child, origin=on_child[:3, 3]), axes="world"
        )
        J = np.asarray(world).copy()
        if parent != "base":
            J -= lw.frame_jacobian(
                machine.tree, q, lw.Frame(parent, origin=on_parent[:3, 3]), axes="world"
            )
        turned = np.kron(np.eye(2), own[:3, :3].T)
        found.append((turned @ J)[held])
    return np.concatenate(found)


def closed_rates(machine, rng):
    K = rows(machine, machine.q)
    v = rng.normal(size=machine.tree.nv)
    return v - np.linalg.pinv(K) @ (K @ v)


def accelerations(machine, v, generalised, bias):
    """dv/dt and loop forces of [H K^T; K 0] under a generalised force; bias: with rates v."""
    K, H = rows(machine, machine.q), lw.mass_matrix(machine.tree, machine.q)
    demand = np.zeros(len(K))
    if bias:
        step = 1e-5
        ahead, behind = (rows(machine, machine.q + s * v) for s in (step, -step))
        demand = -(ahead - behind) @ v / (2 * step)
    n = len(H)
    whole = np.block([[H, K.T], [K, np.zeros((len(K), len(K)))]])
    solution = np.linalg.lstsq(whole, np.concatenate([generalised, demand]), rcond=1e-11)[0]
    return solution[:n], solution[n:]


#: Directions that the self-stresses of hinges along z leave alone: forces in the plane, and the
#: hinges' own free moment.
PLANAR = np.array([1, 1, 0, 0, 0, 1], dtype=bool)


def four_bar(cut, *, frames=None, units=(1.0, 1.0, 1.0), cut_the_other_way=False):
    """Four hinges along z, of which `cut` ("c" or "d") closes the loop.

    frames: axes of each hinge's frame, by name, (3, 3) against the world's; units: what one metre,
    kilogram and second count.
    """
    metre, kilogram, second = units
    rods = {"crank": ("a", "b"), "coupler": ("b", "c"), "rocker": ("c", "d")}
    points = {"a": (0, 0, 0), "b": (0.2, 0.5, 0), "c": (1.1, 0.9, 0), "d": (1.3, -0.1, 0)}
    points = {name: metre * np.array(point, dtype=float) for name, point in points.items()}
    origin = {"base": np.zeros(3), "crank": points["a"], "coupler": points["b"]}
    origin["rocker"] = points["d"] if cut == "c" else points["c"]
    gravity = np.array([0.5, -9.81, 0]) * metre / second**2
    builder = lw.ModelBuilder("four-bar", gravity=gravity)
    builder.add_link("base", mass=0)
    axes = dict.fromkeys("abcd", np.eye(3)) | (frames or {})
    of_link = {"base": np.eye(3)} | {"crank": axes["a"], "coupler": axes["b"]}
    of_link["rocker"] = axes["d" if cut == "c" else "c"]
    for link, ends in rods.items():
        turn = of_link[link]
        middle = sum(points[end] for end in ends) / 2 - origin[link]
        inertia = turn.T @ np.diag([0.02, 0.03, 0.04]) @ turn * kilogram * metre**2
        builder.add_link(link, mass=1.5 * kilogram, com=turn.T @ middle, inertia=inertia)
    hinges = {
        "a": ("base", "crank"),
        "b": ("crank", "coupler"),
        "c": ("coupler", "rocker"),
        "d": ("base", "rocker"),
    }
    for name, (parent, child) in hinges.items():
        if name == cut and cut_the_other_way:
            parent, child = child, parent
        sides = [
            (
                of_link[link].T @ (points[name] - origin[link]),
                of_link[link].T @ axes[name],
            )
            for link in (parent, child)
        ]
        (translation, rotation), (child_translation, child_rotation) = sides
        where = {"translation": translation, "rotation": rotation}
        where["axis"] = axes[name].T @ (0.0, 0.0, 1.0)
        if name == cut:
            where |= {"child_translation": child_translation, "child_rotation": child_rotation}
            builder.add_loop(name, "revolute", parent, child, **where)
        else:
            builder.add_joint(name, "revolute", parent, child, **where)
    return builder.build()
