"""Joint loads along whole simulated motions of robots, against Pinocchio's inverse dynamics."""

import numpy as np
import pytest

pin = pytest.importorskip("pinocchio")

import linkwise as lw  # noqa: E402
from helpers.pinocchio_pair import Pair, robot_files  # noqa: E402

ROBOTS = {
    "ur5": ("ur5_robot", False),
    "panda": ("panda", False),
    "anymal": ("anymal", True),
    "talos": ("talos_reduced", True),
    "solo": ("solo12", True),
}


def _path(stem):
    found = [path for name, path in robot_files().items() if name.endswith(f"/{stem}")]
    assert found, stem
    return found[0]


@pytest.mark.parametrize("robot", ROBOTS)
def test_loads_are_those_of_inverse_dynamics(robot):
    """Falling, swinging and driven: every sample's loads are Pinocchio's for that q, v, a."""
    stem, floating = ROBOTS[robot]
    pair = Pair(_path(stem), floating_base=floating)
    model = pair.model
    rng = np.random.default_rng(7)
    q0 = model.neutral_configuration()
    ones = [name for name, nv in zip(model.joint_names, model.joint_nv, strict=True) if nv == 1]
    for name in ones:
        q0[model.q_slice(name)] = rng.uniform(-0.3, 0.3)
    drives = {
        name: (lambda t, q, v, k=k: [2.0 * np.sin(3 * t + k)]) for k, name in enumerate(ones[::2])
    }
    run = lw.simulate(
        model,
        duration=0.4,
        every=0.02,
        drives=drives,
        q0=q0,
        v0=rng.normal(scale=0.3, size=model.nv),
        tolerance=1e-6,
    )
    worst = scale = 0.0
    for k in range(run.sizes["time"]):
        q, v, a = (run[name].values[k] for name in ("position", "velocity", "acceleration"))
        pin.rnea(pair.pin, pair.data, pair.pin_configuration(q), pair.to_pin(v), pair.to_pin(a))
        wrenches = pair.wrenches()
        worst = max(worst, np.abs(run.joint_load.values[k] - wrenches).max())
        scale = max(scale, np.abs(wrenches).max())
    assert worst < 1e-8 * scale
