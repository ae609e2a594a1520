"""What most tests of recording start from."""

import pytest

from helpers.made_up_run import small_model
from linkwise.record.provenance import provenance
from linkwise.record.schema import build_schema


@pytest.fixture
def model():
    return small_model()


@pytest.fixture
def schema(model):
    return build_schema(model)


@pytest.fixture
def attrs(model):
    return provenance(model, options={"tolerance": 1e-6}, scenario="[simulate]\nduration = 1\n")
