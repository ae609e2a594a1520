"""Relative comparisons of arrays that mix units and sizes."""

import numpy as np


def relative_error(actual, expected, *, axis=-1, floor=0.0):
    """Largest |actual - expected| over the largest |expected|, both along `axis`.

    The scale is the size of the whole compared vector, not of each component: a component that
    vanishes by symmetry carries the rounding of its neighbours. `floor` is the smallest scale.
    """
    actual, expected = np.asarray(actual, float), np.asarray(expected, float)
    assert actual.shape == expected.shape, (actual.shape, expected.shape)
    if expected.size == 0:
        return 0.0
    assert np.isfinite(expected).all()
    error = np.abs(actual - expected).max(axis=axis)
    scale = np.maximum(np.abs(expected).max(axis=axis), floor)
    worst = np.max(np.where(error == 0, 0.0, error / np.where(scale > 0, scale, 1e-300)))
    return float(worst) if np.isfinite(actual).all() else np.inf


def assert_close(actual, expected, tolerance, *, axis=-1, floor=0.0, what=""):
    error = relative_error(actual, expected, axis=axis, floor=floor)
    assert error <= tolerance, f"{what}: relative error {error:.2e} > {tolerance:.0e}"


def load_error(actual, expected, *, floor=0.0):
    """Relative error of (..., joint, 6) loads: forces against the largest force, moments alike."""
    actual, expected = np.asarray(actual), np.asarray(expected)
    return max(
        relative_error(actual[..., part], expected[..., part], axis=(-2, -1), floor=floor)
        for part in (slice(0, 3), slice(3, 6))
    )
