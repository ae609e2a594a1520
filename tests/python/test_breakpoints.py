"""What acts for a short time is seen: tables, functions, given motions, whatever the tolerance."""

import json
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import linkwise as lw

INERTIA, TORQUE = 10 / 1.31, 10.0
RAMP = 1e-6
VARIABLE = ("auto", "adams", "bdf", "esdirk")


@pytest.fixture(scope="module")
def rotor():
    """One body on a hinge, at rest, that nothing pulls."""
    builder = lw.ModelBuilder("rotor", gravity=(0, 0, 0))
    builder.add_link("ground")
    builder.add_link("disc", mass=1.0, inertia=INERTIA * np.eye(3))
    builder.add_joint("axle", "continuous", "ground", "disc", axis=(0, 0, 1))
    return builder.build()


@pytest.fixture(scope="module")
def pendulum():
    """q'' = -sin q + torque: 1 kg at 1 m, in a field of 1 m/s2."""
    builder = lw.ModelBuilder("pendulum", gravity=(0, 0, -1))
    builder.add_link("ground")
    builder.add_link("bob", mass=1.0, com=(0, 0, -1))
    builder.add_joint("hinge", "continuous", "ground", "bob", axis=(0, 1, 0))
    return builder.build()


def pulse(start, width, height, end, ramp=RAMP):
    times = [0, start, start + ramp, start + width, start + width + ramp, end]
    return lw.Table(times, [0, 0, height, height, 0, 0])


def angle_after(torque, start, width, end):
    """Of the rotor: half a turn of constant acceleration, then coasting."""
    return torque / INERTIA * (width**2 / 2 + width * (end - start - width))


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("integrator", VARIABLE)
def test_a_pulse_on_a_machine_at_rest(rotor, integrator, tolerance):
    """10 N m from 5 to 6 s of 20 s."""
    run = lw.simulate(
        rotor,
        duration=20,
        every=5,
        drives={"axle": lw.Torque(pulse(5, 1, TORQUE, 20))},
        numerics={"integrator": integrator},
        tolerance=tolerance,
    )
    expected = angle_after(TORQUE, 5 + RAMP / 2, 1, 20)
    assert expected == pytest.approx(18.995, abs=1e-5)
    assert run.position[-1, 0] == pytest.approx(expected, abs=20 * tolerance)


@pytest.mark.parametrize("width", [1.0, 1e-2, 1e-4, 1e-6, 1e-8, 1e-9])
def test_pulses_of_any_width(rotor, width):
    drive = lw.Torque(pulse(7.3, width, 1 / width, 1000, ramp=width / 100))
    run = lw.simulate(rotor, times=[0, 1000], drives={"axle": drive})
    assert run.velocity[-1, 0] == pytest.approx(1 / INERTIA, rel=1e-5)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("width", [1e-4, 1e-6, 1e-8, 1e-10, 1e-12])
def test_a_blow_is_felt_or_said(rotor, width, tolerance):
    """1 N m s at rest: however short, it turns the rotor, or the run says that it cannot.

    The times of the table are doubles, and so is its width: the blow is what they make of it.
    """
    table = pulse(7.3, width, 1 / width, 20, ramp=width / 100)
    blow = np.trapezoid(np.ravel(table.values), np.ravel(table.times))
    times = np.spacing(7.3) / width
    options = {"tolerance": tolerance, "on_failure": "return"}
    options["drives"] = {"axle": lw.Torque(table)}
    run = lw.simulate(rotor, times=[0, 20], **options)
    if run.outcome == "converged":
        rel = max(50 * tolerance, 100 * times, 1e-6)
        assert float(run.velocity[-1, 0]) == pytest.approx(blow / INERTIA, rel=rel)
    else:
        assert run.outcome == "step_too_small"
        assert width < 1e-8


def wrench_of(table):
    return lw.Table(table.times, np.c_[np.zeros((6, 5)), table.values])


@pytest.mark.parametrize("integrator", ["runge_kutta_4", "semi_implicit_euler"])
def test_fixed_steps_are_cut_at_the_pulse(rotor, integrator):
    """Its start and end lie within steps of 0.3 s; speeds are exact for piecewise constant torques,
    and nearly so on ramps of a microsecond."""
    run = lw.simulate(
        rotor,
        duration=20,
        every=1,
        drives={"axle": lw.Torque(pulse(5, 1, TORQUE, 20))},
        numerics={"integrator": integrator, "step": 0.3},
    )
    assert run.velocity[-1, 0] == pytest.approx(TORQUE / INERTIA, rel=3e-6)
    if integrator == "runge_kutta_4":
        expected = angle_after(TORQUE, 5 + RAMP / 2, 1, 20)
        assert run.position[-1, 0] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("members", [1, 5, 9])
def test_members_of_a_batch_see_it_alike(rotor, members):
    table = pulse(5, 1, TORQUE, 20)

    def batch(threads):
        return lw.simulate_batch(
            rotor,
            q0=np.arange(members)[:, None] * 1.0,
            times=[0.0, 5.5, 20.0],
            step=0.3,
            drives={"axle": table},
            threads=threads,
        )

    one, two = batch(1), batch(2)
    expected = np.arange(members) + angle_after(TORQUE, 5 + RAMP / 2, 1, 20)
    np.testing.assert_allclose(one.position[:, -1, 0], expected, rtol=1e-9)
    np.testing.assert_array_equal(one.position, two.position)


def test_wrenches_and_targets(rotor):
    table = pulse(5, 1, TORQUE, 20)
    run = lw.simulate(rotor, times=[20], wrenches={"disc": lw.Wrench(wrench_of(table))})
    expected = angle_after(TORQUE, 5 + RAMP / 2, 1, 20)
    assert run.position[-1, 0] == pytest.approx(expected, abs=1e-5)
    # A target that goes out and back between 5 and 5.4 s; kp and kd make it critically damped.
    target = lw.Table([0, 5, 5.2, 5.4, 10], [0, 0, 1, 0, 0])
    kp, kd = 100 * INERTIA, 20 * INERTIA
    run = lw.simulate(rotor, duration=10, every=0.1, drives={"axle": lw.PD(kp, kd, target)})

    def rate(t, y):
        goal = np.interp(t, target.times, target.values[:, 0])
        slope = {5.0: 5.0, 5.2: -5.0}.get(start, 0.0)
        return [y[1], 100 * (goal - y[0]) + 20 * (slope - y[1])]

    state = [0.0, 0.0]
    for start, end in ((5.0, 5.2), (5.2, 5.4), (5.4, 6.0)):
        steps = solve_ivp(rate, (start, end), state, rtol=1e-10, atol=1e-12)
        state = steps.y[:, -1]
    assert run.position.sel(time=6, method="nearest")[0] == pytest.approx(state[0], abs=1e-5)
    assert np.abs(run.position).max() > 0.3


@pytest.mark.parametrize("integrator", VARIABLE)
def test_hits_on_a_moving_machine(pendulum, integrator):
    """1 N m s within 1 to 10 ms, at 40 random times."""
    random = np.random.default_rng(7)
    for start, width in zip(
        random.uniform(3, 6, 40), 10 ** random.uniform(-3, -2, 40), strict=True
    ):
        hit = lw.Table(
            [0, start, start + 0.1 * width, start + 0.9 * width, start + width, 10],
            np.array([0, 0, 1, 1, 0, 0]) / (0.9 * width),
        )
        end = start + width + 0.5
        run = lw.simulate(
            pendulum,
            times=[end],
            q0=[1.0],
            drives={"hinge": hit},
            numerics={"integrator": integrator},
        )
        state = [1.0, 0.0]
        for first, last in zip([*hit.times[:5]], [*hit.times[1:5], end], strict=True):
            state = solve_ivp(
                lambda t, y: [y[1], np.interp(t, hit.times, hit.values[:, 0]) - np.sin(y[0])],  # noqa: B023
                (first, last),
                state,
                rtol=1e-9,
                atol=1e-10,
            ).y[:, -1]
        assert run.velocity[-1, 0] == pytest.approx(state[1], abs=2e-4), (start, width)


def bump(width, start=5.0, size=0.5):
    """A motion out and back, smooth to the third derivative."""

    def motion(t):
        s = (t - start) / width
        if not 0 < s < 1:
            return 0.0, 0.0, 0.0
        sin, cos, w = math.sin(math.pi * s), math.cos(math.pi * s), math.pi / width
        return (
            size * sin**4,
            size * 4 * w * sin**3 * cos,
            size * 4 * w**2 * (3 * sin**2 * cos**2 - sin**4),
        )

    return motion


@pytest.mark.parametrize("width", [0.5, 0.1, 0.02])
def test_short_bumps_in_a_given_motion(width):
    """The other joint of a machine at rest moves on; a run with short steps is the witness."""
    model = lw.scenes.chain(2, gravity=(0, 0, 0), axes="parallel")
    motion = lw.Motion(bump(width))
    witness = lw.simulate(
        model,
        times=[10.0],
        drives={"joint_1": motion},
        numerics={"max_step": width / 50},
        tolerance=1e-9,
    )
    expected = float(witness.position[-1, 1])
    assert abs(expected) > 0.1
    times = np.linspace(0, 10, 20001)
    drives = (
        motion,
        lw.Motion(bump(width), breakpoints=[5, 5 + width]),
        lw.Motion(lw.Table(times, [bump(width)(t)[0] for t in times], "cubic")),
    )
    for drive, allowed in zip(drives, (1e-4, 1e-4, 1e-2), strict=True):
        run = lw.simulate(model, times=[10.0], drives={"joint_1": drive})
        assert run.position[-1, 1] == pytest.approx(expected, rel=allowed)


# Functions of the caller's


def on_off(t, q, v):
    return TORQUE * (5 < t < 6)


@pytest.mark.parametrize("integrator", VARIABLE)
@pytest.mark.parametrize("breakpoints", [None, [6, 5]])
def test_a_function_that_is_on_for_a_while(rotor, integrator, breakpoints):
    drive = lw.Torque(on_off, breakpoints=breakpoints)
    run = lw.simulate(
        rotor, times=[20.0], drives={"axle": drive}, numerics={"integrator": integrator}
    )
    assert run.position[-1, 0] == pytest.approx(angle_after(TORQUE, 5, 1, 20), abs=1e-4)
    assert bool(run.warnings) == (breakpoints is None)
    wrench = lw.Wrench(lambda t: [0, 0, 0, 0, 0, on_off(t, 0, 0)], breakpoints=breakpoints)
    run = lw.simulate(
        rotor, times=[20.0], wrenches={"disc": wrench}, numerics={"integrator": integrator}
    )
    assert run.position[-1, 0] == pytest.approx(angle_after(TORQUE, 5, 1, 20), abs=1e-4)


def test_declared_breakpoints_find_what_samples_miss(rotor):
    def hit(t, q, v):
        return 1e4 * (7.3 < t < 7.3001)

    run = lw.simulate(
        rotor, times=[20.0], drives={"axle": lw.Torque(hit, breakpoints=[7.3, 7.3001])}
    )
    assert run.velocity[-1, 0] == pytest.approx(1 / INERTIA, rel=1e-6)
    (note,) = lw.simulate(rotor, times=[20.0], drives={"axle": hit}).warnings
    assert note["element"] == "drives['axle']"
    assert "is a function without breakpoints=" in note["text"]
    assert "0.00977 s" in note["text"]


class Sampled:
    """A controller that looks at the state every 0.1 s and holds its torque between."""

    def __init__(self):
        self.next, self.torque = 0.0, 0.0

    def __call__(self, t, q, v):
        if t >= self.next - 1e-9:
            self.next += 0.1
            self.torque = -2 * float(q[0]) - float(v[0])
        return self.torque


def closed(controller):
    return lambda t, q, v: controller(t, q, v)


def test_what_a_function_remembers_is_not_changed_before_the_run(rotor):
    options = {
        "duration": 2,
        "every": 0.5,
        "numerics": {"integrator": "semi_implicit_euler", "step": 0.01},
    }
    runs = [
        lw.simulate(rotor, q0=[1.0], drives={"axle": drive}, **options)
        for drive in (Sampled(), lw.Torque(closed(Sampled()), breakpoints=()))
    ]
    np.testing.assert_array_equal(runs[0].position, runs[1].position)
    with pytest.raises(lw.InputError, match=r"drives\['axle'\].* between calls.* breakpoints="):
        lw.simulate(rotor, q0=[1.0], drives={"axle": closed(Sampled())}, **options)


@pytest.mark.parametrize("wrong", [[np.nan], "5", 3.0, [[1, 2]]])
def test_breakpoints_are_times(wrong):
    with pytest.raises(lw.InputError, match="torque breakpoints: give a sequence"):
        lw.Torque(on_off, breakpoints=wrong)


# Long tables


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
def test_rows_of_a_smooth_table_do_not_shorten_steps(pendulum, interpolation):
    times = np.linspace(0, 20, 20001)
    table = lw.Table(times, np.sin(3 * times), interpolation)
    run = lw.simulate(pendulum, times=[20.0], drives={"hinge": table})
    same = lw.Torque(lambda t, q, v: math.sin(3 * t), breakpoints=())
    free = lw.simulate(pendulum, times=[20.0], drives={"hinge": same})
    assert run.position[-1, 0] == pytest.approx(float(free.position[-1, 0]), abs=1e-4)
    assert run.attrs["total_steps"] < 2.5 * free.attrs["total_steps"]


def test_a_pulse_within_a_long_smooth_table(pendulum):
    times = np.linspace(0, 20, 20001)
    values = 0.1 * np.sin(times)
    values[7001:7004] += 100.0
    drive = {"hinge": lw.Table(times, values)}
    run = lw.simulate(pendulum, times=[8.0], drives=drive)
    short = lw.simulate(
        pendulum, times=[8.0], drives=drive, numerics={"max_step": 2e-4}, tolerance=1e-9
    )
    assert run.velocity[-1, 0] == pytest.approx(float(short.velocity[-1, 0]), abs=1e-5)
    assert run.attrs["total_steps"] < 1000


# Tables that do not cover the run, or are wrapped


def test_a_table_that_does_not_cover_the_run_is_noted(rotor, tmp_path):
    late = lw.Table([2, 3], [1.0, 2.0])
    drives = ({"axle": late}, {"axle": lw.PD(10, 1, late)})
    for drive in drives:
        run = lw.simulate(rotor, duration=4, output=tmp_path / "run.zarr", drives=drive)
        text = (
            "the table covers 2 to 3 s, the simulation 0 to 4 s: "
            "its first row holds before, its last row holds after"
        )
        assert run.warnings == [{"element": "drives['axle']", "text": text}]
        assert lw.open_run(tmp_path / "run.zarr").warnings == run.warnings
        assert text in repr(run)
        assert lw.loads.summary(run).attrs["warnings"] == run.attrs["warnings"]
    wrench = lw.Wrench(lw.Table([0, 3], np.ones((2, 6))))
    (note,) = lw.simulate(rotor, duration=4, wrenches={"disc": wrench}).warnings
    assert note["element"] == "wrenches['disc']"
    assert note["text"].startswith("the table covers 0 to 3 s")
    assert note["text"].endswith("0 to 4 s: its last row holds after")
    batch = lw.simulate_batch(rotor, duration=4, step=0.1, drives={"axle": late})
    assert "covers 2 to 3 s" in json.loads(batch.attrs["warnings"])[0]["text"]
    assert lw.simulate(rotor, duration=1, drives={"axle": lw.Table([0, 1], [1, 2])}).warnings == []


def test_an_angle_that_is_wrapped_says_so(rotor):
    times = np.linspace(0, 5, 501)
    angle = 2 * times**2
    wrapped = lw.Table(times, (angle + np.pi) % (2 * np.pi) - np.pi, "cubic")
    first = times[np.flatnonzero(np.diff(wrapped.values[:, 0]) < -3)[0] + 1]
    said = f"jumps by one turn at t = {first:.6g} s: unwrap the angle"
    with pytest.raises(lw.InputError, match=said):
        lw.Motion(wrapped)
    (note,) = lw.simulate(rotor, duration=5, drives={"axle": lw.PD(10, 1, wrapped)}).warnings
    assert note["element"] == "drives['axle']"
    assert note["text"].startswith(f"the target {said}")
    lw.Motion(lw.Table(times, np.unwrap(wrapped.values[:, 0]), "cubic"))


def test_what_is_said_of_many_drives_is_said_once():
    chain = lw.scenes.chain(6)
    drives = {name: lambda t, q, v: [0.1 * np.sin(t)] for name in chain.joint_names}
    notes = lw.simulate(chain, duration=0.1, drives=drives).warnings
    (said,) = [note for note in notes if "without breakpoints=" in note["text"]]
    named = [f"drives[{name!r}]" for name in chain.joint_names[:3]]
    assert said["element"] == ", ".join(named) + " and 3 more"
