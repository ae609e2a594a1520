"""The run that most tests of loads start from."""

import pytest

from helpers import loaded_arm


@pytest.fixture(scope="session")
def swing():
    return loaded_arm.swing(tolerance=1e-9)
