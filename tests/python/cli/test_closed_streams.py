"""Standard output that the caller closed, and pipes that nobody reads to their end."""

import os
import subprocess
import sys

import pytest

COMMAND = f"{sys.executable} -c 'from linkwise.cli import main; main()'"
posix = pytest.mark.skipif(os.name != "posix", reason="needs a POSIX shell")


def shell(folder, line):
    done = subprocess.run(
        ["bash", "-c", f'set -o pipefail; linkwise() {{ {COMMAND} "$@"; }}; {line}'],
        cwd=folder,
        capture_output=True,
        text=True,
    )
    assert "Traceback" not in done.stderr
    return done


@posix
@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-"])
def test_closed_streams(tmp_path, arm, closed):
    assert shell(tmp_path, f"linkwise inspect arm.urdf {closed}").returncode == 0
    assert shell(tmp_path, f"linkwise inspect --json arm.urdf {closed}").returncode == 0
    assert shell(tmp_path, f"linkwise inspect nothing.urdf {closed}").returncode == 2


@posix
def test_files_do_not_take_the_place_of_closed_streams(tmp_path, scenario):
    scenario()
    done = shell(tmp_path, "linkwise run swing.toml -o run.zarr <&- >&- 2>&-")
    assert done.returncode == 0
    done = shell(tmp_path, "linkwise loads run.zarr --csv peaks.csv >&- && cat peaks.csv")
    assert done.returncode == 0
    assert done.stdout.startswith("joint,quantity,unit,")


@posix
@pytest.mark.parametrize("line", ["inspect --json arm.urdf", "inspect arm.urdf", "--help"])
def test_a_pipe_that_nobody_reads_is_no_failure(tmp_path, arm, line):
    done = shell(tmp_path, f"(sleep 0.5; linkwise {line}) | true; exit ${{PIPESTATUS[0]}}")
    assert done.returncode == 0
    assert done.stderr == ""


@posix
def test_a_complaint_into_a_closed_pipe_keeps_its_code(tmp_path):
    line = "(sleep 0.5; linkwise inspect --json nothing.urdf) | true; exit ${PIPESTATUS[0]}"
    assert shell(tmp_path, line).returncode == 2
