"""Fuzzing: every input gives a result, or an error of one line that says what is wrong.

`inputs` damages files of every kind, `calls` gives public functions what they should not get,
`judge` says what may come of it. An input is made from its kind and its number alone, so that a
finding is reproduced by `python -m tests.fuzz KIND NUMBER`.
"""
