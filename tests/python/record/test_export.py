"""Exports of a run: what stands at their path stays what it is, and no name is a formula."""

import csv
import os
import stat

import numpy as np
import pytest

import linkwise as lw

EXPORTS = {
    "netcdf": lambda run, path: run.to_netcdf(path),
    "csv": lambda run, path: run.to_csv(path, "energy"),
}


@pytest.fixture(scope="module")
def run():
    return lw.simulate(lw.scenes.chain(2), duration=0.1, q0=[1, 1])


@pytest.fixture(params=EXPORTS)
def export(request):
    return EXPORTS[request.param]


@pytest.mark.skipif(os.name != "posix", reason="needs POSIX files")
def test_pipes_and_devices_stay(tmp_path, run, export):
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(lw.InputError, match="nobody reads this pipe"):
        export(run, tmp_path / "pipe.csv")
    assert stat.S_ISFIFO(os.lstat(tmp_path / "pipe.csv").st_mode)
    device = tmp_path / "null.csv"
    try:
        os.mknod(device, 0o666 | stat.S_IFCHR, os.makedev(1, 3))
        device.write_bytes(b"")
    except OSError:
        return  # only root makes devices
    export(run, device)
    assert stat.S_ISCHR(os.lstat(device).st_mode)


@pytest.mark.skipif(os.name != "posix", reason="needs POSIX files")
def test_links_stay(tmp_path, run, export):
    (tmp_path / "target").write_text("x")
    link = tmp_path / "link.csv"
    link.symlink_to("target")
    export(run, link)
    assert link.is_symlink()
    assert (tmp_path / "target").stat().st_size > 100


def test_names_are_no_formulas(tmp_path):
    builder = lw.ModelBuilder("m")
    builder.add_link("ground")
    for before, name in (("ground", '=HYPERLINK("x")'), ('=HYPERLINK("x")', "+b"), ("+b", "c")):
        builder.add_link(name, mass=1.0, com=(0, 0, -0.1), inertia=np.eye(3))
        builder.add_joint(name, "revolute", before, name, axis=(1, 0, 0))
    run = lw.simulate(builder.build(), duration=0.1, every=0.05)
    run.to_csv(tmp_path / "p.csv", "position")
    with open(tmp_path / "p.csv", newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    assert head == ["time [s]", '\'=HYPERLINK("x") [rad]', "'+b [rad]", "c [rad]"]
    np.testing.assert_array_equal(np.array(rows, dtype=float)[:, 1:], run.position)


@pytest.mark.parametrize("name", ["time", "Time", "t", "T", "=x", "'=x", "a, b", 'a "b"', "a [m]"])
def test_exports_read_back_whatever_the_joints_are_called(tmp_path, name):
    builder = lw.ModelBuilder("m")
    builder.add_link("base")
    builder.add_link("arm", mass=1, com=(0, 0, -1), inertia=np.eye(3))
    builder.add_joint(name, "revolute", "base", "arm", axis=(1, 0, 0))
    run = lw.simulate(builder.build(), q0=[0.3], duration=0.1, every=0.05)
    run.to_csv(tmp_path / "p.csv", "position")
    table = lw.Table.from_csv(tmp_path / "p.csv", name)
    np.testing.assert_array_equal(table.times, run.time.values)
    np.testing.assert_array_equal(table.values, run.position.values)


def test_a_file_that_does_not_fit_is_refused_before_it_is_begun(tmp_path, run, monkeypatch):
    """HDF5 would crash the process later."""
    import shutil

    whole = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: whole._replace(free=100_000))
    with pytest.raises(lw.InputError, match=r"\(it takes \d+ MB, 0 MB are free\)"):
        run.to_netcdf(tmp_path / "a.nc")
    assert os.listdir(tmp_path) == []
