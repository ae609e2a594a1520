"""Links without mass: what can be looked at, what can run, and what the messages name."""

import numpy as np
import pytest

import linkwise as lw

CABINET = """<robot name="cabinet"><link name="base"/>
<link name="drawer"/><link name="knob"/><link name="door"/><link name="leaf"/>
<joint name="slide" type="prismatic"><parent link="base"/><child link="drawer"/>
  <axis xyz="0 0 1"/><limit lower="0" upper="0.5"/></joint>
<joint name="turn" type="continuous"><parent link="drawer"/><child link="knob"/></joint>
<joint name="hinge" type="continuous"><parent link="base"/><child link="door"/></joint>
<joint name="weld" type="fixed"><parent link="door"/><child link="leaf"/></joint></robot>"""


@pytest.fixture
def cabinet(tmp_path):
    path = tmp_path / "cabinet.urdf"
    path.write_text(CABINET)
    return path


def test_moving_links_without_mass_load_and_are_named_at_once(cabinet):
    model = lw.load(cabinet)
    assert model.nv == 3
    assert lw.link_poses(model, [0.2, 0, 0])[1, 2, 3] == 0.2
    warned = [n.element for n in model.notes if "is not determined" in n.text]
    assert warned == ["drawer", "knob", "door"]
    np.testing.assert_array_equal(
        lw.inverse_dynamics(model, np.zeros(3), np.zeros(3), [1, 1, 1]), 0
    )
    for call in (
        lambda: lw.forward_dynamics(model, np.zeros(3), np.zeros(3)),
        lambda: lw.simulate(model, duration=0.1),
        lambda: lw.simulate_batch(model, duration=0.1, step=0.01),
    ):
        with pytest.raises(lw.InputError) as caught:
            call()
        text = str(caught.value)
        for name in ("'drawer'", "'knob'", "'door'", "'slide'", "'turn'", "'hinge'", '[link."'):
            assert name in text


def test_masses_in_a_scenario_cure_it(cabinet):
    scenario = cabinet.with_name("scenario.toml")
    scenario.write_text(
        'model = "cabinet.urdf"\n[link.drawer]\nmass = "3 kg"\n'
        '[link.knob]\nmass = 0.1\ninertia = ["100 kg mm2", 1e-4, 1e-4]\n'
        "[link.leaf]\nmass = 2\ncom = [0, 0.3, 0]\n[simulate]\nduration = 1\n"
    )
    read = lw.load_scenario(scenario)
    model = read.load_model()
    a = lw.forward_dynamics(model, np.zeros(3), np.zeros(3))
    np.testing.assert_allclose(a, [-9.81, 0, -9.81 / 0.3])


def test_with_armature_the_acceleration_is_determined():
    """A rotor of J on each joint and nothing else: du/dt = tau / J, and m g on the slide."""
    builder = lw.ModelBuilder()
    for name in ("base", "a", "b", "c"):
        builder.add_link(name, mass=2.0 if name == "a" else 0.0)
    builder.add_joint("slide", "prismatic", "base", "a", axis=(0, 0, 1), armature=0.5)
    builder.add_joint("turn", "revolute", "a", "b", axis=(1, 0, 0), armature=0.1)
    builder.add_joint("bend", "revolute", "b", "c", axis=(0, 1, 0), armature=0.2)
    model = builder.build()
    a = lw.forward_dynamics(model, np.zeros(3), np.zeros(3), [0, 0.3, 0.4])
    np.testing.assert_allclose(a, [-9.81 * 2 / 2.5, 3, 2], rtol=1e-14)
    run = lw.simulate(model, duration=1, every=1, drives={"turn": 0.3})
    np.testing.assert_allclose(run.position.sel(joint="turn").values[-1], 1.5, rtol=1e-6)


def test_a_locked_joint_needs_no_mass(cabinet):
    run = lw.simulate(
        lw.load(cabinet), duration=0.1, drives={j: lw.Locked() for j in ("slide", "turn", "hinge")}
    )
    assert run.outcome == "converged"


@pytest.mark.parametrize(
    ("kind", "inertia", "com", "named"),
    [
        ("floating", (1, 1, 0), (0, 0, 0.2), True),
        ("floating", (1, 1, 0.1), (0, 0, 0.2), False),
        ("spherical", (0, 0, 0), (0, 0, 0.2), True),
        ("spherical", (0, 0, 1e-3), (0, 0, 0.2), False),
        ("revolute", (0, 0, 0), (0, 0, 0.2), True),
        ("revolute", (0, 0, 0), (0.1, 0, 0.2), False),
        ("prismatic", (0, 0, 0), (0, 0, 0.2), False),
    ],
)
def test_a_body_without_inertia_where_it_turns_is_said_at_loading(kind, inertia, com, named):
    builder = lw.ModelBuilder()
    builder.add_link("base")
    builder.add_link("rod", mass=1, com=com, inertia=np.diag(inertia))
    builder.add_joint("joint", kind, "base", "rod", axis=(0, 0, 1))
    model = builder.build()
    notes = [n for n in model.notes if "its acceleration is not determined" in n.text]
    assert bool(notes) == named
    # The witness: the joint-space mass matrix is singular.
    smallest = np.linalg.eigvalsh(lw.mass_matrix(model, model.initial_configuration()))[0]
    assert (smallest < 1e-14) == named


SENSOR = """<robot name="wrist"><link name="arm"><inertial><mass value="3"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<link name="wrist"><inertial><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<link name="ft_link"/><link name="tool"><inertial><origin xyz="0.07 0 0"/><mass value="0.8"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link><link name="tip"/>
<joint name="turn" type="revolute"><parent link="arm"/><child link="wrist"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="ft" type="fixed"><origin xyz="0 0 0.1"/><parent link="wrist"/><child link="ft_link"/>
</joint>
<joint name="mount" type="{mount}"><parent link="ft_link"/><child link="tool"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="tcp" type="fixed"><parent link="tool"/><child link="tip"/></joint></robot>"""


@pytest.mark.parametrize("mount", ["fixed", "revolute"])
def test_a_sensor_behind_a_link_without_mass_has_its_load(tmp_path, mount):
    """At rest the sensor carries m g at the tool's arm; closed form."""
    path = tmp_path / "wrist.urdf"
    path.write_text(SENSOR.format(mount=mount))
    model = lw.load(path, keep_fixed=True)
    assert "tcp" not in model.joint_names  # it carries nothing
    q = np.zeros(model.nv)
    tau = lw.inverse_dynamics(model, q, q, q)
    load = lw.joint_loads(model, q, q, tau)[model.joint_index("ft")]
    weight = 0.8 * 9.81
    np.testing.assert_allclose(load, [0, 0, weight, 0, -0.07 * weight, 0], atol=1e-12)


def test_messages_say_merged(tmp_path):
    path = tmp_path / "wrist.urdf"
    path.write_text(SENSOR.format(mount="fixed"))
    with pytest.raises(lw.InputError, match=r"'ft' .* merged; .* load with keep_fixed"):
        lw.load(path).joint_index("ft")
    with pytest.raises(lw.InputError, match=r"'tcp' .* merged, because nothing on it has mass"):
        lw.load(path, keep_fixed=True).joint_index("tcp")
    scenario = tmp_path / "s.toml"
    scenario.write_text(
        'model = "wrist.urdf"\n[output]\njoints = ["ft"]\n[simulate]\nduration = 1\n'
    )
    read = lw.load_scenario(scenario)
    with pytest.raises(lw.InputError, match=r"merged; .* load with keep_fixed"):
        read.simulate_arguments(read.load_model())


METHODS = (
    "auto",
    "constraint_force",
    "composite_rigid_body",
    "global_projection",
    "joint_space_conjugate_gradient",
)


@pytest.mark.parametrize("method", METHODS)
def test_axes_that_line_up_are_named_with_the_cure(method):
    builder = lw.ModelBuilder()
    for name in ("base", "f1", "f2"):
        builder.add_link(name)
    builder.add_link("head", mass=5, com=(0, 0, 0.2), inertia=np.diag((0.03, 0.025, 0.02)))
    for k, (parent, child) in enumerate((("base", "f1"), ("f1", "f2"), ("f2", "head"))):
        builder.add_joint("xyz"[k], "revolute", parent, child, axis=np.eye(3)[k])
    model = builder.build()
    locked = [0, np.pi / 2, 0]
    with pytest.raises(lw.NumericsError) as caught:
        lw.forward_dynamics(model, locked, [0, 0, 0.3], method=method)
    many = np.tile([0.1, 0.2, 0.3], (20, 1))
    assert np.isfinite(lw.forward_dynamics(model, many, 0 * many, method=method)).all()
    many[13] = locked
    with pytest.raises(lw.NumericsError):
        lw.forward_dynamics(model, many, 0 * many, method=method)
    run = lw.simulate(
        model, duration=0.1, q0=locked, on_failure="return", numerics={"method": method}
    )
    for text in (str(caught.value), run.message):
        for part in ("'x', 'y', 'z' line up", "gimbal lock", "'f1', 'f2'", "spherical joint"):
            assert part in text


@pytest.mark.parametrize("solver", [s["name"] for s in lw.solvers()])
def test_no_solver_returns_an_answer_where_axes_line_up(solver):
    builder = lw.ModelBuilder()
    builder.add_link("base")
    builder.add_link("head", mass=5, com=(0, 0, 0.2), inertia=np.diag((0.03, 0.025, 0.02)))
    axes = [("revolute", axis) for axis in np.eye(3)]
    builder.add_joint("neck", "composite", "base", "head", axes=axes)
    options = {"method": "constraint_force", "solver": solver}
    model = builder.build()
    assert np.isfinite(lw.forward_dynamics(model, [0, 1.5, 0], [0, 0, 0.3], **options)).all()
    with pytest.raises(lw.NumericsError):
        lw.forward_dynamics(model, [0, np.pi / 2, 0], [0, 0, 0.3], **options)


def row_of_hinges(count, armature=None):
    """Hinges in a row about x, y, z in turn, 0.2 m apart, with nothing but a tip that has mass."""
    builder = lw.ModelBuilder("row")
    builder.add_link("base")
    for k in range(count):
        tip = {"mass": 2.0, "com": (0.1, 0.2, 0.3), "inertia": np.diag([0.03, 0.04, 0.05])}
        builder.add_link(f"l{k}", **(tip if k == count - 1 else {}))
        builder.add_joint(
            *(f"j{k}", "revolute", f"l{k - 1}" if k else "base", f"l{k}"),
            translation=(0.2, 0.05 * k, 0.1),
            axis=np.roll((1, 0.1, 0), k),
            armature=None if armature is None else armature[k],
        )
    return builder.build()


@pytest.mark.parametrize("count", [7, 9, 14])
@pytest.mark.parametrize("where", ["all", "inner", "outer", "scattered"])
def test_rows_of_massless_links_with_armature_run(rng, count, where):
    """Witness: (J^T M J + armature) du = tau - h, with J of the tip, the only link with mass."""
    armature = rng.uniform(0.1, 1.0, count)
    bare = {
        "all": [],
        "inner": range(count - 6, count),
        "outer": range(6),
        "scattered": range(1, 7),
    }
    armature[list(bare[where])] = 0.0  # six degrees of freedom may have none
    model = row_of_hinges(count, armature)
    q, v, tau = rng.normal(size=(3, count))
    tip = lw.body_jacobian(model, q, f"l{count - 1}")
    c, mass, central = np.array([0.1, 0.2, 0.3]), 2.0, np.diag([0.03, 0.04, 0.05])
    cross = np.array([[0, -c[2], c[1]], [c[2], 0, -c[0]], [-c[1], c[0], 0]])
    inertia = np.block(
        [[mass * np.eye(3), -mass * cross], [mass * cross, central - mass * cross @ cross]]
    )
    full = tip.T @ inertia @ tip + np.diag(armature)
    np.testing.assert_allclose(lw.mass_matrix(model, q), full, atol=1e-12)
    expected = np.linalg.solve(full, tau - lw.inverse_dynamics(model, q, v, np.zeros(count)))
    found = lw.forward_dynamics(model, q, v, tau)
    scale = np.abs(expected).max() * np.linalg.cond(full)
    np.testing.assert_allclose(found, expected, atol=1e-14 * scale)
    same = lw.forward_dynamics(model, q, v, tau, method="composite_rigid_body")
    np.testing.assert_allclose(same, expected, atol=1e-14 * scale)
    # What goes through a massless link is what its outboard joint passes on.
    loads = lw.joint_loads(model, q, v, tau)
    poses = lw.joint_poses(model, q)
    for k in range(count - 1):
        force = poses[k + 1, :3, :3] @ loads[k + 1, :3]
        moment = poses[k + 1, :3, :3] @ loads[k + 1, 3:]
        moment += np.cross(poses[k + 1, :3, 3] - poses[k, :3, 3], force)
        np.testing.assert_allclose(poses[k, :3, :3] @ loads[k, :3], force, atol=1e-11 * scale)
        np.testing.assert_allclose(poses[k, :3, :3] @ loads[k, 3:], moment, atol=1e-11 * scale)
    with pytest.raises(lw.InputError, match=r"'l\d+'.* articulated_body"):
        lw.forward_dynamics(model, q, v, tau, method="constraint_force")


def test_seven_hinges_without_armature_can_be_looked_at(linkwise, tmp_path):
    model = row_of_hinges(7)
    assert lw.link_poses(model, np.zeros(7)).shape == (8, 4, 4)
    assert len(lw.inverse_dynamics(model, np.zeros(7), np.zeros(7), np.ones(7))) == 7
    for call in (
        lambda: lw.forward_dynamics(model, np.zeros(7), np.zeros(7)),
        lambda: lw.simulate(model, duration=0.1),
    ):
        with pytest.raises(lw.InputError, match="more than 6 degrees of freedom") as caught:
            call()
        for name in [f"'j{k}'" for k in range(7)] + [f"'l{k}'" for k in range(6)]:
            assert name in str(caught.value)
    run = lw.simulate(model, duration=0.01, drives={"j3": lw.Locked()})
    assert run.outcome == "converged"
    run = lw.simulate(model.with_joint("j3", armature=0.1), duration=0.01)
    assert run.outcome == "converged"
    links = "".join(f'<link name="l{k}"/>' for k in range(7))
    joints = "".join(
        f'<joint name="j{k}" type="continuous"><parent link="l{k}"/><child link="l{k + 1}"/>'
        f'<axis xyz="{k % 2} {(k + 1) % 2} 0"/></joint>'
        for k in range(7)
    )
    tip = '<link name="l7"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" '
    urdf = tmp_path / "row.urdf"
    urdf.write_text(
        f'<robot name="row">{links}{joints}{tip}ixz="0" iyz="0"/></inertial></link></robot>'
    )
    found = linkwise("inspect", urdf)
    assert found.code == 0
    assert "6 at most are determined" in " ".join(found.out.split())


def test_a_floating_base_of_slides_and_hinges_flies_as_a_floating_joint_does():
    """Three slides and three hinges with massless links between, beside one floating joint."""
    builder, free = lw.ModelBuilder(), lw.ModelBuilder()
    body = {"mass": 3.0, "com": (0.1, 0.2, -0.1), "inertia": np.diag([0.2, 0.3, 0.4])}
    builder.add_link("world")
    free.add_link("world")
    free.add_link("body", **body)
    free.add_joint("free", "floating", "world", "body")
    names = [f"{kind}{axis}" for kind in ("slide", "turn") for axis in "xyz"]
    for k, name in enumerate(names):
        last = name == "turnz"
        builder.add_link("body" if last else name, **(body if last else {}))
        kind = "prismatic" if k < 3 else "revolute"
        parent = names[k - 1] if k else "world"
        builder.add_joint(f"j{name}", kind, parent, "body" if last else name, axis=np.eye(3)[k % 3])
    stacked, floating = builder.build(), free.build()
    rates = [0.3, -0.2, 2.0, 0.5, 0.4, 0.6]  # at zero the hinges' axes are the body's
    options = {"duration": 0.8, "every": 0.4, "tolerance": 1e-10, "v0": rates}
    ours, theirs = lw.simulate(stacked, **options), lw.simulate(floating, **options)
    np.testing.assert_allclose(
        lw.joint_poses(stacked, ours.position.values)[:, -1],
        lw.joint_poses(floating, theirs.position.values)[:, 0],
        atol=1e-8,
    )
    with pytest.raises(lw.NumericsError, match=r"some of joints .* line up .* floating joint"):
        lw.forward_dynamics(stacked, [0, 0, 0, 0, np.pi / 2, 0], np.ones(6))
    # Armature of one of them lifts the lock.
    geared = stacked.with_joint("jturnx", armature=1e-3)
    assert np.isfinite(lw.forward_dynamics(geared, [0, 0, 0, 0, np.pi / 2, 0], np.ones(6))).all()
