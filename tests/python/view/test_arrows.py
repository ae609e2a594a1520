"""Loads as arrows: frame, length and colour."""

import numpy as np
import pytest

from linkwise.view.arrows import color_bar, colors_of, in_world, instances


def test_loads_are_turned_from_joint_axes_into_the_world():
    frame = np.eye(4)
    frame[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]  # joint x points along world y
    frame[:3, 3] = [7, 8, 9]
    force, moment = in_world(frame[None], np.array([[1.0, 0, 0, 0, 2, 3]]))
    assert force[0] == pytest.approx([0, 1, 0])
    assert moment[0] == pytest.approx([-2, 0, 3])


def test_length_and_colour_follow_the_magnitude():
    vectors = np.array([[0.0, 0, 4], [0, 2, 0], [0, 0, 0]])
    made = instances(np.zeros((3, 3)), vectors, largest=4.0, longest=10.0)
    assert made.scales[:2] == pytest.approx([10, 5])
    assert 0 < made.scales[2] < 1e-6
    assert made.colors[0].tolist() == colors_of(np.array([1.0]))[0].tolist()
    assert made.colors[1].tolist() == colors_of(np.array([0.5]))[0].tolist()
    assert made.quaternions[0] == pytest.approx([1, 0, 0, 0])


def test_nothing_and_nonsense_are_drawn_as_nothing():
    vectors = np.array([[np.nan, 0, 0], [np.inf, 0, 0], [1.0, 0, 0]])
    for largest in (0.0, 1.0):
        made = instances(np.zeros((3, 3)), vectors, largest=largest, longest=1.0)
        assert np.all(np.isfinite(made.scales))
        assert np.all(made.scales[:2] < 1e-6)


def test_colours_darken_with_the_load():
    grey = colors_of(np.linspace(0, 1, 20)) @ [0.299, 0.587, 0.114]
    assert np.all(np.diff(grey) < 0)
    assert color_bar().startswith("linear-gradient(")
