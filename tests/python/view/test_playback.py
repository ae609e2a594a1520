"""Time of a playback."""

import numpy as np
import pytest

from linkwise.view.playback import Playback, sample_at


def test_plays_at_its_speed_while_playing():
    playback = Playback(1.0, 5.0)
    assert not playback.advance(1.0)
    assert playback.time == 1.0
    playback.play()
    playback.speed = 0.5
    assert playback.advance(2.0)
    assert playback.time == pytest.approx(2.0)
    playback.pause()
    assert not playback.advance(1.0)


def test_loops():
    playback = Playback(1.0, 5.0)
    playback.play()
    playback.advance(9.5)
    assert playback.time == pytest.approx(2.5)
    assert playback.playing


def test_stops_at_the_end_and_starts_over():
    playback = Playback(1.0, 5.0, loop=False)
    playback.play()
    playback.advance(100.0)
    assert playback.time == 5.0
    assert not playback.playing
    playback.play()
    assert playback.time == 1.0


def test_seeks_within_the_run():
    playback = Playback(1.0, 5.0)
    for asked, found in ((3.0, 3.0), (-1.0, 1.0), (9.0, 5.0)):
        playback.seek(asked)
        assert playback.time == found


def test_run_of_one_sample_does_not_play():
    playback = Playback(2.0, 2.0)
    playback.play()
    assert not playback.advance(1.0)
    assert playback.time == 2.0


@pytest.mark.parametrize(
    ("time", "sample"), [(-1, 0), (0, 0), (0.4, 0), (0.6, 1), (2.4, 1), (2.6, 2), (4, 2), (9, 2)]
)
def test_nearest_sample(time, sample):
    assert sample_at(np.array([0.0, 1.0, 4.0]), time) == sample
