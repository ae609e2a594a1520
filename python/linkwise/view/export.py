"""A scene that plays offline: one HTML file with viser's own player inside."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from linkwise._core import InputError
from linkwise.view.player import overlay
from linkwise.view.scene import Scene
from linkwise.view.server import LOCAL, running
from linkwise.view.shown_loads import rating_use
from linkwise.view.source import Source, static_loads

FRAMES_PER_SECOND = 30
MOST_FRAMES = 3000
MOST_BYTES = 192 << 20
"""Of poses before compression; longer runs of larger machines get fewer frames."""
_BYTES_PER_JOINT = 150


class Exported(NamedTuple):
    """What was written: path, frames, seconds of playback and bytes."""

    path: Path
    frames: int
    duration: float
    bytes: int


def check_file(path: str | os.PathLike[str]) -> Path:
    """The path of an HTML file that can be written, or InputError."""
    file = Path(path)
    shown = f"export {str(path)!r}"
    if file.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{shown}: is an HTML file; give a name that ends in .html")
    if not file.parent.is_dir():
        raise InputError(f"{shown}: folder {str(file.parent)!r} does not exist; create it first")
    if file.is_dir() or not os.access(file if file.exists() else file.parent, os.W_OK):
        raise InputError(f"{shown}: cannot be written; choose another path")
    return file


def frame_samples(times: Any, n_joints: int) -> Any:
    """Which samples become frames: evenly in time, as many as the size allows."""
    span = float(times[-1] - times[0])
    fitting = max(2, MOST_BYTES // (_BYTES_PER_JOINT * max(1, n_joints)))
    count = min(int(span * FRAMES_PER_SECOND) + 1, MOST_FRAMES, fitting)
    wanted = np.linspace(times[0], times[-1], max(2, count))
    return np.unique(np.clip(np.searchsorted(times, wanted), 0, len(times) - 1))


def write_html(
    source: Source, path: str | os.PathLike[str], *, by_rating: bool = False
) -> Exported:
    """Write the source as a file that needs neither network nor linkwise.

    A run becomes a film of its samples with their loads and a plot of the load of a joint, a model
    a still with nothing moving. by_rating: colours show how much of the ratings loads use.
    """
    file = check_file(path)
    use = rating_use(source, by_rating)
    with running(LOCAL, 0, source.title) as server:
        scene = Scene(server, source)
        scene.use = use if by_rating else None
        recording = source.recording
        if recording is None:
            q = source.model.neutral_configuration()
            scene.show(scene.at(q, static_loads(source.model, q)))
            html, frames, duration = server.get_scene_serializer().as_html(), 1, 0.0
        else:
            scene.set_largest(*recording.largest)
            chosen = frame_samples(recording.times, source.model.n_joints)
            serializer = None
            for k, sample in enumerate(chosen):
                loads = recording.load(sample) if recording.has_loads else None
                scene.show(scene.at(recording.position(sample), loads))
                if serializer is None:  # it begins with the scene as it is
                    serializer = server.get_scene_serializer()
                after = chosen[min(k + 1, len(chosen) - 1)]
                serializer.insert_sleep(float(recording.times[after] - recording.times[sample]))
            assert serializer is not None
            html, frames = serializer.as_html(), len(chosen)
            duration = float(recording.times[chosen[-1]] - recording.times[chosen[0]])
    html = _with_overlay(html, overlay(source, by_rating=by_rating))
    try:
        file.write_text(html, encoding="utf-8")
    except OSError as error:
        raise InputError(
            f"export {str(path)!r}: cannot be written ({error.strerror}); choose another path"
        ) from None
    return Exported(file, frames, duration, file.stat().st_size)


def _with_overlay(html: str, overlay: str) -> str:
    before, found, after = html.rpartition("</body>")
    return before + overlay + found + after if found else html + overlay
