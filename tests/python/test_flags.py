"""What is True or False is nothing else: the text "no" would count as true."""

import numpy as np
import pytest

import linkwise as lw

ARM = "tests/data/none.urdf"  # flags are looked at before any file
CALLS = {
    "chain": lambda flag: lw.scenes.chain(2, floating_base=flag),
    "tree": lambda flag: lw.scenes.tree(2, floating_base=flag),
    "load": lambda flag: lw.load(ARM, floating_base=flag),
    "keep_fixed": lambda flag: lw.load(ARM, keep_fixed=flag),
}


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.parametrize("flag", ["no", 0, 1, None, [], NotImplemented, np.zeros(2)])
def test_other_values_are_refused(call, flag):
    with pytest.raises(lw.InputError, match="give True or False"):
        CALLS[call](flag)


@pytest.mark.parametrize("call", ["chain", "tree"])
def test_numpy_s_truth_values_are_taken(call):
    assert CALLS[call](np.bool_(True)) is not None


@pytest.mark.parametrize("names", [np.array("joint_1"), np.array([["joint_1"]]), 3, [1]])
@pytest.mark.parametrize("argument", ["joints", "record"])
def test_names_stand_in_a_list(argument, names):
    with pytest.raises(lw.InputError, match=r"^(joints|record): "):
        lw.simulate(lw.scenes.chain(1), duration=0.01, **{argument: names})


def test_a_table_that_has_ended_before_the_start_is_its_last_row():
    """The slope before its end is no target velocity at the start."""
    model = lw.scenes.chain(1)
    drives = [lw.PD(10, 5, target) for target in (lw.Table([-1, 0], [1.0, 2.0]), 2.0)]
    runs = [lw.simulate(model, duration=0.1, every=0.05, drives={"joint_1": d}) for d in drives]
    np.testing.assert_array_equal(runs[0].drive_torque, runs[1].drive_torque)


def test_what_loads_are_asked_for_is_a_list_and_a_point_that_numbers_reach():
    run = lw.simulate(lw.scenes.chain(1), duration=0.02, every=0.01)
    with pytest.raises(lw.InputError, match="give a list of names"):
        lw.loads.damage_equivalent(run, joints=np.array("joint_1"))
    with pytest.raises(lw.InputError, match="so far away"):
        lw.loads.in_frame(run, "world", point=[1e308, 1e308, 1e308])
