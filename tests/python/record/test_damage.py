"""Damage to a stored run is said with its file, in one line; what is whole stays readable."""

import json
import os
import random
import shutil
import struct
import subprocess
import sys
import warnings
import zlib
from pathlib import Path

import numpy as np
import pytest

import linkwise as lw
from linkwise.record import store
from linkwise.record.checksums import LIST

QUIET = "ignore:.*has no checksums:UserWarning"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A finished run whose arrays have several chunks."""
    path = tmp_path_factory.mktemp("whole") / "run.zarr"
    before = store.MAX_BLOCK_ROWS, store.SCALAR_ROWS
    store.MAX_BLOCK_ROWS = store.SCALAR_ROWS = 8
    try:
        lw.simulate(lw.scenes.chain(2), q0=[1, 0.5], duration=1, every=1 / 19, output=path)
    finally:
        store.MAX_BLOCK_ROWS, store.SCALAR_ROWS = before
    return path


@pytest.fixture
def copy(whole, tmp_path):
    return Path(shutil.copytree(whole, tmp_path / "run.zarr"))


def files_of(path):
    return sorted(str(f.relative_to(path)) for f in path.rglob("*") if f.is_file())


def everything(path):
    """All that a run holds, as plain values."""
    run = lw.open_run(path)
    held = {name: run.dataset[name].values.tolist() for name in run.dataset.variables}
    about = {name: dict(v.attrs) for name, v in run.dataset.variables.items()}
    return repr((held, about, dict(run.attrs), run.load_model().hash))


def said(path):
    """The one line about damage that reading everything gives; None where nothing is said."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            everything(path)
        except (lw.InputError, UserWarning) as error:
            line = str(error)
        else:
            return None
    assert "\n" not in line
    return line


def test_a_whole_run_says_nothing(whole):
    assert said(whole) is None


def test_every_file_is_listed(whole):
    listed = [line.split(" ", 1) for line in (whole / LIST).read_text().splitlines()]
    assert [key for _, key in listed] == [f for f in files_of(whole) if f != LIST]
    for number, key in listed:
        assert int(number, 16) == zlib.crc32((whole / key).read_bytes())


def test_no_changed_bit_is_silent(whole, copy):
    """One bit, anywhere in the run: chunks, labels, descriptions, the model, the list itself."""
    chance = random.Random(1)
    truth = everything(whole)
    for name in files_of(whole):
        content = (whole / name).read_bytes()
        for _ in range(2):
            changed = bytearray(content)
            changed[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
            (copy / name).write_bytes(changed)
            line = said(copy)
            assert line is not None or everything(copy) == truth, f"{name} changed silently"
            if line is not None:
                assert name in line or LIST in line or "model" in line or "format" in line, line
        (copy / name).write_bytes(content)
    assert said(copy) is None


def test_no_missing_file_is_silent(whole, copy):
    for name in files_of(whole):
        if name in ("files/zarr.json", "machine/zarr.json"):  # nothing reads them
            continue
        (copy / name).unlink()
        line = said(copy)
        assert line is not None, f"{name} is missing silently"
        shutil.copy(whole / name, copy / name)


def test_exchanged_chunks_are_found(copy):
    """Each fits its own checksum; only the list knows where it belongs."""
    first, second = copy / "joint_load/c/0/0/0", copy / "joint_load/c/1/0/0"
    held = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(held)
    with pytest.raises(lw.InputError, match=r"joint_load/c/[01]/0/0 is damaged: it does not fit"):
        lw.open_run(copy).peak_loads()


def test_a_missing_array_is_left_out_aloud(copy):
    shutil.rmtree(copy / "steps")
    with pytest.warns(UserWarning, match=r"steps/zarr\.json is missing; .* steps is left out"):
        run = lw.open_run(copy)
    assert "steps" not in run
    assert np.isfinite(run.peak_loads().force).all()


@pytest.mark.parametrize("name", ["time", "joint"])
def test_without_times_or_labels_there_is_no_run(copy, name):
    shutil.rmtree(copy / name)
    with pytest.raises(lw.InputError, match=rf"{name}/zarr\.json is missing"):
        lw.open_run(copy)


def test_what_is_whole_stays_readable(whole, copy):
    (copy / "joint_load/c/1/0/0").write_bytes(b"x")
    run, truth = lw.open_run(copy), lw.open_run(whole)
    np.testing.assert_array_equal(run.position, truth.position)
    np.testing.assert_array_equal(run.joint_load[:8], truth.joint_load[:8])
    with pytest.raises(lw.InputError, match=r"run\.zarr': joint_load/c/1/0/0 is damaged"):
        run.joint_load.values  # noqa: B018


def test_other_readers_of_zarr_see_changed_bits(copy):
    import xarray as xr

    chunk = copy / "joint_load/c/0/0/0"
    content = bytearray(chunk.read_bytes())
    content[len(content) // 2] ^= 1
    chunk.write_bytes(content)
    dataset = xr.open_zarr(copy, consolidated=False)
    with pytest.raises(ValueError, match="checksum"):
        dataset.joint_load.values  # noqa: B018


# -- a run from elsewhere ------------------------------------------------------------------------


def forge(path, name, change):
    """Change a description and list it anew, as one who means harm does."""
    described = json.loads((path / name).read_text())
    change(described)
    (path / name).write_text(json.dumps(described))
    relist(path)


def relist(path):
    lines = [
        f"{zlib.crc32((path / f).read_bytes()):08x} {f}\n" for f in files_of(path) if f != LIST
    ]
    (path / LIST).write_text("".join(lines))


def declare(samples, chunk=None):
    def change(described):
        described["shape"][0] = samples
        if chunk:
            described["chunk_grid"]["configuration"]["chunk_shape"][0] = chunk

    return change


LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
import linkwise as lw
try:
    run = lw.open_run(sys.argv[1])
    print("opened", run.sizes["time"], run.position.values.shape)
except lw.InputError as error:
    print("refused", error)
"""


def open_limited(path):
    """Open in a process that may hang or eat memory."""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", LIMITED, str(path)],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr[-500:]
    return done.stdout


@pytest.mark.skipif(sys.platform != "linux", reason="limits memory")
@pytest.mark.parametrize(
    ("chunk", "answer"), [(None, "opened 20 (20, 2)"), (3 * 10**9, "size that linkwise does not")]
)
def test_sizes_are_believed_as_far_as_files_go(copy, chunk, answer):
    for name in files_of(copy):
        if name.endswith("/zarr.json"):
            described = json.loads((copy / name).read_text())
            if described.get("dimension_names", [None])[:1] == ["time"]:
                forge(copy, name, declare(3 * 10**9, chunk))
    assert answer in open_limited(copy)


@pytest.mark.skipif(sys.platform != "linux", reason="limits memory")
def test_a_chunk_that_unpacks_to_more_than_memory_is_refused(copy):
    """A Zstandard frame that says to hold 64 GB in 20 bytes."""
    chunk = copy / "time/c/0"
    chunk.write_bytes(bytes.fromhex("28b52ffd") + b"\xe0" + struct.pack("<Q", 64 << 30) + b"\0" * 9)
    relist(copy)
    assert "time/c/0 is not packed as linkwise packs" in open_limited(copy)


@pytest.mark.parametrize(
    ("codec", "kind"), [({"name": "gzip", "configuration": {"level": 1}}, 1), ("sharding", 2)]
)
def test_other_packings_are_refused(copy, codec, kind):
    def change(described):
        if kind == 1:
            described["codecs"][1] = codec
        else:
            inner = described["codecs"]
            described["codecs"] = [
                {
                    "name": "sharding_indexed",
                    "configuration": {"chunk_shape": [8], "codecs": inner, "index_codecs": inner},
                }
            ]

    forge(copy, "time/zarr.json", change)
    with pytest.raises(lw.InputError, match=r"time/zarr\.json (tells of a packing|is damaged)"):
        lw.open_run(copy)


SPECIAL = {
    "pipe": os.mkfifo,
    "endless": lambda p: os.symlink("/dev/zero", p),
    "loop": lambda p: os.symlink(p.name, p),
    "above": lambda p: os.symlink("..", p),
    "elsewhere": lambda p: os.symlink("/etc/passwd", p),
    "folder": os.mkdir,
}


@pytest.mark.skipif(os.name != "posix", reason="needs POSIX files")
@pytest.mark.parametrize("kind", SPECIAL)
def test_what_is_no_file_is_refused_at_once(whole, copy, kind):
    chunks = ("time/c/0", "joint/c/0", "joint_load/c/0/0/0")
    for name in ("zarr.json", LIST, "time/zarr.json", *chunks):
        (copy / name).unlink()
        SPECIAL[kind](copy / name)
        line = said(copy)
        assert line is not None, name
        if (copy / name).is_dir() and not (copy / name).is_symlink():
            (copy / name).rmdir()
        else:
            (copy / name).unlink()
        shutil.copy(whole / name, copy / name)
    shutil.rmtree(copy / "joint_load")
    SPECIAL[kind](copy / "joint_load")
    assert said(copy) is not None


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("zarr.json", "[" * 5000 + "]" * 5000),
        ("time/zarr.json", "[" * 5000 + "]" * 5000),
        ("joint_load/zarr.json", "[" * 5000 + "]" * 5000),
        ("zarr.json", "{}"),
        ("time/zarr.json", "{}"),
        ("joint/zarr.json", "null"),
        ("time/c/0", ""),
        ("joint/c/0", "x"),
        ("machine/description/c/0", "x"),
        ("machine/zarr.json", "x"),
    ],
)
@pytest.mark.parametrize("listed", [True, False])
def test_every_damage_ends_in_one_line(copy, name, content, listed):
    """Also where the list agrees with the damage."""
    (copy / name).write_text(content)
    if listed:
        relist(copy)
    line = said(copy)
    if name == "machine/zarr.json":  # the model itself is whole
        return
    assert line is not None


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("time/zarr.json", declare(2**63)),
        ("time/zarr.json", declare(-1)),
        ("joint_load/zarr.json", declare(3)),
        ("time/zarr.json", lambda d: d["attributes"].update(coordinates=5)),
        ("joint_load/zarr.json", lambda d: d.update(dimension_names=["a", "b", "c"])),
        ("joint_load/zarr.json", lambda d: d.update(dimension_names=None)),
        ("joint_load/zarr.json", lambda d: d.update(dimension_names=["time", "joint"])),
        ("joint_load/zarr.json", lambda d: d.update(data_type="complex128")),
        ("joint_load/zarr.json", lambda d: d.update(codecs=[])),
        ("zarr.json", lambda d: d.update(attributes=5)),
        ("zarr.json", lambda d: d["attributes"].update(linkwise_run=[1])),
    ],
)
def test_forged_descriptions_end_in_one_line(copy, name, change):
    forge(copy, name, change)
    said(copy)  # no other exception than InputError gets through


# -- a run without its list ----------------------------------------------------------------------


@pytest.mark.parametrize("version", [1, 3])
def test_a_run_of_another_format_is_refused(copy, version):
    described = copy / "zarr.json"
    content = json.loads(described.read_text())
    content["attributes"]["linkwise_run"] = version
    described.write_text(json.dumps(content))
    said = f"has format {version}, this linkwise reads 2; update linkwise, or simulate again"
    with pytest.raises(lw.InputError, match=said):
        lw.open_run(copy)


@pytest.mark.filterwarnings(QUIET)
def test_a_run_without_a_list_needs_its_time_as_well(copy):
    (copy / LIST).unlink()
    shutil.rmtree(copy / "time")
    with pytest.raises(lw.InputError, match="time"):
        lw.open_run(copy)


def test_a_list_that_is_gone_is_said(copy):
    (copy / LIST).unlink()
    with pytest.warns(UserWarning, match=r"has no checksums \(files/checksums.txt is missing\)"):
        lw.open_run(copy)


@pytest.mark.filterwarnings(QUIET)
@pytest.mark.parametrize("damaged", ["bit", "end", "other array", "empty"])
def test_chunks_without_a_list_are_checked_by_what_they_hold(copy, damaged):
    """By Zarr's own checksum, by unpacking them, and by their size."""
    (copy / LIST).unlink()
    file = copy / "velocity" / "c" / "0" / "0"
    data = bytearray(file.read_bytes())
    if damaged == "bit":
        data[len(data) // 2] ^= 16
    elif damaged == "end":
        data = data[:-3]
    elif damaged == "other array":
        data = (copy / "joint_load" / "c" / "0" / "0" / "0").read_bytes()
    else:
        data = b""
    file.write_bytes(data)
    run = lw.open_run(copy)
    with pytest.raises(lw.InputError, match="velocity/c/0/0 is "):
        _ = run.velocity.values
    assert np.isfinite(run.position.values).all()


def test_a_label_that_is_not_listed_is_said(copy):
    """A changed bit in the list may hide any array."""
    (copy / LIST).write_text((copy / LIST).read_text().replace("body/zarr.json", "body/zasr.json"))
    with pytest.warns(UserWarning, match=r"body/zarr\.json is not listed in .* body is left out"):
        lw.open_run(copy)


@pytest.mark.filterwarnings("ignore:.*is left out")
def test_a_damaged_name_in_the_list_is_told_on_a_printable_line(copy):
    text = (copy / LIST).read_text()
    (copy / LIST).write_text(text.replace("steps/zarr.json", "st\x00ps/zarr.json"))
    with pytest.raises(lw.InputError, match=r"st.*ps/zarr\.json is damaged") as complaint:
        lw.open_run(copy)
    assert str(complaint.value).isprintable()


def test_a_person_s_array_in_the_folder_is_no_part_of_the_run(whole, copy):
    import zarr

    zarr.open_group(copy, mode="r+").create_array("mine", shape=(2,), dtype="float64")
    with pytest.warns(UserWarning, match="mine is left out"):
        run = lw.open_run(copy)
    assert set(run.dataset.variables) == set(lw.open_run(whole).dataset.variables)
