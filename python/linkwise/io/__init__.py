"""Reading what users bring: models (URDF, MJCF, SDF) and CSV tables.

Everything here treats its input as untrusted: sizes are bounded, XML entities and includes are
refused, nothing is fetched. A defect is one line that names file, line, element and remedy.
"""

from linkwise.io.load import load
from linkwise.io.table import CsvTable, read_table

__all__ = ["CsvTable", "load", "read_table"]
