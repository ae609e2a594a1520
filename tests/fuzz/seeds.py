"""Good inputs, to be damaged."""

import tomllib
import warnings
from functools import cache
from pathlib import Path

import numpy as np

import linkwise as lw
from helpers.arm_urdf import ARM
from helpers.press_sdf import PRESS
from linkwise.io.sdf import _READ
from linkwise.io.sdf_frames import _ATTRIBUTES
from linkwise.io.urdf_vocabulary import ATTRIBUTES
from linkwise.scenario import schema

_HERE = Path(__file__).resolve().parent
DATA = _HERE.parent / "data"

TREE = """<robot name="tree">
  <link name="body"><inertial><origin xyz="0.1 0 0"/><mass value="5"/>
    <inertia ixx="0.2" ixy="0.01" ixz="0" iyy="0.3" iyz="0" izz="0.4"/></inertial>
    <visual><geometry><box size="1 1 1"/></geometry></visual></link>
  <link name="ball"/><link name="hand"><inertial><mass value="1"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <link name="plate"><inertial><mass value="2"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <link name="tool"/>
  <joint name="turn" type="continuous"><parent link="body"/><child link="ball"/>
    <origin xyz="0 0 1" rpy="0 1.57 0"/><axis xyz="0 0 1"/><dynamics damping="0.1"/></joint>
  <joint name="wrist" type="revolute"><parent link="ball"/><child link="hand"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" effort="10" velocity="2"/>
    <mimic joint="turn" multiplier="2" offset="0.1"/></joint>
  <joint name="slip" type="planar"><parent link="body"/><child link="plate"/><axis xyz="0 0 1"/>
    </joint>
  <joint name="weld" type="fixed"><parent link="hand"/><child link="tool"/>
    <origin xyz="0 0.1 0"/></joint>
  <transmission name="t"><joint name="turn"/></transmission><gazebo reference="hand"/>
</robot>
"""
#: A ring: the rocker has two parents, and a gear beside it goes with the crank.
RING = """<robot name="ring">
  <link name="base"/>
  <link name="crank"><inertial><origin xyz="0.1 0 0"/><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
  <link name="bar"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
  <link name="rocker"><inertial><origin xyz="0 0.1 0"/><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
  <link name="gear"><inertial><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
  <joint name="drive" type="continuous"><parent link="base"/><child link="crank"/>
    <axis xyz="0 0 1"/><dynamics damping="0.1"/></joint>
  <joint name="knee" type="continuous"><parent link="crank"/><child link="bar"/>
    <origin xyz="0.2 0 0"/><axis xyz="0 0 1"/></joint>
  <joint name="pivot" type="continuous"><parent link="base"/><child link="rocker"/>
    <origin xyz="0.5 -0.2 0"/><axis xyz="0 0 1"/></joint>
  <joint name="wrist" type="continuous"><parent link="bar"/><child link="rocker"/>
    <origin xyz="0.4 0 0"/><axis xyz="0 0 1"/><dynamics damping="0.01" friction="0.01"/></joint>
  <joint name="mesh" type="continuous"><parent link="base"/><child link="gear"/>
    <origin xyz="0 1 0"/><axis xyz="0 0 1"/><mimic joint="drive" multiplier="-2"/></joint>
</robot>
"""
RING_MJCF = """<mujoco><worldbody>
  <body name="crank"><joint name="drive" axis="0 0 1"/><geom type="capsule"
    size=".05" fromto="0 0 0 .2 0 0"/>
    <body name="bar" pos=".2 0 0"><joint name="knee" axis="0 0 1"/>
      <geom type="capsule" size=".05" fromto="0 0 0 .4 0 0"/></body></body>
  <body name="rocker" pos=".5 -.2 0"><joint name="pivot" axis="0 0 1"/><geom size=".1 .1 .1"
    type="box"/></body>
  <body name="gear" pos="0 1 0"><joint name="mesh" axis="0 0 1"/><geom size=".1"/></body>
  <body name="box" pos="1 1 0"><freejoint/><geom size=".1"/></body>
  </worldbody><equality>
  <connect body1="bar" body2="rocker" anchor=".4 0 0"/>
  <weld body1="box" body2="gear" relpose="1 0 0 1 0 0 0"/>
  <joint joint1="mesh" joint2="drive" polycoef="0 -2 0 0 0"/>
</equality></mujoco>
"""
RING_SCENARIO = """
model = "ring.urdf"
mimic = "couple"
[loop.prop]
type = "spherical"
parent = "bar"
child = "rocker"
translation = ["400 mm", 0, 0]
child_translation = [0, 0, 0]
child_rotation = [0, 0, "10 deg"]
damping = 0.1
[rod.link]
parent = "crank"
child = "rocker"
length = "40 cm"
point = [0.2, 0, 0]
child_point = [0, 0, 0.0]
[coupling.pair]
factors = {mesh = 1, drive = 2.0}
offset = 0.0
[drive.drive]
kind = "torque"
value = 1
[simulate]
duration = 0.02
integrator = "bdf"
[output]
every = 0.01
"""
SCENARIO = """
model = "arm.urdf"
gravity = [0, 0, "-9.81 m/s2"]
keep_fixed = false
[initial]
position = {shoulder = "10 deg", slide = 0.1}
velocity = {shoulder = 0.5}
[drive.shoulder]
kind = "pd"
kp = 50
kd = "5 N m s/rad"
table = "table.csv"
column = "shoulder"
[drive.slide]
kind = "torque"
value = "3 N"
[wrench.lower]
force = [0, "1 N", 0]
axes = "frame"
[payload.box]
link = "lower"
mass = "2 kg"
com = [0, 0, 0.1]
inertia = [0.1, 0.1, 0.1]
[link.upper]
mass = 3
[rating.shoulder]
torque = "40 N m"
force = 100
[simulate]
duration = "20 ms"
tolerance = 1e-4
integrator = "adams"
method = "auto"
[output]
every = "5 ms"
quantities = ["joint_load", "position"]
joints = ["shoulder"]
path = "run.zarr"
"""
CHAIN_SCENARIO = """
[model.chain]
n_bodies = 3
joint = "revolute"
axes = "parallel"
length = 0.5
floating_base = true
[drive.joint_2]
kind = "spring"
stiffness = 10
damping = 1
[drive.joint_3]
kind = "motion"
table = "table.csv"
columns = ["slide"]
[simulate]
duration = 0.01
integrator = "runge_kutta_4"
step = 1e-3
[output]
every = 2e-3
"""
TREE_SCENARIO = """
floating_base = true
mimic = "independent"
model = "tree.urdf"
[initial.position]
turn = 0.3
[wrench.plate]
table = "wrench.csv"
[simulate]
duration = 0.01
method = "constraint_force"
solver = "conjugate_gradients"
"""


def rows(columns, names, count=9):
    """A table of smooth values over 0 to 0.2 s."""
    times = np.linspace(0, 0.2, count)
    head = ",".join(["time", *names])
    body = [
        ",".join(f"{x:.6g}" for x in [t, *(0.1 * np.sin(3 * t + np.arange(columns)))])
        for t in times
    ]
    return "\n".join([head, *body]) + "\n"


TABLE = rows(2, ["shoulder", "slide"])
WRENCH_TABLE = rows(6, ["fx", "fy", "fz", "nx", "ny", "nz"])
STORAGE = "motion\nversion=1\nnRows=3\nnColumns=2\ninDegrees=no\nendheader\n" + (
    "time\tshoulder\n0\t1.5\n0.1\t1.25\n0.2\t1.125\n"
)
TABLES = (
    TABLE,
    WRENCH_TABLE,
    STORAGE,
    TABLE.replace(",", ";").replace(".", ","),
    "time;a b\n0;1\n",
)

URDFS = (ARM, TREE, RING)
URDF_WORDS = (
    [*ATTRIBUTES, "robot", "visual", "collision", "geometry", "transmission", "gazebo", "damping"],
    sorted({name for names in ATTRIBUTES.values() for name in names} | {"reference", "filename"}),
)
_MJCF_ELEMENTS = """mujoco worldbody body joint freejoint geom inertial site camera light default
compiler option asset mesh include attach replicate composite flexcomp actuator motor position
tendon fixed spatial equality connect weld sensor keyframe key frame size custom numeric contact
exclude general plugin hfield texture material"""
_MJCF_ATTRIBUTES = """name type axis pos quat euler mass size range damping armature frictionloss
stiffness ref springref class file count fromto inertia diaginertia fullinertia limited autolimits
angle gravity timestep qpos qvel joint body1 body2 density builtin width height nrow ncol solref
gear ctrlrange gravcomp mocap childclass prefix polycoef"""
MJCF_WORDS = (_MJCF_ELEMENTS.split(), _MJCF_ATTRIBUTES.split())
#: A model in a model, in a world with another.
_HALL = PRESS.replace("<model ", '<world name="hall"><model name="cell"><model ', 1).replace(
    "</sdf>",
    '<link name="table"/><joint name="stand" type="fixed"><parent>table</parent>'
    '<child>press</child></joint></model><model name="wall"><static>true</static>'
    '<link name="w"/></model><joint name="feet" type="ball"><parent>wall::w</parent>'
    "<child>cell::table</child></joint></world></sdf>",
)
SDFS = (PRESS, PRESS.replace('type="prismatic"', 'type="ball"'), _HALL)
SDF_WORDS = (
    [
        *_READ,
        "sdf",
        "world",
        "model",
        *sorted({word for words in _READ.values() for word in words.split()}),
    ],
    sorted(_ATTRIBUTES | {"version"}),
)
SCENARIO_WORDS = sorted(
    {
        name
        for section in (
            *schema._SECTIONS.values(),
            *schema._NAMED.values(),
            *schema.DRIVES.values(),
        )
        for name in section.model_fields
    }
    | {*schema.ScenarioFile.model_fields, "shoulder", "slide", "lower", "chain", "tree", "srms"}
)


@cache
def mjcfs():
    return (*(p.read_text() for p in sorted((DATA / "mjcf").glob("*.xml"))), RING_MJCF, RING_MJCF)


@cache
def scenarios():
    texts = (SCENARIO, CHAIN_SCENARIO, TREE_SCENARIO, RING_SCENARIO)
    return tuple(tomllib.loads(text) for text in texts)


def write_companions(folder):
    """The files that the scenarios name."""
    (folder / "arm.urdf").write_text(ARM)
    (folder / "tree.urdf").write_text(TREE)
    (folder / "ring.urdf").write_text(RING)
    (folder / "table.csv").write_text(TABLE)
    (folder / "wrench.csv").write_text(WRENCH_TABLE)


def machine(number):
    """One of some small machines of all joint types, with loops among them."""
    return _machines()[number % len(_machines())]


def any_machine(rng):
    """One of all of them."""
    return rng.choice(_machines())


@cache
def _machines():
    arm = lw.load(ARM)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", lw.ModelWarning)
        tree = lw.load(TREE, floating_base=True, mimic="independent")
        ring = lw.load(RING, mimic="couple")
    return (
        arm,
        tree,
        lw.scenes.chain(3),
        lw.scenes.tree(5, joint="universal"),
        _all_joints(),
        lw.scenes.benchmark("four_bars").model,
        ring,
        lw.scenes.chain(2).with_rod("rod", "ground", "link_2", length=1.0, point=(0.5, 0, -1)),
    )


def _all_joints():
    builder = lw.ModelBuilder("all", gravity=(0, 0, -9.81))
    builder.add_link("ground")
    before = "ground"
    kinds = ("revolute", "prismatic", "helical", "cylindrical", "universal", "spherical", "planar")
    for kind in kinds:
        builder.add_link(f"l_{kind}", mass=1, com=(0.1, 0, 0.2), inertia=np.eye(3) * 0.1)
        options = {"helical": {"pitch": 0.1}, "universal": {"axes": np.eye(3)[:2]}}.get(kind, {})
        builder.add_joint(kind, kind, before, f"l_{kind}", translation=(0, 0, 1), **options)
        before = f"l_{kind}"
    return builder.build()
