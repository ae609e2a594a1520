"""Shared set-up: helpers and tools on the path, one deterministic hypothesis profile."""

import os
import signal
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "tools")]

# A shell that starts pytest in the background makes it ignore Ctrl-C, which some tests need.
signal.signal(signal.SIGINT, signal.default_int_handler)

# Deterministic, so that a red run can be repeated; "explore" draws new examples every time.
settings.register_profile(
    "default",
    derandomize=True,
    deadline=None,
    max_examples=40,
    suppress_health_check=[HealthCheck.too_slow],
    database=None,
)
settings.register_profile("explore", parent=settings.get_profile("default"), derandomize=False)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "default"))


@pytest.fixture
def rng():
    return np.random.default_rng(1993)
