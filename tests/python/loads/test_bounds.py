"""The plus-minus beside every peak holds against much tighter runs: a part of the scenes that
tools/bounds_coverage.py counts."""

import numpy as np
import pytest

import linkwise as lw
from helpers import odd_scenes
from helpers.bound_scenes import KINDS, SCENES, coverage
from helpers.loaded_arm import arm
from helpers.random_trees import random_configuration

FEW = [
    name
    for kind, scenes in KINDS.items()
    for name in list(scenes)[: 10 if kind == "known machines" else 2]
]


ODD = {name: scene for scenes in odd_scenes.KINDS.values() for name, scene in scenes.items()}


@pytest.mark.parametrize("scene", [*FEW, *(name for name in ODD if name.endswith(" 1"))])
def test_bounds_hold(scene):
    covered, total, _ = coverage((SCENES | ODD)[scene], 1e-5)
    assert total >= 1
    assert covered == total


def test_the_algebraic_bound_sees_an_early_stop(rng):
    """An iteration that stops far too early errs by as much as the bound says, and no less."""
    model = lw.scenes.chain(12, joint="spherical")
    options = {"duration": 0.2, "every": 0.02}
    options |= {"q0": random_configuration(model, rng), "tolerance": 1e-3}
    loose = lw.simulate(
        model,
        numerics=lw.Numerics(
            method="constraint_force", solver="conjugate_gradient", solver_tolerance=1e-4
        ),
        **options,
    )
    q, v = loose.position.values, loose.velocity.values
    exact = lw.joint_loads(model, q, v, np.zeros(model.nv))
    error = np.linalg.norm((loose.joint_load.values - exact)[..., :3], axis=-1).max(axis=0)
    said = lw.loads.bounds(loose).algebraic.sel(quantity="force").values
    sizes = (np.linalg.norm(x[..., :3], axis=-1) for x in (loose.joint_load.values, exact))
    size = np.abs(np.subtract(*sizes)).max(axis=0)
    assert error.max() > 1e-9
    assert (said >= size * (1 - 1e-6)).all()
    assert (said <= error + 1e-9).all()


def test_bounds_cover_the_whole_time():
    """Both runs have their peaks first, but later the truth may be higher than either."""
    builder = lw.ModelBuilder("weight")
    builder.add_link("ground")
    builder.add_link("weight", mass=1.0, com=(0.5, 0, 0), inertia=np.eye(3))
    builder.add_joint("bearing", "revolute", "ground", "weight", axis=[0, 0, 1])
    runs = [lw.simulate(builder.build(), duration=1, every=0.1, tolerance=t) for t in (1e-6, 1e-8)]
    np.testing.assert_allclose(runs[0].joint_load[:, 0, 2], 9.81)
    for run, late in zip(runs, (0.9990, 0.9998), strict=True):
        run.dataset["joint_load"][6:] *= late
    found = lw.loads.bounds(*runs).integration.sel(quantity="force").item()
    assert found == pytest.approx(9.81 * (0.9990 + 2 * 0.0008 - 1 + 1e-8), rel=1e-6)


def test_without_a_tighter_run_the_integration_is_not_known(swing):
    found = lw.loads.bounds(swing)
    assert np.isnan(found.integration).all()
    assert np.isnan(found.plus_minus).all()
    assert (found.algebraic.max() < 1e-9).item()


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"tolerance": 1e-7}, "step_tolerance 1e-08, the run 1e-08; simulate it with 1e-10"),
        ({"every": 0.1}, "other samples or joints"),
        ({"drives": {"elbow": 2.0}}, "another drives"),
        ({"model": lw.scenes.srms()}, "other samples or joints"),
    ],
)
def test_a_run_that_is_no_tighter_one_is_refused(change, complaint):
    options = {"duration": 0.2, "every": 0.05, "drives": {"elbow": 1.0}}
    run = lw.simulate(arm(), **options, tolerance=1e-7)
    options |= {"tolerance": 1e-9, "model": arm(), **change}
    if "model" in change:
        options["drives"] = None
    with pytest.raises(lw.InputError, match=complaint):
        lw.loads.bounds(run, lw.simulate(**options))
