"""Extremes between the samples: closed forms, any sampling, every way that a run can end."""

import csv

import numpy as np
import pytest
import xarray as xr

import linkwise as lw
from helpers.loaded_arm import arm, profile, swing
from helpers.machines import DOWN_Y, G, pendulum, rod_chain, stopped_arm
from linkwise.loads.engineering import derived_rows, joint_directions
from linkwise.loads.extremes import extremes_of
from linkwise.loads.limits import beyond_limits
from linkwise.loads.samples import select


def falling(duration=1.2):
    return {"model": pendulum(), "duration": duration, "tolerance": 1e-9}


def test_pendulum_let_go_horizontally():
    """3 m g at the bottom, which no sample of three meets; speed and angle there, too."""
    run = lw.simulate(**falling(), every=0.6)
    found = lw.loads.summary(run).isel(joint=0)
    assert found.attrs["extremes"] == "along the steps"
    assert float(found.peak.sel(quantity="force")) == pytest.approx(3 * G, rel=5e-4)
    assert float(found.sampling.sel(quantity="force")) < 1e-3 * 3 * G
    wrench = found.wrench.sel(quantity="force").values
    assert np.linalg.norm(wrench[:3]) == pytest.approx(float(found.peak.sel(quantity="force")))
    speed = extremes_of(run, "velocity")
    assert float(np.abs(speed.largest[0])[0]) == pytest.approx(np.sqrt(2 * G), rel=5e-4)
    assert float(speed.largest[1][0]) == pytest.approx(
        float(found.peak_time.sel(quantity="force")), abs=0.02
    )
    swung = lw.simulate(**falling(3.0), every=3.0)
    assert float(extremes_of(swung, "position").minimum[0]) == pytest.approx(-np.pi, abs=2e-3)
    assert float(lw.loads.peak_loads(run).force[0]) == float(found.peak.sel(quantity="force"))


@pytest.mark.parametrize("lost", ["extreme_wrench", "extreme_quantity"])
def test_a_part_that_is_lost_is_no_reason_to_guess(lost):
    run = lw.simulate(**falling(), every=0.6)
    without = lw.Run(run.dataset.drop_vars(lost), model=pendulum())
    if lost == "extreme_wrench":
        with pytest.raises(lw.InputError, match="extreme_wrench is missing or has another shape"):
            lw.loads.summary(without)
    else:
        assert lw.loads.summary(without).attrs["extremes"] != "along the steps"
    held = run.dataset[lost]
    short = held[:1].rename({held.dims[0]: "row"}).drop_vars("row", errors="ignore")
    damaged = lw.Run(run.dataset.assign({lost: short}), model=pendulum())
    with pytest.raises(lw.InputError, match=f"{lost} is missing or has another shape"):
        lw.loads.summary(damaged)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6])
def test_a_stiff_stop_hits_as_hard_at_any_sampling(tolerance):
    """The samples of the default run miss most of the blow."""
    machine, found = stopped_arm(), []
    for samples in (2, 1001, 10_001):
        run = lw.simulate(machine, times=np.linspace(0, 1.0, samples), tolerance=tolerance)
        found.append(lw.loads.summary(run))
        if samples == 1001:
            seen = np.linalg.norm(run.joint_load.values[..., 3:], axis=-1).max()
    peaks = [one.peak.sel(quantity=["force", "moment", "radial", "torque"]).values for one in found]
    np.testing.assert_allclose(peaks[0], peaks[1], rtol=1e-3)
    np.testing.assert_allclose(peaks[0], peaks[2], rtol=1e-3)
    assert peaks[0].max() > 3 * seen
    for one in found:
        assert float((one.sampling / np.abs(one.peak)).max()) < 1e-3


def scenes():
    still = lw.scenes.srms(payload_mass=50.0, gravity=(0, 0, -9.81))
    drives = {name: lw.PD(kp=2e5, kd=4e4) for name in still.joint_names}
    drives["shoulder_yaw"] = lw.Motion(profile(0.5, 2.0))
    return {
        "hinges": {"model": rod_chain(5), "duration": 1.0},
        "tumbling": {
            "model": rod_chain(3, floating=True),
            "duration": 1.0,
            "v0": [0, 0, 0, 0.1, 2.0, 0.5, 1.0, -2.0],
        },
        "balls": {"model": lw.scenes.chain(3, joint="spherical"), "duration": 1.0},
        "crane": {"model": still, "duration": 2.0, "drives": drives, "tolerance": 1e-9},
        "locked": {
            "model": arm(),
            "duration": 1.0,
            "drives": {"elbow": lw.Locked()},
            "v0": [1, 0, 2],
        },
        "pulse": {
            "model": arm(),
            "duration": 2.0,
            "drives": {"elbow": lw.Table([0, 1, 1.001, 1.003, 1.004, 2], [0, 0, 90, 90, 0, 0])},
            "wrenches": {"hand": lw.Wrench([5.0, -3.0, 2.0, 0.1, 0.2, -0.3])},
        },
    }


@pytest.mark.parametrize("scene", scenes())
def test_extremes_are_those_of_very_many_samples(scene):
    """Every quantity, component, coordinate and rate, against the slow twin in NumPy."""
    options = scenes()[scene]
    run = lw.simulate(**options, every=options["duration"])
    dense = lw.simulate(**options, every=options["duration"] / 40_000, extremes=False)
    assert "extreme_quantity" not in dense
    model = options["model"]
    values = derived_rows(dense, select(dense, model), joint_directions(model), slice(None))
    truth = {"quantity": np.stack(list(values.values()), axis=1)}
    names = ("joint_load", "position", "velocity", "acceleration", "drive_torque")
    truth |= {name: dense[name].values for name in names}
    whole = {
        "joint_load": np.abs(truth["quantity"][:, [0] * 3 + [3] * 3]).max(axis=0).T,
        "quantity": np.abs(truth["quantity"][:, [0, 0, 0, 3, 3, 3, 6]]).max(axis=0),
    }
    for name, expected in truth.items():
        found = extremes_of(run, name)
        low, high = expected.min(axis=0), expected.max(axis=0)
        size = np.fmax(np.abs(low), np.abs(high))
        room = 1e-3 * size + 1e-5 * whole.get(name, size.max(initial=0.0)) + 1e-5
        for got, said, right, sign in (
            (found.minimum, found.minimum_reach, low, -1),
            (found.maximum, found.maximum_reach, high, 1),
        ):
            np.testing.assert_array_equal(np.isnan(got), np.isnan(right))
            off = sign * (right - got)
            assert (off <= room)[~np.isnan(off)].all(), (name, np.nanmax(off / room))
            assert (sign * (said - got) >= 0)[~np.isnan(got)].all()
            # Nothing is made up: what was found is reached, to the samples' own distance.
            assert (-off <= 1e-2 * size + room)[~np.isnan(off)].all(), name


def test_the_wrench_is_that_of_the_moment():
    run = swing()
    found = lw.loads.summary(run)
    directions = joint_directions(arm())
    for k, joint in enumerate(found["joint"].values):
        for name in ("force", "axial", "radial", "moment", "tilting_moment", "torque"):
            row = found.sel(joint=joint, quantity=name)
            values = lw.loads.engineering.derive(
                row.wrench.values[None, None], directions[k : k + 1]
            )
            assert float(values[name][0, 0]) == pytest.approx(float(row.peak), rel=1e-12)


def test_the_motion_keeps_its_bits():
    options = {"duration": 1.0, "every": 0.1, "drives": {"elbow": lambda t, q, v: [np.sin(9 * t)]}}
    with_, without = (lw.simulate(arm(), **options, extremes=keep) for keep in (True, False))
    for name in without.dataset.data_vars:
        np.testing.assert_array_equal(with_[name].values, without[name].values)


def test_a_ramp_that_falls_at_once_is_seen_at_its_top():
    """The last moment before a table's corner is the end of a step."""
    drives = {"pivot": lw.Table([0, 1.0, 1.0 + 1e-9, 2.0], [0, 40.0, 0, 0])}
    run = lw.simulate(pendulum(), duration=2.0, every=2.0, drives=drives)
    assert float(extremes_of(run, "drive_torque").maximum[0]) == pytest.approx(40.0, rel=1e-6)


def test_position_limits_are_looked_at_between_samples():
    builder = lw.ModelBuilder("limited", gravity=DOWN_Y)
    builder.add_link("ground")
    builder.add_link("bob", mass=1.0, com=(1.0, 0, 0), inertia=1e-3 * np.eye(3))
    builder.add_joint("pivot", "revolute", "ground", "bob", lower=-3.0, upper=1.0)
    model = builder.build()
    quarter = lw.simulate(model, duration=3.0, every=3.0)
    (found,) = beyond_limits(quarter)
    assert found["farthest"] == pytest.approx(-np.pi, abs=2e-3)
    assert 0 < found["since"] < 3.0


def test_selected_joints_and_quantities():
    whole = swing()
    some = swing(joints=["elbow", "wrist"], record=["joint_load", "position"])
    assert {str(n) for n in some.dataset if str(n).startswith("extreme_")} == {
        "extreme_quantity",
        "extreme_joint_load",
        "extreme_position",
        "extreme_wrench",
    }
    picked = whole.dataset.sel(joint=["elbow", "wrist"])
    for name in ("extreme_quantity", "extreme_joint_load", "extreme_wrench", "extreme_position"):
        np.testing.assert_array_equal(some[name].values, picked[name].values)
    assert "extreme_position" not in swing(record=["position"])


def test_stored_exported_and_read_again(tmp_path):
    memory = swing()
    stored = swing(output=tmp_path / "run.zarr")
    stored.to_netcdf(tmp_path / "run.nc")
    again = lw.open_run(tmp_path / "run.zarr")
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as exported:
        for name in (n for n in memory.dataset.data_vars if str(n).startswith("extreme_")):
            np.testing.assert_array_equal(memory[name].values, again[name].values)
            np.testing.assert_array_equal(memory[name].values, exported[name].values)
    assert (tmp_path / "tables" / "extremes.csv") in memory.to_csv(tmp_path / "tables")
    with open(tmp_path / "tables" / "extremes.csv", newline="") as file:
        table = {row["column"]: row for row in csv.DictReader(file) if "load" in row["quantity"]}
    envelope = lw.loads.envelope(memory)
    for key in ("minimum", "maximum"):
        assert float(table["elbow.ny [N m]"][key]) == float(
            envelope[key].sel(joint="elbow", component="ny")
        )
    xr.testing.assert_identical(lw.loads.summary(memory), lw.loads.summary(again))


def test_runs_that_end_early_keep_what_was_found(tmp_path):
    options = {"duration": 5.0, "every": 2.5, "drives": {"pivot": lw.Table([0, 5], [0, 300.0])}}
    for output in (None, tmp_path / "run.zarr"):
        run = lw.simulate(pendulum(), **options, output=output, max_steps=40, on_failure="return")
        assert not run.completed
        reached = float(run.attrs["stop_time"])
        assert 0 < reached < 2.5
        found = extremes_of(run, "drive_torque")
        assert float(found.maximum[0]) == pytest.approx(60.0 * reached)
        assert float(found.maximum_time[0]) == pytest.approx(reached)


def test_a_function_that_raises_leaves_what_was_found(tmp_path):
    def failing(t, q, v):
        if t > 0.5:
            raise ZeroDivisionError
        return [60.0 * t]

    with pytest.raises(ZeroDivisionError):
        lw.simulate(
            pendulum(), duration=1, every=0.2, drives={"pivot": failing}, output=tmp_path / "r.zarr"
        )
    run = lw.open_run(tmp_path / "r.zarr")
    assert float(np.abs(lw.loads.envelope(run).maximum).max()) > 10


def test_a_run_without_extremes_falls_back_to_its_samples():
    run = swing(extremes=False)
    found = lw.loads.summary(run)
    assert found.attrs["extremes"] == "of the samples"
    size = np.linalg.norm(run.joint_load.values[..., :3], axis=-1).max(axis=0)
    np.testing.assert_array_equal(found.peak.sel(quantity="force"), size)
    with pytest.raises(lw.InputError, match="extremes"):
        swing(extremes="yes")


def test_members_have_what_each_has_alone():
    q0 = np.linspace(0, 0.3, 5)[:, None] * np.ones(3)
    options = {"drives": {"elbow": lw.PD(30, 2, 0.1)}, "duration": 0.5, "every": 0.5}
    batch = lw.simulate_batch(arm(), step=1e-2, q0=q0, **options)
    twice = lw.simulate_batch(arm(), step=1e-2, q0=q0, threads=2, **options)
    for k in range(5):
        alone = lw.simulate(arm(), q0=q0[k], integrator="runge_kutta_4", step=1e-2, **options)
        for name in ("extreme_quantity", "extreme_joint_load", "extreme_velocity"):
            got = batch[name].isel(member=k)
            np.testing.assert_allclose(got, alone[name], rtol=1e-9, atol=1e-9)
            np.testing.assert_array_equal(got, twice[name].isel(member=k))
        peaks = lw.loads.summary(lw.Run(batch.isel(member=k), model=arm())).peak
        np.testing.assert_allclose(peaks, lw.loads.summary(alone).peak, rtol=1e-9, atol=1e-9)
    without = lw.simulate_batch(arm(), step=1e-2, q0=q0, extremes=False, **options)
    assert "extreme_quantity" not in without
    with pytest.raises(lw.InputError, match="extremes: is 'x'; use True, False or None"):
        lw.simulate_batch(arm(), step=1e-2, q0=q0, extremes="x", **options)
    with pytest.raises(lw.InputError, match="extremes: is 1; use True, False or None"):
        lw.Recording(extremes=1)
    with pytest.raises(lw.InputError, match="unknown quantity 'positon'"):
        lw.Recording(quantities=["positon"])


@pytest.mark.parametrize(
    "integrator", ["adams", "bdf", "esdirk", "runge_kutta_4", "semi_implicit_euler"]
)
def test_every_integrator(integrator):
    options = {"step": 1e-3} if integrator in ("runge_kutta_4", "semi_implicit_euler") else {}
    run = lw.simulate(pendulum(), duration=1.2, every=1.2, integrator=integrator, **options)
    peak = float(lw.loads.summary(run).peak.sel(quantity="force", joint="pivot"))
    assert peak == pytest.approx(3 * G, rel=1e-2 if integrator == "semi_implicit_euler" else 1e-3)


def test_an_iterative_solver_and_other_states():
    model = lw.scenes.chain(4, joint="revolute", axes="alternating")
    options = {"duration": 1.0, "every": 1.0, "tolerance": 1e-8}
    plain = lw.loads.summary(lw.simulate(model, **options)).peak
    for other in (
        {"method": "constraint_force", "solver": "conjugate_gradient"},
        {"method": "constraint_force", "state": "body_velocities"},
    ):
        found = lw.loads.summary(lw.simulate(model, **options, **other)).peak
        np.testing.assert_allclose(found, plain, rtol=1e-3, atol=1e-3)


def test_a_run_that_is_killed_has_what_was_found_until_then(tmp_path):
    """What is on disk while the run goes on: at least the extremes of the samples there."""
    found = []

    def progress(at):
        if at.time > 0.6 and not found:
            run = lw.open_run(tmp_path / "run.zarr")
            found.append((run.time.size, run.position.values, extremes_of(run, "position")))

    lw.simulate(
        pendulum(), duration=1.0, every=1 / 9000, output=tmp_path / "run.zarr", progress=progress
    )
    ((count, position, between),) = found
    assert 1000 < count < 9001
    assert float(between.minimum[0]) <= position.min() * (1 - 1e-12)
    assert between.minimum[0] > -np.pi


def test_what_shows_samples_says_what_they_miss(tmp_path):
    run = lw.simulate(stopped_arm(1e7), duration=1.0, every=0.1)
    peak = float(lw.loads.peak_loads(run).moment.sel(joint="shoulder"))
    text = f"moment of joint 'shoulder' peaks between the samples, at {peak:.4g} N m"
    for made in (
        lw.loads.in_frame(run, "world"),
        lw.loads.in_frame(run, "world", joint="shoulder"),
        lw.loads.split(run),
        lw.loads.quantities(run),
        lw.loads.spectrum(run, "shoulder", "fx"),
        lw.loads.load_duration(run, "shoulder", "force"),
        lw.loads.damage_equivalent(run, joints=["shoulder"]),
    ):
        assert text in made.attrs["samples"]
    with pytest.warns(UserWarning, match=r"loads.csv: moment of joint 'shoulder' peaks between"):
        run.to_csv(tmp_path / "loads.csv", "joint_load")
    found = lw.loads.summary(run)
    shown = np.linalg.norm(run.joint_load.values[..., 3:], axis=-1).max(axis=0)
    expected = 1 - shown / found.peak.sel(quantity="moment")
    np.testing.assert_allclose(found.missed.sel(quantity="moment"), expected, rtol=1e-12)
    assert np.isnan(lw.loads.summary(swing(extremes=False)).missed).all()
    assert "not known" in lw.loads.quantities(swing(extremes=False)).attrs["samples"]
    fine = lw.simulate(**falling(), every=0.01)
    assert lw.loads.quantities(fine).attrs["samples"] == (
        "the samples show every peak of force and moment to 1%"
    )
