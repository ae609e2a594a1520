"""`linkwise demo`: the Shuttle arm slews a payload."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from linkwise.cli.output import JsonOption, console

if TYPE_CHECKING:
    from linkwise._core import Model
    from linkwise.drives import Torque

DURATION = 10.0
PAYLOAD_MASS = 100.0
TOLERANCE = 1e-6
# Shoulder yaw and pitch, elbow pitch, wrist pitch, yaw and roll [rad].
START = (0.0, -0.3, 0.5, -0.2, 0.15, 0.0)
END = (0.4, -0.6, 0.9, 0.2, 0.45, 0.5)
_TABLE_INTERVALS = 500


def slew_torques(model: Model) -> dict[str, Torque]:
    """Joint torques of the slew, as tables over time.

    Every joint moves by s(t) = t/T - sin(2 pi t/T) / (2 pi) of its way, the profile of the
    manoeuvres in [sharf1993]: velocity and acceleration vanish at both ends. The torques are the
    inverse dynamics of that motion, and are applied open loop.
    """
    import numpy as np

    import linkwise as lw

    times = np.linspace(0.0, DURATION, _TABLE_INTERVALS + 1)
    phase = 2 * np.pi * times / DURATION
    way = np.subtract(END, START)
    q = np.array(START) + np.outer(times / DURATION - np.sin(phase) / (2 * np.pi), way)
    v = np.outer((1 - np.cos(phase)) / DURATION, way)
    a = np.outer(2 * np.pi * np.sin(phase) / DURATION**2, way)
    torques = lw.inverse_dynamics(model, q, v, a)
    return {
        name: lw.Torque(lw.Table(times, torques[:, model.v_slice(name)], "cubic"))
        for name in model.joint_names
    }


def demo(
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Where to write the results. By default run.zarr in this folder, numbered if it "
            "exists.",
            show_default=False,
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """The Space Shuttle's arm slews a payload: peak loads of every joint."""
    import numpy as np

    import linkwise as lw
    from linkwise.cli.progress import live_progress
    from linkwise.cli.run import show_run
    from linkwise.record.claim import check_target, unused_path

    target = output if output is not None else unused_path("run.zarr")
    check_target(target)
    model = lw.scenes.srms(payload_mass=PAYLOAD_MASS)
    with live_progress(quiet=as_json) as progress:
        result = lw.simulate(
            model,
            duration=DURATION,
            drives=slew_torques(model),
            q0=START,
            every=0.01,
            tolerance=TOLERANCE,
            output=target,
            progress=progress,
        )
    if not as_json:
        screen = console()
        screen.print(
            f"The Shuttle arm ({len(model.joint_names)} joints, {model.total_mass:g} kg with its "
            f"payload of {PAYLOAD_MASS:g} kg) slews for {DURATION:g} s at tolerance {TOLERANCE:g}."
        )
    show_run(result, as_json)
    if not as_json:
        missed = float(np.max(np.abs(result.position.values[-1] - np.array(END))))
        screen.print(f"The planned pose is reached to {missed:.1e} rad, torques applied open loop.")
        screen.print(f'Open them in Python: linkwise.open_run("{target}").joint_load', markup=False)
