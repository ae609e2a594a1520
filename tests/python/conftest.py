"""Runs the command line inside the test process, in an empty folder."""

import json
import sys
from dataclasses import dataclass

import pytest

from linkwise import cli


@dataclass
class Result:
    code: int
    out: str
    err: str

    @property
    def json(self):
        def refuse(constant):
            raise AssertionError(f"{constant} is not JSON")

        return json.loads(self.out, parse_constant=refuse)

    @property
    def complaint(self):
        """The one line on stderr of a failed command."""
        assert self.err.endswith("\n")
        line = self.err[:-1]
        assert "\n" not in line
        assert line.startswith("linkwise: ")
        assert "Traceback" not in line
        return line


@pytest.fixture
def linkwise(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "150")

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["linkwise", *map(str, arguments)])
        with pytest.raises(SystemExit) as caught:
            cli.main()
        return Result(caught.value.code, *capsys.readouterr())

    return call
