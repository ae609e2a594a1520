"""Many motions of machines with closed loops at once: each is that of its own simulation."""

import json

import numpy as np
import pytest

import linkwise as lw
from linkwise.scenes import benchmark

pytestmark = pytest.mark.filterwarnings("ignore::linkwise.ModelWarning")

STEP, DURATION = 1e-3, 0.1


def starts(machine, members: int, spread: float) -> np.ndarray:
    draws = np.random.default_rng(5).standard_normal((members, machine.model.nq))
    q0 = np.asarray(machine.q0) + spread * draws
    q0[0] = machine.q0
    return q0


def batch(machine, q0, **options):
    return lw.simulate_batch(
        machine.model,
        step=STEP,
        duration=DURATION,
        every=DURATION / 10,
        q0=q0,
        v0=machine.v0,
        drives=machine.drives,
        **options,
    )


@pytest.mark.parametrize("name", ["slider_crank", "stewart", "bricard", "four_bars"])
def test_members_are_their_single_runs_bit_by_bit(name):
    machine = benchmark(name)
    q0 = starts(machine, 11, 0.02)
    found = batch(machine, q0, threads=1)
    assert (found.outcome == "converged").all()
    for k in (0, 3, 10):
        alone = lw.simulate(
            machine.model,
            integrator="runge_kutta_4",
            step=STEP,
            duration=DURATION,
            every=DURATION / 10,
            q0=q0[k],
            v0=machine.v0,
            drives=machine.drives,
        ).dataset
        compared = [name for name in found.data_vars if name in alone]
        assert {"position", "joint_load", "extreme_joint_load", "drive_work"} <= set(compared)
        for variable in compared:
            assert np.array_equal(
                found[variable].values[k], alone[variable].values, equal_nan=True
            ), variable
    both = batch(machine, q0, threads=2)
    for variable in found.data_vars:
        assert np.array_equal(found[variable].values, both[variable].values, equal_nan=True)


def test_what_closing_loops_moved_is_said():
    machine = benchmark("bricard")
    notes = json.loads(batch(machine, starts(machine, 4, 0.02)).attrs["warnings"])
    moved = [note["text"] for note in notes if note["element"] == "assembly"]
    assert len(moved) == 1
    assert moved[0].startswith("member 1: to close loops, joints were moved: 'P0'")
    assert moved[0].endswith("the like of 2 more members")
    assert any("rigid bodies do not determine" in note["text"] for note in notes)


def test_a_start_that_cannot_be_closed_is_told_with_its_member():
    builder = lw.ModelBuilder("short")
    builder.add_link("ground")
    builder.add_link("bar", mass=1.0, com=(0.5, 0, 0), inertia=np.diag([1e-3, 0.08, 0.08]))
    builder.add_joint("slide", "prismatic", "ground", "bar", axis=(1, 0, 0))
    builder.add_loop("pin", "revolute", "ground", "bar", axis=(0, 0, 1), translation=(0, 1, 0))
    with pytest.raises(lw.InputError, match=r"^member 0: .*loop"):
        lw.simulate_batch(builder.build(), step=STEP, duration=DURATION, q0=[[0.0], [1.0]])


def test_a_member_that_fails_ends_alone():
    machine = benchmark("slider_crank")
    torque = np.zeros((3, machine.model.nv))
    torque[1, 0] = 1e300
    found = lw.simulate_batch(
        machine.model, step=STEP, duration=DURATION, q0=machine.q0, v0=machine.v0, tau=torque
    )
    assert list(found.outcome.values == "converged") == [True, False, True]
    assert np.isfinite(found.position.values[[0, 2]]).all()
    same = found.sel(member=0).joint_load.values
    assert np.array_equal(same, found.sel(member=2).joint_load.values)


def test_a_sweep_takes_loops(tmp_path):
    (tmp_path / "press.toml").write_text(
        """
model = "press.urdf"

[loop.pin]
type = "revolute"
parent = "slider"
child = "rod"
child_translation = ["500 mm", 0, 0]
axis = [0, 0, 1]

[initial.position]
crank = "30 deg"

[payload.box]
link = "slider"
mass = 0

[simulate]
duration = 0.1
"""
    )
    link = (
        '<link name="{}"><inertial><mass value="1"/><origin xyz="{} 0 0"/>'
        '<inertia ixx="0.01" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )
    joint = (
        '<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/><origin xyz="{} 0 0"/>'
        '<axis xyz="{}"/></joint>'
    )
    (tmp_path / "press.urdf").write_text(
        '<robot name="press"><link name="base"/>'
        + link.format("arm", 0.1)
        + link.format("rod", 0.25)
        + link.format("slider", 0)
        + joint.format("crank", "continuous", "base", "arm", 0, "0 0 1")
        + joint.format("knee", "continuous", "arm", "rod", 0.2, "0 0 1")
        + joint.format("guide", "prismatic", "base", "slider", 0.6, "1 0 0").replace(
            "</joint>", '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        )
        + "</robot>"
    )
    masses = [0.0, 2.0, 4.0]
    found = lw.sweep(tmp_path / "press.toml", {"payload.box.mass": masses}, processes=1)
    assert (found.outcome == "converged").all()
    assert "pin" in found.joint.values
    scenario = lw.load_scenario(tmp_path / "press.toml")
    model = scenario.load_model()
    alone = lw.simulate(model, **scenario.simulate_arguments(model))
    assert np.array_equal(found.joint_load.values[0], alone.joint_load.values)


def states_along_a_motion(machine, count: int) -> tuple[np.ndarray, np.ndarray]:
    run = lw.simulate(
        machine.model,
        q0=machine.q0,
        v0=machine.v0,
        drives=machine.drives,
        times=np.linspace(0, 0.1, count),
        record=["position", "velocity"],
    )
    return run.position.values, run.velocity.values


@pytest.mark.parametrize("name", ["stewart", "bricard"])
def test_threads_share_states_and_change_no_bit(name):
    machine = benchmark(name)
    q, v = states_along_a_motion(machine, 50)
    q, v = np.tile(q, (40, 1)), np.tile(v, (40, 1))  # enough for several threads
    tau = np.random.default_rng(1).standard_normal(v.shape)
    one = lw.forward_dynamics(machine.model, q, v, tau, full=True, threads=1)
    for threads in (2, 3, 8):
        many = lw.forward_dynamics(machine.model, q, v, tau, full=True, threads=threads)
        assert np.array_equal(one.acceleration, many.acceleration)
        assert np.array_equal(one.joint_load, many.joint_load)
        loads = lw.joint_loads(machine.model, q, v, tau, threads=threads)
        assert np.array_equal(one.joint_load, loads)
    for k in (0, 777, len(q) - 1):
        alone = lw.forward_dynamics(machine.model, q[k], v[k], tau[k], full=True)
        assert np.array_equal(one.acceleration[k], alone.acceleration)
        assert np.array_equal(one.joint_load[k], alone.joint_load)


@pytest.mark.parametrize("threads", [1, 2, 8])
def test_the_first_state_that_leaves_a_loop_open_is_named(threads):
    machine = benchmark("bricard")
    q = np.tile(machine.q0, (3000, 1))
    q[[1234, 2900]] += 0.1
    with pytest.raises(lw.InputError, match=r"^state 1234: "):
        lw.forward_dynamics(machine.model, q, np.zeros_like(q), threads=threads)
