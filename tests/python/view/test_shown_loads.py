"""Loads of chosen causes and colours by rating, and what the exported page holds of them."""

import base64
import gzip
import json
import re

import numpy as np
import pytest

import linkwise as lw
from helpers.loaded_arm import arm, swing
from linkwise.view.arrows import colors_of_use
from linkwise.view.export import write_html
from linkwise.view.shown_loads import RatingUse, rating_use
from linkwise.view.source import Options, open_source


@pytest.fixture(scope="module")
def loaded_path(tmp_path_factory):
    """A run with every cause."""
    path = tmp_path_factory.mktemp("run") / "loaded.zarr"
    swing(output=path)
    return path


def test_chosen_causes_are_their_shares(loaded_path):
    run = lw.open_run(loaded_path)
    shares = lw.loads.split(run)
    for chosen in (["gravity"], ["drive", "motion", "passive"], []):
        recording = open_source(loaded_path, Options()).recording
        recording.causes.choose(chosen)
        expected = shares.sel(cause=chosen).sum("cause").transpose("time", "joint", "component")
        for sample in (0, 63, 64, 100, 7):  # the blocks of samples end in between
            np.testing.assert_allclose(recording.load(sample), expected[sample], atol=1e-11)
        times, loads = recording.history(1, 30)
        at = np.searchsorted(run.time.values, times)
        assert times.size == 30
        np.testing.assert_allclose(loads, expected[at, 1], atol=1e-11)


def test_all_causes_are_the_load(loaded_path):
    recording = open_source(loaded_path, Options()).recording
    assert recording.causes.names == [
        "gravity",
        "velocity",
        "drive",
        "motion",
        "passive",
        "external",
    ]
    total = lw.open_run(loaded_path).joint_load.values
    recording.causes.choose(recording.causes.names[:2])
    recording.causes.choose(recording.causes.names)
    assert np.array_equal(recording.load(50), total[50])


def test_use_is_that_of_the_margins(loaded_path):
    run = lw.open_run(loaded_path)
    ratings = {
        "shoulder": lw.loads.Rating(radial=60, axial=5, torque=20),
        "elbow": lw.loads.Rating(tilting_moment=3),
    }
    use = RatingUse(arm(), ratings)
    uses = np.array([[use.of(load, half) for half in (0, 1)] for load in run.joint_load.values])
    samples = run.dataset.drop_vars([n for n in run.dataset if str(n).startswith("extreme_")])
    summary = lw.loads.summary(lw.Run(samples, model=run.load_model()))
    found = lw.loads.margins(summary, ratings).use
    forces, moments = ["axial", "radial"], ["torque", "tilting_moment"]
    expected = [
        found.sel(joint=["shoulder", "elbow", "wrist"], quantity=names).max("quantity").values
        for names in (forces, moments)
    ]
    np.testing.assert_allclose(uses.max(axis=0), expected, rtol=1e-12)
    assert np.isnan(uses[:, 0, 1:]).all()


def test_colours_of_use_have_a_step_at_the_rating():
    blue, below, at, above, unrated = colors_of_use(np.array([0, 0.999, 1.0, 1.001, np.nan]))
    steps = [np.abs(a.astype(int) - b).max() for a, b in ((below, at), (at, above))]
    assert steps[0] <= 1
    assert steps[1] > 60
    assert len({tuple(c) for c in (blue, at, above, unrated)}) == 4
    assert np.ptp(unrated) == 0


def test_ratings_come_from_the_scenario_or_a_file(linkwise, tmp_path):
    scenario = tmp_path / "c.toml"
    scenario.write_text(
        "[model.chain]\nn_bodies = 3\n[rating.joint_2]\nforce = 5\n[simulate]\nduration = 0.1\n"
    )
    (tmp_path / "other.toml").write_text("[rating.joint_1]\nmoment = '2 N m'\n")
    assert linkwise("run", scenario, "-o", "run.zarr").code == 0
    for target in ("c.toml", "run.zarr"):
        assert open_source(target, Options()).ratings == {"joint_2": lw.loads.Rating(force=5)}
        other = open_source(target, Options(ratings=tmp_path / "other.toml"))
        assert other.ratings == {"joint_1": lw.loads.Rating(moment=2)}
        assert rating_use(other.model, other.ratings, True).known


def embedded(path):
    """What an exported page holds: `content` with the arrays in their places."""
    text = path.read_text(encoding="utf-8")
    packed = re.search(r"id='linkwise-data'>(.*?)</script>", text)[1]
    data = gzip.decompress(base64.b64decode(packed))
    size = int.from_bytes(data[:8], "little")
    found = json.loads(data[8 : 8 + size])
    arrays, at = [], 8 + size
    for length in found["lengths"]:
        at += -at % 8
        arrays.append(data[at : at + length])
        at += length
    assert at == len(data)

    def filled(value):
        if isinstance(value, dict) and "__binary_index" in value:
            return np.frombuffer(arrays[value["__binary_index"]], value["dtype"])
        return value

    return {name: filled(value) for name, value in found["content"].items()}


@pytest.mark.parametrize("causes", [[], ["gravity", "drive"]])
def test_exported_page_holds_the_load_of_every_cause(loaded_path, tmp_path, causes):
    pytest.importorskip("viser", reason="the view needs viser: pip install '.[view]'")
    written = write_html(open_source(loaded_path, Options(causes=causes)), tmp_path / "a.html")
    page = embedded(written.path)
    run = lw.open_run(loaded_path)
    assert page["jointNames"] == ["shoulder", "elbow", "wrist"]
    shares = lw.loads.split(run).sel(time=page["times"])
    assert shares.sizes["time"] == 31  # 30 frames in this second, of 101 samples
    assert page["causes"] == shares.cause.values.tolist()
    assert page["chosen"] == sorted(causes or page["causes"])
    loads = page["loads"].reshape(-1, len(page["causes"]), 3, 6)
    np.testing.assert_allclose(loads, shares.values, rtol=1e-6, atol=1e-4)


def test_page_of_a_run_without_a_split_holds_the_whole_load(loaded_path, tmp_path):
    pytest.importorskip("viser", reason="the view needs viser: pip install '.[view]'")
    source = open_source(loaded_path, Options())
    source.recording.causes = None
    page = embedded(write_html(source, tmp_path / "a.html").path)
    assert (page["causes"], page["chosen"]) == ([], [])
    loads = page["loads"].reshape(-1, 3, 6)
    whole = lw.open_run(loaded_path).joint_load.sel(time=page["times"])
    np.testing.assert_allclose(loads, whole, rtol=1e-6, atol=1e-4)
