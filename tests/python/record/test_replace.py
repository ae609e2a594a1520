"""A new run in the place of an older one: what a person put there stays, and nothing gets lost."""

import os
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest

import linkwise as lw

posix = pytest.mark.skipif(os.name != "posix", reason="needs POSIX")


def simulate(path, duration=0.1, **more):
    return lw.simulate(lw.scenes.chain(2), duration=duration, q0=[1, 1], output=path, **more)


@pytest.fixture
def path(tmp_path):
    simulate(tmp_path / "run.zarr")
    return tmp_path / "run.zarr"


@posix
@pytest.mark.filterwarnings("ignore:.*photos is left out")
def test_a_person_s_files_stay(path):
    (path / "NOTES.txt").write_text("notes")
    (path / "joint_load" / "peaks.csv").write_text("peaks")
    (path / "joint_load" / "c" / "deep").mkdir()
    (path / "joint_load" / "c" / "deep" / "x.txt").write_text("deep")
    (path / "photos" / "c").mkdir(parents=True)
    (path / "photos" / "c" / "0").write_text("a name like a chunk's")
    (path / "photos" / "zarr.json").write_text("and like a description's")
    (path / "empty").mkdir()
    (path / "link").symlink_to("/etc")
    (path / "time" / "link").symlink_to("..")
    run = simulate(path, duration=0.2)
    assert lw.open_run(path).time[-1] == 0.2
    assert run.path == path
    assert (path / "NOTES.txt").read_text() == "notes"
    assert (path / "joint_load" / "peaks.csv").read_text() == "peaks"
    assert (path / "joint_load" / "c" / "deep" / "x.txt").read_text() == "deep"
    assert (path / "photos" / "c" / "0").read_text() == "a name like a chunk's"
    assert (path / "photos" / "zarr.json").read_text() == "and like a description's"
    assert (path / "empty").is_dir()
    assert os.readlink(path / "link") == "/etc"
    assert os.readlink(path / "time" / "link") == ".."
    assert os.listdir(path.parent) == ["run.zarr"]


def test_of_the_older_run_nothing_stays(path):
    before = {str(f.relative_to(path)) for f in path.rglob("*")}
    lw.simulate(lw.scenes.chain(2), duration=0.1, output=path, record=["position"], every=0.05)
    after = {str(f.relative_to(path)) for f in path.rglob("*")}
    assert after < before
    assert not (path / "joint_load").exists()


def test_an_early_failure_leaves_the_older_run(path):
    with pytest.raises(lw.SimulationError) as caught:
        simulate(path, numerics={"max_steps": 1})
    failed = caught.value.run
    assert failed.path is None
    assert failed.outcome != "converged"
    assert failed.sizes["time"] == 1
    assert lw.open_run(path).outcome == "converged"
    assert lw.open_run(path).sizes["time"] == 1001
    assert os.listdir(path.parent) == ["run.zarr"]


def test_a_late_failure_takes_the_place(path):
    def drive(t, q, v):
        if t > 0.05:
            raise ZeroDivisionError
        return 0.0

    with pytest.raises(ZeroDivisionError):
        simulate(path, drives={"joint_1": drive}, numerics={"max_step": 0.01})
    run = lw.open_run(path)
    assert run.outcome == "error"
    assert 1 < run.sizes["time"] < 1001
    assert os.listdir(path.parent) == ["run.zarr"]


def test_the_older_run_stays_until_the_new_one_has_samples(path):
    seen = []

    def progress(_):
        seen.append(lw.open_run(path).sizes["time"])

    simulate(path, duration=0.2, every=0.1, progress=progress)
    assert seen[0] == 1001  # the older one
    assert lw.open_run(path).sizes["time"] == 3


@posix
def test_of_two_runs_onto_one_path_one_is_refused(path):
    for before in (True, False):
        if not before:
            path = path.with_name("fresh.zarr")
        started, go = threading.Event(), threading.Event()

        def wait(_, started=started, go=go):
            started.set()
            go.wait(60)

        first = threading.Thread(target=simulate, args=(path, 0.2), kwargs={"progress": wait})
        first.start()
        started.wait(60)
        with pytest.raises(lw.InputError, match="is being written by another process"):
            simulate(path, duration=0.3)
        go.set()
        first.join(60)
        assert lw.open_run(path).time[-1] == 0.2


KILLED = """
import os, signal, sys
import linkwise as lw
from linkwise.record import replace
die_at = int(sys.argv[2])
class Renaming:
    count = 0
    def __getattr__(self, name):
        return getattr(os, name)
    def rename(self, *names):
        Renaming.count += 1
        if Renaming.count == die_at:
            os.kill(os.getpid(), signal.SIGKILL)
        os.rename(*names)
replace.os = Renaming()
lw.simulate(lw.scenes.chain(2), duration=0.2, q0=[1, 1], output=sys.argv[1])
"""


@posix
@pytest.mark.parametrize("die_at", [1, 2, 3])
def test_killed_between_the_renames(path, die_at):
    """Before the older run is moved aside, before the new one is there, before the notes are."""
    (path / "NOTES.txt").write_text("notes")
    done = subprocess.run([sys.executable, "-c", KILLED, str(path), str(die_at)], check=False)
    assert done.returncode == -signal.SIGKILL
    run = lw.open_run(path)
    assert run.sizes["time"] == 1001
    assert run.time[-1] == (0.2 if die_at == 3 else 0.1)
    simulate(path, duration=0.4)
    assert lw.open_run(path).time[-1] == 0.4
    assert (path / "NOTES.txt").read_text() == "notes"
    assert os.listdir(path.parent) == ["run.zarr"]


def test_leftovers_of_the_living_stay(path):
    """Only what no process holds any more is cleared away."""
    from linkwise.record.claim import hold, release

    living = path.with_name(".run.zarr.0123abcd.new")
    living.mkdir()
    lock = hold(living)
    if lock is None:
        pytest.skip("no locks here")
    other = path.with_name(".run.zarr.backup.old")  # a name that linkwise does not give
    other.mkdir()
    simulate(path)
    assert living.exists()
    assert other.exists()
    release(lock)
    simulate(path)
    assert not living.exists()
    assert other.exists()


def test_without_locks_nothing_is_cleared_away(path, monkeypatch):
    """Nobody can tell then whether a process still writes there."""
    from linkwise.record import claim

    monkeypatch.setattr(claim, "fcntl", None)
    other = path.with_name(".run.zarr.0123abcd.new")
    other.mkdir()
    simulate(path)
    assert other.exists()
    assert lw.open_run(path).sizes["time"] == 1001


# -- a full disk ---------------------------------------------------------------------------------


class FullDisk:
    """Counts what is written through the store, and has room for so much."""

    def __init__(self, monkeypatch, room):
        from zarr.storage import _local

        self.room = room
        put = _local._put

        def count(path, value, **options):
            self.room -= len(value)
            if self.room < 0 and not str(path).endswith("zarr.json"):
                raise OSError(28, "No space left on device")
            return put(path, value, **options)

        monkeypatch.setattr(_local, "_put", count)


def test_a_full_disk_is_told(tmp_path, monkeypatch):
    from linkwise.record import store

    monkeypatch.setattr(store, "MAX_BLOCK_ROWS", 16)
    monkeypatch.setattr(store, "SCALAR_ROWS", 16)
    disk = FullDisk(monkeypatch, 100_000)
    with pytest.raises(OSError, match=r"cannot be written further \(No space left on device\)"):
        simulate(tmp_path / "run.zarr", duration=1)
    disk.room = 1 << 30
    run = lw.open_run(tmp_path / "run.zarr")
    assert run.outcome == "error"
    assert "No space left on device" in run.attrs["message"]
    count = run.sizes["time"]
    assert 16 <= count < 1001
    assert count % 16 == 0
    truth = lw.simulate(lw.scenes.chain(2), duration=1, q0=[1, 1])
    np.testing.assert_array_equal(run.position, truth.position[:count])


@pytest.mark.skipif(sys.platform != "linux", reason="mounts a small file system")
def test_a_disk_that_is_really_full(tmp_path):
    """The spare room is enough for the last words."""
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(tmp_path)], capture_output=True
    )
    if mounted.returncode:
        pytest.skip("may not mount")
    try:
        with pytest.raises(OSError, match="cannot be written further"):
            lw.simulate(
                lw.scenes.chain(20), duration=3, q0=[1] * 20, every=1e-3, output=tmp_path / "r.zarr"
            )
        run = lw.open_run(tmp_path / "r.zarr")
        assert run.outcome == "error"
        assert "No space left" in run.attrs["message"]
        assert run.sizes["time"] >= 0
        del run
    finally:
        subprocess.run(["umount", str(tmp_path)], check=True)
