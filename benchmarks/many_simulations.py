"""Many simulations of one arm at once, beside one by one and beside MuJoCo's rollouts.

    python -m benchmarks many_simulations [--members 1024] [-o DIR]

The chain of seven joints of `peers` moves for a second from as many states, by steps of
1 ms of the classical Runge-Kutta method; end positions are compared before anything is timed. Time
is that of the processor, all threads together, the best of five. MuJoCo (`mujoco.rollout`, no
contacts, constraints and sensors) takes part where it is installed; it finds no joint loads, and
records every step as its interface has it. Writes many_simulations.json and many_simulations.md.
"""

from __future__ import annotations

import importlib.util
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import linkwise as lw
from benchmarks import study
from benchmarks.machine import Array, random_chain, random_states, read_bodies, write_machine
from benchmarks.timing import least_cpu

STEP, STEPS, JOINTS = 1e-3, 1000, 7
EVALUATIONS = 4  # per step
SLOW = 32  # members that are simulated one by one: more would only take longer


def mujoco_rollouts(machine: Any, q: Array, v: Array) -> Callable[[int], Array]:
    import mujoco
    import mujoco.rollout

    from benchmarks.engines.mujoco import compiled_model

    with tempfile.TemporaryDirectory() as folder:
        write_machine(machine, Path(folder))
        gravity, bodies = read_bodies(Path(folder))
    model = compiled_model(mujoco, gravity, bodies)
    model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, STEP
    states = np.hstack([np.zeros((len(q), 1)), q, v])
    data = mujoco.MjData(model)

    def run(count: int) -> Array:
        found, _ = mujoco.rollout.rollout(model, data, states[:count], nstep=STEPS)
        return np.asarray(found)[:, -1, 1 : 1 + JOINTS]

    return run


def contestants(members: int) -> dict[str, tuple[int, Callable[[int], Array]]]:
    """Name: how many members it simulates, and how."""
    machine = random_chain(JOINTS)
    drawn = random_states(machine, members)
    model, q, v = machine.model, drawn.q, drawn.v
    end = STEP * STEPS

    def at_once(count: int, *quantities: str) -> Array:
        batch = lw.simulate_batch(
            model,
            q0=q[:count],
            v0=v[:count],
            times=[end],
            step=STEP,
            threads=1,
            record=("position", *quantities),
            extremes=False,  # the peers search no peaks
        )
        return np.asarray(batch.position.values[:, 0])

    def one_by_one(count: int) -> Array:
        ends = []
        for k in range(count):
            run = lw.simulate(
                model,
                q0=q[k],
                v0=v[k],
                times=[end],
                numerics={"integrator": "runge_kutta_4", "step": STEP},
                threads=1,
                record=["position"],
            )
            ends.append(run.position.values[0])
        return np.array(ends)

    found = {
        "simulate_batch": (members, at_once),
        "simulate_batch, joint loads": (members, lambda count: at_once(count, "joint_load")),
        "simulate, one by one": (min(SLOW, members), one_by_one),
    }
    if importlib.util.find_spec("mujoco"):
        found["MuJoCo rollout"] = (min(8 * SLOW, members), mujoco_rollouts(machine, q, v))
    return found


def measure(members: int) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []
    expected = None
    for name, (count, run) in contestants(members).items():
        ends = run(count)
        expected = ends if expected is None else expected
        error = float(np.abs(ends - expected[:count]).max())
        if error > 1e-6:
            raise SystemExit(f"{name} ends {error:.1e} rad away from simulate_batch")
        each = least_cpu(partial(run, count)) / count
        rows.append(
            {
                "what": name,
                "members": count,
                "ms_per_member": 1e3 * each,
                "ns_per_body_and_evaluation": 1e9 * each / (STEPS * EVALUATIONS * JOINTS),
                "times_real_time": STEP * STEPS / each,
                "deviation": error,
            }
        )
    for row in rows:
        row["ratio"] = row["ms_per_member"] / rows[0]["ms_per_member"]
    return rows


COLUMNS: study.Columns = {
    "one core": lambda r: r["what"],
    "ms per member": lambda r: f"{r['ms_per_member']:.3g}",
    "ns per body and evaluation": lambda r: f"{r['ns_per_body_and_evaluation']:.3g}",
    "times real time": lambda r: f"{r['times_real_time']:,.0f}",
    "ratio": lambda r: f"{r['ratio']:.2g}",
}


def main() -> None:
    parser = study.parser(__doc__)
    parser.add_argument("--members", type=int, default=1024)
    asked = parser.parse_args()
    rows = measure(asked.members)
    study.write(asked.output, "many_simulations", study.table(rows, COLUMNS), rows)
