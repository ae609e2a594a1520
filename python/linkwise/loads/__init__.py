"""What a designer reads off a run: loads in any frame, by cause, with bounds, against ratings.

Everything takes a `Run` and returns xarray objects whose attributes state units, frames and signs.
The run must hold `joint_load`; what else a function needs is in its docstring.
"""

from linkwise.loads.causes import split, split_at_peaks
from linkwise.loads.certainty import bounds
from linkwise.loads.deflections import section_deflections
from linkwise.loads.energy import energy_balance
from linkwise.loads.engineering import QUANTITIES, quantities
from linkwise.loads.fatigue import cycles, damage_equivalent, load_duration, spectrum
from linkwise.loads.frames import in_frame
from linkwise.loads.peaks import envelope, peak_loads, summary
from linkwise.loads.rating import Rating, margins
from linkwise.loads.section_summary import (
    SectionRating,
    section_damage,
    section_margins,
    section_summary,
)
from linkwise.loads.sections import section_loads, section_split

__all__ = [
    "QUANTITIES",
    "Rating",
    "SectionRating",
    "bounds",
    "cycles",
    "damage_equivalent",
    "energy_balance",
    "envelope",
    "in_frame",
    "load_duration",
    "margins",
    "peak_loads",
    "quantities",
    "section_damage",
    "section_deflections",
    "section_loads",
    "section_margins",
    "section_split",
    "section_summary",
    "spectrum",
    "split",
    "split_at_peaks",
    "summary",
]
