"""Figures of runs: by matplotlib, in the report's HTML file, and as SVG text."""

from linkwise.plot.report import write_report
from linkwise.plot.run_figures import RunPlots

__all__ = ["RunPlots", "write_report"]
