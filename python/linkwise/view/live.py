"""The view in the browser: one thread that moves time, acts on requests and draws."""

from __future__ import annotations

import threading
import time as clock
import webbrowser
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.base import lengths
from linkwise.view.beams import bend_legend
from linkwise.view.joint_sliders import JointSliders
from linkwise.view.known import elsewhere
from linkwise.view.load_plot import LoadPlot
from linkwise.view.panel import (
    JointChoice,
    PlaybackControls,
    Requests,
    add_load_choices,
    add_show_folder,
    headline,
    legend,
)
from linkwise.view.playback import Playback, sample_at
from linkwise.view.pose import Pose
from linkwise.view.scene import Scene
from linkwise.view.server import running
from linkwise.view.shown_loads import rating_use
from linkwise.view.source import Recording, Source

if TYPE_CHECKING:
    import viser

_FRAME = 1 / 30
_PLOT_INTERVAL = 0.1


class View:
    """A source on a server: the scene, the panel, and what moves them.

    posable: whether a model alone gets sliders.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        source: Source,
        *,
        by_rating: bool = False,
        posable: bool = True,
    ) -> None:
        self._source = source
        self._requests = Requests(redraw=True)
        self._joint = 0
        self._sample = -1
        self._told = self._drawn = 0.0
        server.gui.add_html(headline(source))
        self.scene = Scene(server, source)
        recording = source.recording
        self._use = rating_use(source.model, source.ratings, by_rating)
        self.scene.style.use = self._use if by_rating else None
        self._largest = (0.0, 0.0) if recording is None else recording.largest
        self._plot: LoadPlot | None = None
        self._choice: JointChoice | None = None
        self._playback: Playback | None = None
        if recording is not None:
            self.scene.style.largest = recording.largest
            self._playback = Playback(float(recording.times[0]), float(recording.times[-1]))
            self._controls = PlaybackControls(server, self._playback, self._requests)
        self._sliders: JointSliders | None = None
        self._pose = Pose(source.model, source.held)
        if recording is None and posable:
            self._sliders = JointSliders(
                server,
                source.model,
                0.5 * self.scene.size,
                self._requests,
                source.first_position,
            )
        if recording is None or recording.has_loads:
            self._add_loads(server, recording, by_rating)
        self._bends: Any = None
        if self.scene.beams.count:
            with server.gui.add_folder("Flexible links"):
                self._bends = server.gui.add_html(bend_legend(self.scene.bends.largest))
        add_show_folder(server, self.scene, self._requests)

    def _add_loads(
        self, server: viser.ViserServer, recording: Recording | None, by_rating: bool
    ) -> None:
        with server.gui.add_folder("Joint load"):
            self._legend = server.gui.add_html(legend(self._largest, by_rating))
            names = self.scene.places.names
            self._choice = JointChoice(server, self.scene, names, self._requests)
            if recording is not None:
                known = self._source.known
                self._plot = LoadPlot(
                    server, recording, None if known is None else known.throughout
                )
                self._plot.choose(0)
            causes = recording.causes if recording is not None else None
            add_load_choices(
                server,
                causes.names if causes else [],
                causes.chosen if causes else set(),
                None if self._use is None else by_rating,
                self._requests,
            )

    def step(self, seconds: float) -> None:
        """Let wall time pass and draw what changed."""
        requests, self._requests.redraw = self._requests.redraw, False
        while self._requests.toggles:
            self.scene.toggle(*self._requests.toggles.popitem())
        requests = self._take_load_choices() or requests
        if self._requests.joint is not None:
            self._joint = self.scene.places.names.index(self._requests.joint)
            self._requests.joint = None
            if self._plot is not None:
                self._plot.choose(self._joint)
            requests = True
        if self._source.recording is None:
            if requests:
                self._draw_pose()
        else:
            self._draw_sample(self._source.recording, seconds, requests)

    def _take_load_choices(self) -> bool:
        """Which causes are shown and what colours mean; whether anything has changed."""
        changed = False
        recording = self._source.recording
        if self._requests.causes and recording is not None and recording.causes is not None:
            causes, changed = recording.causes, True
            chosen = set(causes.chosen)
            while self._requests.causes:
                name, shown = self._requests.causes.popitem()
                chosen = chosen | {name} if shown else chosen - {name}
            causes.choose(sorted(chosen))
            if self._plot is not None:
                self._plot.choose(self._joint)
        if self._requests.by_rating is not None:
            by_rating, self._requests.by_rating = self._requests.by_rating, None
            self.scene.style.use = self._use if by_rating else None
            self._legend.content = legend(self._largest, by_rating)
            changed = True
        return changed

    def _draw_pose(self) -> None:
        if self._sliders is None:
            q = self._pose.assembled(self._source.first_position, None)
        else:
            q = self._pose.assembled(self._sliders.q.copy(), self._sliders.moved)
            self._sliders.follow(q)
        loads = self._pose.loads(q)
        largest = tuple(
            float(lengths(half).max(initial=0.0)) for half in (loads[:, :3], loads[:, 3:])
        )
        self._largest = (largest[0], largest[1])
        self.scene.style.largest = self._largest
        snapshot = self.scene.at(q, loads)
        if snapshot.beams is not None:
            self.scene.bends.largest = float(snapshot.beams.moments.max())
            self._bends.content = bend_legend(self.scene.bends.largest)
        self.scene.show(snapshot)
        self._legend.content = legend(self._largest, self.scene.style.use is not None)
        self._tell("held still: ", loads[self._joint], self._pose.told)

    def _draw_sample(self, recording: Recording, seconds: float, forced: bool) -> None:
        playback = self._playback
        assert playback is not None
        moved = playback.advance(seconds)
        if not (moved or forced):
            return
        sample = sample_at(recording.times, playback.time)
        now = clock.monotonic()
        due = forced or not playback.playing or now - self._drawn > self.scene.drawing_time
        if due and (sample != self._sample or forced):
            self._sample, self._drawn = sample, now
            loads = recording.load(sample) if recording.has_loads else None
            self.scene.show(self.scene.at(recording.position(sample), loads))
        if forced or not playback.playing or now - self._told > _PLOT_INTERVAL:
            self._told = now
            self._controls.show()
            if self._plot is not None:
                self._plot.show(playback.time)
                self._tell(
                    f"t = {recording.times[sample]:.4g} s: ", recording.load(sample)[self._joint]
                )

    def _tell(self, head: str, load: np.ndarray, tail: str = "") -> None:
        if self._choice is not None:
            sizes = [f"{size:.4g}" for size in lengths(load.reshape(2, 3))]
            if self.scene.known is not None and self._source.known is not None:
                known = self.scene.known[self._joint]
                sizes = [x if one else f"({x})" for x, one in zip(sizes, known, strict=True)]
                other = elsewhere(known, self._source.known.sometimes[self._joint])
                tail = "; ".join(filter(None, (other, tail)))
            tail = f"; {tail}" if tail else ""
            self._choice.tell(f"{head}{sizes[0]} N, {sizes[1]} N m{tail}")


def show(
    source: Source,
    *,
    host: str,
    port: int,
    open_browser: bool,
    started: Callable[[str], object],
    stop: threading.Event | None = None,
    by_rating: bool = False,
) -> None:
    """Serve until Ctrl-C (or `stop`); `started` is told the address."""
    with running(host, port, source.title) as server:
        view = View(server, source, by_rating=by_rating)
        view.step(0.0)
        started(server.address)
        if open_browser:
            webbrowser.open(server.address)
        before = clock.monotonic()
        ended = stop or threading.Event()
        while True:
            now = clock.monotonic()
            view.step(now - before)
            before = now
            if ended.wait(max(0.005, _FRAME - (clock.monotonic() - now))):
                return
