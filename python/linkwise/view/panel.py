"""The controls beside the scene. Callbacks note requests; `live` acts on them in one thread."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from typing import TYPE_CHECKING, Any

from linkwise.notes import warning_lines
from linkwise.view.arrows import color_bar, use_bar
from linkwise.view.playback import SPEEDS, Playback

if TYPE_CHECKING:
    import viser

    from linkwise._core import Model
    from linkwise.view.scene import Scene
    from linkwise.view.source import Source

MOST_CHOICES = 300  # joints in a drop-down list; of more, one is named or clicked


@dataclass
class Requests:
    """What users asked for and is not yet done."""

    toggles: dict[str, bool] = field(default_factory=dict)
    joint: str | None = None
    causes: dict[str, bool] = field(default_factory=dict)
    by_rating: bool | None = None
    redraw: bool = False


def legend(largest: tuple[float, float], by_rating: bool = False) -> str:
    """The meaning of colours and lengths as HTML."""
    longest = f"{largest[0]:.4g} N (arrows), {largest[1]:.4g} N m (arcs)"
    bar = use_bar() if by_rating else color_bar()
    ends = ["0", "of the rating: 100 %", "over"] if by_rating else ["0", longest]
    labels = "".join(f"<span>{end}</span>" for end in ends)
    below = f"<div>longest: {longest}; grey: not rated</div>" if by_rating else ""
    return (
        '<div style="padding:4px 12px;font-size:12px">'
        f'<div style="height:8px;border-radius:4px;background:{bar}"></div>'
        f'<div style="display:flex;justify-content:space-between">{labels}</div>{below}</div>'
    )


def add_load_choices(
    server: viser.ViserServer,
    causes: Sequence[str],
    chosen: set[str],
    rated: bool | None,
    requests: Requests,
) -> None:
    """Checkboxes of causes, and of the colours' meaning where there are ratings (None: none)."""
    if rated is not None:
        rating = server.gui.add_checkbox("Colour by rating", rated)

        def recolor(event: Any) -> None:
            requests.by_rating = rating.value

        rating.on_update(recolor)
    if len(causes) < 2:
        return
    with server.gui.add_folder("Caused by"):
        for name in causes:
            box = server.gui.add_checkbox(name, name in chosen)

            def note(event: Any, name: str = name, box: Any = box) -> None:
                requests.causes[name] = box.value

            box.on_update(note)


def add_show_folder(server: viser.ViserServer, scene: Scene, requests: Requests) -> None:
    """One checkbox per layer, and the length of arrows."""
    with server.gui.add_folder("Show"):
        for name, shown in scene.toggles.items():
            box = server.gui.add_checkbox(name, shown)

            def note(event: Any, name: str = name, box: Any = box) -> None:
                requests.toggles[name] = box.value

            box.on_update(note)
        if "Forces" in scene.toggles:
            slider = server.gui.add_slider("Arrow size", min=0.1, max=4.0, step=0.1,
                                           initial_value=1.0)  # fmt: skip

            def resize(event: Any) -> None:
                scene.set_arrow_scale(slider.value)
                requests.redraw = True

            slider.on_update(resize)


class PlaybackControls:
    """Play and pause, time, speed, loop."""

    def __init__(self, server: viser.ViserServer, playback: Playback, requests: Requests) -> None:
        self._playback = playback
        span = playback.end - playback.start
        with server.gui.add_folder("Playback"):
            self._button = server.gui.add_button("Play")
            self._time: Any = server.gui.add_slider(
                "Time [s]",
                min=playback.start,
                max=playback.end if span > 0 else playback.start + 1,
                step=max(span / 2000, 1e-9),
                initial_value=playback.start,
            )
            self._speed = server.gui.add_dropdown("Speed", tuple(SPEEDS), initial_value="1")
            self._loop = server.gui.add_checkbox("Loop", playback.loop)
        self._label = "Play"

        def press(event: Any) -> None:
            if playback.playing:
                playback.pause()
            else:
                playback.play()
            requests.redraw = True

        def scrub(event: Any) -> None:
            if event.client is not None:  # by a person, not by `show`
                playback.pause()
                playback.seek(self._time.value)
                requests.redraw = True

        def set_speed(event: Any) -> None:
            playback.speed = SPEEDS.get(self._speed.value, playback.speed)

        def set_loop(event: Any) -> None:
            playback.loop = self._loop.value

        self._button.on_click(press)
        self._time.on_update(scrub)
        self._speed.on_update(set_speed)
        self._loop.on_update(set_loop)

    def show(self) -> None:
        """Follow the playback."""
        label = "Pause" if self._playback.playing else "Play"
        if label != self._label:
            self._button.label = self._label = label
        if self._playback.playing or self._time.value != self._playback.time:
            self._time.value = self._playback.time


class JointChoice:
    """The joint whose load is plotted: chosen from a list, by name, or by a click on its mark."""

    def __init__(
        self, server: viser.ViserServer, scene: Scene, names: list[str], requests: Requests
    ) -> None:
        self._many = len(names) > MOST_CHOICES
        self._input: Any
        if self._many:
            self._input = server.gui.add_text("Joint", names[0], hint="name of a joint")
        else:
            self._input = server.gui.add_dropdown("Joint", tuple(names), initial_value=names[0])
        self._known = set(names)
        self._text = server.gui.add_html("")

        def choose(event: Any) -> None:
            if self._input.value in self._known:
                requests.joint = self._input.value
            else:
                self.tell(f"there is no joint {self._input.value!r}")

        def click(event: Any) -> None:
            if event.instance_index in range(len(names)):
                self._input.value = names[event.instance_index]
                requests.joint = names[event.instance_index]

        self._input.on_update(choose)
        if scene.joint_marks is not None:
            scene.joint_marks.on_click(click)

    def tell(self, text: str) -> None:
        with contextlib.suppress(AttributeError):
            self._text.content = (
                f'<div style="padding:2px 12px;font-size:12px">{escape(text)}</div>'
            )


def headline(source: Source) -> str:
    """What is shown, as HTML."""
    model = source.model
    lines = [f"<b>{escape(source.title)}</b>: {_counted(model)}, {model.total_mass:.4g} kg"]
    lines += [escape(note) for note in source.notes]
    lines += [escape(f"warning: {line}") for line in warning_lines(source.warnings)]
    return f'<div style="padding:4px 12px;font-size:13px">{"<br>".join(lines)}</div>'


def _counted(model: Model) -> str:
    count = model.n_joints + model.n_loops
    closing = f", {model.n_loops} of which close loops" if model.n_loops else ""
    return f"{count} joints{closing}"
