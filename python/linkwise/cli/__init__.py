"""The command line: `linkwise demo`, `inspect`, `run`; one file per command.

Imports here and in the command files happen when a command runs: `linkwise --help` must not wait
for NumPy, xarray or the compiled core.
"""

from linkwise.cli.main import app, main

__all__ = ["app", "main"]
