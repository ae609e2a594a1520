"""Hashes of what linkwise computes, to see whether a change kept every bit.

    python tools/golden.py > before.txt     # with the old build
    python tools/golden.py > after.txt      # with the new one, on the same machine
    diff before.txt after.txt               # silent: no bit moved

One line per machine and quantity: accelerations, joint loads and constraint forces of every method
and solver in the tables, inverse dynamics, batches, loads by cause, whole simulations. It uses the
public Python API alone, so that the same file runs on builds far apart. Bits depend on the
processor and the compiler: only outputs of one machine can be compared.
"""

from __future__ import annotations

import hashlib
import sys
import warnings
from collections.abc import Callable, Iterator
from dataclasses import fields
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

import linkwise as lw

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))
from helpers import loaded_arm  # noqa: E402
from helpers.random_trees import JOINT_TYPES, make_tree, random_configuration  # noqa: E402

ROBOTS = ("xarm7", "panda", "ur5_robot", "anymal", "talos_reduced", "icub", "hyq")
FLOATING = ("anymal", "talos_reduced", "icub", "hyq")
CAUSES = ("gravity", "velocity", "drive", "passive", "external")
SLOW_FROM = 60  # coordinates: methods of cubic time and stationary iterations stop there
SLOW_METHODS = ("composite_rigid_body", "joint_space_conjugate_gradient", "global_projection")
QUICK_SOLVERS = ("thomas", "twisted", "cyclic_reduction", "two_level")  # at any size


def digest(value: Any) -> str:
    if value is None:
        return "none"
    array = np.ascontiguousarray(value)
    return hashlib.sha256(f"{array.dtype}{array.shape}".encode() + array.tobytes()).hexdigest()[:16]


def show(machine: str, quantity: str, compute: Callable[[], Any]) -> None:
    """A line per array of a dictionary, or one for a single array; an error is a line as well."""
    try:
        value = compute()
    except (lw.InputError, lw.NumericsError, AttributeError, TypeError) as error:
        missing = isinstance(error, AttributeError | TypeError)
        print(f"{machine} | {quantity} | {'missing' if missing else type(error).__name__}")
        return
    for name, array in (value if isinstance(value, dict) else {"": value}).items():
        print(f"{machine} | {quantity}{name and ' | '}{name} | {digest(array)}")


# Machines


def hand() -> lw.Model:
    """A floating palm with five fingers of four hinges."""
    builder = lw.ModelBuilder("hand")
    builder.add_link("palm", mass=0.6, com=(0.01, 0, 0.05), inertia=1e-3 * np.diag([1, 2, 1.5]))
    builder.set_floating_base("base")
    for finger in range(5):
        parent, place = "palm", (0.02 * finger - 0.04, 0.01, 0.1)
        for k in range(4):
            link = f"finger{finger}_{k}"
            inertia = 1e-5 * np.diag([2, 2.2, 0.5])
            builder.add_link(link, mass=0.05, com=(0, 0.001, 0.02), inertia=inertia)
            axis = (0, 1, 0) if k == 0 else (1, 0, 0.1)
            builder.add_joint(f"{link}_joint", "revolute", parent, link, axis=axis,
                              translation=place, armature=1e-5)  # fmt: skip
            parent, place = link, (0, 0, 0.04)
    return builder.build()


def random_tree(seed: int, size: int, **options: Any) -> lw.Model:
    rng = np.random.default_rng(seed)
    kinds = [str(kind) for kind in rng.choice(JOINT_TYPES, size)]
    parents = [int(rng.integers(max(-1, k - 5), k)) for k in range(size)]
    return make_tree(kinds, parents, seed, **options).build()


def robot_files() -> dict[str, Path]:
    """The newest description of every robot of the package example-robot-data, by file name."""
    try:
        listed = metadata.files("example-robot-data") or []
    except metadata.PackageNotFoundError:
        return {}
    paths = sorted((file for file in listed if file.suffix == ".urdf"), key=str)
    return {path.stem: Path(str(path.locate())) for path in paths}


def machines() -> Iterator[tuple[str, Callable[[], lw.Model]]]:
    scenes = lw.scenes
    for n in (1, 7, 30, 300, 3000):
        yield f"chain {n}", partial(scenes.chain, n, axes="random", damping=0.1)
    for kind in ("prismatic", "universal", "spherical", "helical"):
        yield f"chain 12 {kind}", partial(scenes.chain, 12, joint=kind, armature=0.02)
    yield "chain 40 floating", partial(scenes.chain, 40, floating_base=True)
    yield "chain 600 spherical", partial(scenes.chain, 600, joint="spherical")
    yield (
        "chain 1500 parallel floating",
        partial(scenes.chain, 1500, axes="parallel", floating_base=True),
    )
    yield "tree 31", scenes.tree
    yield "tree 40 of 3 floating", partial(scenes.tree, 40, branching=3, floating_base=True)
    yield "tree 1000", partial(scenes.tree, 1000, axes="random")
    yield "tree 200 spherical", partial(scenes.tree, 200, branching=4, joint="spherical")
    yield "star 80", partial(scenes.tree, 81, branching=80)
    for name in ("srms", "ssrms"):
        yield name, partial(getattr(scenes, name), 50.0)
    yield "srms_3l5d", scenes.srms_3l5d
    yield "arm with stops", loaded_arm.arm
    yield "hand", hand
    for seed, size in enumerate((1, 2, 3, 5, 5, 8, 8, 12, 20, 60, 300)):
        yield f"random tree {seed}", partial(random_tree, seed, size)
    for folder in ("examples/data", "tests/data"):
        for path in sorted((ROOT / folder).rglob("*.*")):
            if path.suffix in (".urdf", ".xml"):
                yield path.name, partial(lw.load, path)
    found = robot_files()
    for name in ROBOTS:
        if name in found:
            floating = name in FLOATING
            yield (
                name,
                partial(lw.load, found[name], floating_base=floating, mimic="independent"),
            )


def states(model: lw.Model, count: int) -> dict[str, Any]:
    """Random q, v, tau (count, ...) and a wrench on every body that has mass."""
    rng = np.random.default_rng([count, model.nv])
    heavy = np.asarray(model.child_link_masses)[:, None] > 0
    reach = 1.0 if model.nv < 1000 else 0.05
    return {
        "q": random_configuration(model, rng, (count,), reach),
        "v": reach * rng.standard_normal((count, model.nv)),
        "tau": rng.standard_normal((count, model.nv)),
        "external": heavy * rng.standard_normal((count, len(heavy), 6)),
    }


# What is computed of a machine


def accelerations(model: lw.Model, state: dict[str, Any], **options: Any) -> dict[str, Any]:
    result = lw.forward_dynamics(model, **state, full=True, threads=1, **options)
    return {
        "acceleration": result.acceleration,
        "load": result.joint_load,
        "constraint": result.constraint_force,
        "iterations": result.report.iterations,
    }


def show_methods(name: str, model: lw.Model) -> None:
    batch = states(model, 1)
    state = {key: value[0] for key, value in batch.items()}
    small = model.nv < SLOW_FROM
    for method in ("auto", *(entry["name"] for entry in lw.methods())):
        if small or method not in SLOW_METHODS:
            show(name, method, partial(accelerations, model, state, method=method))
    for entry in lw.solvers():
        solver = entry["name"]
        if not small and solver not in QUICK_SOLVERS:
            continue
        options = {"method": "constraint_force", "solver": solver}
        if entry["kind"] == "iterative":
            # Far from round-off, so that the slow ones end soon; a limit hit is an answer as well.
            options |= {"tolerance": 1e-6, "max_iterations": 300}
        show(name, solver, partial(accelerations, model, state, **options))
    for key, options in {
        "passive": {"passive": True},
        "weightless": {"gravity": 0.0},
        "passive constraint_force": {"passive": True, "method": "constraint_force"},
    }.items():
        show(name, key, partial(accelerations, model, state, **options))
    show(name, "given motion", partial(given_motion, model, state))


def given_motion(model: lw.Model, state: dict[str, Any]) -> dict[str, Any]:
    driven = model.prescribe(list(model.joint_names)[::2])
    return accelerations(driven, state, prescribed=np.cos(np.arange(model.nv)))


def show_rest(name: str, model: lw.Model) -> None:
    count = 19 if model.nv < 400 else 3  # full lanes and a rest
    batch = states(model, count)
    q, v, tau, external = batch.values()
    known = {"external": external, "threads": 1}
    show(name, "batch", partial(accelerations_only, model, batch))
    show(name, "batch, loads", partial(lw.joint_loads, model, q, v, tau, **known))
    if model.nv < 400:
        show(name, "batch, constraint_force",
             partial(accelerations_only, model, batch, method="constraint_force"))  # fmt: skip
        show(name, "causes", partial(lw.joint_loads_by_cause, model, CAUSES, q, v, tau, **known))
        show(name, "mass matrix", partial(lw.mass_matrix, model, q[:2], threads=1))
    else:
        options = {"threads": 2}
        show(name, "threads", partial(lw.forward_dynamics, model, q, v, tau, **options))
    show(name, "inverse dynamics", partial(lw.inverse_dynamics, model, q, v, tau, **known))
    show(name, "inverse loads", partial(lw.inverse_dynamics_loads, model, q, v, tau, **known))
    show(name, "kinetic energy", partial(lw.kinetic_energy, model, q, v))
    show(name, "potential energy", partial(lw.potential_energy, model, q))
    show(name, "momentum", partial(lw.momentum, model, q, v))
    show(name, "passive torque", partial(lw.passive_torque, model, q, v))
    show(name, "link poses", partial(lw.link_poses, model, q))
    show(name, "joint poses", partial(lw.joint_poses, model, q))
    show(name, "jacobian", partial(lw.body_jacobian, model, q, len(model.joint_names) - 1))
    if model.nv < SLOW_FROM:
        show(name, "system", partial(system, model, batch))
        show(name, "evaluator", partial(followed, model, batch))


def accelerations_only(model: lw.Model, batch: dict[str, Any], **options: Any) -> Any:
    return lw.forward_dynamics(model, **batch, threads=1, **options)


def system(model: lw.Model, batch: dict[str, Any]) -> dict[str, Any]:
    one = lw.ConstraintSystem(model, *(batch[key][0] for key in ("q", "v", "tau")))
    force, _ = one.solve("thomas")
    return {"A": one.dense(), "b": one.b, "force": force, "recovered": one.recover(force)[1]}


def followed(model: lw.Model, batch: dict[str, Any]) -> dict[str, Any]:
    """Iterations of an iterative solver that remembers, by initial guess."""
    found = {}
    q, v = batch["q"][:1], batch["v"][:1]
    times = np.linspace(0, 0.01, 8)
    for guess in (entry["name"] for entry in lw.initial_guesses()):
        evaluator = lw.DynamicsMethod(model, method="constraint_force", solver="conjugate_gradient",
                                 initial_guess=guess, threads=1)  # fmt: skip
        rows = np.repeat(q, times.size, axis=0), v * (1 + times[:, None])
        result = evaluator.follow(times, *rows)
        found[guess] = np.append(result["acceleration"], result["iterations"])
    return found


# Whole simulations


def swing(start: float) -> lw.Table:
    times = np.linspace(0, 0.4, 81)
    return lw.Table(times, start + 0.2 * np.sin(7 * times), "cubic")


def runs() -> Iterator[tuple[str, Callable[[], lw.Run]]]:
    srms, weight = partial(lw.scenes.srms, 50.0, gravity=(0, 0, -9.81)), [2.0, -1, 3, 0.1, 0.2, 0.3]
    names = srms().joint_names
    table = lw.Table([0, 0.2, 0.4], [0.0, 300.0, -100.0])
    drives = {
        names[0]: lw.Motion(swing(0.0)),
        names[1]: lw.PD(kp=2e5, kd=4e4, target=swing(0.1)),
        names[2]: lw.PD(kp=2e4, kd=4e3, target=0.2),
        names[3]: lw.Torque(table),
        names[4]: lw.Spring(stiffness=50.0, damping=2.0, rest=0.1),
        names[5]: lw.Locked(),
    }
    functions = {
        names[0]: lambda t, q, v: 40 * np.cos(5 * t) - 3 * v,
        names[2]: lw.Motion(lambda t: (0.1 * t**2, 0.2 * t, 0.2)),
        names[4]: 5.0,
    }
    wrenches = {srms().child_link_names[-1]: lw.Wrench(weight)}
    turning = lw.Wrench(lambda t: np.cos(t) * np.array(weight), axes="frame")
    along = {srms().child_link_names[2]: turning}
    arm = loaded_arm.arm
    for integrator in ("adams", "bdf"):
        options = {"integrator": integrator, "duration": 0.4, "every": 0.02}
        yield (
            f"srms driven {integrator}",
            partial(simulated, srms, drives=drives, wrenches=wrenches, **options),
        )
        yield (
            f"srms functions {integrator}",
            partial(simulated, srms, drives=functions, wrenches=along, **options),
        )
        yield f"stops {integrator}", partial(simulated, arm, v0=[1.0, 2.0, 3.0], **options)
        yield f"hand {integrator}", partial(simulated, hand, **options)
    for integrator in ("runge_kutta_4", "semi_implicit_euler"):
        options = {"integrator": integrator, "duration": 0.2, "every": 0.02, "step": 0.002}
        yield (
            f"srms driven {integrator}",
            partial(simulated, srms, drives=drives, wrenches=wrenches, **options),
        )
        yield f"random tree {integrator}", partial(simulated, partial(random_tree, 6, 8), **options)
    slow = {"duration": 0.1, "every": 0.02, "method": "constraint_force"}
    chain = partial(lw.scenes.chain, 12, axes="random")
    for solver in ("thomas", "conjugate_gradient", "red_black_sor", "lagged_thomas"):
        for guess in ("cubic", "projection"):
            yield (
                f"chain {solver} {guess}",
                partial(simulated, chain, solver=solver, initial_guess=guess, **slow),
            )
    yield "chain body velocities", partial(simulated, chain, state="body_velocities", **slow)
    yield (
        "chain few",
        partial(
            simulated,
            chain,
            quantities=["position", "joint_load"],
            joints=["joint_3"],
            duration=0.1,
        ),
    )
    long = partial(lw.scenes.chain, 500)
    yield "chain 500", partial(simulated, long, q0=0.01 * np.ones(500), duration=0.05, every=0.01)
    yield "hoist.toml", partial(scenario, ROOT / "examples/data/hoist.toml")


def simulated(build: Callable[[], lw.Model], **options: Any) -> lw.Run:
    if hasattr(lw, "Recording"):  # older builds take them as arguments
        kept = [field.name for field in fields(lw.Recording) if field.name in options]
        named = [field.name for field in fields(lw.Numerics) if field.name in options]
        options["record"] = {name: options.pop(name) for name in kept}
        options["numerics"] = {name: options.pop(name) for name in named}
    elif hasattr(lw, "Numerics"):
        rare = [name for name in ("initial_guess", "state") if name in options]
        options["numerics"] = {name: options.pop(name) for name in rare}
    return lw.simulate(build(), threads=1, on_failure="return", **options)


def scenario(path: Path) -> lw.Run:
    return lw.run_scenario(path, on_failure="return")


def batches() -> Iterator[tuple[str, Callable[[], Any]]]:
    arm, chain = loaded_arm.arm(), lw.scenes.chain(7, axes="random")
    rng = np.random.default_rng(5)
    options = {"duration": 0.1, "every": 0.02, "step": 0.002, "threads": 1}
    heavy = [chain.with_payload("link_7", mass=mass) for mass in (0.5, 2.0)]
    for integrator in ("runge_kutta_4", "semi_implicit_euler"):
        yield f"arms {integrator}", partial(
            lw.simulate_batch, arm, integrator=integrator,
            v0=[1, 1, 0] * rng.standard_normal((11, 3)),
            drives={"elbow": lw.PD(kp=30, kd=3, target=0.3), "wrist": lw.Locked()}, **options,
        )  # fmt: skip
        yield f"payloads {integrator}", partial(
            lw.simulate_batch, heavy, q0=rng.standard_normal((9, 7)), integrator=integrator,
            tau=rng.standard_normal(7), wrenches={"link_7": lw.Wrench([1, 2, 3, 0, 0, 1])},
            drives={"joint_2": lw.Motion(swing(0.0))}, **options,
        )  # fmt: skip


def variables(result: Any) -> dict[str, Any]:
    dataset = getattr(result, "dataset", result)
    found = {str(name): dataset[name].values for name in sorted(dataset.data_vars)}
    numbers = {name: array for name, array in found.items() if array.dtype.kind in "fiub"}
    return numbers | {str(name): dataset[name].values for name in dataset.coords if name == "time"}


def main() -> None:
    warnings.simplefilter("ignore")
    for name, build in machines():
        model = build()
        show_methods(name, model)
        show_rest(name, model)
    for name, simulate in (*runs(), *batches()):
        show(f"run {name}", "", lambda simulate=simulate: variables(simulate()))
    for name in ("peaks", "causes"):
        show("run loads", name, partial(load_of_a_run, name))


def load_of_a_run(what: str) -> Any:
    run = simulated(loaded_arm.arm, duration=0.3, every=0.01, drives={"elbow": 3.0})
    found = lw.loads.summary(run) if what == "peaks" else lw.loads.split(run)
    return variables(found) if hasattr(found, "data_vars") else found.values


if __name__ == "__main__":
    main()
