"""Rotors in the <transmission> elements of a URDF."""

import numpy as np
import pytest

import linkwise as lw

WINCH = """<robot name="winch" xmlns:drake="http://drake.mit.edu"><link name="base"/>
<link name="drum"><inertial><mass value="2"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.02"/></inertial></link>
<link name="hook"><inertial><mass value="3"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="shaft" type="continuous"><parent link="base"/><child link="drum"/><axis xyz="0 0 1"/>
</joint><joint name="rope" type="prismatic"><parent link="base"/><child link="hook"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
{}</robot>"""
ON_SHAFT = '<joint name="shaft"/>'
REDUCTION = "<mechanicalReduction>113.9</mechanicalReduction>"
ROTOR = "<motorInertia>5e-6</motorInertia>"
DRAKE_ROTOR = '<drake:rotor_inertia value="5e-6"/>'
DRAKE_RATIO = '<drake:gear_ratio value="113.9"/>'
ARMATURE = 113.9**2 * 5e-6


def load(*inner):
    text = "".join(f'<transmission name="t{k}">{i}</transmission>' for k, i in enumerate(inner))
    return lw.load(WINCH.format(text))


def about(model, element):
    return [(n.level, n.text) for n in model.notes if n.element == element]


@pytest.mark.parametrize(
    "inner",
    [
        f"{ON_SHAFT}<actuator name='m'>{REDUCTION}{ROTOR}</actuator>",
        f"{ON_SHAFT}<actuator name='m'>{DRAKE_ROTOR}{DRAKE_RATIO}</actuator>",
        f"{ON_SHAFT}<actuator name='m'>{REDUCTION}{ROTOR}{DRAKE_ROTOR}{DRAKE_RATIO}</actuator>",
        f"{ON_SHAFT}<actuator name='m'>{ROTOR}</actuator>{REDUCTION}",
        f"{ON_SHAFT}<actuator name='m'/>{ROTOR}{REDUCTION}",
        '<joint name="shaft"><mechanical_reduction>-113.9</mechanical_reduction></joint>'
        "<actuator><rotor_inertia>5e-6</rotor_inertia></actuator>",
        f"{ON_SHAFT}<actuator>{DRAKE_ROTOR.replace('drake:', 'other:')}{REDUCTION}</actuator>",
    ],
)
def test_a_rotor_and_its_gear_are_armature(inner):
    """dw/dt = tau / (I + g^2 J), whoever wrote them."""
    model = load(inner)
    a = lw.forward_dynamics(model, [0, 0], [0, 0], [1, 0])
    np.testing.assert_allclose(a[0], 1 / (0.02 + ARMATURE), rtol=1e-14)
    ((level, text),) = about(model, "shaft")
    assert level == "info"
    assert text.startswith("armature 0.0648661 from transmission 't0': motor inertia 5e-06 kg m2")


def test_several_motors_add_up_and_a_sliding_joint_has_a_ratio_per_metre():
    motor = f"<actuator>{ROTOR}<mechanicalReduction>{{}}</mechanicalReduction></actuator>"
    model = load(
        f"{ON_SHAFT}{motor.format(100)}{motor.format(200)}",
        f"{ON_SHAFT}{motor.format(10)}",
        f'<joint name="rope"/>{motor.format(1000)}',
    )
    np.testing.assert_allclose(model.armature, [(1e4 + 4e4 + 1e2) * 5e-6, 5.0], rtol=1e-14)


@pytest.mark.parametrize(
    ("inner", "element", "said", "armature"),
    [
        (f"{ON_SHAFT}<actuator>{DRAKE_ROTOR}</actuator>", "shaft", "no gear ratio is given", 5e-6),
        (
            f"{ON_SHAFT}<actuator>{DRAKE_ROTOR}{DRAKE_RATIO}"
            "<mechanicalReduction>1</mechanicalReduction></actuator>",
            "shaft",
            "gear ratio 113.9 of gear_ratio; mechanicalReduction 1 beside it is not used",
            ARMATURE,
        ),
        (
            f'{ON_SHAFT}<joint name="rope"/><actuator>{ROTOR}{REDUCTION}</actuator>',
            "transmission 't0'",
            "drives 2 joints: its motor inertia of 5e-06 kg m2 is not read (line 9)",
            0,
        ),
        (
            f"<actuator>{ROTOR}{REDUCTION}</actuator>",
            "transmission 't0'",
            "drives 0 joints: its motor inertia",
            0,
        ),
        (
            f'<joint name="shift"/><actuator>{ROTOR}</actuator>',
            "transmission 't0'",
            "drives joint 'shift', which does not exist: its motor inertia",
            0,
        ),
        (
            f"{ON_SHAFT}<actuator>{REDUCTION}</actuator>",
            "<transmission>",
            "reduction 113.9 of joint 'shaft' has no motor's inertia beside it: rotors are",
            0,
        ),
    ],
)
def test_what_is_assumed_or_left_out_is_a_warning(inner, element, said, armature):
    model = load(inner)
    assert any(level == "warning" and said in text for level, text in about(model, element))
    np.testing.assert_allclose(model.armature, [armature, 0], rtol=1e-14)


def test_reductions_of_one_without_an_inertia_are_counted():
    inner = f"{ON_SHAFT}<actuator><mechanicalReduction>1</mechanicalReduction></actuator>"
    model = load(inner, inner, inner.replace(">1<", ">${{ratio}}<"), "<type>other</type>")
    assert about(model, "<transmission>") == [
        ("info", "4 without a motor's inertia: nothing of them acts")
    ]
    assert not model.armature.any()


@pytest.mark.parametrize(
    ("inner", "said"),
    [
        (f"{ROTOR}<motorInertia>6e-6</motorInertia>", "gives a motor's inertia twice"),
        ("<motorInertia>-1</motorInertia>", r"motor inertia is negative \(-1\)"),
        ("<motorInertia>five</motorInertia>", "motorInertia: 'five' is not a number"),
        ("<motorInertia>nan</motorInertia>", "motorInertia: "),
        ("<motorInertia/>", "<motorInertia> has no value"),
        (f"{ROTOR}<mechanicalReduction>ten</mechanicalReduction>", "mechanicalReduction: 'ten'"),
    ],
)
def test_numbers_that_are_none_are_refused_with_their_line(inner, said):
    with pytest.raises(lw.InputError, match=rf":9: transmission 't0': .*{said}"):
        load(f"{ON_SHAFT}<actuator>{inner}</actuator>")
