"""A scene that plays offline: one HTML file with viser's client, the data, and what plays it.

The page is the live view's: viser's client unchanged with the messages that a server sends to a new
client, and `player.js` in the place of the server.
"""

from __future__ import annotations

import base64
import gzip
import json
import os
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from linkwise import _core
from linkwise._core import InputError
from linkwise.base import AnyArray, Array
from linkwise.io import writing
from linkwise.view import arrows
from linkwise.view.beams import Beams, rows_of
from linkwise.view.live import View
from linkwise.view.load_plot import lines_of
from linkwise.view.panel import legend
from linkwise.view.places import Places
from linkwise.view.pose import Pose
from linkwise.view.server import LOCAL, client_page, replay, running
from linkwise.view.shapes import quaternions
from linkwise.view.shown_loads import rating_use
from linkwise.view.source import Source

if TYPE_CHECKING:
    from linkwise._core import Model
    from linkwise.view.scene import Scene

FRAMES_PER_SECOND = 30
MOST_FRAMES = 3000
MOST_BYTES = 192 << 20
"""Of poses and loads before compression; longer runs of larger machines get fewer frames."""


class Exported(NamedTuple):
    """What was written: path, frames, seconds of playback and bytes."""

    path: Path
    frames: int
    duration: float
    bytes: int


class Animation(NamedTuple):
    """What moves, over the frames of the film.

    poses: (frames, n, 7: position, quaternion with its scalar first) of the joints' places, then of
    those links' frames that are not one of them; link_poses: where each link's is in there;
    loads: (frames, causes, n_joints, 6) of the causes named; known: (frames or 1, n_joints, 2)
    which forces and moments are determinate, None: all; beams: (frames, pieces, 9) of elastic
    links.
    """

    times: Array
    poses: npt.NDArray[np.float32]
    link_poses: npt.NDArray[np.int64]
    loads: npt.NDArray[np.float32]
    causes: list[str]
    known: AnyArray | None = None
    beams: npt.NDArray[np.float32] = np.zeros((0, 0, 9), dtype=np.float32)


class Blob:
    """Arrays one after the other; in JSON each is a placeholder, as in viser's own messages."""

    def __init__(self) -> None:
        self.parts: list[memoryview] = []

    def add(self, values: Any, dtype: str) -> dict[str, Any]:
        self.parts.append(np.ascontiguousarray(values, dtype=dtype).data)
        return {"__binary_index": len(self.parts) - 1, "dtype": dtype}

    def packed(self, content: dict[str, Any]) -> str:
        """Base64 of the compressed content: length of the JSON, JSON, arrays at multiples of 8."""

        def other(value: Any) -> dict[str, Any]:
            if isinstance(value, np.ndarray):
                return self.add(value, "<i4" if value.dtype.kind == "i" else "<f4")
            return self.add(np.frombuffer(value, dtype=np.uint8), "|u1")

        text = json.dumps({"content": content}, default=other, allow_nan=False)[:-1]
        head = f'{text}, "lengths": {[part.nbytes for part in self.parts]}}}'.encode()
        out = bytearray(len(head).to_bytes(8, "little") + head)
        for part in self.parts:
            out += bytes(-len(out) % 8)
            out += part.cast("B") if part.nbytes else b""
        return base64.b64encode(gzip.compress(out, 6)).decode("ascii")


def check_file(path: str | os.PathLike[str]) -> Path:
    """The path of an HTML file that can be written, or InputError."""
    file = Path(os.path.abspath(path))
    shown = f"export {str(path)!r}"
    if file.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{shown}: is an HTML file; give a name that ends in .html")
    writing.check_file(file)
    return file


def frame_samples(times: Any, frame_bytes: int) -> Any:
    """Which samples become frames: evenly in time, as many as the size allows."""
    span = float(times[-1] - times[0])
    fitting = max(2, MOST_BYTES // max(1, frame_bytes))
    count = min(int(span * FRAMES_PER_SECOND) + 1, MOST_FRAMES, fitting)
    wanted = np.linspace(times[0], times[-1], max(2, count))
    return np.unique(np.clip(np.searchsorted(times, wanted), 0, len(times) - 1))


def write_html(
    source: Source, path: str | os.PathLike[str], *, by_rating: bool = False
) -> Exported:
    """Write the source as a file that needs neither network nor linkwise.

    A run becomes a film of its samples with the panel of the live view, a model a still of the
    machine at rest. by_rating: colours show how much of the ratings loads use from the start.
    """
    file = check_file(path)
    animation = _still(source) if source.recording is None else _film(source)
    with running(LOCAL, 0, source.title) as server:
        view = View(server, source, by_rating=by_rating, posable=False)
        view.step(0.0)
        content = _content(source, view.scene, animation)
        content["byRating"] = by_rating
        blob = Blob()
        content["messages"] = replay(server, blob.parts)
    page = _page(source.title, blob, content)
    writing.write_text(file, page)
    duration = float(animation.times[-1] - animation.times[0])
    return Exported(Path(path), animation.times.size, duration, len(page.encode("utf-8")))


def _link_poses(model: Model, places: Places, q: Array) -> npt.NDArray[np.int64]:
    """Where each link's pose is among those of the joints' places and then of other links.

    A body is named after one of its links, whose frame is the joint's in most files: two frames of
    one rigid body that agree in one position agree in all.
    """
    links = _core.link_poses(model, q)
    joints = places.frames(links, q)
    index = {name: k for k, name in enumerate(model.link_names)}
    found = np.full(len(links), -1)
    for joint, body in enumerate(model.child_link_names):
        if np.array_equal(links[index[body]], joints[joint]):
            found[index[body]] = joint
    others = np.flatnonzero(found < 0)
    found[others] = len(joints) + np.arange(others.size)
    return found


def _poses(model: Model, places: Places, q: Array, link_poses: npt.NDArray[np.int64]) -> Array:
    links = _core.link_poses(model, q)
    joints = places.frames(links, q)
    frames = np.concatenate([joints, links[link_poses >= len(joints)]])
    return np.concatenate([frames[:, :3, 3], quaternions(frames[:, :3, :3])], axis=1)


def _still(source: Source) -> Animation:
    model, places, pose = source.model, Places(source.model), Pose(source.model, source.held)
    q = pose.assembled(source.first_position, None)
    where = _link_poses(model, places, q)
    poses, loads = _poses(model, places, q, where)[None], pose.loads(q)[None, None]
    known = None if source.known is None else source.known.at(q)[None]
    still = poses.astype(np.float32), where, loads.astype(np.float32)
    bent = Beams(model).at(_core.link_poses(model, q), q)
    beams = np.zeros((1, 0, 9)) if bent is None else rows_of(bent)[None]
    return Animation(np.zeros(1), *still, [], known, beams.astype(np.float32))


def _film(source: Source) -> Animation:
    recording, model = source.recording, source.model
    assert recording is not None
    causes = recording.causes.names if recording.causes is not None else []
    parts = max(1, len(causes)) if recording.has_loads else 0
    places = Places(model)
    n_joints = len(places.names)
    where = _link_poses(model, places, recording.position(0))
    n_poses = len(_poses(model, places, recording.position(0), where))
    bending = Beams(model)
    floats = 7 * n_poses + 6 * parts * n_joints + 9 * bending.count
    chosen = frame_samples(recording.times, 4 * floats)
    poses = np.empty((chosen.size, n_poses, 7), dtype=np.float32)
    loads = np.empty((chosen.size, parts, n_joints, 6), dtype=np.float32)
    beams = np.empty((chosen.size, bending.count, 9), dtype=np.float32)
    for k, sample in enumerate(chosen):
        q = recording.position(sample)
        poses[k] = _poses(model, places, q, where)
        bent = bending.at(_core.link_poses(model, q), q)
        if bent is not None:
            beams[k] = rows_of(bent)
        if parts and not causes:
            loads[k, 0] = recording.load(sample)
    if causes:
        assert recording.causes is not None
        loads[:] = recording.causes.shares(chosen)[:, :, : loads.shape[2]]
    known = _known(source, chosen) if parts else None
    return Animation(recording.times[chosen], poses, where, loads, causes, known, beams)


def _known(source: Source, samples: Any) -> AnyArray | None:
    """(samples, or 1 where they are alike; joints, 2) what is determinate, None: all."""
    recording = source.recording
    if source.known is None or recording is None:
        return None
    looked = samples if source.known.varies else samples[:1]
    found = np.array([source.known.at(recording.position(sample)) for sample in looked])
    return found[:1] if (found == found[0]).all() else found


def _content(source: Source, scene: Scene, animation: Animation) -> dict[str, Any]:
    """Everything that player.js needs but the messages."""
    recording = source.recording
    largest = scene.style.largest
    layers = [
        {"toggle": toggle, "name": layer.handle.name, **layer.place.plan()}
        for toggle, layers in scene.layers.items()
        for layer in layers
    ]
    for layer in layers:
        if "links" in layer:
            layer["links"] = animation.link_poses[layer["links"]]
    names = scene.places.names
    use = rating_use(source.model, source.ratings, needed=False)
    rating = None
    if use is not None:
        rating = {"directions": np.nan_to_num(use.directions, nan=np.inf), "limits": use.limits}
    chosen = animation.causes
    if recording is not None and recording.causes is not None:
        chosen = sorted(recording.causes.chosen)
    return {
        "times": [float(t) for t in animation.times],
        "poses": animation.poses,
        "loads": animation.loads,
        "beams": animation.beams,
        "largestBending": scene.bends.largest,
        "causes": animation.causes,
        "chosen": chosen,
        "jointNames": names,
        "toggles": scene.toggles,
        "layers": layers,
        "largest": largest,
        "longest": scene.style.longest,
        "rating": rating,
        "legends": [legend(largest, by_rating) for by_rating in (False, True)],
        "colors": arrows.color_table(),
        "film": recording is not None,
        **_marks(source, animation),
    }


def _marks(source: Source, animation: Animation) -> dict[str, Any]:
    """What is dashed, dotted or in brackets: `known` per frame or once, joint and half, null where
    all is; `sometimes` open, per joint and half; `lines` of the plots of each joint."""
    known = source.known
    if known is None or animation.known is None:
        return {"known": None, "sometimes": None, "lines": None}
    lines = [[lines_of(half, own) for half in (0, 1)] for own in known.throughout]
    return {
        "known": animation.known.astype(np.int32).reshape(-1),
        "sometimes": known.sometimes.reshape(-1).tolist(),
        "lines": lines,
    }


def _page(title: str, blob: Blob, content: dict[str, Any]) -> str:
    """viser's page with the data and the player ahead of its own scripts."""
    script = (Path(__file__).parent / "player.js").read_text(encoding="utf-8")
    page = client_page()
    at = page.index("</head>")
    ours = (
        f"<script type='text/plain' id='linkwise-data'>{blob.packed(content)}</script>"
        f"<script>{script}</script>"
    )
    page = page[:at] + ours + page[at:]
    return page.replace("<title>Viser</title>", f"<title>{escape(title)}</title>", 1)
