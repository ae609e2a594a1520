"""Hinge chains that are held in few places, which go by pieces, against the equations of motion of
the open chain with the forces of what holds it as unknowns, in one dense system."""

from __future__ import annotations

import numpy as np
import pytest

import linkwise as lw

N = 90
POINT = np.array([0.4, 0.0, 0.05])  # of a link, where it is held
AXES = np.random.default_rng(7).normal(size=(N, 3))


def chain(planar: bool = False, hold=()) -> lw.Model:
    """hold: (link, another link or "ground", point there, type of the joint, properties)."""
    builder = lw.ModelBuilder("line", gravity=(0.3, 0.2, -9.81))
    builder.add_link("ground")
    for k in range(N):
        builder.add_link(
            f"rod_{k}", mass=1 + k % 3, com=(0.2, 0.02, 0), inertia=np.diag([0.01, 0.03, 0.04])
        )
        axis = (0, 1, 0) if planar else AXES[k]
        parent, at = (f"rod_{k - 1}", POINT) if k else ("ground", (0, 0, 0))
        builder.add_joint(f"J{k}", "revolute", parent, f"rod_{k}", translation=at, axis=axis)
    for k, (link, other, point, joint, properties) in enumerate(hold):
        builder.add_loop(
            f"hold_{k}",
            joint,
            f"rod_{link}",
            other,
            translation=POINT,
            child_translation=point,
            **properties,
        )
    return builder.build()


def random_state(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-0.5, 0.5, N), rng.normal(size=N), rng.normal(size=N)


class Held:
    """Balls that hold links where they are, to the ground or to each other."""

    def __init__(self, pairs, *, planar=False, seed=1, **properties):
        self.open = chain(planar)
        self.q, v, self.tau = random_state(seed)
        frames = [lw.Frame(f"rod_{k}", POINT) for k, _ in pairs]
        poses = [lw.frame_pose(self.open, self.q, f) for f in frames]
        others, hold = [], []
        for (link, other), pose in zip(pairs, poses, strict=True):
            point = pose[:3, 3]
            if other is not None:
                base = lw.frame_pose(self.open, self.q, lw.Frame(f"rod_{other}"))
                point = base[:3, :3].T @ (point - base[:3, 3])
            name = "ground" if other is None else f"rod_{other}"
            others.append(None if other is None else lw.Frame(name, point))
            hold.append((link, name, point, "spherical", properties))
        self.model = chain(planar, hold)
        self.pairs = list(zip(frames, others, strict=True))
        J = self.rows()
        self.v = v - np.linalg.pinv(J) @ (J @ v)

    def rows(self) -> np.ndarray:
        """What holds, times rates: linear parts of frame velocities."""
        rows = []
        for own, other in self.pairs:
            J = lw.frame_jacobian(self.open, self.q, own)[:3]
            if other is not None:
                J = J - lw.frame_jacobian(self.open, self.q, other)[:3]
            rows.append(J)
        return np.concatenate(rows)

    def bent(self) -> np.ndarray:
        """What accelerates while the joints do not."""
        rows = []
        for own, other in self.pairs:
            a = lw.frame_acceleration(self.open, self.q, self.v, np.zeros(N), own)[:3]
            if other is not None:
                a = a - lw.frame_acceleration(self.open, self.q, self.v, np.zeros(N), other)[:3]
            rows.append(a)
        return np.concatenate(rows)

    def dense(self) -> np.ndarray:
        H = lw.mass_matrix(self.open, self.q)
        J = self.rows()
        rest = self.tau - lw.inverse_dynamics(self.open, self.q, self.v, np.zeros(N))
        free = np.linalg.solve(H, rest)
        A = J @ np.linalg.solve(H, J.T)
        f = np.linalg.lstsq(A, -self.bent() - J @ free, rcond=1e-11)[0]
        return free + np.linalg.solve(H, J.T @ f)


PLACES = {
    "end": [(N - 1, None)],
    "middle": [(N // 2, None)],
    "end and middle": [(N - 1, None), (40, None)],
    "end to a link": [(N - 1, 20)],
    "twice": [(N - 1, None), (N - 1, None)],
    "figure of eight": [(N - 1, 45), (44, None)],
}


@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize("where", PLACES)
def test_accelerations_are_those_of_a_dense_system(where, planar):
    held = Held(PLACES[where], planar=planar)
    by = {
        method: lw.forward_dynamics(held.model, held.q, held.v, held.tau, full=True, method=method)
        for method in ("piecewise", "articulated_body")
    }
    got, twin = by.values()
    assert got.report.outcome == "converged"
    want = held.dense()
    assert np.abs(got.acceleration - want).max() < 1e-9 * np.abs(want).max()
    # Loads, too, are those of the recursion that carries unit forces along the loops.
    largest = np.abs(twin.acceleration).max()
    assert np.abs(got.acceleration - twin.acceleration).max() < 1e-10 * largest
    largest = np.abs(twin.joint_load).max()
    assert np.abs(got.joint_load - twin.joint_load).max() < 1e-10 * largest


def test_auto_takes_pieces_and_says_why():
    held = Held(PLACES["end"])
    method = lw.DynamicsMethod(held.model)
    assert method.method == "piecewise"
    report = lw.forward_dynamics(held.model, held.q, held.v, full=True).report
    assert report.method == "piecewise"
    assert "its pieces fill the SIMD lanes, and the loops close where pieces end" in report.reason


def test_damping_of_what_holds_acts():
    """An anchor that damps turns, whose rates the method finds on its way."""
    held = Held(PLACES["end"], damping=0.2)
    by = [
        lw.forward_dynamics(held.model, held.q, held.v, passive=True, method=method)
        for method in ("piecewise", "articulated_body")
    ]
    assert np.abs(by[0] - by[1]).max() < 1e-10 * np.abs(by[1]).max()
    without = lw.forward_dynamics(held.model, held.q, held.v, method="piecewise")
    assert np.abs(by[0] - without).max() > 1e-6 * np.abs(by[1]).max()


def test_states_that_leave_the_line_open_are_refused():
    held = Held(PLACES["end"])
    q = held.q.copy()
    q[3] += 1e-3
    with pytest.raises(lw.InputError, match=r"hold_0.*is open"):
        lw.forward_dynamics(held.model, q, held.v)
    v = held.v.copy()
    v[3] += 1e-3
    with pytest.raises(lw.InputError, match=r"hold_0.*opens"):
        lw.DynamicsMethod(held.model).evaluate(0.0, held.q, v)
    with pytest.raises(lw.InputError, match=r"state 1: .*hold_0"):
        lw.forward_dynamics(held.model, np.stack([held.q, q]), np.zeros((2, N)))


def test_batches_and_threads_give_the_same_bits():
    held = Held(PLACES["end and middle"])
    rng = np.random.default_rng(3)
    tau = rng.normal(size=(5, N))
    q, v = np.tile(held.q, (5, 1)), np.tile(held.v, (5, 1))
    one = [lw.forward_dynamics(held.model, held.q, held.v, t, full=True) for t in tau]
    for threads in (1, 2, 3):
        all_of_them = lw.forward_dynamics(held.model, q, v, tau, full=True, threads=threads)
        for k in range(5):
            assert np.array_equal(all_of_them.acceleration[k], one[k].acceleration)
            assert np.array_equal(all_of_them.joint_load[k], one[k].joint_load)


def test_shares_of_causes_add_up():
    held = Held(PLACES["end"])
    causes = ["gravity", "velocity", "drive"]
    shares = lw.joint_loads_by_cause(held.model, causes, held.q, held.v, held.tau)
    loads = lw.joint_loads(held.model, held.q, held.v, held.tau)
    assert np.abs(shares.sum(axis=0) - loads).max() < 1e-9 * np.abs(loads).max()


def test_a_line_swings_without_losing_energy():
    held = Held(PLACES["end"], planar=True)
    run = lw.simulate(held.model, duration=0.3, every=0.05, q0=held.q, tolerance=1e-9)
    q, v = run.position.values, run.velocity.values
    energy = lw.kinetic_energy(held.model, q, v) + lw.potential_energy(held.model, q)
    exchanged = np.ptp(lw.kinetic_energy(held.model, q, v))
    assert exchanged > 1
    assert np.ptp(energy) < 1e-6 * exchanged
    assert np.abs(lw.loop_gaps(held.model, q[-1])).max() < 1e-8
