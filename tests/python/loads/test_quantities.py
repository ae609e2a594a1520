"""Engineering quantities, frames and summaries: closed forms, there and back, by hand."""

import numpy as np
import pytest

import linkwise as lw
from helpers.loaded_arm import arm
from helpers.machines import DOWN_Y, G, pendulum


def cantilever(length=2.0, mass=3.0):
    """A uniform beam along x, its hinge about y locked, gravity along -z."""
    builder = lw.ModelBuilder("beam")
    builder.add_link("wall")
    inertia = mass * length**2 / 12
    builder.add_link(
        "beam", mass=mass, com=(length / 2, 0, 0), inertia=np.diag([0.01, inertia, inertia])
    )
    builder.add_joint("root", "revolute", "wall", "beam", axis=(0, 1, 0))
    return builder.build()


def test_static_cantilever():
    run = lw.simulate(cantilever(), duration=1.0, every=0.5, drives={"root": lw.Locked()})
    found = lw.loads.quantities(run).isel(joint=0, time=-1)
    expected = {"force": 3 * G, "axial": 0, "radial": 3 * G, "moment": 3 * G, "torque": -3 * G}
    expected |= {"tilting_moment": 0, "drive_power": 0, "drive_energy": 0}
    for name, value in expected.items():
        assert float(found[name]) == pytest.approx(value, abs=1e-12), name


def test_uniformly_rotating_rod():
    """Hub load m w^2 L / 2 along the rod, across the axis; a function gives the motion."""
    length, mass, w = 2.0, 3.0, 7.0
    builder = lw.ModelBuilder("rotor")
    builder.add_link("hub")
    inertia = mass * length**2 / 12
    builder.add_link(
        "rod", mass=mass, com=(length / 2, 0, 0), inertia=np.diag([0.01, inertia, inertia])
    )
    builder.add_joint("axle", "continuous", "hub", "rod", axis=(0, 0, 1))
    motion = lw.Motion(lambda t: (w * t, w, 0.0))
    run = lw.simulate(builder.build(), duration=2.0, every=0.1, drives={"axle": motion})
    found = lw.loads.quantities(run).isel(joint=0)
    np.testing.assert_allclose(found.radial, mass * w**2 * length / 2, rtol=1e-13)
    np.testing.assert_allclose(found.axial, mass * G, rtol=1e-13)
    np.testing.assert_allclose(found.tilting_moment, mass * G * length / 2, rtol=1e-13)
    np.testing.assert_allclose(found.torque, 0, atol=1e-11)
    world = lw.loads.in_frame(run, "world").isel(joint=0).values
    angle = w * run.time.values
    inward = -mass * w**2 * length / 2 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    np.testing.assert_allclose(world[:, :2], inward, atol=1e-11)


def test_pendulum_tension_at_every_angle():
    """m (L w^2 + g cos), w^2 = 2 g (cos - cos 0) / L; let go horizontally: 3 m g cos."""
    run = lw.simulate(pendulum(), duration=3.0, every=0.01, tolerance=1e-11)
    below = run.position.sel(joint="pivot").values + np.pi / 2
    radial = lw.loads.quantities(run).radial.isel(joint=0).values
    np.testing.assert_allclose(radial, 3 * G * np.cos(below), atol=1e-8)
    peak = lw.loads.summary(run).peak.sel(quantity="radial").item()
    assert peak == pytest.approx(3 * G, rel=1e-4)


def test_frames_there_and_back(swing):
    load = swing.joint_load.values
    scale = np.abs(load).max()
    model = swing.load_model()
    child = lw.loads.in_frame(swing, "child")
    np.testing.assert_allclose(child, load, atol=1e-13 * scale)
    poses = lw.joint_poses(model, swing.position.values)
    world = lw.loads.in_frame(swing, "world").values
    for half in (slice(0, 3), slice(3, 6)):
        back = np.einsum("tjki,tjk->tji", poses[..., :3, :3], world[..., half])
        np.testing.assert_allclose(back, load[..., half], atol=1e-13 * scale)
    parent = lw.loads.in_frame(swing, "parent").values
    inboard = np.concatenate(
        [np.broadcast_to(np.eye(3), (101, 1, 3, 3)), poses[:, :-1, :3, :3]], axis=1
    )
    outward = np.einsum("tjik,tjk->tji", inboard, parent[..., :3])
    np.testing.assert_allclose(outward, world[..., :3], atol=1e-13 * scale)


@pytest.mark.parametrize("frame", ["child", "parent", "world"])
@pytest.mark.parametrize("fixed_in", ["child", "parent", "world"])
def test_about_another_point(swing, frame, fixed_in):
    """n_P = n_O + (O - P) x f, with everything in the world's axes; forces do not change."""
    point = np.array([0.3, -0.2, 0.5])
    model = swing.load_model()
    poses = lw.joint_poses(model, swing.position.values)
    about = {"child": poses, "world": np.broadcast_to(np.eye(4), poses.shape)}
    about["parent"] = np.concatenate(
        [np.broadcast_to(np.eye(4), poses[:, :1].shape), poses[:, :-1]], axis=1
    )
    at = about[fixed_in] @ np.append(point, 1)
    world = lw.loads.in_frame(swing, "world").values
    moment = world[..., 3:] + np.cross(poses[..., :3, 3] - at[..., :3], world[..., :3])
    found = lw.loads.in_frame(swing, frame, point=point, fixed_in=fixed_in)
    turned = np.einsum("tjik,tjk->tji", about[frame][..., :3, :3], found.values[..., 3:])
    np.testing.assert_allclose(turned, moment, atol=1e-12 * np.abs(moment).max())
    same = lw.loads.in_frame(swing, frame).values[..., :3]
    np.testing.assert_allclose(found.values[..., :3], same, atol=1e-12 * np.abs(world).max())
    assert "(0.3, -0.2, 0.5) m" in found.attrs["point"]
    assert "outboard" in found.attrs["convention"]


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ({"frame": "body"}, "frame: 'body' is unknown; use child, parent, world"),
        ({"point": [1, 2]}, r"point: shape \(2,\)"),
        ({"point": [np.nan, 0, 0]}, "three finite coordinates"),
    ],
)
def test_wrong_frames_and_points(swing, arguments, complaint):
    with pytest.raises(lw.InputError, match=complaint):
        lw.loads.in_frame(swing, **arguments)


def test_every_quantity_says_what_it_is(swing):
    found = lw.loads.quantities(swing)
    for name, variable in found.data_vars.items():
        assert variable.attrs["units"], name
        assert variable.attrs["convention"], name
    assert set(lw.loads.QUANTITIES) < set(found.data_vars)


def test_axial_and_radial_make_up_the_force(swing):
    found = lw.loads.quantities(swing)
    np.testing.assert_allclose(found.axial**2 + found.radial**2, found.force**2, rtol=1e-12)
    np.testing.assert_allclose(
        found.torque**2 + found.tilting_moment**2, found.moment**2, rtol=1e-12
    )


def test_joints_without_one_axis_have_no_axial_force():
    model = lw.scenes.chain(2, joint="spherical")
    run = lw.simulate(model, duration=0.1, every=0.05)
    found = lw.loads.summary(run).peak
    assert np.isnan(found.sel(quantity=["axial", "radial", "torque", "tilting_moment"])).all()
    assert (found.sel(quantity=["force", "moment"]) >= 0).all()


def test_power_balance(swing):
    """Drive and external power are the rate of energy and dissipation, to the integration."""
    fine = lw.simulate(
        arm(),
        duration=1.0,
        every=0.0002,
        drives={"elbow": lambda t, q, v: [2 * np.sin(3 * t)]},
        wrenches={"hand": lw.Wrench([2.0, 1.0, 0, 0, 0.3, 0], axes="frame")},
        tolerance=1e-10,
    )
    balance = lw.loads.energy_balance(fine)
    largest = max(
        float(np.abs(balance[k]).max()) for k in ("drive_work", "external_work", "dissipated")
    )
    assert float(balance.dissipated[-1]) > 0.01
    assert float(np.abs(balance.external_work).max()) > 0.01
    assert float(np.abs(balance.residual).max()) < 1e-6 * largest


def of_samples(run):
    """The run, without the extremes between its samples."""
    names = [name for name in run.dataset.data_vars if str(name).startswith("extreme_")]
    return lw.Run(run.dataset.drop_vars(names), model=run.load_model())


def test_summary_by_hand(swing):
    swing = of_samples(swing)
    found, over_time = lw.loads.summary(swing), lw.loads.quantities(swing)
    t = swing.time.values
    for name in found["quantity"].values:
        for joint in found["joint"].values:
            x = over_time[name].sel(joint=joint).values
            row = found.sel(quantity=name, joint=joint)
            k = int(np.argmax(np.abs(x)))
            assert float(row.peak) == x[k]
            assert float(row.peak_time) == t[k]
            np.testing.assert_array_equal(row.wrench, swing.joint_load.sel(joint=joint)[k])
            assert float(row.minimum) == x.min()
            assert float(row.maximum) == x.max()
            span = t[-1] - t[0]
            assert float(row["mean"]) == pytest.approx(np.trapezoid(x, t) / span, abs=1e-12)
            assert float(row.rms) == pytest.approx(np.sqrt(np.trapezoid(x**2, t) / span))
            assert 0 <= float(row.duty) <= 1


def test_summary_does_not_depend_on_the_blocks(swing, monkeypatch):
    whole = lw.loads.summary(swing)
    monkeypatch.setattr("linkwise.base.BLOCK_BYTES", 4096)
    parts = lw.loads.summary(swing)
    for name in whole.data_vars:
        np.testing.assert_allclose(parts[name], whole[name], rtol=1e-13, atol=1e-13)
    assert parts.peak.identical(whole.peak)
    assert lw.loads.envelope(swing).identical(lw.loads.envelope(swing))


def test_the_sampling_bound_covers_a_peak_between_samples():
    """cos at its peak, sampled off it: the true peak is 3 m g."""
    run = lw.simulate(pendulum(), duration=2.0, every=0.07, tolerance=1e-10)
    found = lw.loads.summary(run).sel(quantity="radial", joint="pivot")
    missed = 3 * G - float(found.peak)
    assert 0 < missed <= float(found.sampling)


def test_envelope(swing):
    swing = of_samples(swing)
    found = lw.loads.envelope(swing)
    load = swing.joint_load
    np.testing.assert_array_equal(found.minimum, load.min("time"))
    np.testing.assert_array_equal(found.maximum, load.max("time"))
    when = found.maximum_time.sel(joint="elbow", component="fz").item()
    assert load.sel(joint="elbow", component="fz", time=when) == load.sel(
        joint="elbow", component="fz"
    ).max("time")


def test_margins():
    run = lw.simulate(cantilever(), duration=1.0, every=0.5, drives={"root": lw.Locked()})
    found = lw.loads.summary(run)
    ratings = {"root": lw.loads.Rating(radial=6 * G, torque=1.5 * G)}
    left = lw.loads.margins(found, ratings).sel(joint="root")
    assert float(left.margin.sel(quantity="radial")) == pytest.approx(1.0)
    assert float(left.margin.sel(quantity="torque")) == pytest.approx(-0.5)
    assert np.isnan(left.margin.sel(quantity="force"))
    bound = found.peak.copy(data=np.full(found.peak.shape, 0.5 * G))
    missed = found.assign(sampling=found.peak.copy(data=np.full(found.peak.shape, 0.5 * G)))
    use = lw.loads.margins(missed, ratings, bound).use.sel(joint="root", quantity="radial")
    assert float(use) == pytest.approx((3 + 0.5 + 0.5) / 6)
    with pytest.raises(lw.InputError, match=r"rating for joint 'rot'.*did you mean 'root'"):
        lw.loads.margins(found, {"rot": lw.loads.Rating(force=1)})
    with pytest.raises(lw.InputError, match="positive number"):
        lw.loads.Rating(force=-1)


def test_payloads_and_changed_links():
    """A payload on the cantilever's tip adds its weight and its moment; changes replace."""
    beam = cantilever()
    loaded = beam.with_payload("beam", mass=1.0, com=(2.0, 0, 0), name="box")
    lighter = loaded.with_link("beam", mass=1.5)
    for model, force, moment in ((loaded, 4 * G, 5 * G), (lighter, 2.5 * G, 3.5 * G)):
        load = lw.inverse_dynamics_loads(model, [0.0], [0.0], [0.0])[0]
        np.testing.assert_allclose(load, [0, 0, force, 0, -moment, 0], atol=1e-12)
    with pytest.raises(lw.InputError, match="bem"):
        beam.with_payload("bem", mass=1.0)
    with pytest.raises(lw.InputError, match="mass"):
        beam.with_payload("beam", mass=-1.0)


def test_a_run_says_what_it_lacks():
    run = lw.simulate(pendulum(), duration=0.1, every=0.05, record=["position"])
    with pytest.raises(lw.InputError, match='record the quantity "joint_load"'):
        lw.loads.summary(run)
    other = lw.simulate(pendulum(), duration=0.1, every=0.05)
    with pytest.raises(lw.InputError, match="not the one that the run was made with"):
        lw.loads.summary(other, arm())
    assert DOWN_Y[1] == -G
