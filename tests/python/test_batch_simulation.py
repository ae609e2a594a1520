"""lw.simulate_batch against lw.simulate, one member at a time."""

import numpy as np
import pytest

import linkwise as lw
from helpers.compare import assert_close
from helpers.random_trees import random_configuration
from linkwise import _core

QUANTITIES = (
    "position",
    "velocity",
    "acceleration",
    "joint_load",
    "drive_torque",
    "kinetic_energy",
    "potential_energy",
)
TIMES = np.linspace(0, 1, 5)
DRIVES = {
    "shoulder_yaw": lw.PD(kp=3000, kd=900, target=lw.Table(TIMES, 0.3 * TIMES, "cubic")),
    "elbow_pitch": lw.Torque(lw.Table(TIMES, 40 * TIMES)),
    "wrist_pitch": lw.Locked(),
    "wrist_yaw": lw.Motion(lw.Table(np.linspace(0, 1, 50), np.sin(np.linspace(0, 1, 50)), "cubic")),
    "wrist_roll": 2.0,
}


def machine():
    return lw.scenes.srms()


def alone(model, *, step, integrator="runge_kutta_4", **options):
    numerics = lw.Numerics(method="articulated_body", integrator=integrator, step=step)
    return lw.simulate(model, numerics=numerics, **options)


def assert_member(batch, run, tolerance):
    for name in QUANTITIES:
        assert_close(batch[name].values, run[name].values, tolerance, floor=1.0, what=name)


@pytest.mark.parametrize("integrator", ["runge_kutta_4", "semi_implicit_euler"])
@pytest.mark.parametrize("count", [1, 2, 5, 9])
def test_members_are_the_simulations_one_by_one(integrator, count, rng):
    model = machine()
    q0 = 0.4 * rng.standard_normal((count, model.nq))
    v0 = 0.1 * rng.standard_normal((count, model.nv))
    v0[:, model.v_slice("wrist_pitch")] = 0
    options = {
        "step": 2e-3,
        "duration": 0.5,
        "every": 0.1,
        "integrator": integrator,
        "drives": DRIVES,
        "wrenches": {model.child_link_names[-1]: lw.Wrench([1.0, 2, 3, 4, 5, 6])},
    }
    batch = lw.simulate_batch(model, q0=q0, v0=v0, **options)
    assert batch.sizes["member"] == count
    assert set(batch.outcome.values) == {"converged"}
    assert np.all(batch.stop_time == 0.5)
    for k in range(count):
        run = alone(model, q0=q0[k], v0=v0[k], **options)
        assert_member(batch.isel(member=k), run, 1e-8)
        assert batch.position.attrs == run.position.attrs


def test_every_joint_type_from_its_neutral_configuration(rng):
    builder = lw.ModelBuilder("all")
    builder.add_link("ground")
    types = ("revolute", "prismatic", "cylindrical", "universal", "spherical", "planar", "floating")
    for k, type_ in enumerate(types):
        parent = "ground" if k == 0 else types[k - 1]
        builder.add_link(type_, mass=1.0 + k, com=(0.1, 0.2, -0.3), inertia=0.2 * np.eye(3))
        axes = {"axes": [(1, 0, 0), (0, 1, 0)]} if type_ == "universal" else {}
        builder.add_joint(type_ + "_joint", type_, parent, type_, translation=(0, 0, -1.0), **axes)
    model = builder.build()
    q0 = np.array([random_configuration(model, rng) for _ in range(6)])
    options = {"step": 1e-3, "times": [0.0, 0.05, 0.1234]}
    batch = lw.simulate_batch(model, q0=q0, **options)
    for k in range(6):
        run = alone(model, q0=q0[k], **options)
        assert_member(batch.isel(member=k), run, 1e-8)


def test_axes_of_the_members(rng):
    """Leading axes broadcast; several models come first; the order is NumPy's."""
    light = machine()
    link = light.child_link_names[-1]
    models = [light.with_payload(link, mass=mass) for mass in (10.0, 500.0)]
    q0 = 0.3 * rng.standard_normal((3, 1, light.nq))
    tau = rng.standard_normal((4, light.nv))
    options = {"step": 5e-3, "duration": 0.1, "every": 0.05}
    batch = lw.simulate_batch(models, q0=q0, tau=tau, **options)
    assert dict(batch.sizes) | {"model": 2, "member_1": 3, "member_2": 4} == dict(batch.sizes)
    assert batch.joint_load.dims[:4] == ("model", "member_1", "member_2", "time")
    for at in ((0, 0, 0), (1, 2, 1), (0, 1, 3)):
        run = alone(
            models[at[0]],
            q0=q0[at[1], 0],
            drives=dict(zip(light.joint_names, tau[at[2]], strict=True)),
            **options,
        )
        member = batch.isel(dict(zip(("model", "member_1", "member_2"), at, strict=True)))
        assert_member(member, run, 1e-8)
    single = lw.simulate_batch(light, **options)
    assert "member" not in single.dims
    assert lw.simulate_batch([light], **options).sizes["model"] == 1


def test_a_member_that_fails_ends_alone():
    model = lw.scenes.chain(2, gravity=(0, 0, 0))
    q0 = np.zeros((9, 2))
    q0[4] = 0.1  # off the target of a spring that is too stiff for the step
    stiff = dict.fromkeys(model.joint_names, lw.Spring(1e8))
    batch = lw.simulate_batch(
        model, q0=q0, drives=stiff, step=0.1, duration=50, every=0.1, record=["position"]
    )
    assert batch.outcome.values.tolist() == [
        "not_finite" if k == 4 else "converged" for k in range(9)
    ]
    assert batch.attrs["outcome"] == "1 of 9 members ended early"
    assert np.all(batch.position.sel(member=[0, 3, 5, 8]) == 0)
    failed = batch.isel(member=4)
    before = failed.time <= failed.stop_time + 1e-12
    assert 0 < float(failed.stop_time) < 50
    assert np.isfinite(failed.position.where(before, drop=True)).all()
    assert np.isnan(failed.position.where(~before, drop=True)).all()


def test_only_what_is_asked_for_is_recorded():
    options = {"step": 1e-2, "duration": 0.1, "record": ["joint_load", "energy"]}
    batch = lw.simulate_batch(machine(), **options, extremes=False)
    assert set(batch.data_vars) == {"joint_load", "kinetic_energy", "potential_energy"}
    kept = {"extreme_quantity", "extreme_joint_load", "extreme_wrench"}
    assert set(lw.simulate_batch(machine(), **options).data_vars) == set(batch.data_vars) | kept
    assert list(lw.simulate_batch(machine(), step=1e-2, duration=0.1, record=["position"])) == [
        "position"
    ]


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"q0": np.zeros((4, 5))}, r"q0: expected shape \(..., 6\), given shape \(4, 5\)"),
        (
            {"q0": np.zeros((4, 6)), "v0": np.zeros((3, 6))},
            r"the leading axes do not broadcast: q0 \(4, 6\), v0 \(3, 6\); make them equal or 1",
        ),
        ({"q0": np.full((2, 6), np.nan)}, r"q0: expected finite numbers, q0\[0, 0\] is nan"),
        ({"tau": "x"}, "tau holds text"),
        ({"step": 0}, "step: 0 given; give a finite number above 0"),
        (
            {"integrator": "adams"},
            "takes runge_kutta_4 or semi_implicit_euler, not 'adams'",
        ),
        (
            {"integrator": "euler"},
            "takes runge_kutta_4 or semi_implicit_euler, not 'euler'",
        ),
        ({"record": ["statistics"]}, "record: a batch has no 'statistics'; use position"),
        (
            {"drives": {"elbow_pitch": lambda t, q, v: 0.0}},
            r"drives\['elbow_pitch'\] is a function",
        ),
        ({"drives": {"elbow": 1.0}}, "elbow"),
        ({"wrenches": {"link_6": lambda t: np.zeros(6)}}, "a function is given; a batch takes"),
        ({"threads": 0}, "threads: 0 given; give a whole number of at least 1"),
        ({"threads": 100_000}, "threads is 100000; give a whole number from 1 to"),
        ({"duration": None}, "duration: missing"),
        (
            {"drives": {"elbow_pitch": lw.Locked()}, "v0": np.ones(6)},
            "joint 'elbow_pitch'.* is locked but starts with a rate; start it at rest",
        ),
        ({"model": []}, "model: give a Model, or a sequence of at least one"),
        ({"model": [lw.scenes.srms(), lw.scenes.chain(6)]}, r"model\[1\] has other joints than"),
    ],
)
def test_bad_input(changed, message):
    given = {"model": machine(), "step": 1e-2, "duration": 0.1} | changed
    if "wrenches" in given:
        given["wrenches"] = {machine().child_link_names[-1]: given["wrenches"]["link_6"]}
    with pytest.raises(lw.InputError, match=message):
        lw.simulate_batch(given.pop("model"), **given)


def test_members_that_simulations_cannot_share_evenly():
    model = lw.scenes.chain(2)
    simulations = [_core.Simulation(model, integrator="runge_kutta_4", step=1e-3) for _ in range(2)]
    rows = np.zeros((3, model.nv))
    with pytest.raises(lw.InputError, match="q0 has 3 rows for 2 simulations; give"):
        _core.simulate_members(
            simulations, q0=rows, v0=rows, tau=None, times=[0.0], quantities=["position"]
        )
