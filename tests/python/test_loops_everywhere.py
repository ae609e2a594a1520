"""Every public function with machines whose joints close loops or are coupled: a number that can be
checked, or one line that says why not. A function that is missing here has forgotten them."""

import numpy as np
import pytest
from test_loops import four_bar, rates

import linkwise as lw
from helpers.machines import rod_chain
from linkwise.compare import compare, free_trajectory


class _Machine:
    """A model, the tree that its loops and couplings constrain, and a state that they allow."""

    def __init__(self, model, tree, q, v, driven):
        self.model, self.tree, self.q, self.v, self.driven = model, tree, q, v, driven
        self.a = lw.forward_dynamics(model, q, v)


def _four_bar():
    model = four_bar("c")
    q = np.zeros(3)
    return _Machine(model, _without_loop(), q, rates(model, 1.5)[0], ["a"])


def _without_loop():
    """The four-bar's tree: its loop is a joint that holds nothing."""
    from linkwise import ModelBuilder

    original, builder = four_bar("c"), ModelBuilder("open", gravity=(0, -9.81, 0))
    for k, name in enumerate(original.link_names):
        builder.add_link(
            name,
            mass=original.link_masses[k],
            com=original.link_centers_of_mass[k],
            inertia=original.link_inertias[k],
        )
    places = lw.joint_poses(original, np.zeros(3))
    links = dict(zip(original.link_names, lw.link_poses(original, np.zeros(3)), strict=True))
    for k, name in enumerate(original.joint_names):
        at = np.linalg.inv(links[original.parent_link_names[k]]) @ places[k]
        builder.add_joint(
            name,
            "revolute",
            original.parent_link_names[k],
            original.child_link_names[k],
            translation=at[:3, 3],
            axis=(0, 0, 1),
        )
    return builder.build()


def _geared():
    tree = rod_chain(3)
    first, second, third = tree.joint_names
    model = tree.with_coupling("gear", {first: 1.0, third: -2.0})
    return _Machine(model, tree, np.zeros(3), np.array([2.0, 0.3, 1.0]), [first, second])


MACHINES = {"four-bar": _four_bar, "geared": _geared}


@pytest.fixture(scope="module", params=list(MACHINES))
def machine(request):
    return MACHINES[request.param]()


@pytest.fixture(scope="module")
def runs(machine):
    options = {"q0": machine.q, "v0": machine.v, "duration": 0.2, "every": 0.02}
    return [lw.simulate(machine.model, tolerance=t, **options) for t in (1e-6, 1e-8)]


#: What depends on positions, rates and accelerations alone is that of the tree.
OF_MOTION = {
    "body_jacobian": lambda m, of: lw.body_jacobian(of, m.q, of.child_link_names[-1]),
    "external_wrenches": lambda m, of: lw.external_wrenches(
        of, m.q, {of.child_link_names[0]: [1.0, 2, 3, 4, 5, 6]}
    ),
    "frame_acceleration": lambda m, of: lw.frame_acceleration(
        of, m.q, m.v, m.a, of.child_link_names[-1]
    ),
    "frame_jacobian": lambda m, of: lw.frame_jacobian(of, m.q, of.child_link_names[-1]),
    "frame_pose": lambda m, of: lw.frame_pose(of, m.q, of.child_link_names[-1]),
    "frame_velocity": lambda m, of: lw.frame_velocity(of, m.q, m.v, of.child_link_names[-1]),
    "joint_poses": lambda m, of: lw.joint_poses(of, m.q),
    "kinetic_energy": lambda m, of: lw.kinetic_energy(of, m.q, m.v),
    "link_poses": lambda m, of: lw.link_poses(of, m.q),
    "mass_matrix": lambda m, of: lw.mass_matrix(of, m.q),
    "momentum": lambda m, of: lw.momentum(of, m.q, m.v),
    "passive_torque": lambda m, of: lw.passive_torque(of, m.q, m.v),
    "potential_energy": lambda m, of: lw.potential_energy(of, m.q),
}


@pytest.mark.parametrize("name", OF_MOTION)
def test_what_depends_on_motion_alone_is_the_trees(name, machine):
    got, want = (OF_MOTION[name](machine, of) for of in (machine.model, machine.tree))
    np.testing.assert_allclose(got, want, rtol=0, atol=1e-12 * (1 + np.abs(want).max()))


def _assemble(m):
    found = lw.assemble(m.model, m.q, m.v)
    np.testing.assert_allclose([found.q, found.v], [m.q, m.v], atol=1e-12)


def _gaps(m):
    np.testing.assert_allclose(lw.loop_gaps(m.model, m.q), 0, atol=1e-12)


def _undecided_loads(m):
    told = lw.undecided_loads(m.model, m.q)
    open_rows = len(lw.indeterminacy(m.model, m.q).undecided)
    assert sum(one.self_stresses for one in told) == open_rows


def _indeterminacy(m):
    found = lw.indeterminacy(m.model, m.q)
    assert found.mobility == len(m.driven)
    assert found.determinate.shape == (m.model.n_joints + m.model.n_loops, 6)


def _inverse(m):
    tau = lw.inverse_dynamics(m.model, m.q, m.v, m.a, driven=m.driven)
    np.testing.assert_allclose(tau, 0, atol=1e-10)
    loads = lw.inverse_dynamics_loads(m.model, m.q, m.v, m.a, driven=m.driven)
    np.testing.assert_allclose(loads, lw.joint_loads(m.model, m.q, m.v), atol=1e-9)


def _causes(m):
    shares = lw.joint_loads_by_cause(m.model, ["gravity", "velocity"], m.q, m.v)
    np.testing.assert_allclose(shares.sum(axis=0), lw.joint_loads(m.model, m.q, m.v), atol=1e-10)


def _energy(m):
    """No force of a loop or coupling works: gravity alone changes the kinetic energy."""
    step = 1e-6
    ahead = lw.potential_energy(m.tree, m.q + step * m.v)
    behind = lw.potential_energy(m.tree, m.q - step * m.v)
    H, bias = lw.mass_matrix(m.tree, m.q), lw.inverse_dynamics(m.tree, m.q, m.v, None, gravity=0.0)
    assert m.v @ (H @ m.a + bias) == pytest.approx((behind - ahead) / (2 * step), rel=1e-6)


def _batch(m):
    batch = lw.simulate_batch(
        m.model, q0=np.tile(m.q, (2, 1)), v0=np.tile(m.v, (2, 1)), duration=0.1, step=0.01
    )
    position = batch["position"].transpose("member", "time", ...).values
    np.testing.assert_array_equal(position[0], position[1])
    assert np.abs(position[0, -1] - position[0, 0]).max() > 1e-3


OF_STATES = {
    "assemble": _assemble,
    "forward_dynamics": _energy,
    "indeterminacy": _indeterminacy,
    "undecided_loads": _undecided_loads,
    "inverse_dynamics": _inverse,
    "inverse_dynamics_loads": _inverse,
    "joint_loads": _causes,
    "joint_loads_by_cause": _causes,
    "loop_gaps": _gaps,
    "simulate_batch": _batch,
}


@pytest.mark.parametrize("name", OF_STATES)
def test_functions_of_states(name, machine):
    OF_STATES[name](machine)


#: Functions of files, which the tests of files run with loops, and those that are made for loops.
ELSEWHERE = {"load", "load_scenario", "open_run", "run_scenario", "sweep", "simulate"}
ELSEWHERE |= {"driven_jacobian", "loop_accelerations", "loop_coordinates"}
TABLES = {"initial_guesses", "integrators", "methods", "numerics", "quantities", "solver_options"}
TABLES |= {"solvers", "stop_rules"}


def test_no_public_function_is_missing():
    functions = {
        name
        for name in lw.__all__
        if callable(getattr(lw, name)) and not isinstance(getattr(lw, name), type)
    }
    assert functions <= {*OF_MOTION, *OF_STATES, *ELSEWHERE, *TABLES}
    named = {name for name in lw.loads.__all__ if name.islower() and name != "margins"}
    inside = {name for name in named if name.startswith("section_")}  # elastic links take no loops
    assert named - inside == {*OF_RUNS, *OF_ONE}


OF_RUNS = {
    "bounds": lambda run, tighter: lw.loads.bounds(run, tighter),
    "damage_equivalent": lambda run, _: lw.loads.damage_equivalent(run),
    "energy_balance": lambda run, _: lw.loads.energy_balance(run),
    "envelope": lambda run, _: lw.loads.envelope(run),
    "in_frame": lambda run, _: lw.loads.in_frame(run, "world"),
    "peak_loads": lambda run, _: lw.loads.peak_loads(run),
    "quantities": lambda run, _: lw.loads.quantities(run),
    "split": lambda run, _: lw.loads.split(run),
    "split_at_peaks": lambda run, _: lw.loads.split_at_peaks(run),
    "summary": lambda run, _: lw.loads.summary(run),
}


OF_ONE = {
    "cycles": lambda run, joint: lw.loads.cycles(run, joint, "force")["range"],
    "load_duration": lambda run, joint: lw.loads.load_duration(run, joint, "force"),
    "spectrum": lambda run, joint: lw.loads.spectrum(run, joint, "force"),
}


@pytest.mark.parametrize("name", OF_ONE)
def test_functions_of_a_joint_take_loop_joints(name, runs):
    """The last joint that has a load, of the four-bar the one that closes its loop."""
    found = OF_ONE[name](runs[0], str(runs[0].dataset["joint"].values[-1]))
    assert np.isfinite(found.values).any()


@pytest.mark.parametrize("name", OF_RUNS)
def test_functions_of_runs_have_all_joints(name, machine, runs):
    found = OF_RUNS[name](*runs)
    if name == "energy_balance":
        residual = np.abs(found["residual"].values).max()
        assert residual < 1e-4 * np.abs(found["kinetic_energy"].values).max()
        return
    names = [*machine.model.joint_names, *machine.model.loop_names]
    assert found["joint"].values.tolist() == names


def test_systems_of_constraint_forces_take_trees_alone(machine):
    with pytest.raises(lw.InputError, match=r"A f = b of a tree takes none"):
        lw.ConstraintSystem(machine.model, machine.q)


def test_methods_are_compared_and_say_what_they_do_not_take(machine):
    trajectory = free_trajectory(machine.model, 3, seed=1)
    found = compare(machine.model, trajectory, time_limit=600.0)
    outcomes = {row["method"]: row for row in found["rows"]}
    assert outcomes.keys() == {entry["name"] for entry in lw.methods()}
    for row in found["rows"]:
        if row["method"] == "articulated_body" or row["solver"] in ("thomas", "conjugate_gradient"):
            assert row["outcome"] == "converged"
            assert row["error"] < 1e-8
        else:
            assert row["outcome"] == "does not apply"
            cure = "use solver thomas" if row["solver"] else "use method articulated_body"
            assert cure in row["message"]
