"""linkwise: rigid multibody dynamics in linear time, with the six-component load of every joint.

import linkwise as lw

model = lw.load("arm.urdf")
run = lw.simulate(model, duration=10, drives={"elbow": lw.PD(kp=100, kd=10, target=1.0)})
run.joint_load.sel(joint="elbow")
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

# The public names and where they live. They are imported when first used: the command line must
# answer `--help` without loading NumPy, xarray and the compiled core. No module in this table is
# called like a public name, because importing a submodule binds its name in the package.
_PUBLIC = {
    "InputError": "linkwise._core",
    "Model": "linkwise._core",
    "ModelBuilder": "linkwise._core",
    "NumericsError": "linkwise._core",
    "ForwardDynamicsResult": "linkwise._core",
    "Report": "linkwise._core",
    "Note": "linkwise._core",
    "forward_dynamics": "linkwise._core",
    "inverse_dynamics": "linkwise._core",
    "inverse_dynamics_loads": "linkwise._core",
    "joint_loads": "linkwise._core",
    "joint_loads_by_cause": "linkwise._core",
    "mass_matrix": "linkwise._core",
    "kinetic_energy": "linkwise._core",
    "potential_energy": "linkwise._core",
    "momentum": "linkwise._core",
    "body_poses": "linkwise._core",
    "link_poses": "linkwise._core",
    "body_jacobian": "linkwise._core",
    "passive_torque": "linkwise._core",
    "solvers": "linkwise._core",
    "methods": "linkwise._core",
    "integrators": "linkwise._core",
    "initial_guesses": "linkwise._core",
    "stop_rules": "linkwise._core",
    "solver_options": "linkwise._core",
    "ConstraintSystem": "linkwise._core",
    "Evaluator": "linkwise._core",
    "Spectrum": "linkwise._core",
    "load": "linkwise.io.load",
    "Drive": "linkwise.drives",
    "Free": "linkwise.drives",
    "Locked": "linkwise.drives",
    "Motion": "linkwise.drives",
    "PD": "linkwise.drives",
    "Spring": "linkwise.drives",
    "Table": "linkwise.drives",
    "Torque": "linkwise.drives",
    "Wrench": "linkwise.drives",
    "Progress": "linkwise.simulation.time_loop",
    "Run": "linkwise.results",
    "SimulationError": "linkwise.simulation.simulate",
    "SimulationInterrupted": "linkwise.simulation.simulate",
    "load_scenario": "linkwise.scenario",
    "open_run": "linkwise.results",
    "run_scenario": "linkwise.simulation.simulate",
    "simulate": "linkwise.simulation.simulate",
    "simulate_batch": "linkwise.simulation.batch",
    "sweep": "linkwise.simulation.sweep",
}
_SUBMODULES = ("drives", "loads", "scenes")

__all__ = [
    "PD",
    "ConstraintSystem",
    "Drive",
    "Evaluator",
    "ForwardDynamicsResult",
    "Free",
    "InputError",
    "Locked",
    "Model",
    "ModelBuilder",
    "Motion",
    "Note",
    "NumericsError",
    "Progress",
    "Report",
    "Run",
    "SimulationError",
    "SimulationInterrupted",
    "Spectrum",
    "Spring",
    "Table",
    "Torque",
    "Wrench",
    "body_jacobian",
    "body_poses",
    "drives",
    "forward_dynamics",
    "initial_guesses",
    "integrators",
    "inverse_dynamics",
    "inverse_dynamics_loads",
    "joint_loads",
    "joint_loads_by_cause",
    "kinetic_energy",
    "link_poses",
    "load",
    "load_scenario",
    "loads",
    "mass_matrix",
    "methods",
    "momentum",
    "open_run",
    "passive_torque",
    "potential_energy",
    "run_scenario",
    "scenes",
    "simulate",
    "simulate_batch",
    "solver_options",
    "solvers",
    "stop_rules",
    "sweep",
]
__version__: str

if TYPE_CHECKING:
    from linkwise import drives, loads, scenes
    from linkwise._core import (
        ConstraintSystem,
        Evaluator,
        ForwardDynamicsResult,
        InputError,
        Model,
        ModelBuilder,
        Note,
        NumericsError,
        Report,
        Spectrum,
        body_jacobian,
        body_poses,
        forward_dynamics,
        initial_guesses,
        integrators,
        inverse_dynamics,
        inverse_dynamics_loads,
        joint_loads,
        joint_loads_by_cause,
        kinetic_energy,
        link_poses,
        mass_matrix,
        methods,
        momentum,
        passive_torque,
        potential_energy,
        solver_options,
        solvers,
        stop_rules,
    )
    from linkwise.drives import PD, Drive, Free, Locked, Motion, Spring, Table, Torque, Wrench
    from linkwise.io.load import load
    from linkwise.results import Run, open_run
    from linkwise.scenario import load_scenario
    from linkwise.simulation.batch import simulate_batch
    from linkwise.simulation.simulate import (
        SimulationError,
        SimulationInterrupted,
        run_scenario,
        simulate,
    )
    from linkwise.simulation.sweep import sweep
    from linkwise.simulation.time_loop import Progress


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        value = getattr(import_module(_PUBLIC[name]), name)
    elif name in _SUBMODULES:
        value = import_module(f"linkwise.{name}")
    elif name == "__version__":
        value = import_module("linkwise.record.provenance").versions()["linkwise"]
    else:
        raise AttributeError(f"module 'linkwise' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
