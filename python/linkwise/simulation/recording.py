"""What a simulation records."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from linkwise.simulation.arguments import options_object


@dataclass(frozen=True, kw_only=True)
class Recording:
    """What a simulation keeps of every sample.

    Attributes:
        quantities: Names, of those that `linkwise.quantities()` lists as groups; all by default.
        joints: Names of the joints to record; all by default.
        scenario_text: Kept with the results, to tell where they come from.
    """

    quantities: Collection[str] | None = None
    joints: Sequence[str] | None = None
    scenario_text: str = ""

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
