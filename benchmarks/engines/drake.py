"""Drake: a continuous MultibodyPlant, with and without the joints' reactions; its integrators."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import coordinates
from benchmarks.engines.base import Contestant, Field, Motion, Offer, Simulator
from benchmarks.machine import Array, States, read_bodies
from benchmarks.timing import timed


def build(folder: Path) -> Field:
    gravity, bodies = read_bodies(folder)
    plant = _plant(gravity, bodies)
    context = plant.CreateDefaultContext()
    ours = States.read(folder / "linkwise.states")
    floating = bodies[0].joint == "floating"
    states = coordinates.to_drake(ours) if floating else ours
    port = plant.get_applied_generalized_force_input_port()
    torque = port.FixValue(context, ours.tau[0]).GetMutableData().get_mutable_value()
    accelerations = plant.get_generalized_acceleration_output_port()
    reactions = plant.get_reaction_forces_output_port()

    def forward(q: Array, v: Array, tau: Array) -> Array:
        plant.SetPositionsAndVelocities(context, np.concatenate([q, v]))
        torque.SetFromVector(tau)
        return np.asarray(accelerations.Eval(context))

    def with_reactions(q: Array, v: Array, tau: Array) -> Array:
        found = forward(q, v, tau)
        reactions.Eval(context)
        return found

    field = Field(
        states,
        [
            Contestant(Offer("aba"), forward),
            Contestant(Offer("aba and reactions", loads=True), with_reactions),
        ],
    )
    if floating:
        field.to_ours = lambda a: coordinates.from_drake(ours, a)
    else:
        field.simulators = [
            _simulator(plant, states, name) for name in ("runge_kutta3", "runge_kutta5")
        ]
    return field


def _plant(gravity: tuple[float, ...], bodies: list[Any]) -> Any:
    multibody: Any = import_module("pydrake.multibody.plant")
    tree: Any = import_module("pydrake.multibody.tree")
    math: Any = import_module("pydrake.math")
    plant = multibody.MultibodyPlant(0.0)
    plant.mutable_gravity_field().set_gravity_vector(np.array(gravity))
    made: list[Any] = []
    for k, body in enumerate(bodies):
        central = tree.RotationalInertia(
            *body.inertia.diagonal(), *body.inertia[[0, 0, 1], [1, 2, 2]]
        )
        inertia = tree.SpatialInertia.MakeFromCentralInertia(body.mass, body.com, central)
        made.append(plant.AddRigidBody(f"body{k}", inertia))
        if body.joint == "floating":
            continue
        parent = made[body.parent].body_frame() if body.parent >= 0 else plant.world_frame()
        place = math.RigidTransform(math.RotationMatrix(body.rotation), body.translation)
        frame = plant.AddFrame(tree.FixedOffsetFrame(f"frame{k}", parent, place))
        kind = tree.RevoluteJoint if body.joint == "revolute" else tree.PrismaticJoint
        plant.AddJoint(kind(f"joint{k}", frame, made[-1].body_frame(), body.axis))
    plant.Finalize()
    return plant


def _simulator(plant: Any, states: States, method: str) -> Simulator:
    analysis: Any = import_module("pydrake.systems.analysis")

    def simulate(duration: float, setting: float) -> Motion:
        simulator = analysis.Simulator(plant)
        analysis.ResetIntegratorFromFlags(simulator, method, duration)
        integrator = simulator.get_mutable_integrator()
        integrator.set_target_accuracy(setting)
        integrator.set_maximum_step_size(duration)
        context = simulator.get_mutable_context()
        plant.SetPositionsAndVelocities(context, np.concatenate([states.q[0], states.v[0]]))
        tau = np.zeros(states.v.shape[1])
        plant.get_applied_generalized_force_input_port().FixValue(context, tau)

        def run() -> None:
            simulator.Initialize()
            simulator.AdvanceTo(duration)

        _, taken = timed(run)
        q = np.array(plant.GetPositions(context))
        return Motion(q, taken.cpu, int(integrator.get_num_derivative_evaluations()))

    return Simulator(method.replace("_", " "), False, simulate)
