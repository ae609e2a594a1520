"""Nothing of the core is left when a process ends: nanobind says what is."""

import os
import subprocess
import sys

import pytest

USES = {
    "models and runs": """
        import linkwise as lw
        model = lw.load(ARM)
        run = lw.simulate(model, duration=0.02, every=0.01, output="run.zarr")
        lw.loads.summary(lw.open_run("run.zarr")), lw.loads.quantities(run)
    """,
    "errors that are kept": """
        import sys, linkwise as lw
        kept = []
        for text in ("<robot/>", "none.urdf"):
            try:
                lw.load(text)
            except lw.InputError as error:
                kept.append((error, error.__traceback__))
    """,
    "functions of the caller's": """
        import numpy as np, linkwise as lw
        model = lw.scenes.chain(2)
        drive = lw.Torque(lambda t, q, v: np.ones(model.nv)[:1])
        run = lw.simulate(model, duration=0.02, every=0.01, drives={"joint_1": drive})
        method = lw.DynamicsMethod(model)
    """,
}
USES = {name: code.replace("\n        ", "\n") for name, code in USES.items()}


@pytest.mark.parametrize("use", USES)
def test_a_process_ends_with_nothing_left(use, tmp_path):
    from helpers.arm_urdf import ARM

    code = f"ARM = {ARM!r}\n" + USES[use]
    environment = {**os.environ, "LINKWISE_LEAK_WARNINGS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert "leaked" not in done.stderr, done.stderr
