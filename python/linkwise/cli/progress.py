"""A live line while simulating: simulated time, speed, time left. Silent off a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol

from linkwise.cli.output import console

if TYPE_CHECKING:
    from linkwise.simulation.time_loop import Progress


def _clock(seconds: float) -> str:
    if seconds == float("inf"):
        return "-:--"
    whole = round(seconds)
    hours, minutes = divmod(whole // 60, 60)
    return f"{hours}:{minutes:02}:{whole % 60:02}" if hours else f"{minutes}:{whole % 60:02}"


def describe(progress: Progress) -> str:
    """The figures of one moment, as the live line shows them."""
    stiff = "   stiff" if progress.stiff else ""
    return (
        f"t = {progress.time:.3f} of {progress.duration:g} s   "
        f"{progress.speed:.3g} x real time   {_clock(progress.remaining)} left{stiff}"
    )


@contextmanager
def live_progress(quiet: bool) -> Iterator[Callable[[Progress], None] | None]:
    """A callback for `simulate`, or None when there is nobody to watch."""
    screen = console(stderr=True)
    if quiet or not screen.is_terminal:
        yield None
        return
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bar

    with Bar(BarColumn(), TextColumn("{task.description}"), console=screen, transient=True) as bar:
        task = bar.add_task("starting", total=1.0)

        def show(progress: Progress) -> None:
            fraction = progress.time / progress.duration if progress.duration else 1.0
            bar.update(task, completed=fraction, description=describe(progress))

        yield show


class Step(Protocol):
    """What is about to be computed, and how many of how many steps are done."""

    @property
    def what(self) -> str: ...
    @property
    def done(self) -> int: ...
    @property
    def total(self) -> int: ...


@contextmanager
def live_steps(quiet: bool) -> Iterator[Callable[[Step], None] | None]:
    """A callback for work of many steps, or None when there is nobody to watch."""
    screen = console(stderr=True)
    if quiet or not screen.is_terminal:
        yield None
        return
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns = (BarColumn(), TimeElapsedColumn(), TextColumn("{task.description}"))
    with Bar(*columns, console=screen, transient=True) as bar:
        task = bar.add_task("starting", total=None)

        def show(step: Step) -> None:
            bar.update(task, completed=step.done, total=step.total, description=step.what)

        yield show
