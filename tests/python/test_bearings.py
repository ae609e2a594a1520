"""Bearings decide the loads that rigid bodies leave open: closed forms, and a twin on springs."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import linkwise as lw

G = 9.81
URDF = """<robot name="door"><link name="wall"/>
<link name="door"><inertial><origin xyz="0.45 0 0.75"/><mass value="40"/>
<inertia ixx="20" iyy="22" izz="3" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="upper_end"/>
<joint name="lower" type="continuous"><parent link="wall"/><child link="door"/>
<axis xyz="0 0 1"/></joint>
<joint name="end" type="fixed"><parent link="door"/><child link="upper_end"/>
<origin xyz="0 0 1.5"/></joint>
<joint name="upper" type="continuous"><parent link="wall"/><child link="upper_end"/>
<origin xyz="0 0 1.5"/><axis xyz="0 0 1"/></joint></robot>
"""


def door(kind: str = "spherical", *, cut: str = "upper", scale: float = 1.0) -> lw.Model:
    """40 kg, hinges 1.5 m apart, its centre 0.45 m beside their line. scale: metres in a unit."""
    builder = lw.ModelBuilder("door", gravity=(0, 0, -G / scale))
    builder.add_link("wall")
    points = {"lower": (0, 0, 0.0), "upper": (0, 0, 1.5 / scale)}
    tree = "lower" if cut == "upper" else "upper"
    to = np.array(points[tree])
    inertia = np.diag([20.0, 22.0, 3.0]) / scale**2
    com = np.array((0.45, 0, 0.75)) / scale - to
    builder.add_link("door", mass=40, com=com, inertia=inertia)
    builder.add_joint(tree, kind, "wall", "door", translation=to)
    builder.add_loop(
        cut, kind, "wall", "door", translation=points[cut], child_translation=points[cut] - to
    )
    return builder.build()


def loads(model: lw.Model, **given: object) -> dict[str, np.ndarray]:
    q = model.initial_configuration()
    found = lw.joint_loads(model, q, np.zeros(model.nv), np.zeros(model.nv), **given)
    return dict(zip((*model.joint_names, *model.loop_names), found, strict=True))


@pytest.mark.parametrize("cut", ["upper", "lower"])
@pytest.mark.parametrize(("lower", "upper"), [(1e8, 1e8), (3e8, 1e8), (1e5, 2e9)])
def test_hinges_share_a_weight_by_their_stiffness(cut: str, lower: float, upper: float) -> None:
    model = door(cut=cut)
    before = loads(model)
    ball = {"radial": 1e7, "axis": (0, 0, 1)}
    model = model.with_bearing("lower", axial=lower, **ball)
    found = loads(model.with_bearing("upper", axial=upper, **ball))
    share = 40 * G * lower / (lower + upper)
    np.testing.assert_allclose(found["lower"][2], share, rtol=1e-10)
    np.testing.assert_allclose(found["upper"][2], 40 * G - share, rtol=1e-10)
    for joint in found:  # what was known stays
        np.testing.assert_allclose(found[joint][:2], before[joint][:2], rtol=1e-11, atol=1e-9)
    np.testing.assert_allclose(found["upper"][0], -40 * G * 0.45 / 1.5, rtol=1e-10)


def test_a_rigid_bearing_takes_all() -> None:
    found = loads(door().with_bearing("upper", axial=1e8, axis=(0, 0, 1)))
    np.testing.assert_allclose(found["lower"][2], 40 * G, rtol=1e-12)
    np.testing.assert_allclose(found["upper"][2], 0, atol=1e-9)


def test_bearings_say_what_they_decide() -> None:
    model = door("revolute")
    q = model.initial_configuration()
    bare = lw.indeterminacy(model, q)
    assert len(bare.undecided) == len(bare.self_stresses) == 5
    axial = lw.indeterminacy(model.with_bearing("upper", axial=1e8), q)
    assert len(axial.undecided) == 4
    assert len(axial.self_stresses) == 5
    assert axial.determinate[:, 2].all()
    assert axial.by_bearings[:, 2].all()
    assert not axial.determinate[:, [0, 1, 3, 4]].any()
    whole = lw.indeterminacy(model.with_bearing("upper", axial=1e8, radial=1e8, tilt=1e4), q)
    assert len(whole.undecided) == 0
    assert whole.determinate.all()
    assert whole.by_bearings.sum() == 10


def test_what_no_bearing_decides_keeps_the_least_energy() -> None:
    model = door("revolute")
    bare, found = loads(model), loads(model.with_bearing("upper", axial=1e8))
    for joint in bare:
        np.testing.assert_allclose(found[joint][[0, 1, 3, 4]], bare[joint][[0, 1, 3, 4]], rtol=1e-9)


def shaft(points: tuple[float, ...]) -> lw.Model:
    """30 kg along x on bearings at these points, its centre at 0.3 m."""
    builder = lw.ModelBuilder("shaft")
    builder.add_link("base")
    builder.add_link("shaft", mass=30, com=(0.3, 0, 0), inertia=np.diag([0.1, 4.0, 4.0]))
    along_x = {"axis": (1, 0, 0)}
    builder.add_joint("b0", "revolute", "base", "shaft", **along_x)
    for k, x in enumerate(points[1:], 1):
        ends = {"translation": (x, 0, 0), "child_translation": (x, 0, 0)}
        builder.add_loop(f"b{k}", "cylindrical", "base", "shaft", **along_x, **ends)
    return builder.build()


def on_springs(points: np.ndarray, k: np.ndarray, offset: np.ndarray, weight: float) -> np.ndarray:
    """Forces of springs k at x on a rigid beam: w = k (offset - a - b x), in equilibrium."""
    A = np.array([[k.sum(), k @ points], [k @ points, k @ points**2]])
    b = [k @ offset - weight, (k * offset) @ points - weight * 0.3]
    a = np.linalg.solve(A, b)
    return k * (offset - a[0] - a[1] * points)


@pytest.mark.parametrize("ratio", [1.0, 1e3, 1e9])
def test_a_shaft_on_three_bearings_is_a_beam_on_three_springs(ratio: float) -> None:
    points, k = np.array((0.0, 0.5, 1.2)), np.array((1e8, 2e8 * ratio, 5e7))
    model = shaft(tuple(points))
    for j in range(3):
        model = model.with_bearing(f"b{j}", radial=k[j])
    # Cylindrical bearings hold moments as well; against tilt they are soft.
    for j in range(3):
        model = model.with_bearing(f"b{j}", radial=k[j], tilt=1e-6)
    found = loads(model)
    want = on_springs(points, k, np.zeros(3), 30 * G)
    np.testing.assert_allclose([found[f"b{j}"][2] for j in range(3)], want, rtol=1e-8)


def test_models_carry_their_bearings() -> None:
    bare = door()
    model = bare.with_bearing("upper", axial=1e8, axis=(0, 0, 1))
    assert model.bearing_joints == ["upper"]
    assert bare.bearing_joints == []
    assert model.hash != bare.hash
    for again in (pickle.loads(pickle.dumps(model)), lw.Model.from_bytes(model.to_bytes())):
        assert again == model
        np.testing.assert_array_equal(loads(again)["lower"], loads(model)["lower"])
    twice = model.with_bearing("upper", axial=1e8, axis=(0, 0, 1))
    assert twice == model
    with pytest.raises(lw.InputError, match=r"cut short|damaged"):
        lw.Model.from_bytes(model.to_bytes()[:-8])


def test_shares_by_cause_follow_the_bearings_and_add_up() -> None:
    model = door().with_bearing("lower", axial=3e8, axis=(0, 0, 1))
    model = model.with_bearing("upper", axial=1e8, axis=(0, 0, 1))
    run = lw.simulate(model, duration=0.2, wrenches={"door": [0, 50, 80, 0, 0, 0]})
    shares = lw.loads.split(run)
    np.testing.assert_allclose(shares.sum("cause"), run.joint_load, rtol=1e-9, atol=1e-8)
    gravity = shares.sel(cause="gravity", component="fz").isel(time=0)
    np.testing.assert_allclose(gravity.sel(joint="lower"), 40 * G * 0.75, rtol=1e-9)
    outside = shares.sel(cause="external", component="fz").isel(time=0)
    np.testing.assert_allclose(outside.sel(joint="upper"), -80 * 0.25, rtol=1e-9)
    assert run.determinate.all()
    assert not [w for w in run.warnings if "do not determine" in w["text"]]


def test_the_machine_moves_as_without_bearings() -> None:
    model = door("revolute")
    stiff = model.with_bearing("upper", axial=1e8, radial=1e8, tilt=1e4)
    options = {"duration": 0.5, "v0": [1.0], "every": 0.1}
    bare, found = lw.simulate(model, **options), lw.simulate(stiff, **options)
    np.testing.assert_array_equal(bare.position, found.position)
    assert found.determinate.all()
    assert not bare.determinate.all()


def test_a_scenario_gives_bearings(tmp_path) -> None:
    scenario = tmp_path / "door.toml"
    (tmp_path / "door.urdf").write_text(URDF)
    text = (
        'model = "door.urdf"\n[bearing.lower]\naxial = "300 N/mm"\nradial = "1e8 N/m"\n'
        'tilt = "1e4 Nm/rad"\n[bearing.upper]\naxial = "100 N/mm"\nradial = 1e8\ntilt = 1e4\n'
        "[simulate]\nduration = 0.1\n"
    )
    scenario.write_text(text)
    run = lw.run_scenario(scenario)
    weight = run.joint_load.sel(component="fz").isel(time=0)
    np.testing.assert_allclose(weight.sel(joint="lower"), 40 * G * 0.75, rtol=1e-9)
    assert run.determinate.all()
    for old, new, said in (
        ('axial = "300 N/mm"', "axial = 0", "bearing.lower.axial: is 0; give a number above 0"),
        ('axial = "300 N/mm"', 'axial = "3 kg"', "bearing.lower.axial"),
        ("bearing.lower", "bearing.lowe", "joint 'lowe' does not exist"),
        ("tilt = 1e4", "torsion = 1e4", "turns about its axis freely; remove torsion"),
        ("tilt = 1e4", "wobble = 1", "wobble"),
    ):
        scenario.write_text(text.replace(old, new, 1))
        with pytest.raises(lw.InputError) as error:
            lw.run_scenario(scenario)
        assert said in str(error.value)
        assert "\n" not in str(error.value)


@pytest.mark.parametrize("method", ["constraint_force", "piecewise"])
def test_the_recursion_alone_shares_among_bearings(method: str) -> None:
    model = door("revolute").with_bearing("upper", axial=1e8)
    with pytest.raises(lw.InputError, match="use method articulated_body"):
        loads(model, method=method)


@pytest.mark.parametrize("scale", [1.0, 1e-3])
@pytest.mark.parametrize(("radial", "tilt"), [(2e8, 1e4), (1e8, 5e7)])
def test_hinges_share_a_moment_by_forces_and_by_tilt(
    radial: float, tilt: float, scale: float
) -> None:
    """The line of the hinges turns by an angle: forces grow with 0.75 m of it, moments as well."""
    model = door("revolute", scale=scale)
    for joint in ("lower", "upper"):
        units = {"axial": 1e8, "radial": radial, "tilt": tilt / scale**2}
        model = model.with_bearing(joint, **units)
    angle = 40 * G * 0.45 / (1.5 * 0.75 * radial + 2 * tilt)
    found = loads(model)
    for joint, sign in (("lower", 1), ("upper", -1)):
        force, moment = found[joint][:3] * scale, found[joint][3:] * scale**2
        np.testing.assert_allclose(force, [sign * 0.75 * radial * angle, 0, 20 * G], atol=1e-9)
        np.testing.assert_allclose(moment, [0, -tilt * angle, 0], rtol=1e-9, atol=1e-9)


def test_one_bearing_decides_the_self_stress_of_bricard() -> None:
    """Its loads stay those of rigid bodies but for the self-stress, and its work is least."""
    machine = lw.scenes.benchmark("bricard")
    bare, q = machine.model, machine.q0
    model = bare.with_bearing("P0", radial=1e8)
    found = lw.indeterminacy(model, q)
    assert (len(found.self_stresses), len(found.undecided)) == (1, 0)
    assert found.determinate.all()
    stress = found.self_stresses[0]
    change = loads_at(model, q) - loads_at(bare, q)
    share = np.vdot(change, stress) / np.vdot(stress, stress)
    np.testing.assert_allclose(change, share * stress, atol=1e-12)
    axis = np.asarray(bare.joint_axes[0][0][1])
    across = stress[0, :3] - axis * (axis @ stress[0, :3])
    np.testing.assert_allclose(across @ loads_at(model, q)[0, :3], 0, atol=1e-10)


def loads_at(model: lw.Model, q: np.ndarray) -> np.ndarray:
    return lw.joint_loads(model, q, np.zeros(model.nv), np.zeros(model.nv))
