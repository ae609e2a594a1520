"""Extremes between samples of machines with loops: against samples a hundred times denser."""

import numpy as np
import pytest

import linkwise as lw
from linkwise.loads.peaks import envelope, peak_loads, summary
from linkwise.scenes import benchmark

pytestmark = pytest.mark.filterwarnings("ignore::linkwise.ModelWarning")

MACHINES = {"slider_crank": 2.0, "stewart": 0.5, "bricard": 1.0, "andrews": 0.02}


def runs(machine, duration: float, samples: int, **options):
    """Seldom recorded with extremes; and often, without."""
    common = {
        "q0": machine.q0,
        "v0": machine.v0,
        "drives": machine.drives,
        "tolerance": 1e-8,
        **options,
    }
    return (
        lw.simulate(machine.model, times=np.linspace(0, duration, samples + 1), **common),
        lw.simulate(
            machine.model,
            times=np.linspace(0, duration, 100 * samples + 1),
            extremes=False,
            **common,
        ),
    )


@pytest.mark.parametrize("name", MACHINES)
def test_peaks_are_those_of_dense_samples(name):
    machine = benchmark(name)
    seldom, often = runs(machine, MACHINES[name], 10)
    found, seen = envelope(seldom), envelope(often)
    assert list(found.joint.values) == [
        *machine.model.joint_names,
        *machine.model.loop_names,
    ]
    whole = np.maximum(np.abs(seen.minimum), np.abs(seen.maximum)).values
    half = np.repeat(whole.reshape(-1, 2, 3).max(axis=2), 3, axis=1).reshape(whole.shape)
    allowed = 1e-3 * half + 1e-6 * half.max()
    assert (np.abs(found.maximum - seen.maximum).values <= allowed).all()
    assert (np.abs(found.minimum - seen.minimum).values <= allowed).all()
    # The samples alone would not do, and the whole wrench belongs to the peak.
    peaks, dense = peak_loads(seldom), peak_loads(often)
    sampled = np.linalg.norm(seldom.joint_load.values[..., :3], axis=-1).max(axis=0)
    if name != "bricard":
        assert (sampled < 0.99 * dense.force.values).any()
    wrench = summary(seldom).wrench.sel(quantity="force").values
    assert np.abs(np.linalg.norm(wrench[:, :3], axis=1) - peaks.force.values).max() < (
        1e-9 * peaks.force.values.max()
    )


def test_turns_of_a_spring_in_the_loop_are_counted_between_samples():
    """A parallelogram that goes round, wound up by a spring in a joint that closes it."""
    builder = lw.ModelBuilder("wound")
    builder.add_link("ground")
    for name in ("left", "right", "top"):
        builder.add_link(name, mass=1.0, com=(0.5, 0, 0), inertia=np.diag([1e-3, 0.08, 0.08]))
    axis = (0, 0, 1)
    builder.add_joint("a", "revolute", "ground", "left", axis=axis)
    builder.add_joint("b", "revolute", "left", "top", axis=axis, translation=(1, 0, 0))
    builder.add_joint("c", "revolute", "ground", "right", axis=axis, translation=(0.4, 0, 0))
    builder.add_loop(
        "d",
        "revolute",
        "right",
        "top",
        axis=axis,
        translation=(1, 0, 0),
        child_translation=(0.4, 0, 0),
        stiffness=3.0,
    )
    model = builder.build()
    q0, v0 = [1.0, -1.0, 1.0], [9.0, -9.0, 9.0]
    common = {"q0": q0, "v0": v0, "tolerance": 1e-8}
    seldom = lw.simulate(model, times=[0, 0.4], **common)
    often = lw.simulate(model, times=np.linspace(0, 0.4, 401), extremes=False, **common)
    torque = often.joint_load.values[:, model.n_joints, 5]
    found = envelope(seldom)
    assert found.minimum.values[-1, 5] == pytest.approx(torque.min(), rel=1e-3)
    assert np.abs(torque).max() > 3.0


def test_loads_near_singular_positions_have_no_bound():
    """Forces grow as the bars come into one line: no peak of theirs is the largest."""
    seldom, _ = runs(benchmark("four_bars", n=2), 1.3, 5)
    said = [note["text"] for note in seldom.warnings]
    assert any("no bound of the loads holds: near t = 0.714" in text for text in said)
    assert np.isinf(summary(seldom).sampling.sel(quantity="force")).all()
    before, _ = runs(benchmark("four_bars", n=2), 0.5, 5)
    assert not any("no bound" in note["text"] for note in before.warnings)
    assert np.isfinite(summary(before).sampling.sel(quantity="force")).all()
