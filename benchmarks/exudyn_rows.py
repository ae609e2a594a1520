"""A row of four-bars in Exudyn, in redundant coordinates, by its implicit integrator.

Of its integrators only the implicit ones of second order take constraints. At the singular
positions, where all bars lie in a line, its Newton iterations need `ignoreSingularJacobian`, and
dissipation (a spectral radius below 1): otherwise they fail at the first one.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from benchmarks import timing

#: The end of integration [s].
END = 10.0


def version() -> str:
    return str(import_module("exudyn").__version__)


def _row(n: int) -> tuple[Any, int]:
    """The system, upright and moving to the right, and its first rod."""
    exudyn, items = import_module("exudyn"), import_module("exudyn.itemInterface")
    system = exudyn.SystemContainer().AddSystem()

    def bar(x: float, y: float, speed: float, rate: float) -> int:
        node = system.AddNode(
            items.NodeRigidBody2D(
                referenceCoordinates=[x, y, 0], initialVelocities=[speed, 0, rate]
            )
        )
        body: int = system.AddObject(
            items.ObjectRigidBody2D(physicsMass=1, physicsInertia=1 / 12, nodeNumber=node)
        )
        center = system.AddMarker(items.MarkerBodyMass(bodyNumber=body))
        weight = items.LoadMassProportional(markerNumber=center, loadVector=[0, -9.81, 0])
        system.AddLoad(weight)
        return body

    def hinge(*ends: tuple[int, tuple[float, float]]) -> None:
        markers = [
            system.AddMarker(items.MarkerBodyRigid(bodyNumber=body, localPosition=[*at, 0]))
            for body, at in ends
        ]
        system.AddObject(items.RevoluteJoint2D(markerNumbers=markers))

    ground = system.AddObject(items.ObjectGround())
    rods = [bar(k, 0.5, 0.5, -1.0) for k in range(n + 1)]
    bars = [bar(k + 0.5, 1.0, 1.0, 0.0) for k in range(n)]
    for k, rod in enumerate(rods):
        hinge((ground, (k, 0)), (rod, (0, -0.5)))
    for k, own in enumerate(bars):
        hinge((rods[k], (0, 0.5)), (own, (-0.5, 0)))
        hinge((own, (0.5, 0)), (rods[k + 1], (0, 0.5)))
    system.Assemble()
    return system, rods[0]


def motion(n: int, step: float) -> tuple[tuple[float, float], timing.Taken]:
    """Where the first rod ends after END, and what that took."""
    exudyn = import_module("exudyn")
    system, rod = _row(n)
    settings = exudyn.SimulationSettings()
    settings.solution.file.write = False
    settings.linearSolver.solverType = exudyn.LinearSolverType.EigenSparse
    settings.linearSolver.ignoreSingularJacobian = True
    time = settings.timeIntegration
    time.endTime, time.numberOfSteps = END, round(END / step)
    time.newton.useModifiedNewton = True
    time.newton.relativeTolerance, time.newton.absoluteTolerance = 1e-8, 1e-10
    time.generalizedAlpha.spectralRadius = 0.9
    _, taken = timing.timed(lambda: system.SolveDynamic(settings))
    place = system.GetObjectOutputBody(
        rod, exudyn.OutputVariableType.Position, localPosition=[0, 0.5, 0]
    )
    return (float(place[0]), float(place[1])), taken
