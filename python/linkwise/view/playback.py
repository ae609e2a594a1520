"""Where a playback is in time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

SPEEDS = {"1/100": 0.01, "1/10": 0.1, "1/4": 0.25, "1/2": 0.5, "1": 1.0, "2": 2.0, "5": 5.0,
          "10": 10.0, "100": 100.0}  # fmt: skip


@dataclass
class Playback:
    """Time between `start` and `end` [s], moved by the wall clock while `playing`."""

    start: float
    end: float
    time: float = 0.0
    speed: float = 1.0
    playing: bool = False
    loop: bool = True

    def __post_init__(self) -> None:
        self.time = self.start

    def play(self) -> None:
        """Go on, or start again if the end was reached."""
        if self.time >= self.end:
            self.time = self.start
        self.playing = self.end > self.start

    def pause(self) -> None:
        self.playing = False

    def seek(self, time: float) -> None:
        self.time = min(max(time, self.start), self.end)

    def advance(self, seconds: float) -> bool:
        """Let wall time pass; whether the time has changed."""
        if not self.playing or seconds <= 0:
            return False
        ahead = self.time + seconds * self.speed
        if ahead < self.end:
            self.time = ahead
        elif self.loop:
            self.time = self.start + (ahead - self.start) % (self.end - self.start)
        else:
            self.time = self.end
            self.playing = False
        return True


def sample_at(times: npt.NDArray[np.float64], time: float) -> int:
    """Index of the sample nearest to `time`."""
    after = int(np.searchsorted(times, time))
    if after == 0:
        return 0
    if after == times.size:
        return int(times.size) - 1
    return after if times[after] - time < time - times[after - 1] else after - 1
