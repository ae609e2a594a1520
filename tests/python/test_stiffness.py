"""Stiff machines: the default integrator finds them; fixed steps that are too long say so."""

import warnings

import numpy as np
import pytest

import linkwise as lw
from helpers.loaded_arm import arm
from helpers.machines import rod_chain, stopped_rod
from linkwise.cli.progress import describe


@pytest.fixture(scope="module")
def finger():
    """Two light links; drives of kp 1000, kd 10 make rates of 1e9 1/s."""
    builder = lw.ModelBuilder("finger")
    builder.add_link("base")
    builder.add_link("near", mass=0.02, com=(0, 0, 0.02), inertia=np.diag([1e-6, 1e-6, 5e-7]))
    builder.add_link("far", mass=0.005, com=(0, 0, 0.01), inertia=np.diag([1e-8, 1e-8, 1e-9]))
    builder.add_joint("j1", "revolute", "base", "near", axis=(0, 1, 0))
    builder.add_joint("j2", "revolute", "near", "far", axis=(0, 1, 0), translation=(0, 0, 0.04))
    return builder.build()


DRIVES = {"j1": lw.PD(1000, 10, 0.5), "j2": lw.PD(1000, 10, -0.3)}


def test_a_fixed_step_that_is_too_long_says_so(finger):
    with pytest.raises(lw.SimulationError, match="take a smaller step"):
        lw.simulate(
            finger,
            duration=0.05,
            drives=DRIVES,
            numerics={"integrator": "semi_implicit_euler", "step": 1e-3},
        )


def stiff_notes(run):
    return [note["text"] for note in run.warnings if note["element"] == "integrator"]


@pytest.mark.parametrize("gain", [1.0, 1e3, 1e6, 1e9])
def test_stiff_drives_take_few_evaluations(finger, gain):
    drives = {"j1": lw.PD(gain, 0.01 * gain, 0.5), "j2": lw.PD(gain, 0.01 * gain, -0.3)}
    options = {"duration": 0.5, "every": 0.05, "drives": drives}
    run = lw.simulate(finger, **options)
    tight = lw.simulate(finger, **options, integrator="bdf", tolerance=1e-10)
    assert run.attrs["total_evaluations"] < 8000
    np.testing.assert_allclose(run.position, tight.position, atol=1e-5)
    (note,) = stiff_notes(run)
    assert note.startswith("stiff from t = ")
    assert "bdf took over" in note


@pytest.fixture(scope="module")
def brake():
    """A wheel of 1 kg m2 whose damping is the only force beside its drive."""

    def build(damping):
        builder = lw.ModelBuilder("brake", gravity=(0, 0, 0))
        builder.add_link("ground")
        builder.add_link("wheel", mass=1.0, inertia=np.eye(3))
        builder.add_joint("axle", "continuous", "ground", "wheel", axis=(0, 0, 1), damping=damping)
        return builder.build()

    return build


@pytest.mark.parametrize("damping", [1e2, 1e4, 1e6, 1e9, 1e12])
def test_damped_wheels_follow_the_closed_form(brake, damping):
    # Speed 0.3 (1 - exp(-damping t)).
    run = lw.simulate(
        brake(damping), duration=100.0, every=10.0, drives={"axle": 0.3 * damping}, tolerance=1e-6
    )
    t = run.time.values
    turned = 0.3 * (t + np.expm1(-damping * t) / damping)
    np.testing.assert_allclose(run.position[:, 0], turned, atol=2e-5)
    assert run.attrs["total_evaluations"] < 8000
    assert stiff_notes(run)


def test_friction_that_is_nearly_dry(brake):
    builder = lw.ModelBuilder("slide", gravity=(0, 0, 0))
    builder.add_link("ground")
    builder.add_link("block", mass=2.0, inertia=np.eye(3))
    builder.add_joint(
        "way", "prismatic", "ground", "block", axis=(1, 0, 0), friction=4.0, friction_velocity=1e-6
    )
    # Slows at 2 m/s2 from 1 m/s: stands after 0.5 s at 0.25 m.
    run = lw.simulate(builder.build(), duration=10.0, every=1.0, v0=[1.0])
    np.testing.assert_allclose(run.position[1:, 0], 0.25, atol=1e-5)
    assert run.attrs["total_evaluations"] < 20_000


def test_who_asks_for_adams_gets_adams_and_a_line(finger):
    limited = {"duration": 0.5, "drives": DRIVES, "on_failure": "return", "every": 0.5}
    run = lw.simulate(finger, **limited, numerics={"integrator": "adams", "max_steps": 20_000})
    assert run.outcome == "too_many_steps"
    (note,) = stiff_notes(run)
    assert note.startswith("stiff at t = ")
    assert 'integrator = "auto" it takes over' in note
    assert stiff_notes(lw.simulate(finger, **limited, integrator="bdf")) == []


SOFT = {
    "double pendulum": lambda: {"model": rod_chain(2), "duration": 60.0},
    "chain of 8": lambda: {"model": rod_chain(8), "duration": 20.0},
    "arm with stops and friction": lambda: {
        "model": arm(),
        "duration": 60.0,
        "drives": {"shoulder": lambda t, q, v: 10.0 * np.cos(3 * t) * np.ones(v.size)},
    },
}


@pytest.mark.parametrize("scene", SOFT)
def test_soft_machines_stay_with_adams(scene):
    options = SOFT[scene]()
    run = lw.simulate(**options, times=[options.pop("duration")], record=["position"])
    assert run.attrs["total_evaluations"] > 7000  # a look at least
    assert stiff_notes(run) == []


def test_a_hard_stop_that_is_only_touched_stays_with_adams():
    limits = {"lower": -9.0, "upper": 1.0, "limit_stiffness": 1e8, "limit_damping": 0.1}
    machine = stopped_rod(reach=0.5, inertia=0.1, **limits)
    run = lw.simulate(machine, times=[15.0], record=["position"])
    assert run.attrs["total_evaluations"] > 7000
    assert stiff_notes(run) == []


@pytest.mark.parametrize("integrator", ["auto", "adams", "bdf"])
@pytest.mark.parametrize("gain", [1e13, 1e16, 1e20, 1e60, 1e290])
def test_however_stiff_the_run_ends(finger, integrator, gain):
    drives = {"j1": lw.PD(gain, gain, 0.5), "j2": lw.PD(gain, gain, -0.3)}
    run = lw.simulate(
        finger,
        duration=1.0,
        every=0.5,
        drives=drives,
        on_failure="return",
        numerics={"integrator": integrator, "max_steps": 30_000},
    )
    if run.outcome == "converged":
        np.testing.assert_allclose(run.position[-1], [0.5, -0.3], atol=0.4)
    else:
        assert "; " in run.attrs["message"], "says what to do"


def test_the_line_is_in_stored_runs_and_sweeps(finger, tmp_path, linkwise):
    run = lw.simulate(finger, duration=0.5, every=0.1, drives=DRIVES, output=tmp_path / "r.zarr")
    assert stiff_notes(lw.open_run(tmp_path / "r.zarr")) == stiff_notes(run) != []
    (tmp_path / "s.toml").write_text(
        "[model.chain]\nn_bodies = 2\n"
        "[drive.joint_1]\nkind = 'pd'\nkp = 1e9\nkd = 1e7\ntarget = 0.1\n"
        "[drive.joint_2]\nkind = 'pd'\nkp = 1e9\nkd = 1e7\ntarget = 0.1\n"
        "[simulate]\nduration = 1.0\n[output]\nevery = 0.5\n"
    )
    found = lw.sweep(tmp_path / "s.toml", {"drive.joint_1.kp": [1e9, 2e9]}, processes=1)
    assert "bdf took over" in found.attrs["warnings"]
    for command in (("run", "s.toml", "-o", "t.zarr"), ("loads", "t.zarr")):
        result = linkwise(*command)
        assert result.code == 0
        assert "warning: integrator: stiff from t = " in result.err


def test_who_watches_sees_it(finger):
    seen = []
    lw.simulate(finger, duration=0.5, every=1e-3, drives=DRIVES, progress=seen.append)
    assert seen[-1].stiff
    assert describe(seen[-1]).endswith("stiff")
    assert not describe(seen[-1]._replace(stiff=False)).endswith("stiff")


def test_runs_that_went_astray_are_read_without_a_word_of_numpy(finger, tmp_path, linkwise):
    run = lw.simulate(
        finger,
        duration=0.05,
        every=5e-5,
        drives=DRIVES,
        on_failure="return",
        numerics={"integrator": "semi_implicit_euler", "step": 1e-3},
        output=tmp_path / "astray.zarr",
    )
    assert run.outcome == "not_finite"
    force = run.joint_load.values[..., :3]
    assert np.abs(force).max() > 1e160, "squares overflow"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        peaks = lw.loads.peak_loads(run)
        found = lw.loads.summary(run)
        lw.loads.envelope(run)
        lw.loads.energy_balance(run)
        lw.loads.split(run)
        for joint in finger.joint_names:
            lw.loads.cycles(run, joint, "force")
            lw.loads.load_duration(run, joint, "force")
        assert linkwise("loads", "astray.zarr").code == 0
    size = np.hypot(np.hypot(force[..., 0], force[..., 1]), force[..., 2]).max(axis=0)
    np.testing.assert_allclose(peaks.force, size, rtol=1e-14)
    np.testing.assert_allclose(found.peak.sel(quantity="force"), size, rtol=1e-14)
