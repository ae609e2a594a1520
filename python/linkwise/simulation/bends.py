"""Whether elastic links of a run bend further than their coordinates can follow."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from linkwise import _core
from linkwise._core import Model
from linkwise.base import AnyArray, Array
from linkwise.notes import Ignored

#: What a beam follows to 1 %: rad from its start to its end. Its deflection errs by some 0.44 of
#: the square (tests/python/test_flexible_links.py).
FOLLOWED = 0.15
_ERROR = 0.44


class Bends:
    """The largest angle between start and end of each elastic link, over the samples.

    Args:
        model: The machine of the run.
    """

    #: Of each chunk of samples.
    needs = ("position",)

    def __init__(self, model: Model) -> None:
        self._model = model
        self._kinds = model.flexible_links
        self._links = list(self._kinds)
        self._most = np.zeros(len(self._links))
        self._when = np.zeros(len(self._links))

    @property
    def none(self) -> bool:
        """Has the machine no elastic link?"""
        return not self._links

    def see(self, chunk: Mapping[str, Array]) -> None:
        """The next samples, of which position (time, nq) and time are taken."""
        self.take(chunk["position"], chunk["time"])

    def take(self, positions: AnyArray, times: AnyArray) -> None:
        """Positions (time, nq) at `times` [s]; those of a run that went astray are passed over."""
        whole = np.isfinite(positions).all(axis=-1)
        if self.none or not whole.any():
            return
        angles = _core.elastic_angles(self._model, positions[whole])
        at = angles.argmax(axis=0)
        most = angles[at, np.arange(len(self._links))]
        self._when = np.where(most > self._most, times[whole][at], self._when)
        self._most = np.maximum(most, self._most)

    def notes(self) -> list[Ignored]:
        """A warning for each link, as it was made flexible, that bends too far."""
        worst: dict[str, int] = {}
        count: dict[str, int] = {}
        for k, name in enumerate(self._links):
            whole, _, number = name.rpartition(":")
            link = whole if number.isdigit() and whole in self._links else name
            count[link] = count.get(link, 0) + 1
            if link not in worst or self._most[k] > self._most[worst[link]]:
                worst[link] = k
        return [
            Ignored("", link, self._text(link, count[link], self._most[k], self._when[k]))
            for link, k in worst.items()
            if self._most[k] > FOLLOWED
        ]

    def _text(self, link: str, count: int, angle: float, time: float) -> str:
        if self._kinds[link] == "modal":
            return (
                f"it turns by {angle:.2g} rad from its inboard to its outboard handle, at "
                f"{time:.4g} s, and its displacements, linear in its modes, are off by up to "
                f"{100 * _ERROR * angle**2:.2g} % there: make the part of several links"
            )
        # Under its weight a beam bends three times as much at its start as on average.
        most = count * angle * (3 if count == 1 else 1)
        needed = max(count + 1, math.ceil(most / (0.8 * FOLLOWED)))
        beam = "it" if count == 1 else "one of its beams"
        return (
            f"{beam} bends by {angle:.2g} rad from its start to its end, at {time:.4g} s, and its "
            f"deflection is off by up to {100 * _ERROR * angle**2:.2g} % there: give bodies = "
            f"{needed}"
        )
