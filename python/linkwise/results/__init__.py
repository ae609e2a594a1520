"""Results of simulations: `Run`, opening stored ones, and reading their samples block by block."""

from linkwise.results.open import open_run
from linkwise.results.run import Run

__all__ = ["Run", "open_run"]
