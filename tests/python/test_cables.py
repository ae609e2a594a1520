"""Elastic cables and nets: against the elastic catenary, beams in a row, and what holds them."""

import numpy as np
import pytest
from scipy.optimize import brentq
from test_flexible_links import accelerations
from test_flexible_loops import allowed_rates

import linkwise as lw

LENGTH, SPAN, EA, MU, G = 100.0, 95.0, 2e4, 0.35, 9.81


def turned(vector):
    """Quaternion x, y, z, w of a rotation vector."""
    angle = np.linalg.norm(vector)
    return np.r_[np.asarray(vector) / 2 * np.sinc(angle / 2 / np.pi), np.cos(angle / 2)]


def moved(model, q, by):
    """q moved along rates."""
    out = np.array(q)
    for name in model.joint_names:
        at, rates = model.q_slice(name), model.v_slice(name)
        if at.stop - at.start == 4:
            (x, y, z, w), (X, Y, Z, W) = out[at], turned(by[rates])
            out[at] = [
                w * X + x * W + y * Z - z * Y,
                w * Y - x * Z + y * W + z * X,
                w * Z + x * Y - y * X + z * W,
                w * W - x * X - y * Y - z * Z,
            ]
        else:
            out[at] += by[rates]
    return out


def pull_of_catenary():
    """Horizontal force between two anchors at one height [irvine1981]."""
    w = MU * G
    return brentq(
        lambda H: H * LENGTH / EA + 2 * H / w * np.arcsinh(w * LENGTH / 2 / H) - SPAN, 1.0, 1e5
    )


def along_catenary(model, n, pull):
    """Each beam stretched and bent as the catenary is there."""
    s = np.linspace(-LENGTH / 2, LENGTH / 2, n + 1)
    slope = -np.arctan2(MU * G * s, pull)
    q = model.initial_configuration()
    own = model.q_slice("tether:1")
    columns, step, length = [], 1e-4, LENGTH / n
    for k in range(own.start, own.stop):
        bent = np.array(q)
        bent[k] += step
        X = lw.frame_pose(model, bent, "tether:2")
        columns.append([X[0, 3] - length, X[2, 3], X[0, 2]])
    for i in range(n):
        turn = slope[i + 1] - slope[i]
        tension = np.hypot(pull, MU * G * (s[i] + s[i + 1]) / 2)
        wanted = [tension * length / EA, -length * turn / 2, turn]
        found = np.linalg.lstsq(np.array(columns).T / step, wanted, rcond=1e-10)[0]
        q[model.q_slice(f"tether:{i + 1}")] = found
    q[model.q_slice("start")] = turned([0, slope[0], 0])
    return q


def hanging(n):
    """Closed, and the position in which it stands: Newton on the machine without its loop."""
    given = {"length": LENGTH, "EA": EA, "EI": 0.5, "GJ": 0.5, "mass_per_length": MU}
    model = lw.scenes.tether(n, held="both", span=SPAN, **given)
    free = lw.scenes.tether(n, held="start", **given)
    pull = pull_of_catenary()
    q, f = along_catenary(free, n, pull), np.array([pull, 0, MU * G * LENGTH / 2])
    step = 1e-6

    def missing(q):
        still = np.zeros((*q.shape[:-1], free.nv))
        held = lw.inverse_dynamics(free, q, still, still) - lw.passive_torque(free, q, still)
        return held - lw.frame_jacobian(free, q, "tether:end")[..., :3, :].swapaxes(-1, -2) @ f

    for _ in range(15):
        K = lw.frame_jacobian(free, q, "tether:end")[:3]
        ends = [
            np.array([moved(free, q, way * e) for e in np.eye(free.nv)]) for way in (step, -step)
        ]
        slope = (missing(ends[0]) - missing(ends[1])).T / (2 * step)
        gap = lw.frame_pose(free, q, "tether:end")[:3, 3] - [SPAN, 0, 0]
        full = np.block([[slope, -K.T], [K, np.zeros((3, 3))]])
        by = np.linalg.lstsq(full, -np.r_[missing(q), gap], rcond=1e-14)[0]
        q, f = moved(free, q, by[:-3]), f + by[-3:]
        if np.abs(by[:-3]).max() < 1e-9:
            return model, q
    raise AssertionError("no position of rest")


def test_a_cable_between_two_anchors_hangs_as_the_elastic_catenary():
    pull, w = pull_of_catenary(), MU * G
    sag = w * (LENGTH / 2) ** 2 / (2 * EA) + pull / w * (np.hypot(1, w * LENGTH / 2 / pull) - 1)
    errors = []
    for n in (10, 20):
        model, q = hanging(n)
        rest = np.zeros(model.nv)
        assert np.abs(lw.forward_dynamics(model, q, rest, passive=True)).max() < 1e-7
        loads = lw.joint_loads(model, q, rest, lw.passive_torque(model, q, rest))
        tension = np.linalg.norm(loads[[0, -1], :3], axis=1)
        errors.append(np.abs(tension / np.hypot(pull, w * LENGTH / 2) - 1).max())
        lowest = lw.frame_pose(model, q, f"tether:{n // 2 + 1}")[2, 3]
        assert lowest == pytest.approx(-sag, rel=1 / n**2.5)
        assert lw.indeterminacy(model, q).rank == 3
    assert errors[0] < 1e-4
    assert errors[1] < 0.15 * errors[0]


@pytest.mark.parametrize("joint", ["weld", "spherical"])
def test_a_taut_cable_vibrates_as_a_string(joint):
    n, length, pull, mu = 12, 10.0, 400.0, 0.1
    stretched = length * (1 + pull / 1e5)
    model = lw.scenes.tether(
        n,
        length=length,
        EA=1e5,
        EI=1e-2,
        GJ=1e-2,
        mass_per_length=mu,
        joint=joint,
        held="both",
        span=stretched,
        gravity=(0, 0, 0),
    )
    q, rest = model.initial_configuration(), np.zeros(model.nv)
    for k, name in enumerate([name for name in model.joint_names if ":" in name]):
        q[model.q_slice(name).start] = (stretched - length) / n
        assert k < n
    loads = lw.joint_loads(model, q, rest, lw.passive_torque(model, q, rest))
    assert np.abs(loads[[0, -1], 0]) == pytest.approx(pull, rel=1e-9)
    N, step = allowed_rates(model, q), 1e-6
    slope = [
        (
            accelerations(model, moved(model, q, step * e), rest)
            - accelerations(model, moved(model, q, -step * e), rest)
        )
        / (2 * step)
        for e in N.T
    ]
    omega = np.sqrt(np.abs(np.linalg.eigvals(N.T @ -np.array(slope).T).real))
    # One in each plane; cables turn freely about themselves.
    lowest = np.sort(omega[omega > 1.0])[:4]
    wave = np.sqrt(pull * stretched / (mu * length))
    string = np.pi / stretched * wave * np.array([1, 1, 2, 2])
    assert lowest == pytest.approx(string, rel=2e-3)


@pytest.mark.parametrize("joint", ["spherical", "weld"])
def test_a_net_is_held_at_its_corners(joint):
    model = lw.scenes.net(4, 3, joint=joint, spacing=0.5)
    q, rest = model.initial_configuration(), np.zeros(model.nv)
    cords = 3 * 3 + 4 * 2
    assert model.n_loops == (cords - 11) + 3
    mass = 12 * 0.01 + cords * 0.02 * 0.5
    assert model.total_mass == pytest.approx(mass)
    for name, at in (("knot_0_0", (0, 0, 0)), ("knot_3_2", (1.5, 1, 0)), ("y_3_1", (1.5, 0.5, 0))):
        assert lw.frame_pose(model, q, name)[:3, 3] == pytest.approx(at, abs=1e-15)
    du = lw.forward_dynamics(model, q, rest, passive=True)
    for corner in ("knot_0_0", "knot_3_0", "knot_0_2", "knot_3_2"):
        a = lw.frame_acceleration(model, q, rest, du, corner)
        assert a[:3] == pytest.approx(0, abs=1e-9)
    run = lw.simulate(model, duration=0.05, every=0.01, tolerance=1e-7)
    energy = (run.kinetic_energy + run.potential_energy).values
    assert np.abs(energy - energy[0]).max() < 1e-5 * mass * 9.81


def test_what_floats_falls():
    for model in (lw.scenes.tether(5, held="none"), lw.scenes.net(3, 3, held="none")):
        rest = np.zeros(model.nv)
        du = lw.forward_dynamics(model, model.initial_configuration(), rest, passive=True)
        want = np.zeros(model.nv)
        want[2] = -9.81
        assert du == pytest.approx(want, abs=1e-8)


def test_a_welded_cable_is_a_flexible_link_of_many_beams():
    model = lw.scenes.tether(3, held="start")
    assert list(model.joint_names) == ["start", "tether:1", "tether:2", "tether:3"]
    assert model.nv == 3 + 3 * 6


@pytest.mark.parametrize(
    ("scene", "given", "message"),
    [
        ("tether", {"n_elements": 0}, "n_elements is 0; give a whole number of at least 1"),
        ("tether", {"EA": -1.0}, "EA is -1.0; give a number above 0"),
        ("tether", {"length": 0.0}, "length is 0.0; give a number above 0"),
        ("tether", {"held": "end"}, "held 'end' is unknown; known: start, both, none"),
        ("tether", {"joint": "pin"}, "joint 'pin' is unknown; known: weld, spherical"),
        ("tether", {"span": 3.0}, "span is the distance of two held ends, and held is 'start'"),
        ("net", {"nx": 1}, "nx is 1; give at least 2 knots each way"),
        ("net", {"damping": -1}, "damping is -1; give a number of at least 0"),
        ("net", {"held": "edges"}, "held 'edges' is unknown; known: corners, none"),
    ],
)
def test_wrong_arguments_are_named(scene, given, message):
    with pytest.raises(lw.InputError) as error:
        getattr(lw.scenes, scene)(**given)
    assert message in str(error.value)
