"""Files for the readers to read, and what every complaint about bad input must look like."""

import pytest

from helpers.arm_urdf import ARM
from linkwise._core import InputError


@pytest.fixture
def arm(tmp_path):
    """Path of a good URDF with joints shoulder (revolute) and slide (prismatic)."""
    path = tmp_path / "arm.urdf"
    path.write_text(ARM)
    return path


@pytest.fixture
def complaint():
    """Calls a reader that must refuse its input, and gives its one-line message.

    The message must be one printable line, name the file and say what to do (after a ";").
    """

    def call(function, path, *args, **kwargs):
        with pytest.raises(InputError) as caught:
            function(path, *args, **kwargs)
        message = str(caught.value)
        assert message.isprintable(), message
        assert message.startswith(str(path)), message
        problem, _, remedy = message.partition("; ")
        assert problem, message
        assert remedy, message
        return message.removeprefix(str(path))

    return call
