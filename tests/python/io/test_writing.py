"""Files that people name: what stands there already is asked first."""

import os
import stat
import subprocess
import sys
import threading

import pytest

import linkwise as lw
from linkwise.io.writing import csv_cell, spelled, write_text, written_whole

posix = pytest.mark.skipif(os.name != "posix", reason="needs POSIX files")


def kind(path):
    return stat.S_IFMT(os.lstat(path).st_mode)


def test_a_regular_file_is_replaced_and_keeps_its_mode(tmp_path):
    path = tmp_path / "a.csv"
    write_text(path, "first")
    path.chmod(0o640)
    write_text(path, "second")
    assert path.read_text() == "second"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert os.listdir(tmp_path) == ["a.csv"]


@posix
@pytest.mark.parametrize("there", [True, False])
def test_a_link_stays_and_its_file_is_replaced(tmp_path, there):
    target = tmp_path / "elsewhere"
    target.mkdir()
    if there:
        (target / "real.csv").write_text("old")
    link = tmp_path / "link.csv"
    link.symlink_to("elsewhere/real.csv")
    write_text(link, "new")
    assert os.readlink(link) == "elsewhere/real.csv"
    assert (target / "real.csv").read_text() == "new"
    assert os.listdir(target) == ["real.csv"]


@posix
def test_a_pipe_is_written_into(tmp_path):
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    os.set_blocking(reader, True)
    got = []

    def drain():
        while part := os.read(reader, 1 << 16):
            got.append(part)

    thread = threading.Thread(target=drain, daemon=True)
    content = "x" * 300_000  # more than a pipe holds
    with written_whole(pipe) as aside:
        aside.write_text(content)
        writer = os.open(pipe, os.O_WRONLY)  # so that the reader does not see an end too early
        thread.start()
    os.close(writer)
    thread.join(timeout=60)
    os.close(reader)
    assert b"".join(got).decode() == content
    assert kind(pipe) == stat.S_IFIFO


@posix
def test_a_pipe_without_a_reader_is_refused_at_once(tmp_path):
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    with pytest.raises(lw.InputError, match=r"pipe\.csv': nobody reads this pipe; start"):
        write_text(pipe, "x")
    assert kind(pipe) == stat.S_IFIFO


@posix
def test_a_character_device_is_written_into(tmp_path):
    device = tmp_path / "null"
    try:
        os.mknod(device, 0o666 | stat.S_IFCHR, os.makedev(1, 3))
        device.write_bytes(b"")
    except OSError:
        pytest.skip("only root makes devices")
    write_text(device, "x")
    assert kind(device) == stat.S_IFCHR


@posix
def test_block_devices_and_sockets_are_refused(tmp_path, monkeypatch):
    import socket

    monkeypatch.chdir(tmp_path)  # names of sockets are short
    with socket.socket(socket.AF_UNIX) as made:
        made.bind("s.csv")
        with pytest.raises(lw.InputError, match="is no file that can be replaced"):
            write_text("s.csv", "x")
    assert kind("s.csv") == stat.S_IFSOCK
    try:
        os.mknod("b.csv", 0o666 | stat.S_IFBLK, os.makedev(250, 250))
    except OSError:
        return
    with pytest.raises(lw.InputError, match="is no file that can be replaced"):
        write_text("b.csv", "x")
    assert kind("b.csv") == stat.S_IFBLK


@posix
def test_loops_of_links_and_folders_are_refused(tmp_path):
    (tmp_path / "loop.csv").symlink_to("loop.csv")
    with pytest.raises(lw.InputError, match=r"loop\.csv': cannot be written"):
        write_text(tmp_path / "loop.csv", "x")
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(lw.InputError, match=r"folder\.csv': is a folder; give a file name"):
        write_text(tmp_path / "folder.csv", "x")
    with pytest.raises(lw.InputError, match=r"folder '.*nowhere' does not exist; create it"):
        write_text(tmp_path / "nowhere" / "a.csv", "x")


def test_what_fails_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("old")

    def fail():
        with written_whole(path) as aside:
            aside.write_text("half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["a.csv"]


def test_a_change_of_folder_meanwhile_changes_nothing(tmp_path, monkeypatch):
    for name in ("here", "there"):
        (tmp_path / name).mkdir()
    monkeypatch.chdir(tmp_path / "here")
    with written_whole("a.csv") as aside:
        os.chdir(tmp_path / "there")
        aside.write_text("x")
    assert os.listdir(tmp_path / "here") == ["a.csv"]
    assert os.listdir(tmp_path / "there") == []


@posix
def test_standard_output_takes_an_export():
    code = "from linkwise.io.writing import write_text; write_text('/dev/stdout', 'through')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "through"


def test_no_cell_is_a_formula():
    for text in ("=1+1", "+1", "-1", "@sum", "\t=1", "'=1"):
        assert csv_cell(text) == f"'{text}"
        assert spelled(csv_cell(text)) == text
    for text in ("elbow.fx [N]", "'a'", "a=1", ""):
        assert spelled(csv_cell(text)) == csv_cell(text) == text
    assert csv_cell(-1.5) == -1.5
