"""The program as a process: start-up, pipes, terminals, signals."""

import json
import os
import pty
import select
import signal
import subprocess
import sys
import time

import pytest

import linkwise as lw

FUSE = 600  # seconds: nothing here takes as long, on no machine
COMMAND = [sys.executable, "-c", "from linkwise.cli import main; main()"]

# Long enough that nobody waits for its end: 10 000 s of a stiffly driven chain.
LONG = """[model.chain]
n_bodies = 30
[initial]
position.joint_1 = 1.0
[simulate]
duration = 10000
[output]
every = 0.01
quantities = ["position"]
"""


@pytest.fixture
def long_scenario(tmp_path):
    path = tmp_path / "long.toml"
    path.write_text(LONG)
    return path


def test_help_does_not_load_the_numerics():
    code = (
        "import sys; sys.argv[1:] = ['--help']\n"
        "from linkwise.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'xarray', 'zarr', 'linkwise._core'} & set(sys.modules)\n"
        "print(sorted(heavy), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"
    for command in ("demo", "inspect", "run"):
        assert command in done.stdout


@pytest.mark.parametrize("command", [COMMAND, [sys.executable, "-m", "linkwise"]])
def test_version(command):
    done = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == f"linkwise {lw.__version__}\n"


def test_reader_that_goes_away_is_no_failure(long_scenario):
    """As in `linkwise inspect --all MODEL | head -1`, with more rows than a pipe holds."""
    text = long_scenario.read_text().replace("= 30", "= 3000")
    long_scenario.write_text(text)
    process = subprocess.Popen(
        [*COMMAND, "inspect", "--all", str(long_scenario)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    process.stdout.readline()
    process.stdout.close()
    assert process.stderr.read() == ""
    assert process.wait(timeout=FUSE) == 0


def wait_for_samples(process, path):
    end = time.monotonic() + FUSE
    while not (path.exists() and lw.open_run(path).sizes["time"]):
        assert process.poll() is None, "the run ended before it wrote a sample"
        assert time.monotonic() < end, "no samples"
        time.sleep(0.1)


def start(long_scenario, output, *options, **streams):
    return subprocess.Popen(
        [*COMMAND, "run", str(long_scenario), "-o", str(output), *options], **streams
    )


def test_interrupted_run_is_readable(long_scenario, tmp_path):
    output = tmp_path / "run.zarr"
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    process = start(long_scenario, output, "--json", **streams)
    wait_for_samples(process, output)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=FUSE)
    assert process.returncode == 1
    assert json.loads(out)["outcome"] == "interrupted"
    assert err.startswith("linkwise: interrupted at t = ")
    assert err.count("\n") == 1
    run = lw.open_run(output)
    assert run.outcome == "interrupted"
    assert run.sizes["time"] == json.loads(out)["samples"]


def test_killed_run_is_readable(long_scenario, tmp_path):
    output = tmp_path / "run.zarr"
    process = start(long_scenario, output)
    try:
        wait_for_samples(process, output)
        assert lw.open_run(output).outcome == "running"
    finally:
        process.kill()
        process.wait()
    run = lw.open_run(output)
    assert run.outcome == "killed"
    assert run.sizes["time"] > 0
    assert bool(run.position.notnull().all())


def test_progress_shows_on_a_terminal_only(long_scenario, tmp_path):
    leader, follower = pty.openpty()
    process = start(
        long_scenario,
        tmp_path / "run.zarr",
        stdout=subprocess.PIPE,
        stderr=follower,
        env={**os.environ, "TERM": "xterm", "NO_COLOR": "1", "COLUMNS": "150"},
    )
    os.close(follower)
    seen = b""
    try:
        while b"x real time" not in seen and select.select([leader], [], [], FUSE)[0]:
            seen += os.read(leader, 4096)
    finally:
        process.kill()
        process.wait()
        os.close(leader)
    assert b"of 10000 s" in seen
    assert b" left" in seen
    assert process.stdout.read() == b""
