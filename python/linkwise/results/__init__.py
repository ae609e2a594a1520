"""Results of simulations: `Run`, and opening stored ones."""

from linkwise.results.open import open_run
from linkwise.results.run import Run

__all__ = ["Run", "open_run"]
