"""<connect> and <weld> of an MJCF as joints that close loops, against MuJoCo's own residuals."""

import numpy as np
import pytest

import linkwise as lw
from helpers.closing_frames import closing_frames
from linkwise.io.mjcf import Names, rotation
from linkwise.io.mjcf_equalities import Equalities
from linkwise.io.mjcf_state import position_from_mujoco

mujoco = pytest.importorskip("mujoco")

MACHINE = """<mujoco><worldbody>
  <body name="a" pos="0.1 0.2 0.3" euler="20 30 40">
    <joint name="a1" type="ball" pos="0.01 0.02 0.03"/><geom size="0.1"/>
    <site name="sa" pos="0.2 0.1 -0.1" euler="10 50 -20"/>
    <body name="b" pos="0.3 0 0.1" euler="0 70 0">
      <joint name="b1" axis="1 2 3" pos="-0.05 0.02 0"/><joint name="b2" type="slide" axis="0 1 1"/>
      <geom size="0.1"/>
    </body>
  </body>
  <body name="c" pos="-0.2 0.1 0.2" euler="-30 10 0">
    <freejoint name="c1"/><geom size="0.1"/><site name="sc" pos="0 0.1 0.2" euler="0 -40 15"/>
  </body>
</worldbody><equality>%s</equality></mujoco>"""

CONNECTS = {
    "bodies": '<connect name="e" body1="b" body2="c" anchor="0.1 -0.2 0.05"/>',
    "world": '<connect name="e" body1="b" anchor="0.1 -0.2 0.05"/>',
    "sites": '<connect name="e" site1="sa" site2="sc"/>',
}
WELDS = {
    "bodies": '<weld name="e" body1="b" body2="c" anchor="0.1 0.2 0.3"/>',
    "relpose": '<weld name="e" body1="b" body2="c" relpose="0.1 0.2 0.3 0.5 0.5 -0.5 0.5" '
    'anchor="-0.1 0.05 0"/>',
    "world": '<weld name="e" body1="c"/>',
    "sites": '<weld name="e" site1="sa" site2="sc"/>',
}


def random_pose(mj_model, seed):
    """A configuration, and MuJoCo's residuals there."""
    data = mujoco.MjData(mj_model)
    rng = np.random.default_rng(seed)
    mujoco.mj_integratePos(mj_model, data.qpos, rng.normal(size=mj_model.nv), 1.0)
    mujoco.mj_forward(mj_model, data)
    return data.qpos.copy(), data.efc_pos[: data.ne].copy()


def both(equality, seed=0):
    text = MACHINE % equality
    mj_model = mujoco.MjModel.from_xml_string(text)
    model = lw.load(text)
    qpos, residual = random_pose(mj_model, seed)
    frames = closing_frames(model, position_from_mujoco(model, mj_model, qpos))
    return model, frames[0], residual


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", CONNECTS)
def test_connect_is_as_far_apart_as_in_mujoco(kind, seed):
    model, (here, there), residual = both(CONNECTS[kind], seed)
    assert (model.loop_names, model.loop_types) == (["e"], ["spherical"])
    assert np.linalg.norm(residual) > 0.05
    np.testing.assert_allclose(here[:3, 3] - there[:3, 3], residual, atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", WELDS)
def test_weld_is_as_far_apart_as_in_mujoco(kind, seed):
    model, (here, there), residual = both(WELDS[kind], seed)
    assert (model.loop_names, model.loop_types) == (["e"], ["fixed"])
    np.testing.assert_allclose(here[:3, 3] - there[:3, 3], residual[:3], atol=1e-12)
    # Its rotational residual is the vector part of the quaternion between the two: sin(angle / 2).
    between = here[:3, :3].T @ there[:3, :3]
    angle = np.arccos((np.trace(between) - 1) / 2)
    assert np.linalg.norm(residual[3:]) == pytest.approx(abs(np.sin(angle / 2)), abs=1e-10)


@pytest.mark.parametrize(
    "inside",
    [
        'joint1="b1" joint2="b2" polycoef="0.3 -2.5 0 0 0"',
        'joint1="b1" joint2="b2" polycoef="0.3 -2.5 1.5 -0.7 0.4"',
        'joint1="b1" polycoef="0.3"',
    ],
)
def test_a_joint_constraint_is_a_coupling(inside):
    """Its sum is off by what MuJoCo's residual says, whose hinges count from their ref."""
    text = (MACHINE % f'<joint name="e" {inside}/>').replace('name="b1"', 'name="b1" ref="20"')
    mj_model = mujoco.MjModel.from_xml_string(text)
    model = lw.load(text)
    assert model.coupling_names == ["e"]
    found = Equalities(mj_model, rotation, Names(mj_model).joint)
    ((name, factors, offset),) = found.couplings
    assert (name, len(factors)) == ("e", 2 if "joint2" in inside else 1)
    for seed in range(3):
        qpos, residual = random_pose(mj_model, seed)
        q = position_from_mujoco(model, mj_model, qpos)
        off = -offset
        for joint, powers in factors.items():
            off += np.polynomial.Polynomial([0, *powers])(q[model.q_slice(joint)][0])
        assert residual == pytest.approx([off], rel=1e-12)


def notes_of(text, **options):
    with pytest.warns(lw.ModelWarning):
        model = lw.load(text, **options)
    return model, [note.text for note in model.notes if note.element == "equality"]


def test_left_out_where_asked_for():
    model, notes = notes_of(MACHINE % CONNECTS["bodies"], equality="ignore")
    assert model.n_loops == 0
    assert notes == ['1 equality constraints ignored, as equality="ignore" asks: loops stay open']


@pytest.mark.parametrize(
    ("equality", "reason"),
    [
        ('<connect body1="b" anchor="0 0 0" active="false"/>', "not active"),
    ],
)
def test_others_are_named(equality, reason):
    model, notes = notes_of(MACHINE % equality)
    assert model.n_loops == 0
    assert notes == [f"1 equality constraints ignored: {reason}"]


def test_switched_off_by_the_file():
    text = (MACHINE % CONNECTS["bodies"]).replace(
        "<worldbody>", '<option><flag equality="disable"/></option><worldbody>'
    )
    assert notes_of(text)[1] == ["1 equality constraints ignored: the file switches them off"]


def test_mocap_bodies_hold_nothing():
    text = (MACHINE % '<weld body1="m" body2="c"/>').replace(
        "<worldbody>", '<worldbody><body name="m" mocap="true"/>'
    )
    model, notes = notes_of(text)
    assert model.n_loops == 0
    assert "they hold a mocap body, which a program moves" in notes[0]


def test_bodies_that_are_one_are_left_out():
    text = (MACHINE % '<weld body1="a" body2="d"/>').replace(
        "</body>\n  <body name=\"c\"", '<body name="d" pos="0 0 1"/></body>\n  <body name="c"'
    )  # fmt: skip
    assert "both of their bodies are one" in notes_of(text)[1][0]


@pytest.mark.parametrize(
    ("equality", "text"),
    [
        (CONNECTS["bodies"], "<connect> is made exact: a spherical joint without give"),
        (WELDS["sites"], "<weld> is made exact: a fixed joint without give"),
        ('<joint name="e" joint1="b1"/>', "<joint> is made exact: a coupling without give"),
    ],
)
def test_runs_say_that_it_is_exact(equality, text):
    with pytest.warns(lw.ModelWarning, match="made exact"):
        model = lw.load(MACHINE % equality)
    q0 = lw.assemble(model, model.initial_configuration()).q if model.n_loops else None
    run = lw.simulate(model, duration=0.01, q0=q0)
    assert {"element": "e", "text": text} in run.warnings


def test_names_are_unique():
    model = lw.load(MACHINE % CONNECTS["bodies"].replace('"e"', '"b1"'))
    assert model.loop_names == ["b1_"]


def test_in_a_scenario(tmp_path):
    (tmp_path / "m.xml").write_text(MACHINE % CONNECTS["bodies"])
    path = tmp_path / "s.toml"
    for line, count in (("", 1), ('equality = "ignore"\n', 0)):
        path.write_text(f'model = "m.xml"\n{line}[simulate]\nduration = 1\n')
        assert lw.load_scenario(path).load_model().n_loops == count
