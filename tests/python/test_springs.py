"""Springs and dampers between two points: closed forms, MuJoCo's tendons, Newton and Euler."""

import mujoco
import numpy as np
import pytest

import linkwise as lw

ARMS = """
<mujoco>
  <option gravity="0.3 -0.2 -9.81"/>
  <worldbody>
    <site name="ground" pos="0.5 0.1 0.6"/>
    <body name="upper" pos="0 0 1">
      <joint name="shoulder" type="hinge" axis="0 1 0.2"/>
      <inertial pos="0.2 0.05 0" mass="1.5" diaginertia="0.02 0.03 0.04"/>
      <site name="upper_tip" pos="0.1 -0.1 0.2"/>
      <body name="lower" pos="0.5 0 0">
        <joint name="elbow" type="ball"/>
        <inertial pos="0.3 0 0.1" mass="0.8" diaginertia="0.03 0.02 0.01"/>
        <site name="lower_tip" pos="0.4 0.1 0"/>
      </body>
    </body>
  </worldbody>
  {tendons}
</mujoco>
"""
TENDONS = """
  <tendon>
    <spatial name="inner" springlength="0.25" stiffness="300" damping="7">
      <site site="upper_tip"/><site site="lower_tip"/>
    </spatial>
    <spatial name="outer" springlength="0" stiffness="120" damping="3">
      <site site="ground"/><site site="lower_tip"/>
    </spatial>
  </tendon>
"""


@pytest.fixture
def arms(tmp_path):
    path = tmp_path / "arms.xml"
    path.write_text(ARMS.format(tendons=""))
    model = lw.load(path)
    model = model.with_spring(
        "inner",
        "upper",
        "lower",
        length=0.25,
        point=(0.1, -0.1, 0.2),
        child_point=(0.4, 0.1, 0),
        stiffness=300,
        damping=7,
    )
    return model.with_spring(
        "outer",
        model.link_names[0],
        "lower",
        length=0.0,
        point=(0.5, 0.1, 0.6),
        child_point=(0.4, 0.1, 0),
        stiffness=120,
        damping=3,
    )


def random_state(model, seed):
    rng = np.random.default_rng(seed)
    q = np.concatenate([rng.uniform(-2, 2, 1), rng.normal(size=4)])
    q[1:] /= np.linalg.norm(q[1:])
    return q, rng.normal(size=model.nv)


def test_mujoco_s_tendons(arms):
    theirs = mujoco.MjModel.from_xml_string(ARMS.format(tendons=TENDONS))
    data = mujoco.MjData(theirs)
    names = [*arms.joint_names, *arms.loop_names]
    for seed in range(20):
        q, v = random_state(arms, seed)
        data.qpos[:] = [q[0], q[4], *q[1:4]]
        data.qvel[:] = v
        mujoco.mj_forward(theirs, data)
        got = lw.forward_dynamics(arms, q, v, passive=True)
        np.testing.assert_allclose(got, data.qacc, rtol=1e-9, atol=1e-9)
        loads = dict(zip(names, lw.joint_loads(arms, q, v, passive=True), strict=True))
        for tendon, name in enumerate(("inner", "outer")):
            want = -theirs.tendon_stiffness[tendon] * (
                data.ten_length[tendon] - theirs.tendon_lengthspring[tendon, 0]
            ) - (theirs.tendon_damping[tendon] * data.ten_velocity[tendon])
            assert np.linalg.norm(loads[name][:3]) == pytest.approx(abs(want), rel=1e-9)
            np.testing.assert_array_equal(loads[name][3:], 0)


def test_the_load_is_what_the_parent_does_to_the_child():
    """A mass below the ground on a stretched spring, in axes that are turned on the child."""
    builder = lw.ModelBuilder("hanging")
    builder.add_link("ground")
    builder.add_link("mass", mass=2.0, inertia=np.eye(3))
    turned = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    builder.add_joint("free", "floating", "ground", "mass", rotation=turned)
    builder.add_spring("spring", "ground", "mass", length=0.3, stiffness=50)
    model = builder.build()
    q = np.array([0, 0.3, -0.4, 0, 0, 0, 1.0])
    where = turned @ q[:3]
    force = -50 * (0.5 - 0.3) * where / 0.5  # on the mass, in the ground's axes
    load = lw.joint_loads(model, q, None, passive=True)[-1]
    np.testing.assert_allclose(load, [*turned.T @ force, 0, 0, 0], atol=1e-12)
    acceleration = lw.forward_dynamics(model, q, None, passive=True)
    np.testing.assert_allclose(turned @ acceleration[:3], force / 2 + [0, 0, -9.81], atol=1e-12)


def balanced(**properties):
    """An arm whose weight a spring of length 0 carries in every position."""
    builder = lw.ModelBuilder("balanced")
    builder.add_link("base")
    builder.add_link("arm", mass=2.0, com=(0.5, 0, 0), inertia=np.diag([0.01, 0.2, 0.2]))
    builder.add_joint("hinge", "revolute", "base", "arm", axis=(0, -1, 0))
    builder.add_spring(
        "spring",
        "base",
        "arm",
        length=0.0,
        point=(0, 0, 0.4),
        child_point=(0.6, 0, 0),
        stiffness=2.0 * 9.81 * 0.5 / (0.4 * 0.6),
        **properties,
    )
    return builder.build()


def test_a_spring_of_length_zero_balances_an_arm():
    model = balanced()
    for q in (-2.0, -0.3, 0.0, 1.2, np.pi / 2 + 1):
        assert lw.forward_dynamics(model, [q], None, passive=True) == pytest.approx(0, abs=1e-12)
    run = lw.simulate(model, duration=3, q0=[0.3], v0=[0.5])
    assert run.position.values[-1, 0] == pytest.approx(1.8, abs=1e-6)


def test_where_the_points_meet_a_spring_of_length_zero_pulls_nothing():
    model = balanced(damping=4.0)
    model = model.with_spring(
        "closed", "base", "arm", length=0, point=(0.6, 0, 0), child_point=(0.6, 0, 0), stiffness=9
    )
    loads = lw.joint_loads(model, [0.0], None, passive=True)
    np.testing.assert_array_equal(loads[-1], 0)


def test_an_oscillation_and_its_energy():
    """A mass on a slide between two walls: m x'' = -(k1 + k2) x - (d1 + d2) x'."""
    builder = lw.ModelBuilder("slide", gravity=(0, 0, 0))
    builder.add_link("ground")
    builder.add_link("cart", mass=2.0)
    builder.add_joint("slide", "prismatic", "ground", "cart", axis=(1, 0, 0))
    for name, side, k, d in (("left", -1, 30.0, 0.4), ("right", 1, 42.0, 0.8)):
        builder.add_spring(
            name, "ground", "cart", length=1.0, point=(side, 0, 0), stiffness=k, damping=d
        )
    run = lw.simulate(builder.build(), duration=4, q0=[0.2], tolerance=1e-10)
    decay, omega = 1.2 / 4, np.sqrt(72 / 2 - (1.2 / 4) ** 2)
    t = run.time.values
    want = 0.2 * np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
    np.testing.assert_allclose(run.position.values[:, 0], want, atol=1e-8)
    energy = run.kinetic_energy + run.potential_energy + run.dissipated_energy
    np.testing.assert_allclose(energy.values, 0.5 * 72 * 0.2**2, rtol=1e-7)
    x, v = run.position.values[:, 0], run.velocity.values[:, 0]
    pulled = run.joint_load.sel(joint="right", component="fx").values
    np.testing.assert_allclose(pulled, -42 * x - 0.8 * v, atol=1e-7)


def hung(stiffness, damping=0.0):
    """1 kg on a slide hangs on a spring that is slack where it starts."""
    builder = lw.ModelBuilder("hung", gravity=(0, 0, -10))
    builder.add_link("ground")
    builder.add_link("mass", mass=1.0)
    builder.add_joint("slide", "prismatic", "ground", "mass", axis=(0, 0, -1))
    builder.add_spring(
        "spring",
        "ground",
        "mass",
        length=1.0,
        point=(0, 0, 1),
        stiffness=stiffness,
        damping=damping,
    )
    return builder.build()


@pytest.mark.parametrize(("tolerance", "allowed"), [(1e-4, 1.5), (1e-6, 0.05), (1e-8, 1e-3)])
def test_forces_of_stiff_springs_are_known_at_any_tolerance(tolerance, allowed):
    """x = g / w^2 (1 - cos w t): the force swings between 0 and 2 m g."""
    omega = 1e4
    run = lw.simulate(hung(omega**2), duration=2e-3, every=1e-5, tolerance=tolerance)
    force = run.joint_load.sel(joint="spring", component="fz").values
    want = 10 * (1 - np.cos(omega * run.time.values))
    np.testing.assert_allclose(np.abs(force), want, atol=allowed)
    assert not [w for w in run.warnings if w["element"] == "forces"]


def test_fixed_steps_say_which_springs_they_do_not_resolve():
    start = {"q0": [0.0], "v0": [0.0], "integrator": "semi_implicit_euler", "duration": 0.01}
    coarse = lw.simulate_batch(hung(1e8, 100.0), step=1e-4, **start)
    assert "the force of joint 'spring' may be wrong" in coarse.attrs["warnings"]
    fine = lw.simulate_batch(hung(1e4, 1.0), step=1e-4, **start)
    assert "the force of" not in str(fine.attrs.get("warnings"))


def test_a_rope_only_pulls():
    """A spring with an upper stop alone: slack inside its length, tight beyond it."""
    builder = lw.ModelBuilder("rope", gravity=(0, 0, -10))
    builder.add_link("ground")
    builder.add_link("mass", mass=1.0)
    builder.add_joint("slide", "prismatic", "ground", "mass", axis=(0, 0, -1))
    builder.add_spring("rope", "ground", "mass", length=1.0, upper=0.0, limit_stiffness=1e4)
    run = lw.simulate(builder.build(), duration=1, q0=[0.5], tolerance=1e-9, every=5e-4)
    depth = run.position.values[:, 0]
    force = run.joint_load.sel(joint="rope", component="fz").values
    np.testing.assert_allclose(force, 1e4 * np.maximum(depth - 1, 0), rtol=1e-6, atol=1e-3)
    # m g (0.5 + d) = k d^2 / 2
    deepest = (10 + np.sqrt(100 + 4 * 5e3 * 5)) / 1e4
    assert depth.max() == pytest.approx(1 + deepest, abs=1e-5)


def test_the_governor_by_three_integrators():
    """They agree, and nothing of the energy is lost."""
    governor = lw.scenes.benchmark("flyball_governor")
    runs = {
        name: lw.simulate(
            governor.model,
            duration=10,
            q0=governor.q0,
            v0=governor.v0,
            integrator=name,
            tolerance=tolerance,
        )
        for name, tolerance in (("runge_kutta_8", 1e-10), ("bdf", 1e-9), ("auto", 1e-8))
    }
    want = runs.pop("runge_kutta_8")
    for name, run in runs.items():
        np.testing.assert_allclose(
            run.position.values, want.position.values, rtol=1e-6, atol=1e-6, err_msg=name
        )
    energy = want.kinetic_energy + want.potential_energy + want.dissipated_energy
    assert np.ptp(energy.values) < 1e-8 * want.dissipated_energy.values[-1] + 1e-9
    turning = want.velocity.values[0, 0]
    assert turning == pytest.approx(2 * np.pi)
    # Both arms move alike, and the shaft's momentum about z stays: it has no torque.
    np.testing.assert_allclose(want.position.values[:, 2], -want.position.values[:, 3], atol=1e-9)


def test_what_python_refuses():
    with pytest.raises(lw.InputError, match=r"length is -1; give the length of the spring in m, 0"):
        balanced().with_spring("s", "base", "arm", length=-1)
    with pytest.raises(lw.InputError, match=r"a spring has no armature; give it to a joint"):
        balanced(armature=1.0)
    with pytest.raises(lw.InputError, match=r"is a rod or a spring, whose motion cannot be given"):
        balanced().prescribe(["spring"])


def test_a_spring_whose_ends_meet_has_no_direction():
    model = balanced()
    at_end = {"point": (0.6, 0, 0), "child_point": (0.6, 0, 0)}
    pushing = model.with_spring("pusher", "base", "arm", length=0.5, stiffness=100, **at_end)
    said = "^spring 'pusher': its ends meet, so that its force of 50 N has no direction"
    with pytest.raises(lw.InputError, match=said):
        lw.forward_dynamics(pushing, [0.0], None, passive=True)
    with pytest.raises(lw.InputError, match=f"state 1: {said[1:]}"):
        lw.joint_loads(pushing, [[0.1], [0.0]], None, passive=True)
    with pytest.raises(lw.InputError, match=said):
        lw.simulate(pushing, duration=0.1)
    assert lw.simulate(pushing, duration=0.1, q0=[1e-3]).attrs["outcome"] == "converged"
    # Without a force it needs none: a rope that is slack, a damper at rest.
    for idle in ({"upper": 0, "limit_stiffness": 1e4}, {"damping": 5.0}):
        slack = model.with_spring("idle", "base", "arm", length=0.5, **at_end, **idle)
        assert lw.simulate(slack, duration=0.1).attrs["outcome"] == "converged"


def test_limits_of_a_spring_without_a_stop_are_told():
    """A rope whose stiffness was forgotten does nothing."""

    def notes(**properties):
        model = balanced().with_spring("rope", "base", "arm", length=0.1, **properties)
        return [note.text for note in model.notes if note.level == "warning"]

    (said,) = notes(upper=0.0)
    assert said.startswith("upper has no effect, because limit_stiffness is zero; give limit_")
    assert len(notes(lower=-0.1, upper=0.1, stiffness=10.0)) == 2
    assert notes(upper=0.0, limit_stiffness=1e4) == notes(stiffness=10.0) == []
