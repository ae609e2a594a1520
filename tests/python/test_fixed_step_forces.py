"""With fixed steps, forces of large gain are right or told: against closed forms and tight runs."""

import numpy as np
import pytest
from test_force_accuracy import INERTIA, blow, hardest_push, rod

import linkwise as lw

SILENT = 0.05
#: Steps of less than this time of a contact are resolved.
LOUD = {"runge_kutta_4": 0.4, "semi_implicit_euler": 0.2}


def said(run):
    return [note["text"] for note in run.warnings if note["element"] == "forces"]


@pytest.mark.parametrize("integrator", ["runge_kutta_4", "semi_implicit_euler"])
@pytest.mark.parametrize("stiffness", [1e4, 1e6, 1e8])
@pytest.mark.parametrize("damping", [0, 1, 100])
def test_a_blow_is_right_or_told(stiffness, damping, integrator):
    """x: the step, of the time that the contact takes."""
    model = rod(limit_stiffness=stiffness, limit_damping=damping)
    start, wrong = -0.31, 0
    truth = blow(stiffness, damping, start)
    speed = np.sqrt(2 * 0.1 * 9.81 * 0.5 * np.sin(-start) / INERTIA)
    rate = np.sqrt(stiffness * (1 + damping * speed) / INERTIA)
    for x in (0.05, 0.2, 0.8, 1.5, 3, 6, 20):
        if 0.3 * rate / x > 1e5:
            continue
        options = {"integrator": integrator, "step": x / rate, "on_failure": "return"}
        run = lw.simulate(model, times=[0.3], q0=[start], **options)
        if not run.completed:
            continue  # it says so
        error = abs(hardest_push(run) / truth - 1)
        wrong += error > SILENT
        assert said(run) or error < SILENT, x
        assert not said(run) or x >= LOUD[integrator], x
    assert wrong


@pytest.mark.parametrize("integrator", ["runge_kutta_4", "semi_implicit_euler"])
def test_friction_that_chatters_is_told(integrator):
    """The force that holds the rod flips between its bounds, and so do the loads."""
    options = {"q0": [-1.0], "times": [0.5], "integrator": integrator, "step": 1e-3}
    for velocity in (1e-2, 1e-3, 1e-4):
        run = lw.simulate(rod(upper=9.0, friction=2.0, friction_velocity=velocity), **options)
        assert "joint 'hinge'" in said(run)[0]
    assert not said(lw.simulate(rod(upper=9.0, friction=2.0, friction_velocity=0.5), **options))


@pytest.mark.parametrize("integrator", ["runge_kutta_4", "semi_implicit_euler"])
@pytest.mark.parametrize("damping", [0.0, 1.0])
def test_a_controller_is_told_where_it_is_faster_than_the_steps(integrator, damping):
    kp = 1e4
    rate = np.sqrt(kp / INERTIA)
    drive = {"hinge": lw.PD(kp, 1.4 * damping * rate * INERTIA, -0.5)}
    options = {"q0": [-0.6], "times": [0.05], "integrator": integrator, "drives": drive}
    for x, told in ((0.05, False), (0.1, False), (1.0, True)):
        run = lw.simulate(rod(upper=9.0), **options, step=x / rate)
        assert bool(said(run)) == told, x


def test_the_step_that_is_named_is_enough():
    model = rod(limit_stiffness=1e6, limit_damping=1)
    options = {"q0": [-0.5], "times": [0.35], "integrator": "runge_kutta_4"}
    (text,) = said(lw.simulate(model, **options, step=1e-3))
    step = float(text.split("take steps of ")[1].split(" s,")[0])
    again = lw.simulate(model, **options, step=step)
    assert not said(again)
    assert hardest_push(again) == pytest.approx(blow(1e6, 1, -0.5), rel=SILENT)


@pytest.mark.parametrize("integrator", ["auto", "bdf", "runge_kutta_4", "semi_implicit_euler"])
@pytest.mark.parametrize("gravity", [(0, 0, -9.81), (0, 0, 0)])
def test_a_machine_at_rest_has_nothing_to_tell(integrator, gravity):
    step = {"step": 1e-3} if "_" in integrator else {}
    model = lw.scenes.chain(5, damping=0.1, gravity=gravity)
    assert not said(lw.simulate(model, times=[1.0], integrator=integrator, **step))


def test_a_jump_of_a_target_is_no_error():
    """Steps begin anew there: the table's target leaps, and the drive is resolved."""
    target = lw.Table([0, 0.1, 0.100001, 1], [[-0.5], [-0.5], [-0.4], [-0.4]])
    drive = {"hinge": lw.PD(20.0, 2.0, target=target)}
    options = {"q0": [-0.5], "times": [0.5], "drives": drive, "step": 1e-3}
    for integrator in ("runge_kutta_4", "semi_implicit_euler"):
        assert not said(lw.simulate(rod(upper=9.0), **options, integrator=integrator))


def test_a_batch_tells_of_its_members():
    """Two of nine fall on the stop within the time; a single run says the same of the worst."""
    model = rod(limit_stiffness=1e6, limit_damping=1)
    starts = np.linspace(-1.5, -0.3, 9)[:, None]
    options = {"times": [0.22], "step": 5e-4, "integrator": "runge_kutta_4"}
    batch = lw.simulate_batch(model, q0=starts, **options)
    alone = [said(lw.simulate(model, q0=q, **options)) for q in starts]
    count = sum(map(bool, alone))
    assert 0 < count < 9
    (note,) = lw.Run(batch).warnings
    assert note["element"] == "forces"
    assert note["text"].startswith(f"in {count} of 9 members; in member ")
    member = int(note["text"].split("in member ")[1].split()[0])
    assert note["text"].endswith(alone[member][0])
    assert not lw.Run(lw.simulate_batch(model, q0=starts, **options | {"step": 2e-5})).warnings
