"""Bearings that do not fit, and preloads: statics of rigid bodies on springs."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from test_bearings import URDF, G, door, loads, on_springs, shaft

import linkwise as lw
from linkwise import _core

pytestmark = pytest.mark.filterwarnings("ignore::linkwise.ModelWarning")
UP = {"axis": (0, 0, 1)}


def misfit_loads(model: lw.Model, q: np.ndarray | None = None) -> dict[str, np.ndarray]:
    q = model.initial_configuration() if q is None else q
    found = lw.joint_loads_by_cause(model, ["misfit"], q, np.zeros(model.nv))[0]
    return dict(zip((*model.joint_names, *model.loop_names), found, strict=True))


@pytest.mark.parametrize("cut", ["upper", "lower"])
def test_a_shim_of_a_hinge_loads_both_hinges_of_a_door(cut: str) -> None:
    """Two springs in a row are pressed together by what they lack: e / (1/k + 1/k')."""
    lower, upper, e = 3e8, 1e8, 20e-6
    model = door(cut=cut).with_bearing("lower", axial=lower, offset=e, **UP)
    found = loads(model.with_bearing("upper", axial=upper, **UP))
    pressed = e / (1 / lower + 1 / upper)
    assert found["lower"][2] == pytest.approx(40 * G * 0.75 + pressed, rel=1e-12)
    assert found["upper"][2] == pytest.approx(40 * G * 0.25 - pressed, rel=1e-12)


def test_a_rigid_bearing_may_have_a_shim() -> None:
    model = door().with_bearing("lower", offset=(0, 0, 2e-5)).with_bearing("upper", axial=1e8, **UP)
    assert misfit_loads(model)["upper"][2] == pytest.approx(-2e3, rel=1e-12)
    assert loads(model)["lower"][2] == pytest.approx(40 * G + 2e3, rel=1e-12)


def test_a_shim_below_a_shaft_on_three_bearings() -> None:
    points, k = np.array((0.0, 0.5, 1.2)), np.array((1e8, 2e8, 5e7))
    offset = np.array((1e-5, 3e-5, 0.0))
    model = shaft(tuple(points))
    for j in range(3):
        given = {"radial": k[j], "tilt": 1e-6, "offset": (0, 0, offset[j])}
        model = model.with_bearing(f"b{j}", **given)
    found = loads(model)
    want = on_springs(points, k, offset, 30 * G)
    np.testing.assert_allclose([found[f"b{j}"][2] for j in range(3)], want, rtol=1e-7)
    # A line of bearings that is only askew fits: the shaft lies askew.
    for j in range(3):
        given = {"radial": k[j], "tilt": 1e-6, "offset": (0, 0, 1e-5 + 1e-4 * points[j])}
        model = model.with_bearing(f"b{j}", **given)
    assert np.abs(misfit_loads(model)["b1"]).max() < 1e-6 * 2e8 * 1e-5


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_a_misfit_stands_in_the_axes_of_the_parent(angle: float) -> None:
    """The upper hinge is mounted e too far along x of the wall: the door's line turns by phi."""
    k, kappa, h, e = 2e8, 3e7, 1.5, 1e-4
    model = door("revolute")
    model = model.with_bearing("lower", axial=1e8, radial=k, tilt=kappa)
    model = model.with_bearing("upper", axial=1e8, radial=k, tilt=kappa, offset=(e, 0, 0))
    phi = k * e * h / 2 / (2 * kappa + k * h**2 / 2)
    found = misfit_loads(model, np.array([angle]))
    axes = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0],
                     [0, 0, 1]])  # fmt: skip
    force = axes @ [k * (e - phi * h) / 2, 0, 0]
    np.testing.assert_allclose(found["upper"][:3], force, atol=1e-6)
    np.testing.assert_allclose(found["lower"][:3], -force, atol=1e-6)
    np.testing.assert_allclose(found["upper"][3:], axes @ [0, -kappa * phi, 0], atol=1e-6)


def test_a_hinge_that_is_mounted_askew() -> None:
    """With rigid places both hinges bend until their lines agree: two springs in a row again."""
    model = door("revolute").with_bearing("lower", tilt=2e6, turn=(0, 1e-3, 0))
    found = misfit_loads(model.with_bearing("upper", tilt=1e6))
    # The places hold the door upright by a couple of forces: each hinge bends by its own misfit.
    assert found["lower"][4] == pytest.approx(2e6 * 1e-3, rel=1e-9)
    assert found["upper"][4] == pytest.approx(0, abs=1e-6)
    np.testing.assert_allclose(found["upper"][0], -found["lower"][0], rtol=1e-12)
    assert abs(found["upper"][0]) == pytest.approx(2e3 / 1.5, rel=1e-9)


def pair(k1: float, k2: float, preload: float) -> lw.Model:
    """A shaft on two tapered bearings, set against each other along x."""
    model = shaft((0.0, 0.5))
    builder = lw.ModelBuilder("spindle", gravity=(0, 0, 0))
    builder.add_link("base")
    builder.add_link("shaft", mass=30, com=(0.3, 0, 0), inertia=np.diag([0.1, 4.0, 4.0]))
    along_x = {"axis": (1, 0, 0)}
    builder.add_joint("left", "revolute", "base", "shaft", **along_x)
    ends = {"translation": (0.5, 0, 0), "child_translation": (0.5, 0, 0)}
    builder.add_loop("right", "revolute", "base", "shaft", **along_x, **ends)
    model = builder.build().with_bearing("left", axial=k1, radial=1e9, tilt=1e6, preload=preload)
    return model.with_bearing("right", axial=k2, radial=1e9, tilt=1e6, preload=-preload)


@pytest.mark.parametrize(("k1", "k2"), [(1e8, 1e8), (3e8, 1e8)])
def test_tapered_bearings_that_are_set_against_each_other(k1: float, k2: float) -> None:
    """Of a load along the shaft each takes its stiffness' part, on top of the preload. Past the
    load that frees one of them, which a real one lets go, the linear model lets it pull."""
    model = pair(k1, k2, 500.0)
    assert misfit_loads(model)["left"][0] == pytest.approx(500, rel=1e-12)
    for force in (-300.0, 0.0, 500 * (k1 + k2) / k1, 3000.0):
        wrench = np.zeros((1, model.n_joints, 6))
        wrench[0, 0, 0] = force
        found = lw.joint_loads(model, [[0]], [[0]], [[0]], external=wrench)[0]
        assert found[0, 0] == pytest.approx(500 - force * k1 / (k1 + k2), abs=1e-8)
        assert found[1, 0] == pytest.approx(-500 - force * k2 / (k1 + k2), abs=1e-8)


def test_a_run_in_which_a_preload_is_overcome_says_so() -> None:
    """The shaft's own weight does nothing; a force along it frees the left bearing at 667 N."""
    for force, lifted in ((600.0, 0), (700.0, 1), (-1900.0, 0), (-2100.0, 1)):
        wrench = {"shaft": lw.Wrench([force, 0, 0, 0, 0, 0])}
        run = lw.simulate(pair(3e8, 1e8, 500.0), duration=0.01, wrenches=wrench)
        said = [w["element"] for w in run.warnings if "turns against its preload" in w["text"]]
        assert said == (["left"] if force > 0 else ["right"]) * lifted


def plates(kind: str, preload: tuple[float, float, float], **more: object) -> lw.Model:
    """A plate between two joints, pressed against each other along y, both as stiff: of a kind, or
    a ball joint and a fixed one."""
    builder = lw.ModelBuilder("plates", gravity=(0, 0, 0))
    builder.add_link("base")
    builder.add_link("plate", mass=30, com=(0, 0, 0), inertia=np.diag([1.0, 4.0, 4.0]))
    first = "spherical" if kind == "fixed" else kind
    builder.add_joint("one", first, "base", "plate", **more)
    builder.add_loop("other", kind, "base", "plate", **more)
    stiff = {"axial": 1e8, "radial": 1e8}
    model = builder.build().with_bearing("one", **stiff, preload=preload)
    return model.with_bearing("other", **stiff, preload=tuple(-x for x in preload))


@pytest.mark.parametrize(
    ("kind", "more", "what"),
    [
        ("spherical", {}, "the force turns"),
        ("fixed", {}, "the force turns"),
        ("revolute", {"axis": (0, 0, 1)}, "the force across its axis turns"),
    ],
)
def test_any_joint_whose_preload_is_overcome_says_so(kind, more, what) -> None:
    """Each of two equal bearings takes half of a push: 500 N are overcome by more than 1000 N."""
    model = plates(kind, (0, 500.0, 0), **more)
    assert misfit_loads(model)["one"][1] == pytest.approx(500, rel=1e-9)
    for force, who in ((900.0, []), (1100.0, ["one"]), (-900.0, []), (-1100.0, ["other"])):
        wrench = {"plate": lw.Wrench([0, force, 0, 0, 0, 0], axes="world")}
        run = lw.simulate(model, duration=0.01, wrenches=wrench)
        said = {w["element"]: w["text"] for w in run.warnings if "its preload in" in w["text"]}
        assert list(said) == who
        assert all(text.startswith(what) for text in said.values())


def test_a_preload_is_turned_with_the_joint() -> None:
    """The hinge's preload stands along the parent's y; the plate is turned by a right angle, so a
    push along the world's y is one along its own -x or x."""
    model = plates("revolute", (0, 500.0, 0), axis=(0, 0, 1))
    found = _core.preload_forces(model, [[0.0], [np.pi / 2]])
    np.testing.assert_allclose(found[0], [[0, 500, 0], [0, -500, 0]], atol=1e-10)
    np.testing.assert_allclose(found[1], [[500, 0, 0], [-500, 0, 0]], atol=1e-10)
    for force, who in ((900.0, []), (1100.0, ["one"]), (-1100.0, ["other"])):
        wrench = {"plate": lw.Wrench([0, force, 0, 0, 0, 0], axes="world")}
        run = lw.simulate(model, duration=0.01, wrenches=wrench, q0=[np.pi / 2])
        said = [w["element"] for w in run.warnings if "its preload in" in w["text"]]
        assert said == who


def test_it_turns_during_a_run() -> None:
    """A push that grows: the first sample past 1000 N is named."""
    model = plates("spherical", (0, 500.0, 0))
    wrench = {"plate": lw.Wrench(lambda t: [0, 19000 * t, 0, 0, 0, 0], axes="world")}
    run = lw.simulate(model, duration=0.1, every=0.01, wrenches=wrench)
    (text,) = [w["text"] for w in run.warnings if "its preload in" in w["text"]]
    assert "first at 0.06 s" in text
    light = lw.simulate(model, duration=0.1, every=0.01, wrenches=wrench, record=["joint_load"])
    assert any(w["text"] == text for w in light.warnings)


def test_a_preloaded_tie_rod_that_goes_slack_says_so() -> None:
    """Both rods pull by 300 N. The lower one, twice as stiff, loses two thirds of a weight."""
    model = braced(preload=-300.0).with_bearing("above", axial=1e6, preload=-300.0)
    for weight, slack in ((440.0, []), (460.0, ["below"])):
        wrench = {"slider": lw.Wrench([0, 0, G - weight, 0, 0, 0])}
        run = lw.simulate(model, duration=0.01, wrenches=wrench)
        assert [w["element"] for w in run.warnings if "its preload in" in w["text"]] == slack


def braced(**given: float) -> lw.Model:
    """A slider along z between a rod below it and one above."""
    builder = lw.ModelBuilder("braced", gravity=(0, 0, 0))
    builder.add_link("frame")
    builder.add_link("slider", mass=1, inertia=np.eye(3))
    builder.add_joint("guide", "prismatic", "frame", "slider", axis=(0, 0, 1))
    builder.add_rod("below", "frame", "slider", length=1, point=(0, 0, -1))
    builder.add_rod("above", "frame", "slider", length=2, point=(0, 0, 2))
    model = builder.build().with_bearing("below", axial=2e6, **given)
    return model.with_bearing("above", axial=1e6)


def test_a_rod_that_is_too_long_pushes() -> None:
    found = misfit_loads(braced(offset=3e-4))
    assert found["below"][2] == pytest.approx(200, rel=1e-12)
    assert found["above"][2] == pytest.approx(-200, rel=1e-12)
    found = misfit_loads(braced(preload=-300))  # a third is the other rod's to give
    assert found["below"][2] == pytest.approx(-100, rel=1e-12)


def test_runs_have_it_as_a_cause_and_in_peaks_and_bounds() -> None:
    model = door().with_bearing("lower", axial=3e8, offset=20e-6, **UP)
    model = model.with_bearing("upper", axial=1e8, **UP)
    run = lw.simulate(model, duration=0.2, v0=[0, 0, 1.0])
    shares = lw.loads.split(run)
    assert "misfit" in shares.cause
    np.testing.assert_allclose(shares.sum("cause"), run.joint_load, rtol=1e-9, atol=1e-8)
    pressed = shares.sel(cause="misfit", component="fz", joint="lower")
    np.testing.assert_allclose(pressed, 1500, rtol=1e-9)
    assert run.by_bearings.sel(component="fz").values.all()
    assert not run.by_bearings.sel(component="fx").values.any()
    peak = run.peak_loads().force.sel(joint="lower")
    assert float(peak) > 1500 + 40 * G * 0.75 - 1
    algebraic = lw.loads.bounds(run).algebraic.sel(quantity="force", joint="lower")
    assert float(algebraic) < 1e-6
    many = lw.simulate_batch(model, step=1e-3, duration=0.01, v0=np.zeros((2, 3)))
    np.testing.assert_allclose(
        many.joint_load.sel(component="fz", joint="lower"), 1794.3, rtol=1e-6
    )
    np.testing.assert_array_equal(many.by_bearings[0], run.by_bearings)
    bare = lw.loads.split(lw.simulate(door(), duration=0.01))
    assert "misfit" not in bare.cause


def test_it_is_no_need_of_the_motion() -> None:
    """What each part of a motion needs is that of the machine whose bearings fit."""
    builder = lw.ModelBuilder("door", gravity=(0, 0, -G))
    builder.add_link("wall")
    builder.add_link("door", mass=20, com=(0.4, 0, 1), inertia=np.diag([5, 6, 2.0]))
    up = (0, 0, 1)
    builder.add_joint("low", "revolute", "wall", "door", translation=(0, 0, 0.2), axis=up)
    builder.add_loop(
        "high",
        "revolute",
        "wall",
        "door",
        translation=(0, 0, 2),
        child_translation=(0, 0, 1.8),
        axis=up,
    )
    fits = builder.build().with_bearing("low", axial=1e6).with_bearing("high", axial=1e6)
    model = fits.with_bearing("high", axial=1e6, offset=1e-4)
    shares, expected = (
        lw.loads.split(lw.simulate(m, duration=0.2, v0=[1.0], drives={"low": 0.5}), "motion")
        for m in (model, fits)
    )
    assert set(shares.cause.values) == {*expected.cause.values, "misfit"}
    for cause in expected.cause.values:
        np.testing.assert_allclose(
            shares.sel(cause=cause), expected.sel(cause=cause), rtol=1e-9, atol=1e-8
        )
    pressed = shares.sel(cause="misfit", component="fz", joint="high")
    np.testing.assert_allclose(pressed, 1e-4 / (2 / 1e6), rtol=1e-9)


def test_stored_runs_keep_what_bearings_decided(tmp_path) -> None:
    model = door().with_bearing("lower", axial=3e8, **UP).with_bearing("upper", axial=1e8, **UP)
    run = lw.simulate(model, duration=0.05, output=tmp_path / "run.zarr")
    np.testing.assert_array_equal(lw.open_run(run.path).by_bearings, run.by_bearings)
    assert "by_bearings" not in lw.simulate(door(), duration=0.01)


def test_a_misfit_moves_nothing() -> None:
    model = door("revolute")
    shimmed = model.with_bearing("lower", axial=1e8, offset=1e-3).with_bearing("upper", axial=1e8)
    options = {"duration": 0.3, "v0": [1.0], "every": 0.1}
    np.testing.assert_array_equal(
        lw.simulate(model, **options).position, lw.simulate(shimmed, **options).position
    )


def texts(model: lw.Model) -> list[str]:
    return [
        w["text"] for w in lw.simulate(model, duration=0.01).warnings if w["element"] == "lower"
    ]


def test_misfits_without_effect_are_told() -> None:
    # Two ball joints hold no couple against each other: the door hangs askew.
    model = door().with_bearing("lower", axial=1e8, radial=1e8, offset=(1e-4, 0, 0), **UP)
    assert "moves the machine as that is assembled" in texts(model)[0]
    assert "offset of its bearing along x" in texts(model)[0]
    rigid = door().with_bearing("lower", offset=(0, 0, 1e-4))
    assert "what holds against it is rigid" in texts(rigid)[0]
    lone = door().with_bearing("lower", axial=1e8, preload=500, **UP)
    lone = lone.with_bearing("upper", axial=1e8, **UP)
    assert "gets 250 N of the preload of 500 N" in texts(lone)[0]
    assert not texts(pair(1e8, 3e8, 500))
    whole = lone.with_bearing("upper", axial=1e8, preload=-500, **UP)
    assert not texts(whole)


def test_models_carry_their_misfits() -> None:
    plain = door().with_bearing("lower", axial=1e8, **UP)
    model = door().with_bearing(
        "lower", axial=1e8, offset=(0, 0, 1e-5), turn=(0, 1e-3, 0), preload=200.0, **UP
    )
    assert model.bearings == {
        "lower": {
            "axial": 1e8,
            "axis": (0, 0, 1),
            "offset": (0, 0, 1e-5),
            "turn": (0, 1e-3, 0),
            "preload": 200.0,
        }
    }
    assert plain.bearings == {"lower": {"axial": 1e8, "axis": (0, 0, 1)}}
    assert model.hash != plain.hash
    for again in (pickle.loads(pickle.dumps(model)), lw.Model.from_bytes(model.to_bytes())):
        assert again == model
        assert again.bearings == model.bearings
    with pytest.raises(lw.InputError, match=r"cut short|damaged"):
        lw.Model.from_bytes(model.to_bytes()[:-8])


@pytest.mark.parametrize(
    ("joint", "given", "said"),
    [
        ("lower", {"offset": np.nan}, "offset is not finite"),
        ("lower", {"offset": (0, 0, np.inf)}, "offset is not finite"),
        ("lower", {"offset": (0, 0)}, "shape"),
        ("lower", {"turn": 1.0}, "shape"),
        ("lower", {"preload": 500.0}, "preload acts against the stiffness axial"),
        ("lower", {"preload": (5, 0, 5), "axial": 1e8}, "give radial, or offset"),
        ("slide", {"offset": 1e-4}, "slides along its axis freely; remove offset"),
        ("slide", {"preload": (0, 0, 1), "radial": 1e8}, "freely and holds no preload"),
        ("ball", {"offset": 1e-4}, "give axis"),
        ("rod", {"offset": (0, 0, 1e-4)}, "fits or not along itself alone"),
        ("rod", {"preload": 10.0}, "preload acts against the stiffness axial"),
    ],
)
def test_misfits_that_make_no_sense(joint: str, given: dict, said: str) -> None:
    builder = lw.ModelBuilder("door")
    for link in ("wall", "leaf", "drawer", "lamp"):
        builder.add_link(link, mass=1, inertia=np.eye(3))
    builder.add_joint("lower", "revolute", "wall", "leaf", axis=(0, 0, 1))
    builder.add_joint("slide", "prismatic", "wall", "drawer", axis=(0, 0, 1))
    builder.add_joint("ball", "spherical", "wall", "lamp")
    builder.add_rod("rod", "leaf", "lamp", length=1, point=(1, 0, 0))
    with pytest.raises(lw.InputError) as error:
        builder.build().with_bearing(joint, **given)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_a_scenario_gives_misfits(tmp_path) -> None:
    (tmp_path / "door.urdf").write_text(URDF)
    text = (
        'model = "door.urdf"\n[bearing.lower]\naxial = "300 N/um"\noffset = "20 um"\n'
        'turn = [0, "1 deg", 0]\n[bearing.upper]\naxial = "100 N/um"\n'
        'preload = ["0 N", "0 N", "-0.1 kN"]\n[simulate]\nduration = 0.01\n'
    )
    scenario = tmp_path / "door.toml"
    scenario.write_text(text)
    found = lw.run_scenario(scenario).joint_load.sel(component="fz", joint="lower").isel(time=0)
    # 20 um and a preload of 100 N, of which three quarters are the upper bearing's.
    assert float(found) == pytest.approx(40 * G * 0.75 + 1500 + 75, rel=1e-9)
    for old, new, said in (
        ('"20 um"', '"20 N"', "bearing.lower.offset"),
        ('"20 um"', "[1, 2]", "give one along the axis, or three"),
        ('"1 deg"', '"1 mm"', "bearing.lower.turn"),
        ('preload = ["0 N", "0 N", "-0.1 kN"]', 'preload = "5 mm"', "bearing.upper.preload"),
    ):
        scenario.write_text(text.replace(old, new, 1))
        with pytest.raises(lw.InputError) as error:
            lw.run_scenario(scenario)
        assert said in str(error.value)
        assert "\n" not in str(error.value)
