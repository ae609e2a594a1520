"""A bound on the steps of a run, so that an absurd duration ends."""

import pytest

import linkwise as lw


@pytest.mark.parametrize("options", [{}, {"integrator": "semi_implicit_euler", "step": 0.01}])
def test_absurd_durations_end(options):
    with pytest.raises(lw.SimulationError, match=r"too_many_steps.*by max_steps") as info:
        lw.simulate(
            lw.scenes.chain(2), duration=1e9, q0=[1, 1], numerics={"max_steps": 300, **options}
        )
    run = info.value.run
    assert run.outcome == "too_many_steps"
    assert run.attrs["total_steps"] == 300
    assert 0 < run.attrs["stop_time"] < 1e9


def test_enough_steps_change_nothing():
    free = lw.simulate(lw.scenes.chain(2), duration=1, q0=[1, 1])
    bound = lw.simulate(
        lw.scenes.chain(2),
        duration=1,
        q0=[1, 1],
        numerics={"max_steps": free.attrs["total_steps"] + 1},
    )
    assert bound.position.identical(free.position)


def test_scenarios_have_it(tmp_path):
    (tmp_path / "s.toml").write_text(
        "[model.chain]\nn_bodies = 2\n[initial]\nposition.joint_1 = 1.0\n"
        "[simulate]\nduration = 1e12\nmax_steps = 50\n"
    )
    run = lw.run_scenario(tmp_path / "s.toml", on_failure="return")
    assert run.outcome == "too_many_steps"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"duration": 1e308}, "duration: 1e.308 s given; give at most 1e.12 s"),
        ({"times": [0, 1e300]}, "times: 1e.300 s given"),
        (
            {"duration": 1, "step": 5e-324, "integrator": "runge_kutta_4"},
            "step: 4.9.*e-324 s makes",
        ),
        ({"duration": 1, "max_step": 1e-200}, "max_step: 1e-200 s makes more than 1e.12 steps"),
    ],
)
def test_what_would_take_for_ever_is_refused(options, said):
    with pytest.raises(lw.InputError, match=said):
        lw.simulate(lw.scenes.chain(2), **options)


def test_batches_refuse_it_too():
    with pytest.raises(lw.InputError, match="step: 1e-20 s makes more than"):
        lw.simulate_batch(lw.scenes.chain(2), duration=1, step=1e-20)


def test_the_command_refuses_it(linkwise, tmp_path):
    (tmp_path / "s.toml").write_text(
        "[model.chain]\nn_bodies = 2\n[simulate]\nduration = 1e308\n"
        'integrator = "runge_kutta_4"\nstep = 5e-324\n'
    )
    result = linkwise("run", "s.toml")
    assert result.code == 2
    assert "give at most" in result.complaint


@pytest.mark.parametrize("steps", [0, -1, 1.5, "many", True])
def test_bounds_that_are_none(steps):
    with pytest.raises(lw.InputError, match="max_steps"):
        lw.simulate(lw.scenes.chain(2), duration=1, numerics={"max_steps": steps})
