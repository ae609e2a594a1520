"""Which loads are dashed and in brackets: those that are open in the pose that is shown."""

from pathlib import Path

import numpy as np
import pytest

import linkwise as lw
from linkwise.view.known import Known, elsewhere
from linkwise.view.source import Options, open_source

WATT = Path(__file__).parents[3] / "examples" / "data" / "watt.urdf"
IN_LINE = np.pi / 2


def two_bars() -> lw.Model:
    """Two bars on the ground, whose ends a rod joins: what it carries is open where all lie in one
    line, since any force along that passes through both pins."""
    builder = lw.ModelBuilder("bars")
    builder.add_link("ground")
    for name, x in (("left", 0.0), ("right", 1.5)):
        builder.add_link(name, mass=1, com=[0, 0, 0.5], inertia=np.diag([0.1, 0.1, 0.001]))
        turn = {"axis": [0, 1, 0], "translation": [x, 0, 0]}
        builder.add_joint(f"turn_{name}", "revolute", "ground", name, **turn)
    ends = {"point": [0, 0, 1], "child_point": [0, 0, 1]}
    builder.add_rod("tie", "left", "right", length=1.5, **ends)
    return builder.build()


def test_the_mask_is_that_of_the_pose() -> None:
    known = Known(two_bars(), np.ones((3, 6), dtype=bool))
    assert known.varies
    assert known.at([0.4, 0.4]).all()
    np.testing.assert_array_equal(known.at([IN_LINE, IN_LINE]), [[False, True]] * 3)
    assert known.at([0.4, 0.5]).all()  # open loops: what was found elsewhere


def test_large_machines_keep_the_mask_of_the_run() -> None:
    machine = lw.scenes.benchmark("four_bars", n=40)
    mask = np.zeros((machine.model.n_joints + machine.model.n_loops, 6), dtype=bool)
    mask[:, :2] = True
    known = Known(machine.model, mask)
    assert not known.varies
    np.testing.assert_array_equal(known.at(machine.q0), np.zeros((len(mask), 2), dtype=bool))


def test_what_is_said_of_other_poses() -> None:
    here, sometimes = np.array([True, True]), np.array([True, False])
    assert elsewhere(here, sometimes) == "force not determined in other poses"
    assert elsewhere(here, np.array([True, True])).startswith("force and moment not determined")
    assert elsewhere(np.array([False, True]), sometimes) == ""


def test_locked_joints_hold_more() -> None:
    """Bars that are both locked hold the rod between them."""
    model, all_ = two_bars(), np.ones((3, 6), dtype=bool)
    assert Known(model, all_).at([0.4, 0.4])[2, 0]
    assert not Known(model, all_, ["turn_left", "turn_right"]).at([0.4, 0.4])[2, 0]


def test_a_run_opens_with_its_locked_joints(tmp_path) -> None:
    drives = {"left": lw.Locked()}
    run = lw.simulate(
        lw.load(WATT), duration=0.02, q0=[0.3, 0, 0], drives=drives, output=tmp_path / "run.zarr"
    )
    source = open_source(run.path, Options())
    here = source.known.at(source.recording.position(1))
    np.testing.assert_array_equal(here, run.determinate.values.reshape(-1, 2, 3).all(axis=2))
    np.testing.assert_array_equal(source.known.sometimes, ~here)


def test_arrows_change_with_the_pose() -> None:
    pytest.importorskip("viser", reason="the view needs viser: pip install '.[view]'")
    from linkwise.view.scene import Scene
    from linkwise.view.server import running
    from linkwise.view.source import Appearance, Source

    model = two_bars()
    known = Known(model, np.ones((3, 6), dtype=bool))
    source = Source("bars", model, Appearance([], [], []), known=known)
    with running("127.0.0.1", 0, "bars") as server:
        scene = Scene(server, source)
        scene.style.largest = (1.0, 1.0)
        solid, dashed = (layer.place for layer in scene.layers["Forces"])
        for angle, is_open in ((0.4, False), (IN_LINE, True)):
            moment = scene.at(np.array([angle, angle]), np.ones((3, 6)))
            full, broken = (place(moment)["batched_scales"] for place in (solid, dashed))
            shown, hidden = (broken, full) if is_open else (full, broken)
            assert (shown > 1e-3 * scene.size).all()
            assert (hidden < 1e-6 * scene.size).all()


def test_lines_of_the_plot_of_loads() -> None:
    pytest.importorskip("viser", reason="the view needs viser: pip install '.[view]'")
    from linkwise.view.load_plot import lines_of

    mask = np.array([True, True, False, True, True, True])
    force, moment = lines_of(0, mask), lines_of(1, mask)
    names = ["t [s]", "(size)", "fx", "fy", "(fz)", "now"]
    assert [line["label"] for line in force] == names
    assert ["dash" in line for line in force] == [False, True, False, False, True, False]
    assert [line["label"] for line in moment] == ["t [s]", "size", "nx", "ny", "nz", "now"]
    assert not any("dash" in line for line in moment)
