"""Worker processes: right answers, and failures that are told apart and survived."""

import dataclasses
import sys

import numpy as np
import pytest

import linkwise as lw
from benchmarks.engines.table import ENGINES
from benchmarks.machine import (
    Body,
    Machine,
    States,
    hanging_chain,
    random_chain,
    random_states,
    read_bodies,
    read_model,
)
from benchmarks.process import Worker, WorkerError, memory_limit, python_worker
from benchmarks.race import race, write_case
from benchmarks.sessions import PYTHON, QUICK, Session, Workers

COUNT = 5
GIB = 2**30
FUSE = 600  # seconds: no answer takes as long, on no machine


def floating_tree():
    """A floating base with two arms, one of them on a slide along a slanted axis."""
    rng = np.random.default_rng(3)
    builder = lw.ModelBuilder("floating tree")
    builder.set_floating_base()
    bodies = []
    for k, (parent, joint) in enumerate(
        [(-1, "floating"), (0, "revolute"), (1, "prismatic"), (0, "revolute"), (3, "revolute")]
    ):
        rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        rotation *= np.sign(np.linalg.det(rotation))
        axis = np.eye(3)[k % 3] if k < 4 else np.array([0.6, 0.0, 0.8])
        place = rng.uniform(-1, 1, 3)
        if joint == "floating":
            rotation, place, axis = np.eye(3), np.zeros(3), np.zeros(3)
        mass, com, inertia = 1.0 + k, rng.uniform(-0.2, 0.2, 3), np.diag([0.3, 0.4, 0.5])
        bodies.append(Body(parent, joint, axis, rotation, place, mass, com, inertia))
        builder.add_link(f"l{k}", mass=mass, com=com, inertia=inertia)
        if k > 0:
            builder.add_joint(
                f"j{k}",
                joint,
                f"l{parent}",
                f"l{k}",
                translation=place,
                rotation=rotation,
                axis=axis,
            )
    return Machine("floating tree", tuple(bodies), builder.build())


MACHINES = {"chain": random_chain(5), "tree": floating_tree(), "hanging": hanging_chain(4)}


@pytest.mark.parametrize("engine", ENGINES, ids=lambda engine: engine.name)
@pytest.mark.parametrize("machine", MACHINES.values(), ids=MACHINES)
def test_every_engine_is_given_the_same_machine(engine, machine, tmp_path):
    """Peers are timed at work that is the same: their accelerations are ours."""
    if not engine.installed:
        pytest.skip(f"{engine.package} is not installed")
    states = random_states(machine, COUNT)
    write_case(machine, states, tmp_path)
    expected = lw.forward_dynamics(machine.model, *(states.q, states.v, states.tau))
    with python_worker(engine.name, memory=memory_limit()) as worker:
        built = worker.ask("build", str(tmp_path), timeout=FUSE)
        assert built["states"] == COUNT
        for offer in built["contestants"]:
            worker.ask("check", offer["method"], str(tmp_path / "a"), timeout=FUSE)
            found = np.fromfile(tmp_path / "a").reshape(expected.shape)
            np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)
            answer = worker.ask("time", offer["method"], "2", timeout=FUSE)
            assert answer["cpu"] > 0
            assert answer["seconds"] > 0


@pytest.mark.parametrize("engine", ENGINES, ids=lambda engine: engine.name)
def test_every_integrator_ends_in_the_same_place(engine, tmp_path):
    if not engine.installed:
        pytest.skip(f"{engine.package} is not installed")
    machine = random_chain(3)
    write_case(machine, random_states(machine, 1), tmp_path)
    end = lw.simulate(
        machine.model,
        times=[0.25],
        q0=random_states(machine, 1).q[0],
        v0=random_states(machine, 1).v[0],
        tolerance=1e-12,
    ).position.values[-1]
    with python_worker(engine.name, memory=memory_limit()) as worker:
        for simulator in worker.ask("build", str(tmp_path), timeout=FUSE)["simulators"]:
            setting = "1e-4" if simulator["fixed_step"] else "1e-10"
            lines = ("simulate", simulator["method"], "0.25", setting, str(tmp_path / "q"))
            worker.ask(*lines, timeout=FUSE)
            first_order = simulator["method"] == "semi_implicit_euler"
            error = np.abs(np.fromfile(tmp_path / "q") - end).max()
            assert error < (1e-2 if first_order else 1e-7), simulator["method"]


def test_a_case_folder_holds_the_machine(tmp_path):
    machine = MACHINES["tree"]
    states = random_states(machine, COUNT)
    write_case(machine, states, tmp_path)
    assert read_model(tmp_path).hash == machine.model.hash
    gravity, bodies = read_bodies(tmp_path)
    assert gravity == (0.0, 0.0, -9.81)
    for found, expected in zip(bodies, machine.bodies, strict=True):
        assert (found.parent, found.joint, found.mass) == (
            expected.parent,
            expected.joint,
            expected.mass,
        )
        np.testing.assert_array_equal(found.rotation, expected.rotation)
        np.testing.assert_array_equal(found.inertia, expected.inertia)
    again = States.read(tmp_path / "linkwise.states")
    np.testing.assert_array_equal(again.q, states.q)
    np.testing.assert_array_equal(again.tau, states.tau)


def program(text):
    """A worker that runs this Python text."""
    return Worker([sys.executable, "-c", text], memory=GIB)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("import os; os.abort()", "killed by SIGABRT"),
        ("import sys; sys.exit('the library is broken')", "the library is broken"),
        ("input(); raise SystemExit(3)", "ended with status 3"),
        ("import threading; threading.Event().wait()", "takes more than 0.5 s"),
        ('input(); print(\'{"error": "no such joint"}\')', "no such joint"),
        ('input(); print(\'{"error": "out of memory"}\')', "needs more than 1.0 GiB of memory"),
    ],
)
def test_why_a_worker_failed(text, reason):
    with program(text) as worker, pytest.raises(WorkerError) as failed:
        worker.ask("build", timeout=0.5 if "wait" in text else FUSE)
    assert str(failed.value) == reason


def test_memory_is_bounded(tmp_path):
    """An engine that wants more than it may have is told so, and the machine keeps the rest."""
    machine = random_chain(100)
    write_case(machine, random_states(machine, 4096), tmp_path)
    with python_worker("linkwise", memory=2**26) as worker:
        worker.ask("build", str(tmp_path), timeout=FUSE)
        with pytest.raises(WorkerError, match=r"needs more than 0\.1 GiB of memory"):
            worker.ask("time", "batch", "1", timeout=FUSE)
        assert not worker.alive  # what it had is free again


@pytest.mark.skipif(sys.platform != "linux", reason="limits of other processes are Linux's")
def test_what_is_allowed_can_be_less_than_at_the_start(tmp_path):
    machine = random_chain(100)
    write_case(machine, random_states(machine, 4096), tmp_path)
    with python_worker("linkwise", memory=2**31) as worker:
        worker.ask("build", str(tmp_path), timeout=FUSE)
        worker.ask("time", "auto", "1", timeout=FUSE)
        worker.allow(2**26)
        with pytest.raises(WorkerError, match=r"needs more than 0\.1 GiB of memory"):
            worker.ask("time", "batch", "1", timeout=FUSE)


def test_a_box_is_built_again_after_its_worker_died(tmp_path):
    machine = MACHINES["chain"]
    write_case(machine, random_states(machine, COUNT), tmp_path)
    with Workers(memory_limit(), None, QUICK, print) as workers:
        session = Session(workers, ENGINES[0], PYTHON, tmp_path)
        session.build()
        workers.worker(ENGINES[0], PYTHON).close()
        assert session.ask("time", "auto", "1", timeout=FUSE)["cpu"] > 0


def test_wrong_answers_are_not_timed():
    """Peers that are given another machine than ours have no time, but a reason."""
    pytest.importorskip("pinocchio")
    right = random_chain(5)
    heavier = dataclasses.replace(right.bodies[-1], mass=1.1)
    wrong = dataclasses.replace(right, bodies=(*right.bodies[:-1], heavier))
    with Workers(memory_limit(), None, QUICK, print) as workers:
        rows = race(workers, "single", wrong, states=4, wanted=lambda *_: True)
    assert any(row.measured for row in rows if row.engine == "linkwise")
    peers = [row for row in rows if row.engine == "pinocchio"]
    assert peers
    for row in peers:
        assert not row.measured
        assert "accelerations differ by" in row.failure
