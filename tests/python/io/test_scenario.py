"""Scenario files: what they become, and one line for each way in which they are wrong."""

import inspect
import math
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import linkwise as lw
from linkwise import drives
from linkwise._core import InputError
from linkwise.scenario import load_scenario
from linkwise.scenario.schema import SimulateSection

GOOD = """model = "arm.urdf"
[simulate]
duration = 10
"""


@pytest.fixture
def write(arm):
    """Writes run.toml beside arm.urdf; its lines go in front of a minimal good scenario."""

    def call(text="", good=GOOD):
        path = arm.with_name("run.toml")
        top, dot, tables = text.partition("\n[")
        text = f"{top}\n{good}" + (f"[{tables}" if dot else "") if good else text
        path.write_text(text)
        return path

    return call


def arguments(path):
    scenario = load_scenario(path)
    return scenario.simulate_arguments(scenario.load_model())


def read_all(path):
    arguments(path)


def test_defaults(write):
    path = write()
    given = arguments(path)
    assert given == {
        "duration": 10.0,
        "numerics": {},
        "threads": None,
        "drives": {},
        "wrenches": {},
        "q0": None,
        "v0": None,
        "every": None,
        "record": {
            "quantities": None,
            "joints": None,
            "extremes": None,
            "scenario_text": path.read_text(),
        },
        "output": None,
    }


def test_everything(write, arm):
    (arm.parent / "force.csv").write_text("time,f [N]\n0,1\n1,2\n")
    (arm.parent / "hand.csv").write_text("t,fx,fy,fz,nx,ny,nz\n0,1,2,3,4,5,6\n1,1,2,3,4,5,6\n")
    path = write(
        good="",
        text="""
        model = "arm.urdf"
        gravity = [0, "-1.62 m/s2", 0]
        joint_order = "pinocchio"
        [initial]
        position.shoulder = "30 deg"
        position.slide = "5 mm"
        velocity.shoulder = [1.5]
        [drive.shoulder]
        kind = "pd"
        kp = "100 N m/rad"
        kd = 10
        target = "-90 deg"
        [drive.slide]
        kind = "torque"
        table = "force.csv"
        interpolation = "cubic"
        [wrench.lower]
        force = [0, "2 kN", 0]
        [wrench.upper]
        table = "hand.csv"
        axes = "frame"
        [simulate]
        duration = "0.5 min"
        tolerance = 1e-8
        integrator = "bdf"
        max_step = "100 ms"
        threads = 2
        [output]
        extremes = false
        every = 0.01
        quantities = ["joint_load", "energy"]
        joints = ["slide"]
        path = "results/run.zarr"
        """,
    )
    scenario = load_scenario(path)
    model = scenario.load_model()
    np.testing.assert_array_equal(model.gravity, [0, -1.62, 0])
    given = scenario.simulate_arguments(model)
    assert (given["duration"], given["threads"]) == (30.0, 2)
    assert given["numerics"] == {"tolerance": 1e-8, "integrator": "bdf", "max_step": 0.1}
    np.testing.assert_allclose(given["q0"], [math.pi / 6, 0.005])
    np.testing.assert_allclose(given["v0"], [1.5, 0])
    pd, force = given["drives"]["shoulder"], given["drives"]["slide"]
    assert isinstance(pd, drives.PD)
    assert (pd.kp, pd.kd, pd.target) == (100, 10, pytest.approx(-math.pi / 2))
    assert isinstance(force, drives.Torque)
    assert force.value.interpolation == "cubic"
    np.testing.assert_array_equal(force.value.values, [[1], [2]])
    np.testing.assert_array_equal(given["wrenches"]["lower"].value, [0, 2000, 0, 0, 0, 0])
    wrench = given["wrenches"]["upper"]
    assert wrench.axes == "frame"
    np.testing.assert_array_equal(wrench.value.values[0], [1, 2, 3, 4, 5, 6])
    assert given["every"] == 0.01
    assert given["record"]["quantities"] == ["joint_load", "energy"]
    assert given["record"]["joints"] == ["slide"]
    assert given["record"]["extremes"] is False
    assert given["output"] == path.parent / "results" / "run.zarr"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('kind = "locked"', drives.Locked()),
        ('kind = "free"', drives.Free()),
        (
            'kind = "spring"\nstiffness = "1 N m/deg"\ndamping = 2\nrest = "10 deg"',
            drives.Spring(180 / math.pi, 2.0, math.radians(10)),
        ),
    ],
)
def test_other_drives(write, text, expected):
    assert arguments(write(f"\n[drive.shoulder]\n{text}\n"))["drives"] == {"shoulder": expected}


def test_constant_torque(write):
    drive = arguments(write('\n[drive.shoulder]\nkind = "torque"\nvalue = "3 kNm"\n'))["drives"]
    np.testing.assert_array_equal(drive["shoulder"].value, [3000])


def test_pd_follows_a_table_in_degrees(write, arm):
    (arm.parent / "way.csv").write_text("time,shoulder [deg],slide [mm]\n0,0,0\n1,180,5\n")
    given = arguments(
        write(
            "\n[drive.shoulder]\nkind = 'pd'\nkp = 1\nkd = 1\ntable = 'way.csv'\n"
            "[drive.slide]\nkind = 'pd'\nkp = 1\nkd = 1\ntable = 'way.csv'\ncolumn = 'slide'\n"
        )
    )["drives"]
    np.testing.assert_allclose(given["shoulder"].target.values, [[0], [math.pi]])
    np.testing.assert_allclose(given["slide"].target.values, [[0], [0.005]])


def test_state_of_a_floating_base(write, arm):
    arm.write_text(
        arm.read_text().replace(
            '<link name="base"/>',
            '<link name="base"><inertial><mass value="1"/>'
            '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>',
        )
    )
    top = "floating_base = true\n"
    pose = '[initial]\nposition.root_joint = ["10 cm", 2, 3, 0, 0, 0.7071, 0.7071]\n'
    q0 = arguments(write(f"{top}\n{pose}"))["q0"]
    np.testing.assert_allclose(q0[:3], [0.1, 2, 3])
    assert np.linalg.norm(q0[3:7]) == pytest.approx(1, abs=1e-15)
    np.testing.assert_allclose(q0[7:], 0)
    with pytest.raises(InputError, match=r"its quaternion x y z w has length 2; give a unit"):
        arguments(write(f"{top}\n{pose.replace('0, 0, 0.7071, 0.7071', '0, 0, 0, 2')}"))


def test_every_argument_is_one_of_simulate(write):
    inspect.signature(lw.simulate).bind("model", **arguments(write()))


UNITS = "known units: rad, deg, rev, mrad, m, cm, mm, um, km, s, ms, min, h, "


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("gravty = [0, 0, 1]", ": gravty: unknown key; did you mean 'gravity'?"),
        (
            "\n[drive.shoulder]\nkind = 'pd'\nkp = 1\nkdd = 1",
            ": drive.shoulder.kdd: unknown key; did you mean 'kd'?",
        ),
        (
            "\n[output]\nevry = 1",
            ": output.evry: unknown key; did you mean 'every'?",
        ),
        (
            "\n[wrench.upper]\nzzz = 1",
            ": wrench.upper.zzz: unknown key; "
            "the keys are: table, column, columns, interpolation, link, point, axes, force, ...",
        ),
        (
            "\n[initial]\nposition.shouldr = 1",
            ": initial.position.shouldr: the model has no joint 'shouldr'; "
            "did you mean 'shoulder'?",
        ),
        (
            "\n[drive.elbow]\nkind = 'locked'",
            ": drive.elbow: the model has no joint 'elbow'; the joints are: shoulder, slide",
        ),
        (
            "\n[wrench.hand]\nforce = [0, 0, 1]",
            ": wrench.hand: is no link of the model and names none; "
            "add link = ..., or the links are: base, upper, lower",
        ),
        (
            "\n[output]\njoints = ['slid']",
            ": output.joints: the model has no joint 'slid'; did you mean 'slide'?",
        ),
        (
            "\n[output]\nquantities = ['joint_lod']",
            ": output.quantities: unknown quantity 'joint_lod'; did you mean 'joint_load'?",
        ),
        (
            "\n[drive.shoulder]\nkind = 'movement'",
            ": drive.shoulder.kind: 'movement' is not a kind of drive; "
            "use one of torque, motion, pd, spring, locked, free",
        ),
        (
            "\n[drive.shoulder]\nkind = 'motion'",
            ": drive.shoulder.table: is missing; add table = ...",
        ),
        (
            "\n[payload.box]\nlink = 'hnd'\nmass = 1",
            ": payload.box.link: the model has no link 'hnd'; the links are: base, upper, lower",
        ),
        (
            "\n[payload.box]\nlink = 'hand'\nmass = -1",
            ": payload.box.mass: is -1; give a number at least 0",
        ),
        (
            "\n[rating.slid]\nforce = 1",
            ": rating.slid: the model has no joint 'slid'; did you mean 'slide'?",
        ),
        (
            "\n[rating.slide]\nforce = '3 N m'",
            ": rating.slide.force: has a unit of moment where a force belongs; use one of "
            "N, kN, MN, mN",
        ),
        (
            "\n[drive.shoulder]\nvalue = 1",
            ": drive.shoulder: has no kind; "
            "add kind = one of torque, motion, pd, spring, locked, free",
        ),
        (
            "\n[drive.shoulder]\nkind = 'torque'",
            ': drive.shoulder: has neither value nor table; give value or "FILE.csv"',
        ),
        (
            "\n[drive.shoulder]\nkind = 'torque'\nvalue = 1\ntable = 'a.csv'",
            ": drive.shoulder: has both value and table; keep one",
        ),
        (
            "\n[drive.shoulder]\nkind = 'torque'\nvalue = 1\ncolumn = 'a'",
            ': drive.shoulder: column belongs to a table; add table = "FILE.csv"',
        ),
        (
            "\n[drive.shoulder]\nkind = 'torque'\nvalue = nan",
            ": drive.shoulder.value: is nan, not a finite number; give a finite number",
        ),
        (
            "\n[drive.shoulder]\nkind = 'torque'\nvalue = [1, 2]",
            ": drive.shoulder.value: has 2 numbers, the joint needs 1; give one number",
        ),
        (
            "\n[drive.shoulder]\nkind = 'torque'\nvalue = true",
            ": drive.shoulder.value: is not a number; give a number or a text such as '30 deg'",
        ),
        (
            "\n[drive.shoulder]\nkind = 'torque'\nvalue = '3 N'",
            ": drive.shoulder.value: has a unit of force where a moment belongs; "
            "use one of Nm, kNm, MNm, Ncm, Nmm, mNm",
        ),
        (
            "\n[drive.shoulder]\nkind = 'pd'\nkp = -1\nkd = 1\ntarget = 0",
            ": drive.shoulder: pd kp: is negative (-1); give a value >= 0",
        ),
        (
            "\n[drive.shoulder]\nkind = 'pd'\nkd = 1\ntarget = 0",
            ": drive.shoulder.kp: is missing; add kp = ...",
        ),
        (
            "\n[initial]\nposition.slide = '3 deg'",
            ": initial.position.slide: has a unit of angle where a length belongs; "
            "use one of m, cm, mm, um, km",
        ),
        (
            "\n[initial]\nvelocity.shoulder = '3 parsec'",
            f": initial.velocity.shoulder: unknown unit 'parsec'; {UNITS}",
        ),
        (
            "\n[initial]\nposition.left.elbow = 1",
            ": initial.position.left: is a table where a number belongs; "
            "put quotes around a joint name that holds a dot",
        ),
        (
            "\n[wrench.upper]\nforce = [1, 2]",
            ": wrench.upper.force: has 2 numbers; give three",
        ),
        (
            "\n[wrench.upper]\ntable = 'a.csv'\ncolumns = ['a']",
            ": wrench.upper: columns has 1 names; name six: fx fy fz nx ny nz",
        ),
        (
            "floating_base = 1",
            ": floating_base: 1 does not fit here; give true or false",
        ),
        (
            "joint_order = 'name'",
            ": joint_order: 'name' is not known; use 'file' or 'pinocchio'",
        ),
        ("gravity = [0, 0]", ": gravity: has 2 numbers; give three"),
        ("drive = 3", ": drive: 3 does not fit here; give a table"),
    ],
)
def test_defect_is_named(write, complaint, text, expected):
    message = complaint(read_all, write(text))
    assert message == expected or (expected == message[: len(expected)] and UNITS in expected)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", ': model: is missing; add model = "FILE", above the first table'),
        ('model = "arm.urdf"', ": simulate: is missing; add [simulate] with duration = ... in s"),
        ('model = "arm.urdf"\n[simulate]', ": simulate.duration: is missing; add duration = ..."),
        (
            'model = "arm.urdf"\n[simulate]\nduration = 0',
            ": simulate.duration: is 0; give a number above 0",
        ),
        (
            'model = "arm.urdf"\n[simulate]\nduration = 1\ntolerance = 0',
            ": simulate.tolerance: is 0; give a number above 0",
        ),
        (
            'model = "arm.urdf"\n[simulate]\nduration = 1\ntolerance = -1e-6',
            ": simulate.tolerance: is -1e-06; give a number above 0",
        ),
        (
            'model = "arm.urdf"\n[simulate]\nduration = "3 m"',
            ": simulate.duration: has a unit of length where a time belongs; "
            "use one of s, ms, min, h",
        ),
        (
            'model = "arm.urdf"\n[simulate]\nduration = 1\nthreads = 0',
            ": simulate.threads: is 0; give a number at least 1",
        ),
        (
            'model = "arm.urdf"\n[simulate]\nduration = 1\nthreads = 1.5',
            ": simulate.threads: 1.5 does not fit here; give a whole number",
        ),
        (
            'model = "arm.urdf"\n[simulate]\nduration = 1\nintegrator = "adam"',
            ": simulate.integrator: unknown integrator 'adam'; did you mean 'adams'?",
        ),
        (
            'model = "arm.urdf"\n[simulate]\nduration = 1\nmethod = "featherstone"',
            ": simulate.method: unknown method 'featherstone'; "
            "known: articulated_body, constraint_force, piecewise, "
            "composite_rigid_body, joint_space_conjugate_gradient, global_projection, auto",
        ),
        (
            'model = "arm.urdf"\n[simulate]\nduration = 1\nsolver = "tomas"',
            ": simulate.solver: unknown solver 'tomas'; did you mean 'thomas'?",
        ),
        (
            "model = 3\n[simulate]\nduration = 1",
            ": model: 3 does not fit here; give a table",
        ),
        (
            "[model]\n[simulate]\nduration = 1",
            ': model: no model is given; give one: model = "robot.urdf", or [model.chain], '
            "[model.tree], [model.srms]",
        ),
        (
            "[model]\npath = 'a'\nchain = {}\n[simulate]\nduration = 1",
            ': model: path and chain are both given; give one: model = "robot.urdf", '
            "or [model.chain], [model.tree], [model.srms]",
        ),
        (
            "model = 'a'\nmodel = 'b'\n",
            ":2: scenario: is not valid TOML (Cannot overwrite a value); correct the syntax",
        ),
        (
            "model = ",
            ": scenario: is not valid TOML (Invalid value); correct the syntax",
        ),
    ],
)
def test_defect_of_the_whole_is_named(write, complaint, text, expected):
    assert complaint(read_all, write(text, good="")) == expected


def test_file_that_is_no_text(write, complaint):
    path = write()
    path.write_bytes(b"model = 'a'\nx = '\xff'")
    assert complaint(load_scenario, path) == ":2: scenario: is not UTF-8 text; save it as UTF-8"


@pytest.mark.parametrize(
    "text",
    [
        "x = " + "[" * 100_000,
        "x = 1" + "0" * 10_000,
        "a" + ".a" * 50_000 + " = 1",
        "x = " + "{a = " * 500,
    ],
)
def test_files_made_to_exhaust_the_parser(write, complaint, text):
    complaint(load_scenario, write(text, good=""))


def test_missing_scenario(tmp_path, complaint):
    assert complaint(load_scenario, tmp_path / "x.toml") == (
        ": scenario: no such file; check the path"
    )


def test_missing_model_names_the_model_file(write, arm):
    path = write(good=GOOD.replace("arm.urdf", "amr.urdf"))
    with pytest.raises(InputError) as caught:
        read_all(path)
    assert str(caught.value) == (
        f"{arm.with_name('amr.urdf')}: model file: no such file; "
        "check the path (did you mean 'arm.urdf'?)"
    )


def test_unclear_column(write, arm, complaint):
    (arm.parent / "t.csv").write_text("time,a,b\n0,1,2\n1,3,4\n")
    path = write("\n[drive.shoulder]\nkind = 'torque'\ntable = 't.csv'")
    assert complaint(read_all, path) == (
        ": drive.shoulder: which column of 't.csv' is meant is not clear; add column = one of a, b"
    )


def test_column_in_the_wrong_unit(write, arm):
    (arm.parent / "t.csv").write_text("time,a [mm]\n0,1\n1,3\n")
    path = write("\n[drive.shoulder]\nkind = 'torque'\ntable = 't.csv'")
    with pytest.raises(InputError) as caught:
        read_all(path)
    assert str(caught.value) == (
        f"{arm.with_name('t.csv')}:1: column 'a': has a unit of length where a moment belongs; "
        "use one of Nm, kNm, MNm, Ncm, Nmm, mNm"
    )


def test_model_file_options_do_not_go_with_generators(write, complaint):
    path = write("floating_base = true\n[model.chain]\n[simulate]\nduration = 1", good="")
    assert complaint(read_all, path) == ": floating_base: belongs to a model file; remove it"


def test_generator_with_an_unknown_key(write, complaint):
    path = write("[model.chain]\nn_bodie = 3\n[simulate]\nduration = 1", good="")
    assert complaint(read_all, path) == (
        ": model.chain.n_bodie: unknown key; did you mean 'n_bodies'?"
    )


def test_generator(write):
    path = write(
        "gravity = [0, 0, 0]\n[model.chain]\nn_bodies = 3\n[simulate]\nduration = 1", good=""
    )
    model = load_scenario(path).load_model()
    assert model.n_bodies == 3
    np.testing.assert_array_equal(model.gravity, [0, 0, 0])


def test_generator_with_a_bad_value(write, complaint):
    path = write("[model.chain]\nn_bodies = -3\n[simulate]\nduration = 1", good="")
    assert complaint(read_all, path).startswith(": model.chain: ")
    path = write("[model.chain]\nn_bodies = 'x'\n[simulate]\nduration = 1", good="")
    assert complaint(read_all, path).startswith(": model.chain: ")


KEY = st.sampled_from(
    ["model", "gravity", "drive", "shoulder", "kind", "kp", "simulate", "duration", "initial"]
)
VALUE = st.sampled_from(
    ["1", "-1", "nan", "true", "'pd'", "'3 deg'", "[]", "[1, 2, 3]", "{}", "''"]
)
ENTRY = st.builds(
    lambda keys, value: f"{'.'.join(keys)} = {value}", st.lists(KEY, min_size=1, max_size=3), VALUE
)


@given(st.lists(ENTRY, max_size=4))
def test_any_toml_is_a_scenario_or_one_line(tmp_path_factory, entries):
    path = tmp_path_factory.getbasetemp() / "fuzz.toml"
    path.write_text("\n".join(entries))
    try:
        load_scenario(path)
    except InputError as error:
        message = str(error)
    else:
        return
    assert message.isprintable()
    assert message.startswith(str(path))
    assert "; " in message


def test_options_are_those_of_the_core(write):
    names = {row["name"] for row in lw.numerics()}
    assert {*SimulateSection.model_fields} == {"duration", "threads", *names}
    assert {field.name for field in fields(lw.Numerics)} == {*names, "solver_options"}
    assert {row["name"]: row["units"] for row in lw.numerics() if row["units"]} == {
        "step": "s",
        "max_step": "s",
    }


WRENCH = """
[model.chain]
n_bodies = 2
[wrench.link_2]
force = [1, 0, 0]
{}
[simulate]
duration = 0.1
"""


def test_axes_of_a_wrench_are_words_or_angles(tmp_path):
    path = tmp_path / "case.toml"

    def wrench(line):
        path.write_text(WRENCH.format(line))
        scenario = load_scenario(path)
        return scenario.simulate_arguments(scenario.load_model())["wrenches"]["link_2"]

    lines = ('axes = "world"', 'axes = "frame"', "axes = [0, 0, 1]", "")
    assert [wrench(line).axes for line in lines] == ["world", "frame", "frame", "world"]
    assert wrench(lines[2]).at.axes[0, 0] == pytest.approx(math.cos(1))
    with pytest.raises(lw.InputError, match="frame: unknown key"):
        wrench('frame = "body"')
