"""Frames on links, welded ones too: what they are, and the wrenches that act there."""

import copy
import json
import pickle

import numpy as np
import pytest

import linkwise as lw

# A leg whose foot is a frame without mass, welded to the shank.
LEG = """<robot name="leg">
  <link name="base"/>
  <link name="thigh"><inertial><origin xyz="0 0.02 -0.15"/><mass value="1.5"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.002"/></inertial></link>
  <link name="shank"><inertial><origin xyz="0 0 -0.12"/><mass value="0.6"/>
    <inertia ixx="0.004" ixy="0" ixz="0" iyy="0.004" iyz="0" izz="0.0005"/></inertial></link>
  <link name="foot_tip"/>
  <joint name="hip" type="continuous"><origin xyz="0.2 0.1 0" rpy="0.1 0 0"/>
    <parent link="base"/><child link="thigh"/><axis xyz="0 1 0"/></joint>
  <joint name="knee" type="continuous"><origin xyz="0 0.08 -0.3"/>
    <parent link="thigh"/><child link="shank"/><axis xyz="0 1 0"/></joint>
  <joint name="tip" type="fixed"><origin xyz="0.01 0 -0.25" rpy="0 0.5 0.2"/>
    <parent link="shank"/><child link="foot_tip"/></joint>
</robot>"""
# Pinocchio: rnea at rest less J^T f, of the foot's frame, 100 N upwards at q = (0.7, -1.3).
HELD = [-2.21332941, 14.46992686]
POSE = np.array([0.7, -1.3])
UP = np.array([0, 0, 100.0, 0, 0, 0])
TIP = lw.Frame("shank", (0.01, 0, -0.25), (0, 0.5, 0.2))


@pytest.fixture(scope="module")
def leg():
    return lw.load(LEG)


def hold(model, wrenches, **options):
    """A run in which the joints hold still under these wrenches."""
    drives = {"hip": lw.drives.Locked(), "knee": lw.drives.Locked()}
    options = {"duration": 0.1, "every": 0.05, "q0": POSE} | options
    return lw.simulate(model, drives=drives, wrenches=wrenches, **options)


def test_a_frame_is_a_value():
    same = lw.Frame("shank", origin=[0.01, 0.0, -0.25], axes=TIP.axes)
    assert same == TIP
    assert hash(same) == hash(TIP)
    assert lw.Frame("shank") != TIP
    assert TIP != "shank"
    for made in (pickle.loads(pickle.dumps(TIP)), copy.deepcopy(TIP)):
        assert made == TIP
    assert lw.Frame("shank", [-0.0, 0, 0]) == lw.Frame("shank")
    assert {TIP: 1}[same] == 1
    assert repr(lw.Frame("shank", (0, 0, 1))) == "Frame('shank', origin=(0.0, 0.0, 1.0))"


def test_axes_are_angles_a_quaternion_or_a_matrix():
    c, s = np.cos(0.3), np.sin(0.3)
    about_z = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    for axes in ((0, 0, 0.3), (0, 0, np.sin(0.15), np.cos(0.15)), about_z):
        np.testing.assert_allclose(lw.Frame("a", axes=axes).axes, about_z, atol=1e-15)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: lw.Frame("a", (1, 2)), r"origin has shape \(2,\) but shape \(3,\) is expected"),
        (lambda: lw.Frame("a", (1, 2, np.nan)), "origin is not finite"),
        (lambda: lw.Frame("a", axes=[1, 2]), "give roll, pitch, yaw, a quaternion"),
        (lambda: lw.Frame("a", axes=[1, 2, 3, 4]), "has not length 1"),
        (lambda: lw.Frame("a", axes=np.diag([1, 1, -1])), "axes is not a rotation matrix"),
        (lambda: lw.Frame("a", axes=[np.inf, 0, 0]), "axes are not finite"),
        (lambda: lw.Wrench([0] * 6, at=3), "wrench at: 3 is no frame"),
    ],
)
def test_what_is_no_frame_is_refused(make, message):
    with pytest.raises(lw.InputError, match=message):
        make()


def test_unknown_frames_name_the_near_ones(leg):
    for ask in (
        lambda: leg.frame_placement("foot_tpi"),
        lambda: lw.frame_jacobian(leg, POSE, lw.Frame("foot_tpi")),
        lambda: hold(leg, {"foot_tpi": UP}),
    ):
        with pytest.raises(lw.InputError, match=r"link 'foot_tpi' .*; did you mean 'foot_tip'\?"):
            ask()
    with pytest.raises(lw.InputError, match="frame is 3; give the name of a link"):
        lw.frame_pose(leg, POSE, 3)
    with pytest.raises(lw.InputError, match="axes: 'body' is unknown; use world or frame"):
        lw.frame_jacobian(leg, POSE, "shank", axes="body")


def test_placements_survive_copies(leg):
    body, rotation, origin = leg.frame_placement("foot_tip")
    assert body == "shank"
    np.testing.assert_array_equal(origin, TIP.origin)
    np.testing.assert_allclose(rotation, TIP.axes, rtol=0, atol=1e-16)
    for made in (pickle.loads(pickle.dumps(leg)), lw.Model.from_bytes(leg.to_bytes())):
        again = made.frame_placement("foot_tip")
        assert again[0] == body
        np.testing.assert_array_equal(again[1], rotation)
        np.testing.assert_array_equal(again[2], origin)


def test_the_ground_does_not_move(leg):
    on_ground = lw.Frame("base", (1, 2, 3))
    many = np.random.default_rng(0).normal(size=(4, 2))
    assert (lw.frame_pose(leg, many, on_ground)[:, :3, 3] == [1, 2, 3]).all()
    assert not lw.frame_jacobian(leg, many, on_ground).any()
    assert not lw.frame_acceleration(leg, many, many, many, on_ground).any()
    with pytest.raises(lw.InputError, match=r"wrenches\['base'\]: link 'base' .* the ground"):
        hold(leg, {"base": UP})


def test_leading_axes_broadcast(leg):
    q = np.random.default_rng(1).normal(size=(3, 1, 2))
    v = np.random.default_rng(2).normal(size=(4, 2))
    found = lw.frame_velocity(leg, q, v, "foot_tip")
    assert found.shape == (3, 4, 6)
    J = lw.frame_jacobian(leg, q, "foot_tip")
    np.testing.assert_allclose(found, (J @ v[..., None])[..., 0], rtol=0, atol=1e-14)
    np.testing.assert_array_equal(
        lw.frame_acceleration(leg, q, None, v, "foot_tip"), lw.frame_velocity(leg, q, v, "foot_tip")
    )


@pytest.mark.parametrize(
    "wrenches",
    [
        {"foot_tip": UP},
        {TIP: lw.Wrench(UP, "world")},
        {lw.Frame("thigh"): [0] * 6, lw.Frame("foot_tip"): UP},
        {"push": lw.Wrench(UP, at="foot_tip")},
        {"one": lw.Wrench(UP / 4, "world", at=TIP), "foot_tip": lambda t: 3 * UP / 4},
    ],
)
def test_holding_torques_under_a_force_at_the_tip(leg, wrenches):
    run = hold(leg, wrenches)
    np.testing.assert_allclose(run.drive_torque.values, [HELD] * 3, rtol=1e-8)
    assert run.wrenched_body.values.tolist()[-1] == "shank"


def test_along_the_frames_own_axes(leg):
    axes = lw.frame_pose(leg, POSE, TIP)[:3, :3]
    turned = np.concatenate([axes.T @ UP[:3], axes.T @ UP[3:]])
    for at in (TIP, "foot_tip"):
        run = hold(leg, {at: lw.Wrench(turned, axes="frame")})
        np.testing.assert_allclose(run.drive_torque.values, [HELD] * 3, rtol=1e-8)


def test_loads_and_causes_are_computed_again_from_the_recorded_wrench(leg, tmp_path):
    push = {"foot_tip": UP, "side": lw.Wrench([0, 5, 0, 1, 0, 0], at=lw.Frame("shank", (0, 1, 0)))}
    hold(leg, push, output=tmp_path / "run.zarr")
    run = lw.open_run(tmp_path / "run.zarr")
    assert run.wrenched_body.values.tolist() == ["shank"]
    told = json.loads(run.attrs["wrenches"])
    assert told["side"]["at"]["origin"] == [0, 1, 0]
    assert told["foot_tip"]["at"]["link"] == "foot_tip"
    shares = lw.loads.split(run, by="motion").sum("cause")
    np.testing.assert_allclose(shares, run.joint_load, rtol=0, atol=1e-10)
    J = [lw.frame_jacobian(leg, POSE, at) for at in ("foot_tip", lw.Frame("shank", (0, 1, 0)))]
    torque = lw.inverse_dynamics(leg, POSE, None, None) - J[0].T @ UP - J[1].T @ [0, 5, 0, 1, 0, 0]
    np.testing.assert_allclose(run.drive_torque.values[-1], torque, rtol=1e-9)


def test_a_batch_takes_frames(leg):
    options = {"step": 1e-4, "duration": 0.05, "every": 0.05, "q0": POSE}
    batch = lw.simulate_batch(leg, wrenches={TIP: lw.Wrench(UP, "world")}, **options)
    one = lw.simulate(
        leg, wrenches={"foot_tip": UP}, duration=0.05, every=0.05, q0=POSE, tolerance=1e-9
    )
    np.testing.assert_allclose(batch.position.values[-1], one.position.values[-1], atol=1e-8)


def test_a_wrench_has_one_frame(leg):
    with pytest.raises(lw.InputError, match="given for a frame and has another one"):
        hold(leg, {TIP: lw.Wrench(UP, at="shank")})


SCENARIO = """model = "leg.urdf"
drive.hip.kind = "locked"
drive.knee.kind = "locked"
initial.position = {hip = 0.7, knee = -1.3}
simulate.duration = 0.1
"""


@pytest.mark.parametrize(
    "section",
    [
        "[wrench.foot_tip]\nforce = [0, 0, 100]",
        "[wrench.push]\nlink = 'foot_tip'\nforce = [0, 0, 100]",
        "[wrench.push]\nlink = 'shank'\npoint = ['10 mm', 0, -0.25]\nforce = [0, 0, 100]",
        "[wrench.push]\nlink = 'base_of_foot'\npoint = ['10 mm', 0, -0.25]\nforce = [0, 0, 100]\n"
        "[payload.base_of_foot]\nlink = 'shank'\nmass = 0",
        "[wrench.a]\nlink = 'foot_tip'\nforce = [0, 0, 50]\n"
        "[wrench.b]\nlink = 'foot_tip'\nforce = [0, 0, '50 N']",
    ],
)
def test_a_scenario_places_wrenches(tmp_path, section):
    (tmp_path / "leg.urdf").write_text(LEG)
    path = tmp_path / "run.toml"
    path.write_text(f"{SCENARIO}{section}\n")
    run = lw.run_scenario(path)
    np.testing.assert_allclose(run.drive_torque.values[-1], HELD, rtol=1e-8)


def test_axes_of_a_scenario_are_those_of_the_components(leg, tmp_path):
    (tmp_path / "leg.urdf").write_text(LEG)
    path = tmp_path / "run.toml"
    turned = lw.frame_pose(leg, POSE, TIP)[:3, :3].T @ UP[:3]
    text = f"[wrench.push]\nlink = 'shank'\npoint = [0.01, 0, -0.25]\nforce = {turned.tolist()}\n"
    path.write_text(f"{SCENARIO}{text}axes = [0, 0.5, '{np.rad2deg(0.2)} deg']\n")
    run = lw.run_scenario(path)
    np.testing.assert_allclose(run.drive_torque.values[-1], HELD, rtol=1e-8)


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ("[wrench.push]\nforce = [0, 0, 1]", "wrench.push: is no link of the model and names none"),
        ("[wrench.p]\nlink = 'shonk'\nforce = [0, 0, 1]", r"wrench.p.link: .*mean 'shank'"),
        ("[wrench.shank]\nframe = 'world'\nforce = [0, 0, 1]", "wrench.shank.frame: unknown key"),
        ("[wrench.shank]\npoint = [0, 0]\nforce = [0, 0, 1]", "wrench.shank.point: has 2 numbers"),
        ("[wrench.shank]\npoint = [0, 0, '1 s']\nforce = [0, 0, 1]", "wrench.shank.point"),
        ("[wrench.base]\nforce = [0, 0, 1]", r"'base' of .*fixed to the ground"),
    ],
)
def test_what_a_scenario_gets_wrong(tmp_path, section, message):
    (tmp_path / "leg.urdf").write_text(LEG)
    path = tmp_path / "run.toml"
    path.write_text(f"{SCENARIO}{section}\n")
    with pytest.raises(lw.InputError, match=message) as error:
        lw.run_scenario(path)
    assert "\n" not in str(error.value)


def test_loads_of_a_state_under_a_wrench_at_the_tip(leg):
    many = np.random.default_rng(3).normal(size=(5, 2))
    still = np.zeros(2)
    for push in (
        {"foot_tip": UP},
        {TIP: lw.Wrench(UP / 2, "world"), "half": lw.Wrench(UP / 2, at="foot_tip")},
        {"foot_tip": np.tile(UP, (5, 1))},
    ):
        outside = lw.external_wrenches(leg, many, push)
        assert outside.shape == (5, 2, 6)
        torque = lw.inverse_dynamics(leg, many, still, still, external=outside)
        J = lw.frame_jacobian(leg, many, "foot_tip")
        free = lw.inverse_dynamics(leg, many, still, still)
        np.testing.assert_allclose(torque, free - np.swapaxes(J, -1, -2) @ UP, atol=1e-12)
    run = hold(leg, {TIP: lw.Wrench(UP, "frame")})
    outside = lw.external_wrenches(leg, POSE, {TIP: lw.Wrench(UP, "frame")})
    np.testing.assert_allclose(outside[1], run.external_wrench[0, 0], rtol=0, atol=1e-12)
    loads = lw.inverse_dynamics_loads(leg, POSE, still, still, external=outside)
    np.testing.assert_allclose(loads, run.joint_load[0], rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("push", "message"),
    [
        ({"base": UP}, "is fixed to the ground"),
        ({"shank": [1, 2]}, r"shape \(2,\)"),
        ({"shank": lw.Wrench(lambda t: UP)}, "is no constant"),
        ({"shonk": UP}, "did you mean 'shank'"),
    ],
)
def test_wrenches_of_a_state_that_are_refused(leg, push, message):
    with pytest.raises(lw.InputError, match=message):
        lw.external_wrenches(leg, POSE, push)


def test_a_wrench_on_a_link_without_mass_between_joints_is_refused():
    """No body would get it: it would be left out without a word."""
    builder = lw.ModelBuilder("universal")
    builder.add_link("ground")
    builder.add_link("cross")
    builder.add_link("bob", mass=1, com=(0, 0, -1), inertia=0.1 * np.eye(3))
    builder.add_joint("first", "revolute", "ground", "cross", axis=(1, 0, 0))
    builder.add_joint("second", "revolute", "cross", "bob", axis=(0, 1, 0))
    model = builder.build()
    q = np.zeros(2)
    outside = lw.external_wrenches(model, q, {"cross": [0, 1, 0, 0, 0, 0]})
    for call in (lw.joint_loads, lw.forward_dynamics):
        with pytest.raises(lw.InputError, match="link 'cross' between two joints has no mass"):
            call(model, q, q, q, external=outside)
    with pytest.raises(lw.InputError, match="link 'cross' between two joints has no mass"):
        lw.simulate(model, duration=0.1, wrenches={"cross": [0, 1, 0, 0, 0, 0]})
    assert lw.joint_loads(model, q, q, q, external=np.zeros((2, 6))).shape == (2, 6)


def test_what_describes_a_frame_is_read_only(leg):
    for array in (TIP.origin, TIP.axes, *leg.frame_placement(TIP)[1:]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_at_a_frame_with_axes_it_must_be_said_whose_the_components_are(leg):
    for use in (
        lambda: hold(leg, {TIP: UP}),
        lambda: hold(leg, {"push": lw.Wrench(UP, at=TIP)}),
        lambda: lw.external_wrenches(leg, POSE, {TIP: UP}),
        lambda: lw.simulate_batch(leg, wrenches={TIP: UP}, step=0.01, duration=0.1),
    ):
        with pytest.raises(lw.InputError, match="its frame on 'shank' has axes of its own; say"):
            use()
    hold(leg, {lw.Frame("shank", (0.01, 0, -0.25)): UP})


@pytest.mark.parametrize("axes", ["hand", "body"])
def test_axes_are_those_of_the_world_or_of_the_frame(axes):
    with pytest.raises(lw.InputError, match=f"axes: '{axes}' is unknown; use world or frame"):
        lw.Wrench(UP, axes=axes)
