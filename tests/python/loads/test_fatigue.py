"""Cycles, damage-equivalent loads, durations and spectra of known signals."""

import numpy as np
import pytest
import xarray as xr

import linkwise as lw
from helpers.machines import pendulum, stopped_arm


def run_with(signal, times):
    """A run of the pendulum whose fx is this signal."""
    made = lw.simulate(pendulum(), times=times, extremes=False)
    load = made.joint_load.copy()
    load.values[:] = 0
    load.values[:, 0, 0] = signal
    dataset: xr.Dataset = made.dataset.assign(joint_load=load)
    return lw.Run(dataset, model=pendulum())


T = np.linspace(0, 10, 1001)


def test_ten_equal_cycles():
    run = run_with(3 * np.sin(2 * np.pi * T), T)
    found = lw.loads.cycles(run, "pivot", "fx")
    whole = found.sel(cycle=found.range > 5.9)
    assert float(whole["count"].sum()) == pytest.approx(10, abs=0.5)
    np.testing.assert_allclose(whole.range, 6, rtol=1e-12)
    equal = lw.loads.damage_equivalent(run, exponents=[3, 10]).sel(component="fx", joint="pivot")
    np.testing.assert_allclose(equal, 6, rtol=0.02)
    twice = lw.loads.damage_equivalent(run, exponents=[3], repetitions=20)
    np.testing.assert_allclose(twice.sel(component="fx"), 6 * 0.5 ** (1 / 3), rtol=0.02)


def test_the_example_of_the_standard():
    """ASTM E1049, figure 6: -2 1 -3 5 -1 3 -4 4 -2 has these cycles."""
    run = run_with([-2, 1, -3, 5, -1, 3, -4, 4, -2], np.arange(9.0))
    found = lw.loads.cycles(run, "pivot", "fx")
    counted = {}
    for size, count in zip(found.range.values, found["count"].values, strict=True):
        counted[float(size)] = counted.get(float(size), 0) + float(count)
    assert counted == {3: 0.5, 4: 1.5, 6: 0.5, 8: 1.0, 9: 0.5}


def test_load_duration_adds_up():
    run = run_with(np.where(T < 4, 1.0, 3.0), T)
    found = lw.loads.load_duration(run, "pivot", "fx", bins=2)
    np.testing.assert_allclose(found, [4.0, 6.0], atol=0.01)
    assert float(found.sum()) == pytest.approx(10.0)
    assert found.level.attrs["units"] == "N"


def test_the_spectrum_has_its_peak_and_its_power():
    run = run_with(5.0 + 2.0 * np.sin(2 * np.pi * 7 * T), T)
    found = lw.loads.spectrum(run, "pivot", "fx")
    assert float(found.frequency[found.argmax()]) == pytest.approx(7.0, abs=0.1)
    power = float(found.sum() * (found.frequency[1] - found.frequency[0]))
    assert power == pytest.approx(2.0, rel=1e-2)  # 2^2 / 2


@pytest.mark.parametrize(
    ("call", "complaint"),
    [
        (lambda run: lw.loads.cycles(run, "pivt", "fx"), "did you mean 'pivot'"),
        (lambda run: lw.loads.cycles(run, "pivot", "f"), "quantity: 'f' is unknown"),
        (lambda run: lw.loads.damage_equivalent(run, exponents=[0]), "positive numbers"),
        (lambda run: lw.loads.damage_equivalent(run, repetitions=0), "positive number"),
        (lambda run: lw.loads.damage_equivalent(run, [1e-3], 1e-9), "too large for a number"),
        (lambda run: lw.loads.load_duration(run, "pivot", "fx", bins=0), "number of classes"),
    ],
)
def test_wrong_arguments(call, complaint):
    with pytest.raises(lw.InputError, match=complaint):
        call(run_with(T, T))


def test_the_largest_cycle_is_counted_whatever_the_sampling():
    """Of a blow on a stiff stop 21 samples show a small part."""
    coarse, fine = (
        lw.simulate(stopped_arm(1e7), times=np.linspace(0, 1, samples)) for samples in (21, 20_001)
    )
    for joint, quantity in (("shoulder", "ny"), ("elbow", "fx"), ("elbow", "moment")):
        sampled = lw.loads.cycles(lw.Run(coarse.dataset.drop_vars(EXTREMES)), joint, quantity, ARM)
        found, expected = (
            float(lw.loads.cycles(run, joint, quantity).range.max()) for run in (coarse, fine)
        )
        assert found == pytest.approx(expected, rel=5e-3)
        assert float(sampled.range.max()) < 0.7 * expected
        assert "not known" in sampled.attrs["samples"]
    said = lw.loads.cycles(coarse, "shoulder", "ny").attrs["samples"]
    assert "joint 'shoulder' peaks between the samples" in said
    assert "show every peak" in lw.loads.cycles(fine, "shoulder", "ny").attrs["samples"]
    # At slope 10 the largest cycle does the damage.
    damage = (
        lw.loads.damage_equivalent(run, exponents=[10], repetitions=1) for run in (coarse, fine)
    )
    few, many = (found.sel(component=["fx", "ny"]) for found in damage)
    np.testing.assert_allclose(few, many, rtol=0.1)


ARM = stopped_arm(1e7)
EXTREMES = [
    f"extreme_{name}" for name in ("quantity", "joint_load", "position", "velocity", "acceleration")
]
