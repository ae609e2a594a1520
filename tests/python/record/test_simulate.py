"""lw.simulate: what comes back, what is recorded, how it fails and how it is interrupted."""

import json
import os
import signal
import threading
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

import linkwise as lw
from linkwise.record import store
from linkwise.simulation import simulate, time_loop


@pytest.fixture
def chain():
    return lw.scenes.chain(3)


def bend(model):
    return np.linspace(0.3, 0.9, model.nq)


def test_samples_are_where_they_were_asked_for(chain):
    run = lw.simulate(chain, duration=1.0, every=0.3, q0=bend(chain))
    np.testing.assert_allclose(run.time, [0, 0.3, 0.6, 0.9, 1.0])
    np.testing.assert_array_equal(run.position[0], bend(chain))
    assert lw.simulate(chain, duration=1.0, every=0.25).time.values.tolist() == [
        *(0, 0.25, 0.5, 0.75, 1.0)
    ]
    assert lw.simulate(chain, duration=0.5).sizes["time"] == 1001
    given = [0.1, 0.15, 0.4]
    run = lw.simulate(chain, times=given, q0=bend(chain))
    assert run.time.values.tolist() == given
    assert np.all(np.abs(run.velocity[0]) > 0)  # the motion starts at 0 all the same


def test_recorded_quantities_agree_with_the_dynamics(chain):
    """Loads, accelerations and energies of samples are those of the same state and torques."""
    run = lw.simulate(chain, duration=1.0, every=0.1, q0=bend(chain), drives={"joint_2": 0.7})
    q, v, tau = (run[n].values for n in ("position", "velocity", "drive_torque"))
    np.testing.assert_allclose(tau, np.broadcast_to([0, 0.7, 0], (11, 3)))
    loads = lw.joint_loads(chain, q, v, tau)
    np.testing.assert_allclose(run.joint_load, loads, rtol=1e-10, atol=1e-9)
    np.testing.assert_allclose(run.acceleration, lw.forward_dynamics(chain, q, v, tau), rtol=1e-9)
    np.testing.assert_allclose(run.kinetic_energy, lw.kinetic_energy(chain, q, v), rtol=1e-12)
    potential = lw.potential_energy(chain, q)
    np.testing.assert_allclose(run.potential_energy, potential, rtol=1e-12)
    assert np.all(np.diff(run.evaluations) >= 0)
    assert run.attrs["total_evaluations"] == run.evaluations[-1]


def test_drive_may_be_a_number_an_array_a_function_or_a_drive(chain):
    table = lw.Table([0.0, 1.0], [2.0, 2.0])
    runs = [
        lw.simulate(chain, duration=0.5, every=0.1, drives={"joint_1": drive})
        for drive in (2.0, [2.0], lambda t, q, v: 2.0, lw.Torque(2.0), lw.Torque(table))
    ]
    for run in runs[1:]:
        np.testing.assert_allclose(run.position, runs[0].position, rtol=1e-9, atol=1e-12)


def test_wrench_pushes_a_body(chain):
    free = lw.simulate(chain, duration=0.5, every=0.1)
    pushed = lw.simulate(chain, duration=0.5, every=0.1, wrenches={"link_3": [5, 0, 0, 0, 0, 0]})
    assert np.max(np.abs(pushed.position - free.position)) > 0.01


def test_subsets_are_the_same_numbers(chain):
    whole = lw.simulate(chain, duration=1.0, every=0.1, q0=bend(chain))
    part = lw.simulate(
        chain,
        duration=1.0,
        every=0.1,
        q0=bend(chain),
        record=lw.Recording(quantities=["joint_load", "velocity"], joints=["joint_3", "joint_1"]),
    )
    timed = {name for name, variable in part.dataset.data_vars.items() if "time" in variable.dims}
    assert timed == {"joint_load", "velocity"}
    kept = ["joint_1", "joint_3"]
    for name in ("joint_load", "velocity"):
        xr.testing.assert_equal(part[name], whole[name].sel(joint=kept))


def pace(monkeypatch, count, pieces=1):
    """Fix how many samples a call computes, or how many parts an interval has."""

    def adapt(self, spent):
        self.count, self.pieces = count, pieces

    monkeypatch.setattr(time_loop._Pace, "adapt", adapt)


def test_pace_follows_the_clock():
    pace = time_loop._Pace(most=8)
    for _ in range(5):
        pace.adapt(0.0)
    assert (pace.count, pace.pieces) == (8, 1)
    for _ in range(5):
        pace.adapt(1.0)
    assert (pace.count, pace.pieces) == (1, 4)
    calls = list(pace.calls(np.array([0.0, 1.0])))
    between = [float(times[0]) for times, are_samples in calls if not are_samples]
    assert between == [0, 0, 0, 0.25, 0.5, 0.75]
    assert [float(times[0]) for times, are_samples in calls if are_samples] == [0, 1]
    for _ in range(5):
        pace.adapt(0.0)
    assert (pace.count, pace.pieces) == (8, 1)


@pytest.mark.parametrize(
    "integrator", ["adams", "bdf", "esdirk", "runge_kutta_4", "semi_implicit_euler"]
)
def test_results_do_not_depend_on_how_the_loop_is_cut(chain, monkeypatch, integrator):
    numerics = {"integrator": integrator}
    if integrator not in ("adams", "bdf", "esdirk"):
        numerics["step"] = 1e-3
    options = {"duration": 1.0, "every": 0.013, "q0": bend(chain), "numerics": numerics}
    runs = []
    for count, pieces in ((1, 1), (7, 1), (1000, 1), (1, 5)):
        pace(monkeypatch, count, pieces)
        runs.append(lw.simulate(chain, **options))
    for run in runs[1:]:
        xr.testing.assert_equal(run.dataset, runs[0].dataset)


def test_store_holds_what_memory_holds(chain, tmp_path, monkeypatch):
    monkeypatch.setattr(store, "MAX_BLOCK_ROWS", 16)
    options = {"duration": 1.0, "every": 0.01, "q0": bend(chain), "drives": {"joint_1": 1.0}}
    memory = lw.simulate(chain, **options)
    written = lw.simulate(chain, **options, output=tmp_path / "run.zarr")
    assert written.path == tmp_path / "run.zarr"
    again = lw.open_run(tmp_path / "run.zarr")
    for run in (written, again):
        xr.testing.assert_equal(run.dataset, memory.dataset)
    volatile = {"created", "wall_time"}
    assert {k: v for k, v in again.attrs.items() if k not in volatile} == {
        k: v for k, v in memory.attrs.items() if k not in volatile
    }


def test_provenance(chain):
    run = lw.simulate(
        chain,
        duration=0.1,
        every=0.05,
        drives={"joint_1": lw.PD(10, 1, 0.2), "joint_2": lambda t, q, v: 0.0},
        numerics=lw.Numerics(method="constraint_force", solver="conjugate_gradient"),
    )
    attrs = run.attrs
    assert attrs["outcome"] == run.outcome == "converged"
    assert (attrs["method"], attrs["solver"]) == ("constraint_force", "conjugate_gradient")
    assert attrs["reason"]
    assert attrs["stop_time"] == 0.1
    assert attrs["wall_time"] > 0
    assert attrs["model_hash"] == chain.hash
    assert json.loads(attrs["options"])["tolerance"] == 1e-6
    drives = json.loads(attrs["drives"])
    assert drives["joint_1"] == {"kind": "pd", "kp": 10.0, "kd": 1.0, "target": 0.2}
    assert "function" in drives["joint_2"]["value"]
    assert attrs["total_iterations"] > 0


def test_progress_is_reported(chain):
    seen = []
    lw.simulate(chain, duration=1.0, every=0.1, progress=seen.append)
    assert [p.time for p in seen] == sorted({p.time for p in seen})
    assert seen[-1].time == seen[-1].duration == 1.0
    assert seen[-1].steps > 0
    assert seen[-1].remaining == 0
    assert seen[-1].speed > 0


# -- wrong arguments -----------------------------------------------------------------------------


def test_single_options_may_be_keywords(chain):
    """Fields of numerics and record, which go before those objects."""
    options = {"duration": 0.1, "q0": bend(chain)}
    run = lw.simulate(
        chain, numerics=lw.Numerics(integrator="bdf", max_step=0.01), integrator="runge_kutta_4",
        step=0.05, quantities=["position"], joints=["joint_2"], **options,
    )  # fmt: skip
    told = json.loads(run.attrs["options"])
    assert (told["integrator"], told["step"], told["max_step"]) == ("runge_kutta_4", 0.05, 0.01)
    assert "joint_load" not in run.dataset
    with pytest.raises(TypeError, match="unexpected keyword argument 'stepsize'"):
        lw.simulate(chain, stepsize=0.05, **options)
    with pytest.raises(lw.InputError, match="step: -1 given"):
        lw.simulate(chain, step=-1, **options)


@pytest.mark.parametrize(
    ("arguments", "pattern"),
    [
        ({"duration": None}, "duration: missing"),
        ({"duration": 0}, "duration: 0 given; give a finite number above 0"),
        ({"duration": np.nan}, "duration: nan"),
        ({"duration": np.inf}, "duration: inf"),
        ({"duration": "long"}, "duration holds text"),
        ({"every": 0}, "every: 0"),
        ({"every": 1e-12}, "every: 1e-12 s makes 1e.12 samples"),
        ({"times": []}, r"times: expected shape \(n,\) with n > 0, given shape \(0,\)"),
        ({"times": [[0.0, 1.0]]}, r"given shape \(1, 2\)"),
        ({"times": [0.0, 0.5, 0.5]}, "times: expected finite, increasing"),
        ({"times": [0.0, np.nan]}, "times: expected finite, increasing"),
        ({"times": [-1.0, 0.5]}, "from 0 on"),
        ({"times": [0.0, 2.0]}, "times: the last, 2 s, is after duration = 1 s"),
        ({"times": [0.0], "every": 0.1}, "every and times: give one"),
        ({"tolerance": 0}, "tolerance: 0"),
        ({"tolerance": -1e-6}, "tolerance: -1e-06"),
        ({"q0": [0, 0]}, r"q0: expected shape \(3,\), given shape \(2,\)"),
        ({"q0": [[0, 0, 0]]}, r"q0: expected shape \(3,\), given shape \(1, 3\)"),
        ({"q0": [0, np.nan, 0]}, r"q0: expected 3 finite numbers, q0\[1\] is nan"),
        ({"q0": "bent"}, "q0 holds text"),
        ({"v0": np.zeros(4)}, r"v0: expected shape \(3,\), given shape \(4,\)"),
        ({"v0": [0, 0, np.inf]}, r"v0\[2\] is inf"),
        ({"drives": {"joint_9": 1.0}}, "joint_9"),
        ({"drives": {"joint_1": np.nan}}, r"drives\['joint_1'\]: .*not finite"),
        ({"drives": {"joint_1": [1.0, 2.0]}}, "joint_1"),
        ({"wrenches": {"link_9": [0] * 6}}, r"wrenches\['link_9'\]: link 'link_9' does not exist"),
        ({"wrenches": {"link_1": [0] * 5}}, r"wrenches\['link_1'\]: .*six"),
        ({"numerics": {"integrator": "adam"}}, "adam"),
        ({"numerics": {"method": "magic"}}, "magic"),
        ({"numerics": {"solver": "magic", "method": "constraint_force"}}, "magic"),
        (
            {
                "numerics": lw.Numerics(
                    solver="conjugate_gradient", initial_guess="magic", method="constraint_force"
                ),
            },
            "magic",
        ),
        (
            {"numerics": lw.Numerics(initial_guess="magic")},
            "magic.*known: zero, previous, linear, cubic, projection",
        ),
        (
            {"numerics": lw.Numerics(stop="magic")},
            "magic.*known: paper, residual, energy_norm",
        ),
        ({"numerics": lw.Numerics(solver_tolerance=0)}, "solver_tolerance: 0"),
        ({"numerics": lw.Numerics(max_iterations=0)}, "max_iterations: 0 given"),
        ({"numerics": lw.Numerics(max_iterations=1.5)}, "max_iterations: 1.5 given"),
        ({"numerics": lw.Numerics(integrator=3)}, "integrator: 3 given"),
        ({"numerics": {"speed": 3}}, "numerics: unknown option 'speed'; known: tolerance"),
        ({"numerics": 3}, "numerics: 3 given"),
        ({"threads": 0}, "threads: 0 given"),
        ({"numerics": {"step": -1}}, "step: -1"),
        ({"numerics": {"integrator": "runge_kutta_4"}}, "step"),
        ({"numerics": {"max_step": 0}}, "max_step: 0"),
        ({"record": ["loads"]}, "record: unknown quantity 'loads'"),
        ({"record": {"joints": ["joint_9"]}}, "joint_9"),
        ({"record": {"every": 1}}, "record: unknown option 'every'; known: quantities"),
        ({"on_failure": "ignore"}, "on_failure: 'ignore'"),
    ],
)
def test_wrong_arguments_are_refused_and_nothing_is_written(chain, tmp_path, arguments, pattern):
    with pytest.raises(lw.InputError, match=pattern) as caught:
        lw.simulate(chain, **{"duration": 1.0, "output": tmp_path / "run.zarr", **arguments})
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, ValueError)
    assert os.listdir(tmp_path) == []


# -- simulations that end early ------------------------------------------------------------------


def blow_up(t, q, v):
    """Pushes ever harder after half a second."""
    return 0.0 if t < 0.5 else 1e9 * (1 + v * v)


@pytest.mark.parametrize("output", [None, "run.zarr"])
def test_state_that_stops_being_finite(chain, tmp_path, output):
    output = output and tmp_path / output
    with pytest.raises(lw.SimulationError) as caught:
        lw.simulate(chain, duration=1.0, every=0.01, drives={"joint_2": blow_up}, output=output)
    run = caught.value.run
    message = str(caught.value)
    assert "\n" not in message
    assert run.outcome in message
    assert "; " in message  # what happened; what to do
    assert not run.completed
    assert f"t = {run.attrs['stop_time']:.6g} s" in message
    assert 0.5 <= run.attrs["stop_time"] < 0.6
    assert 0.45 < run.time[-1] <= run.attrs["stop_time"]
    assert np.all(np.isfinite(run.position))
    if output:
        assert lw.open_run(output).outcome == run.outcome
        np.testing.assert_array_equal(lw.open_run(output).time, run.time)


def test_failed_run_can_be_returned(chain):
    run = lw.simulate(
        chain, duration=1.0, every=0.01, drives={"joint_2": blow_up}, on_failure="return"
    )
    assert not run.completed
    assert run.attrs["message"] in repr(run)


def test_error_in_a_users_function_arrives_and_keeps_the_samples(chain, tmp_path):
    def fails(t, q, v):
        if t > 0.5:
            raise ZeroDivisionError("mine")
        return 0.0

    with pytest.raises(ZeroDivisionError, match="mine"):
        lw.simulate(
            chain,
            duration=1.0,
            every=0.01,
            drives={"joint_1": fails},
            output=tmp_path / "run.zarr",
        )
    run = lw.open_run(tmp_path / "run.zarr")
    assert run.outcome == "error"
    assert run.attrs["message"] == "ZeroDivisionError: mine"


def interrupt_at(time):
    def progress(moment):
        if moment.time >= time:
            signal.raise_signal(signal.SIGINT)

    return progress


@pytest.mark.parametrize("output", [None, "run.zarr"])
def test_interrupt_keeps_the_samples(chain, tmp_path, monkeypatch, output):
    pace(monkeypatch, 5)
    options = {"duration": 1.0, "every": 0.01, "progress": interrupt_at(0.5)}
    output = output and tmp_path / output
    with pytest.raises(KeyboardInterrupt) as caught:
        lw.simulate(chain, **options, output=output)
    assert isinstance(caught.value, lw.SimulationInterrupted)
    run = caught.value.run
    assert run.outcome == "interrupted"
    assert 0.5 <= run.time[-1] < 0.6
    if output:
        assert lw.open_run(output).outcome == "interrupted"
        assert str(output) in str(caught.value)
    returned = lw.simulate(chain, **options, on_failure="return")
    np.testing.assert_array_equal(returned.time, run.time)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_second_interrupt_does_not_wait():
    with time_loop._Interrupt() as interrupt:
        signal.raise_signal(signal.SIGINT)
        assert interrupt.pressed
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


def test_callers_own_handler_stays(chain):
    calls = []
    previous = signal.signal(signal.SIGINT, lambda *_: calls.append(1))
    try:
        run = lw.simulate(chain, duration=1.0, every=0.1, progress=interrupt_at(0.5))
    finally:
        signal.signal(signal.SIGINT, previous)
    assert run.completed
    assert calls


def test_simulates_in_another_thread(chain):
    runs = []
    thread = threading.Thread(
        target=lambda: runs.append(lw.simulate(chain, duration=0.5, every=0.1))
    )
    thread.start()
    thread.join()
    assert runs[0].completed


def test_failure_message_names_outcome_time_and_joint(chain):
    text = "overflow; limit the step"
    ending = SimpleNamespace(outcome="not_finite", time=1.25, joint="joint_2", text=text)
    message = simulate.failure_message(chain, ending)
    assert message == (
        "simulation of 'chain' stopped at t = 1.25 s with outcome not_finite, joint 'joint_2': "
        "overflow; limit the step"
    )


# -- scenarios -----------------------------------------------------------------------------------


def test_run_scenario(tmp_path):
    path = tmp_path / "swing.toml"
    path.write_text(
        "[model.chain]\nn_bodies = 2\n[initial]\nposition.joint_1 = 0.5\n"
        "[simulate]\nduration = 1.0\n[output]\nevery = 0.1\npath = 'out.zarr'\n"
    )
    run = lw.run_scenario(path)
    assert run.path == tmp_path / "out.zarr"
    assert run.attrs["scenario"] == path.read_text()
    direct = lw.simulate(lw.scenes.chain(2), duration=1.0, every=0.1, q0=[0.5, 0])
    xr.testing.assert_equal(run.dataset, direct.dataset)
    assert lw.run_scenario(path, output=tmp_path / "x.zarr").path == tmp_path / "x.zarr"
