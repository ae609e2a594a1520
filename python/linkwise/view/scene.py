"""The machine in viser: groups of instances, one message per group and snapshot, for any links."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise import _core
from linkwise.base import AnyArray, Array
from linkwise.io.complaint import shorten
from linkwise.io.urdf_visuals import Visual
from linkwise.view.beams import Beams
from linkwise.view.meshes import load_mesh
from linkwise.view.placement import (
    Bending,
    BendStyle,
    Fixed,
    Following,
    Lines,
    Loads,
    LoadStyle,
    Marks,
    Placement,
    Snapshot,
    Spanning,
)
from linkwise.view.places import Places
from linkwise.view.shapes import (
    Mesh,
    dashed_arc,
    dashed_arrow,
    equivalent_boxes,
    turned,
    unit_arc,
    unit_arrow,
    unit_box,
    unit_cylinder,
    unit_sphere,
)

if TYPE_CHECKING:
    import viser

    from linkwise.view.source import Source

_TONES = np.array([[86, 112, 140], [150, 170, 190]], dtype=np.uint8)
_ROD_TONE, _MARK_TONE, _BOX_TONE = (120, 132, 146), (52, 58, 66), (230, 150, 60)
_SLENDEREST = 0.004  # of the machine's size: a thinner beam would not be seen
_PLAIN = (0.62, 0.66, 0.70, 1.0)
_MANY = 1500  # joints, above which marks at every joint only hide the links
_SPARSE_LOADS, _SPARSE_POINTS = 60, 300  # of a machine with more: what a processor draws in time
_THIN = 300  # joints, above which rods are thinner than a point of the screen
_LOOKED_AT = 9  # snapshots of a run that the first picture makes room for
_LIGHTEST = 1e-6  # of the whole: lighter links are placeholders, with any inertia
_INSTANCES_A_SECOND = 500_000  # that viser's client takes in
_ARROW_SHARE = 0.22  # of the machine's size: the largest load's arrow


@dataclass
class Layer:
    """Something drawn; `place` gives the properties of its handle that change with the snapshot."""

    handle: Any
    place: Placement

    def show(self, snapshot: Snapshot) -> None:
        if self.handle.visible:
            for name, values in self.place(snapshot).items():
                setattr(self.handle, name, values)


class Scene:
    """Draws a source; `toggles` says what can be shown and hidden, and whether it is shown."""

    def __init__(self, server: viser.ViserServer, source: Source) -> None:
        self._scene = server.scene
        self._model = model = source.model
        self._inboard = np.array(model.joint_parents, dtype=int)
        self.places = Places(model)
        self.beams, self.bends = Beams(model), BendStyle()
        self._bent = set(model.beam_lengths)
        self._few = model.n_joints <= _MANY
        self.layers: dict[str, list[Layer]] = defaultdict(list)
        self.joint_marks: Any = None
        self._known = source.known
        start = source.first_position
        if source.recording is not None:
            start = source.recording.position(0)
        self._snapshot = self.at(start, None)
        snapshots = [self._snapshot]
        if source.recording is not None:
            last = source.recording.times.size - 1
            some = np.unique(np.linspace(0, last, _LOOKED_AT).astype(int))
            snapshots = [self.at(source.recording.position(k), None) for k in some]
            self.bends.largest = self.beams.largest(source.recording.positions())
        self.center, self.size = _extent(snapshots, model)
        self.style = LoadStyle((0.0, 0.0), _ARROW_SHARE * self.size)
        self.toggles: dict[str, bool] = {}
        self._add_visuals(source)
        self._add_shapes(bare="Meshes" not in self.toggles)
        self._add_beams()
        if source.recording is None or source.recording.has_loads:
            shown = source.recording is not None
            peaks = np.zeros(len(self.places.names))
            if source.recording is not None:
                peaks = source.recording.peaks
            self._add_loads(shown=shown, peaks=peaks)
        self._frame_camera(server)
        for name, shown in self.toggles.items():
            self.toggle(name, shown)

    # -- snapshots ----------------------------------------------------------------------------

    def at(self, q: Array, loads: Array | None) -> Snapshot:
        links = _core.link_poses(self._model, q)
        known = None if loads is None or self._known is None else self._known.at(q)
        beams = self.beams.at(links, q)
        return Snapshot(links, self.places.frames(links, q), loads, known, beams)

    @property
    def known(self) -> AnyArray | None:
        """(joints, half) [bool]: which of the loads shown are determinate, None: all."""
        return self._snapshot.known

    def show(self, snapshot: Snapshot) -> None:
        self._snapshot = snapshot
        for layers in self.layers.values():
            for layer in layers:
                layer.show(snapshot)

    def toggle(self, name: str, shown: bool) -> None:
        """Show or hide a layer. Hidden ones are not kept up to date, so it is placed again."""
        self.toggles[name] = shown
        for layer in self.layers[name]:
            layer.handle.visible = shown
            layer.show(self._snapshot)

    @property
    def drawing_time(self) -> float:
        """Seconds to leave a client between snapshots: more often, and they would queue there."""
        shown = sum(
            len(layer.handle.batched_positions)
            for layers in self.layers.values()
            for layer in layers
            if layer.handle.visible and hasattr(layer.handle, "batched_positions")
        )
        return shown / _INSTANCES_A_SECOND

    def set_arrow_scale(self, scale: float) -> None:
        """Draw arrows and arcs this many times as long as by default."""
        self.style.longest = scale * _ARROW_SHARE * self.size

    # -- links ------------------------------------------------------------------------------

    def _add(self, toggle: str, shown: bool, mesh: Mesh, count: int, **style: Any) -> Any:
        """An empty group of `count` instances."""
        self.toggles.setdefault(toggle, shown)
        name = f"/{toggle.lower().replace(' ', '_')}/{len(self.layers[toggle])}"
        return self._scene.add_batched_meshes_simple(
            name,
            mesh.vertices,
            mesh.faces,
            np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
            np.zeros((count, 3)),
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
            **style,
        )

    def _add_visuals(self, source: Source) -> None:
        """The visuals of the model's file; equal meshes are instances of one."""
        index = {name: k for k, name in enumerate(self._model.link_names)}
        groups: dict[tuple[str, Path | None, Any], list[Visual]] = defaultdict(list)
        for visual in source.appearance.visuals:
            if visual.link in index and visual.link not in self._bent:
                scale = visual.size if visual.shape == "mesh" else None
                groups[visual.shape, visual.path, (scale, visual.color)].append(visual)
        for (shape, path, _), visuals in groups.items():
            links = np.array([index[visual.link] for visual in visuals])
            offsets = np.stack([visual.placement for visual in visuals])
            handle = self._add_visual_group(shape, path, visuals, source.notes)
            if handle is not None:
                self.layers["Meshes"].append(Layer(handle, Following(links, offsets)))

    def _add_visual_group(
        self, shape: str, path: Path | None, visuals: list[Visual], notes: list[str]
    ) -> Any:
        first = visuals[0]
        color = first.color or _PLAIN
        count = len(visuals)
        if path is not None:
            mesh = load_mesh(path, first.color)
            if mesh is None:
                notes.append(f"mesh {shorten(path.name)!r} cannot be read and is left out")
                return None
            self.toggles.setdefault("Meshes", True)
            return self._scene.add_batched_meshes_trimesh(
                f"/meshes/{len(self.layers['Meshes'])}",
                mesh,
                np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
                np.zeros((count, 3)),
                batched_scales=np.tile(first.size, (count, 1)),
                lod="off",
                cast_shadow=False,
                receive_shadow=False,
            )
        unit = {"box": unit_box, "cylinder": unit_cylinder, "sphere": unit_sphere}[shape]()
        return self._add(
            "Meshes",
            True,
            unit,
            count,
            batched_scales=np.array([visual.size for visual in visuals]),
            batched_colors=np.array(np.round(255 * np.array(color[:3])), dtype=np.uint8),
            opacity=color[3] if color[3] < 1 else None,
        )

    def _add_shapes(self, *, bare: bool) -> None:
        """Boxes from the inertias, rods between joint points, marks at joints."""
        model, inboard = self._model, self._inboard
        few, links = self._few, "Bodies" if self._few else "Every link"
        boxes = equivalent_boxes(model.link_masses, model.link_inertias)
        offsets = np.tile(np.eye(4), (len(boxes.edges), 1, 1))
        offsets[:, :3, :3] = boxes.axes
        offsets[:, :3, 3] = model.link_centers_of_mass
        solid = np.flatnonzero(boxes.edges.max(axis=1, initial=0.0) > 0)
        near = solid[_stays_near(self._snapshot, model, boxes.edges, offsets)[solid]]
        near = near[model.link_masses[near] > _LIGHTEST * model.link_masses.sum()]
        near = near[[model.link_names[k] not in self._bent for k in near]]
        for toggle, chosen, shown, style in (
            (links, near, bare and few, {"batched_colors": _TONES[near % 2]}),
            ("Inertia boxes", solid, False, {"batched_colors": _BOX_TONE, "opacity": 0.35}),
        ):
            if chosen.size:
                edges = boxes.edges[chosen]
                handle = self._add(
                    toggle, shown, unit_box(), chosen.size, batched_scales=edges, **style
                )
                self.layers[toggle].append(Layer(handle, Following(chosen, offsets[chosen])))
        outboard = np.flatnonzero(inboard >= 0)
        thick = self._thickness()
        bent = self.beams.joints
        stiff = outboard[[model.joint_names[k] not in bent for k in outboard]]
        spans = np.concatenate([np.column_stack([inboard[stiff], stiff]), self.places.spans])
        if len(spans):
            handle = self._add(
                links,
                bare and few,
                unit_cylinder(8) if few else turned([(1, -0.5), (1, 0.5)], 4),
                len(spans),
                batched_scales=np.ones((len(spans), 3)),
                batched_colors=_ROD_TONE,
            )
            rods = Spanning(spans[:, 0], spans[:, 1], 0.55 * thick)
            self.layers[links].append(Layer(handle, rods))
        self._add_rods(0.35 * thick)
        if model.n_joints > _THIN:  # lines keep their width on the screen, however far away
            ends = _sparse_tree(inboard, model.n_joints if few else _SPARSE_POINTS)
            lines = self._scene.add_line_segments(
                "/bodies/lines",
                points=np.zeros((len(ends[0]), 2, 3)),
                colors=_ROD_TONE,
                thickness=2.5,
                thickness_units="screen",
            )
            self.toggles["Bodies"] = bare
            self.layers["Bodies"].append(Layer(lines, Lines(*ends)))
        self.joint_marks = self._add(
            "Joints",
            bare and few,
            unit_sphere(12 if few else 6),
            len(self.places.names),
            batched_scales=np.full(len(self.places.names), thick),
            batched_colors=_MARK_TONE,
        )
        self.layers["Joints"].append(Layer(self.joint_marks, Marks(len(self.places.names))))

    def _add_rods(self, radius: float) -> None:
        """Rods without mass, which no link stands for: shown whatever else is."""
        rods = self.places.rods
        if len(rods):
            handle = self._add(
                "Rods",
                True,
                unit_cylinder(12),
                len(rods),
                batched_scales=np.ones((len(rods), 3)),
                batched_colors=_MARK_TONE,
            )
            self.layers["Rods"].append(Layer(handle, Spanning(rods[:, 0], rods[:, 1], radius)))

    def _add_beams(self) -> None:
        """Elastic links as they bend, in place of the shapes that their file gives them."""
        thinnest = _SLENDEREST * self.size
        for mesh, is_round, unit in ((unit_cylinder(12), True, 0.5), (unit_box(), False, 1.0)):
            pieces = np.flatnonzero(self.beams.round == is_round)
            if not pieces.size:
                continue
            handle = self._add(
                "Flexible links",
                True,
                mesh,
                pieces.size,
                batched_scales=np.ones((pieces.size, 3)),
                batched_colors=np.zeros((pieces.size, 3), dtype=np.uint8),
            )
            scales = unit * np.maximum(self.beams.sizes[pieces], thinnest)
            place = Bending(pieces, scales, self.bends)
            self.layers["Flexible links"].append(Layer(handle, place))

    def _thickness(self) -> float:
        """Radius of the joint marks: small beside the links and, of short chains, the machine."""
        points = self._snapshot.joints[: self._model.n_joints, :3, 3]
        spans = np.linalg.norm(points - points[self._inboard], axis=1)[self._inboard >= 0]
        spans = spans[spans > 1e-6 * self.size]
        typical = float(np.mean(spans)) if spans.size else self.size
        return min(0.07 * typical, 0.02 * self.size)

    # -- loads ------------------------------------------------------------------------------

    def _add_loads(self, *, shown: bool, peaks: Array) -> None:
        """Arrows and arcs, dashed ones where rigid bodies do not determine the load; of large
        machines at joints here and there and at the most loaded one, and, unless switched on,
        hidden ones at every joint.
        """
        every = np.arange(len(self.places.names))
        arrow, arc = unit_arrow(10), unit_arc(6, 28)
        if not self._few:
            here = np.linspace(0, every.size - 1, _SPARSE_LOADS).astype(int)
            here = np.unique([*here, int(np.argmax(peaks))])
            arrow, arc = unit_arrow(3), unit_arc(3, 8)
            self._add_load_layers("Forces", "Moments", (arrow, arc), here, shown)
            self._add_load_layers("Every force", "Every moment", (arrow, arc), every, False)
        else:
            self._add_load_layers("Forces", "Moments", (arrow, arc), every, shown)

    def _add_load_layers(
        self, forces: str, moments: str, meshes: tuple[Mesh, Mesh], joints: Any, shown: bool
    ) -> None:
        dashed = (dashed_arrow(), dashed_arc())
        for half, (toggle, mesh) in enumerate(zip((forces, moments), meshes, strict=True)):
            is_open = np.zeros(len(joints), dtype=np.bool_)
            if self._known is not None:
                is_open = self._known.possible[joints, half]
            for shape, some, known in (
                (mesh, joints, True),
                (dashed[half], joints[is_open], False),
            ):
                if not some.size:
                    continue
                handle = self._add(
                    toggle,
                    shown,
                    shape,
                    some.size,
                    batched_scales=np.full(some.size, 1e-9),
                    batched_colors=np.zeros((some.size, 3), dtype=np.uint8),
                )
                self.layers[toggle].append(Layer(handle, Loads(half, self.style, some, known)))

    # -- view -------------------------------------------------------------------------------

    def _frame_camera(self, server: viser.ViserServer) -> None:
        self._scene.set_up_direction("+z")
        camera = server.initial_camera
        right, away = _across(self._snapshot)
        middle = self.center + 0.2 * self.size * right  # the panel covers the right of the window
        camera.position = middle + 1.5 * self.size * away
        camera.look_at = middle
        camera.fov = np.deg2rad(50)
        camera.near, camera.far = 1e-3 * self.size, 100 * self.size
        self._scene.world_axes.visible = False
        cell = 10.0 ** np.floor(np.log10(max(self.size, 1e-9)))
        grid = self._scene.add_grid(
            "/grid",
            width=4 * self.size,
            height=4 * self.size,
            cell_size=cell / 2,
            section_size=5 * cell / 2,
            position=(self.center[0], self.center[1], self._floor()),
            shadow_opacity=0.0,
            fade_distance=12 * self.size,
            cell_color=(225, 228, 232),
            section_color=(190, 196, 204),
        )
        self.toggles["Grid"] = True
        self.layers["Grid"].append(Layer(grid, Fixed()))

    def _floor(self) -> float:
        """Height of the grid: the lowest point, or the ground where the machine stands on it."""
        points = np.concatenate([self._snapshot.links[:, :3, 3], self._snapshot.joints[:, :3, 3]])
        return min(0.0, float(points[:, 2].min()) - 0.02 * self.size)


def _sparse_tree(inboard: Any, most: int) -> tuple[Any, Any]:
    """Segments (inboard ends, outboard ends) of a tree through about `most` of its joints.

    Kept are joints here and there, tips and the joints where branches part.
    """
    n = inboard.size
    branches = np.bincount(inboard[inboard >= 0], minlength=n)
    kept = branches != 1
    if np.count_nonzero(kept) > most:
        kept[:] = False
    kept[np.linspace(0, n - 1, most).astype(int)] = True
    nearest = np.full(n, -1)  # the kept joint at or inboard of each; joints come outward
    for joint, before in enumerate(inboard):
        nearest[joint] = joint if kept[joint] else (nearest[before] if before >= 0 else -1)
    outboard = np.array([k for k in np.flatnonzero(kept) if inboard[k] >= 0], dtype=int)
    ends = nearest[inboard[outboard]]
    return ends[ends >= 0], outboard[ends >= 0]


def _across(snapshot: Snapshot) -> tuple[Array, Array]:
    """Unit vectors to the right and to the camera, which sees the machine from its broad side."""
    points = np.concatenate([snapshot.links[:, :2, 3], snapshot.joints[:, :2, 3]])
    spread, axes = np.linalg.eigh(np.cov(points.T))
    x, y = axes[:, 1] if spread[1] > 1.5 * spread[0] else (1.0, 0.0)
    turn = 0.35  # not quite broadside, so that the picture has depth
    right = np.array([x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn), 0])
    right *= 1.0 if right[0] >= 0 else -1.0
    away = np.array([right[1], -right[0], 0.45])
    return right, away / np.linalg.norm(away)


def _extent(snapshots: list[Snapshot], model: _core.Model) -> tuple[Array, float]:
    """Centre and size of where the machine is: of its joint points, centres of mass and boxes."""
    boxes = equivalent_boxes(model.link_masses, model.link_inertias).edges
    found = []
    for snapshot in snapshots:
        centers = np.einsum("nij,nj->ni", snapshot.links[:, :3, :3], model.link_centers_of_mass)
        centers = (centers + snapshot.links[:, :3, 3])[model.link_masses > 0]
        found += [snapshot.joints[:, :3, 3], snapshot.links[:, :3, 3], centers]
    points = np.concatenate(found)
    low, high = points.min(axis=0), points.max(axis=0)
    size = float(np.linalg.norm(high - low))
    largest = float(np.median(boxes.max(axis=1))) if len(boxes) else 0.0
    return (low + high) / 2, max(size, largest, 1e-3)


def _stays_near(snapshot: Snapshot, model: _core.Model, edges: Array, offsets: Array) -> Any:
    """Which links' boxes lie about where the link is: between its joint points.

    An inertia that is published about a joint, with no first moment, gives a box that sticks out
    far behind the joint: true to the numbers, but no picture of the link.
    """
    names = {name: k for k, name in enumerate(model.link_names)}
    link_of = np.array([names[name] for name in model.child_link_names], dtype=int)
    inboard = np.array(model.joint_parents, dtype=int)
    points = snapshot.joints[:, :3, 3]
    outboard = np.flatnonzero(inboard >= 0)
    reach, middle = np.zeros(len(edges)), np.zeros((len(edges), 3))
    for joint in outboard:  # the farthest outboard joint point of each link
        link = link_of[inboard[joint]]
        span = points[joint] - points[inboard[joint]]
        distance = float(np.linalg.norm(span))
        if distance > reach[link]:
            reach[link] = distance
            middle[link] = points[inboard[joint]] + span / 2
    centers = (snapshot.links @ offsets)[:, :3, 3]
    far = np.linalg.norm(centers - middle, axis=1) + 0.5 * np.linalg.norm(edges, axis=1)
    return (reach == 0) | (far <= 0.8 * reach)
