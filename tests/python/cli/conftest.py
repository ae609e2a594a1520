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


ARM = """<robot name="arm">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0 0 0.5"/><mass value="2"/>
    <inertia ixx="0.2" iyy="0.2" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="plate"><inertial><mass value="0.5"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="[red]slider[/red]"><inertial><mass value="1"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="elbow" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 1 0"/><limit lower="-1.5" upper="1.5" effort="50" velocity="3"/></joint>
  <joint name="glue" type="fixed"><parent link="upper"/><child link="plate"/></joint>
  <joint name="slide" type="prismatic"><parent link="upper"/><child link="[red]slider[/red]"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="0.2" effort="10" velocity="1"/></joint>
</robot>
"""

SCENARIO = """model = "arm.urdf"
[initial]
position.elbow = 0.3
[drive.slide]
kind = "locked"
[simulate]
duration = 0.5
[output]
every = 0.01
"""


@pytest.fixture
def arm(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(ARM)
    return path


@pytest.fixture
def scenario(tmp_path, arm):
    """Writes swing.toml, with replacements of (old, new) text."""

    def write(*replacements):
        text = SCENARIO
        for old, new in replacements:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "swing.toml"
        path.write_text(text)
        return path

    return write
