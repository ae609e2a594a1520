"""Rotor inertia, springs, dampers and friction of MJCF actuators and tendons, beside MuJoCo's."""

import numpy as np
import pytest

import linkwise as lw
from linkwise.io import mjcf_state

mujoco = pytest.importorskip("mujoco")

MACHINE = """
<mujoco>
  <compiler autolimits="true"/>
  <worldbody>
    <body name="upper">
      <joint name="h" axis="0 1 0" armature=".1" damping=".1" stiffness="2" springref="20"/>
      <geom size=".1" pos=".3 0 0"/>
      <body name="lower" pos=".5 0 0">
        <joint name="k" type="slide" axis="1 0 0" ref=".1"/>
        <geom size=".1" pos=".3 0 .1"/>
        <body name="hand" pos=".5 0 0"><joint name="b" type="ball"/><geom size=".1" pos=".1 0 0"/>
        <site name="s"/></body>
      </body>
    </body>
  </worldbody>
  <tendon>{tendon}</tendon>
  <actuator>{actuator}</actuator>
</mujoco>
"""
ALONE = """<fixed name="t" armature=".2" damping=".3" stiffness="4" springlength=".1">
<joint joint="h" coef="-2"/></fixed>"""
CASES = {
    "motor": ("", '<motor joint="h" gear="3" armature=".5" damping=".2"/>'),
    "servo": ("", '<position joint="k" kp="0" armature=".4"/><motor joint="k" armature="1"/>'),
    "ball": ("", '<motor joint="b" gear="2 1 0" armature=".05" damping=".02"/>'),
    "in parent": ("", '<motor jointinparent="h" gear="2" armature=".5"/>'),
    "tendon": (ALONE, ""),
    "on a tendon": (ALONE, '<motor tendon="t" gear="3" armature=".7" damping=".2"/>'),
    "as drawn": (ALONE.replace('springlength=".1"', "").replace('"h"', '"k"'), ""),
}


def load(tmp_path, tendon, actuator):
    path = tmp_path / "machine.xml"
    path.write_text(MACHINE.format(tendon=tendon, actuator=actuator))
    return lw.load(path), mujoco.MjModel.from_xml_path(str(path))


def mass_matrix(mj_model, data):
    full = np.zeros((mj_model.nv, mj_model.nv))
    try:
        mujoco.mj_fullM(mj_model, data, full)
    except TypeError:  # before MuJoCo 3.4
        mujoco.mj_fullM(mj_model, full, data.qM)
    return full


@pytest.mark.parametrize("case", list(CASES))
def test_mass_matrix_and_accelerations_are_mujocos(tmp_path, rng, case):
    model, mj_model = load(tmp_path, *CASES[case])
    data = mujoco.MjData(mj_model)
    mujoco.mj_integratePos(mj_model, data.qpos, rng.normal(size=mj_model.nv), 1)
    data.qvel[:] = rng.normal(size=mj_model.nv)
    mj_model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    mujoco.mj_forward(mj_model, data)
    q = mjcf_state.position_from_mujoco(model, mj_model, data.qpos)
    v = mjcf_state.velocity_from_mujoco(model, mj_model, data.qpos, data.qvel)
    theirs = mass_matrix(mj_model, data)
    np.testing.assert_allclose(lw.mass_matrix(model, q), theirs, atol=1e-12 * np.abs(theirs).max())
    bare = load(tmp_path, "", "")[0]
    assert np.abs(lw.mass_matrix(bare, q) - theirs).max() > 0.01  # the case adds something
    theirs = mjcf_state.acceleration_from_mujoco(model, mj_model, data.qpos, data.qvel, data.qacc)
    ours = lw.forward_dynamics(model, q, v, passive=True)
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)
    assert not [note for note in model.notes if "is ignored" in note.text]


def test_friction_of_a_tendon_is_its_joints(tmp_path):
    tendon = '<fixed frictionloss=".5"><joint joint="h" coef="-2"/></fixed>'
    model, _ = load(tmp_path, tendon, "")
    np.testing.assert_allclose(model.friction, [1, 0, 0, 0, 0])


TWO = '<joint joint="h" coef="2"/><joint joint="k" coef="3"/>'


@pytest.mark.parametrize(
    ("tendon", "actuator", "element", "expected"),
    [
        (f'<fixed name="t" armature=".7">{TWO}</fixed>', "", "tendon 't'", "its armature acts"),
        (f'<fixed name="t" damping=".7">{TWO}</fixed>', "", "tendon 't'", "its damper acts"),
        (
            f'<fixed name="t">{TWO}</fixed>',
            '<motor name="m" tendon="t" armature=".5"/>',
            "actuator 'm'",
            "the mass matrix lacks it",
        ),
        (
            '<fixed name="t" stiffness="3" springlength="0 .2"><joint joint="h" coef="1"/></fixed>',
            "",
            "tendon 't'",
            "its spring",
        ),
        (
            '<spatial name="t" armature="1"><site site="s"/><site site="o"/></spatial>',
            "",
            "tendon 't'",
            "the mass matrix lacks it",
        ),
    ],
)
def test_what_couples_joints_is_a_warning(tmp_path, tendon, actuator, element, expected):
    path = tmp_path / "machine.xml"
    text = MACHINE.format(tendon=tendon, actuator=actuator)
    path.write_text(text.replace("<worldbody>", '<worldbody><site name="o"/>'))
    notes = [note for note in lw.load(path).notes if note.element == element]
    assert [note.level for note in notes] == ["warning"]
    assert expected in notes[0].text


def test_the_warning_says_how_much_is_left_out(tmp_path):
    """Beside MuJoCo's mass matrix with and without: what the joint with the largest share lacks."""
    tendon = f'<fixed name="t" armature=".7" damping=".2" frictionloss=".1" stiffness="2">{TWO}'
    tendon += '</fixed><spatial name="s" armature=".2"><site site="s"/><site site="o"/></spatial>'
    actuator = '<motor name="m" tendon="t" gear="2" armature=".5"/>'
    path = tmp_path / "machine.xml"
    text = MACHINE.replace("<worldbody>", '<worldbody><site name="o" pos="0 0 1"/>')
    path.write_text(text.format(tendon=tendon, actuator=actuator))
    notes = {note.element: note.text for note in lw.load(path).notes}
    matrices = {}
    for case in ("", "t", "s", "m"):
        mj_model = mujoco.MjModel.from_xml_path(str(path))
        for k, name in enumerate("ts"):
            mj_model.tendon_armature[k] *= case == name
        mj_model.actuator_armature[:] *= case == "m"
        data = mujoco.MjData(mj_model)
        mujoco.mj_forward(mj_model, data)
        matrices[case] = np.diag(mass_matrix(mj_model, data))
    plain = matrices[""]
    for case, element in (("t", "tendon 't'"), ("s", "tendon 's'"), ("m", "actuator 'm'")):
        added = matrices[case] - plain
        most = int(added.argmax())
        joint, unit = (("h", "kg m2"), ("k", "kg"), *[("b", "kg m2")] * 3)[most]
        said = f"at joint '{joint}' armature {added[most]:.3g} {unit} beside {plain[most]:.3g}"
        assert said in notes[element]
    assert ", damper 1.8 N s/m, friction 0.3 N, spring 18 N/m" in notes["tendon 't'"]
