"""An arm and a scenario as files, for the command line to read."""

import pytest

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
