"""`python -m linkwise`: the command line."""

from linkwise.cli import main

main()
