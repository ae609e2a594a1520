"""What a simulation records."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from linkwise._core import InputError
from linkwise.io.complaint import shown
from linkwise.record.schema import resolve_quantities
from linkwise.simulation.arguments import options_object

# Extremes of larger machines are kept if asked for: they take as much memory as five samples.
MOST_JOINTS = 10_000


@dataclass(frozen=True, kw_only=True)
class Recording:
    """What a simulation keeps of every sample.

    Attributes:
        quantities: Names, of those that `linkwise.quantities()` lists as groups; all by default.
        joints: Names of the joints to record; all by default.
        extremes: Whether the extremes of loads, motions and drive torques are kept between the
            samples too, for `linkwise.loads`. By default they are where joint loads are recorded,
            of machines with up to 10,000 joints.
        scenario_text: Kept with the results, to tell where they come from.
    """

    quantities: Collection[str] | None = None
    joints: Sequence[str] | None = None
    extremes: bool | None = None
    scenario_text: str = ""

    def __post_init__(self) -> None:
        if not (self.extremes is None or isinstance(self.extremes, bool)):
            raise InputError(f"extremes: is {shown(self.extremes)}; use True, False or None")
        if self.quantities is not None:
            resolve_quantities(self.quantities)

    def keeps_extremes(self, joints: int) -> bool:
        """Whether a machine with so many joints keeps them."""
        return joints <= MOST_JOINTS if self.extremes is None else self.extremes

    @classmethod
    def of(
        cls,
        given: Recording | Mapping[str, object] | Collection[str] | None,
        keywords: dict[str, Any] | None = None,
    ) -> Recording:
        """From one itself, from its attributes by name, or from names of quantities; of keywords
        its attributes are taken out and go before."""
        if not (given is None or isinstance(given, Recording | Mapping)):
            given = cls(quantities=given)
        return options_object("record", cls, given, keywords)
