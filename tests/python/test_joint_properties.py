"""Joint properties of a machine that was read: in Python, in scenarios, and what may not be set."""

import numpy as np
import pytest

import linkwise as lw

WINCH = """<robot name="winch"><link name="base"/>
<link name="drum"><inertial><mass value="2"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.02"/></inertial></link>
<joint name="shaft" type="continuous"><parent link="base"/><child link="drum"/><axis xyz="0 0 1"/>
<limit effort="20" velocity="50"/></joint>
<link name="hook"><inertial><mass value="3"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="rope" type="prismatic"><parent link="drum"/><child link="hook"/><axis xyz="0 0 -1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<link name="plate"/><joint name="weld" type="fixed"><parent link="hook"/><child link="plate"/>
</joint></robot>"""
J, G = 5e-6, 113.9


@pytest.fixture
def urdf(tmp_path):
    path = tmp_path / "winch.urdf"
    path.write_text(WINCH)
    return path


@pytest.fixture
def winch(urdf):
    return lw.load(urdf)


def test_a_rotor_behind_a_gear_is_its_inertia_times_the_square_of_the_ratio(winch):
    """dw/dt = tau / (I + g^2 J), with the torque at the joint; a sliding joint's ratio is rad/m."""
    rotor = winch.with_joint("shaft", motor_inertia=J, gear_ratio=G)
    a = lw.forward_dynamics(rotor, [0, 0], [0, 0], [1, 0])
    np.testing.assert_allclose(a, [1 / (1.02 + G * G * J), 9.81], rtol=1e-14)
    assert rotor.hash == winch.with_joint("shaft", armature=G * G * J).hash
    both = rotor.with_joint("rope", motor_inertia=2e-4, gear_ratio=-50)
    a = lw.forward_dynamics(both, [0, 0], [0, 0], [0, 0])
    np.testing.assert_allclose(a[1], 3 * 9.81 / (3 + 2500 * 2e-4), rtol=1e-14)
    np.testing.assert_allclose(winch.armature, 0)  # the machine that it was made of stays


def test_the_convention_is_mujocos():
    mujoco = pytest.importorskip("mujoco")
    text = """<mujoco><worldbody><body><joint name="h" axis="0 1 0"/><geom size=".1" pos=".3 0 0"/>
    <body pos=".5 0 0"><joint name="k" type="slide" axis="1 0 1"/><geom size=".1" pos=".2 0 .1"/>
    </body></body></worldbody>{}</mujoco>"""
    motors = """<actuator><motor joint="h" gear="30" armature="2e-3"/>
    <motor joint="k" gear="-7" armature="0.04"/></actuator>"""
    mj_model = mujoco.MjModel.from_xml_string(text.format(motors))
    data = mujoco.MjData(mj_model)
    data.qpos[:] = 0.4, 0.1
    mujoco.mj_forward(mj_model, data)
    try:
        theirs = np.zeros((2, 2))
        mujoco.mj_fullM(mj_model, data, theirs)
    except TypeError:  # before MuJoCo 3.4
        mujoco.mj_fullM(mj_model, theirs, data.qM)
    with_motors = lw.load(text.format("")).with_joints(
        {
            "h": {"motor_inertia": 2e-3, "gear_ratio": 30},
            "k": {"motor_inertia": 0.04, "gear_ratio": -7},
        }
    )
    np.testing.assert_allclose(lw.mass_matrix(with_motors, data.qpos), theirs, rtol=1e-12)


def test_every_property_is_what_a_builder_would_have_given():
    given = {
        "damping": [0.1, 0.2],
        "friction": 0.3,
        "friction_velocity": 0.02,
        "stiffness": [4.0, 5.0],
        "rest_position": [0.1, -0.1],
        "armature": 0.6,
        "lower": -1.0,
        "upper": [1.0, np.inf],
        "effort": 7.0,
        "velocity": 8.0,
        "limit_stiffness": 900.0,
        "limit_damping": 0.5,
    }

    def machine(**properties):
        builder = lw.ModelBuilder()
        builder.add_link("base")
        builder.add_link("arm", mass=1, com=(0.1, 0, 0.2), inertia=np.eye(3))
        builder.add_joint("wrist", "universal", "base", "arm", axes=np.eye(3)[:2], **properties)
        return builder.build()

    built, changed = machine(**given), machine(damping=3).with_joint("wrist", **given)
    for name in given:
        np.testing.assert_array_equal(changed.dof_property(name), built.dof_property(name))
    q, v = [1.2, -1.1], [0.3, -0.4]
    np.testing.assert_array_equal(
        lw.forward_dynamics(changed, q, v, passive=True),
        lw.forward_dynamics(built, q, v, passive=True),
    )
    # What is None or not named stays, and what is usual again leaves no trace.
    assert changed.with_joint("wrist", damping=None).hash == changed.hash
    assert machine(damping=3).with_joint("wrist", damping=0).hash == machine().hash
    same = changed.with_joints({"wrist": {"stiffness": [4, 5]}})
    assert same.hash == changed.hash


@pytest.mark.parametrize(
    ("joint", "properties", "complaint"),
    [
        ("shaft", {"gear_ratio": 3}, "gear_ratio is given without motor_inertia; give both"),
        ("shaft", {"motor_inertia": 1, "armature": 2}, "both armature and motor_inertia .* keep"),
        ("shaft", {"motor_inertia": -1}, r"motor_inertia is negative \(-1\)"),
        ("shaft", {"motor_inertia": 1, "gear_ratio": 0}, "gear_ratio is 0; give a finite"),
        ("shaft", {"motor_inertia": np.nan}, "armature is not a finite number"),
        ("shaft", {"motor_inertia": 1, "gear_ratio": 1e200}, "armature is not a finite number"),
        ("shaft", {"motor_inertia": [1, 2], "gear_ratio": [1, 2, 3]}, "3 values and motor_iner"),
        ("shaft", {"armatur": 1}, "property 'armatur' is unknown; did you mean 'armature'"),
        ("shaft", {"armature": -1}, r"armature is negative \(-1\)"),
        ("rope", {"lower": 2}, "lower limit 2 is above the upper limit 1"),
        ("rope", {"stiffness": [1, 2]}, "stiffness has 2 values"),
        ("rop", {"stiffness": 1}, "'rop' does not exist .* did you mean 'rope'"),
        ("weld", {"stiffness": 1}, "'weld' .* is fixed and its links are merged"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(winch, joint, properties, complaint):
    with pytest.raises(lw.InputError, match=complaint) as caught:
        winch.with_joint(joint, **properties)
    assert f"joint '{joint}'" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_floating_base_has_no_properties(urdf):
    heavy = '<link name="base"><inertial><mass value="9"/><inertia ixx="1" ixy="0" ixz="0" '
    heavy += 'iyy="1" iyz="0" izz="1"/></inertial></link>'
    urdf.write_text(WINCH.replace('<link name="base"/>', heavy))
    model = lw.load(urdf, floating_base=True)
    with pytest.raises(lw.InputError, match=r"'root_joint' .* floating base, which has no"):
        model.with_joint("root_joint", damping=1)
    with pytest.raises(lw.InputError, match="no dict of dicts"):
        model.with_joints({"rope": 3})


@pytest.mark.parametrize(
    "name",
    [
        *("gravity", "damping", "friction", "friction_velocity", "stiffness", "rest_position"),
        *("armature", "lower_limit", "upper_limit", "effort_limit", "velocity_limit"),
        *("limit_stiffness", "limit_damping", "child_link_masses", "link_masses"),
        *("link_centers_of_mass", "link_inertias"),
    ],
)
def test_arrays_of_a_model_are_read_only(winch, name):
    with pytest.raises(ValueError, match="read-only"):
        getattr(winch, name)[0] = 1


def test_every_array_of_the_core_is_read_only(winch):
    """Those that are not named above: what a property returns would be written into a copy."""
    system = lw.ConstraintSystem(winch, [0, 0], [0, 0], [0, 0])
    method = lw.DynamicsMethod(winch)
    frame = lw.Frame("hook", origin=(0, 0, 1))
    for owner in (winch, system, method, frame):
        for name in dir(type(owner)):
            if isinstance(getattr(type(owner), name), property):
                value = getattr(owner, name)
                assert not isinstance(value, np.ndarray) or not value.flags.writeable, name
    assert not winch.dof_property("armature").flags.writeable
    assert winch.neutral_configuration().flags.writeable  # a state to start from


SCENARIO = """model = "winch.urdf"
[joint.shaft]
motor_inertia = "5 kg mm2"
gear_ratio = 113.9
damping = "0.1 Nms/rad"
upper = inf
effort = 30
[joint.rope]
armature = "500 g"
lower = "-40 cm"
limit_stiffness = "2 N/mm"
limit_damping = "0.3 s/m"
[simulate]
duration = 0.1
"""


def read(urdf, text):
    path = urdf.with_name("scenario.toml")
    path.write_text(text)
    return lw.load_scenario(path)


def test_a_scenario_sets_the_same_properties(urdf, winch, linkwise):
    model = read(urdf, SCENARIO).load_model()
    expected = winch.with_joints(
        {
            "shaft": {"motor_inertia": J, "gear_ratio": G, "damping": 0.1, "effort": 30},
            "rope": {
                **{"armature": 0.5, "lower": -0.4},
                **{"limit_stiffness": 2000, "limit_damping": 0.3},
            },
        }
    )
    for name in ("armature", "damping", "lower", "upper", "effort", "velocity", "limit_stiffness"):
        np.testing.assert_allclose(
            model.dof_property(name), expected.dof_property(name), rtol=1e-15, err_msg=name
        )
    scenario = str(urdf.with_name("scenario.toml"))
    shaft, rope = linkwise("inspect", scenario, "--json").json["joints"]
    assert (shaft["damping"], rope["armature"], rope["limit_damping"]) == ([0.1], [0.5], [0.3])
    assert "0.06487" in linkwise("inspect", scenario).out


def test_properties_may_be_swept(urdf):
    """At constant torque an axle turns by tau t^2 / 2 (I + g^2 J)."""
    scenario = read(
        urdf,
        'model = "winch.urdf"\n[joint.shaft]\nmotor_inertia = 5e-6\n'
        '[drive.shaft]\nkind = "torque"\nvalue = 2\n'
        "[simulate]\nduration = 1\ntolerance = 1e-9\n[output]\nevery = 1\n",
    )
    ratios = [1, 50, 113.9]
    found = lw.sweep(scenario, {"joint.shaft.gear_ratio": ratios}, processes=1)
    turned = found.position.isel(time=-1).sel(joint="shaft")
    np.testing.assert_allclose(turned, [1 / (1.02 + g * g * J) for g in ratios], rtol=1e-8)


@pytest.mark.parametrize(
    ("line", "complaint"),
    [
        ('[joint.shaft]\narmature = "3 kg"', "joint.shaft.armature: has a unit of mass"),
        ('[joint.rope]\nmotor_inertia = "3 kg"', "joint.rope.motor_inertia: has a unit of mass"),
        (
            "[joint.rope]\narmature = [1, 2]",
            "joint.rope.armature: has 2 numbers, the joint needs 1",
        ),
        ("[joint.rope]\narmature = inf", "joint.rope.armature: is inf, not a finite number"),
        ("[joint.rope]\nlower = nan", "joint.rope.lower: is nan, not a finite number"),
        ("[joint.rope]\narmature = -1", r"joint.rope: joint 'rope' .* negative \(-1\); give"),
        ("[joint.rope]\ngear_ratio = 2", "joint.rope: .* without motor_inertia; give both"),
        (
            "[joint.rope]\nrest = 2",
            "joint.rope.rest: unknown key; did you mean 'rest_position'|the",
        ),
        (
            "[joint.rop]\ndamping = 2",
            "joint.rop: the model has no joint 'rop'; did you mean 'rope'",
        ),
        ("[joint.weld]\ndamping = 2", "joint.weld: .* its links are merged"),
    ],
)
def test_what_a_scenario_gets_wrong_is_named_with_its_key(urdf, line, complaint):
    with pytest.raises(lw.InputError, match=complaint):
        read(urdf, f'model = "winch.urdf"\n{line}\n[simulate]\nduration = 1\n').load_model()


def test_machines_of_a_batch_keep_their_own_properties(winch):
    """Models of one batch differ by armature, damping, spring and stop: each moves as it does
    alone."""
    rope = {"lower": -0.01, "upper": 0.02, "limit_stiffness": 500.0, "limit_damping": 0.1}
    models = [
        winch,
        winch.with_joint("shaft", armature=3.0),
        winch.with_joint("shaft", damping=5.0, friction=0.2),
        winch.with_joints({"shaft": {"stiffness": 40.0, "rest_position": 0.3}, "rope": rope}),
    ]
    options = {
        **{"duration": 0.1, "step": 1e-3, "every": 0.1, "integrator": "runge_kutta_4"},
        **{"v0": [1.0, 0.2], "drives": {"shaft": 2.0}},
    }
    found = lw.simulate_batch(models, **options).position.isel(time=-1).values.reshape(4, 2)
    for model, ours in zip(models, found, strict=True):
        alone = lw.simulate(model, **options).position.isel(time=-1).values
        np.testing.assert_allclose(ours, alone, rtol=1e-9)
    assert len({tuple(row) for row in found.round(6)}) == 4


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"limit_damping": 0.5}, "limit_damping has no effect, because limit_stiffness is zero"),
        ({"friction_velocity": 0.1}, "friction_velocity has no effect, because friction is zero"),
        ({"rest_position": 0.2}, "rest_position has no effect, because stiffness is zero"),
        ({"limit_stiffness": 1e4, "lower": -np.inf, "upper": np.inf}, "the range has no ends"),
        ({"limit_damping": 0.5, "limit_stiffness": 1e4}, None),
        ({"friction_velocity": 0.1, "friction": 2.0}, None),
        ({"rest_position": 0.2, "stiffness": 5.0}, None),
        ({"limit_stiffness": 1e4, "upper": np.inf}, None),
    ],
)
def test_what_does_nothing_is_said(winch, given, said):
    notes = [
        note.text
        for note in winch.with_joint("rope", **given).notes
        if note.level == "warning" and note.element == "rope"
    ]
    assert len(notes) == (said is not None)
    assert said is None or said in notes[0]


def test_one_value_for_several_serves_those_that_need_it():
    builder = lw.ModelBuilder("ball")
    builder.add_link("ground")
    builder.add_link("ball", mass=1.0, inertia=np.eye(3))
    some = {"friction": [1.0, 0, 0], "friction_velocity": 0.1}
    builder.add_joint("hip", "spherical", "ground", "ball", **some)
    assert not builder.build().notes
    each = {"friction_velocity": [0.1, 0.1, 0.1]}
    (note,) = builder.build().with_joint("hip", **each).notes
    assert note.text.startswith("friction_velocity has no effect")
