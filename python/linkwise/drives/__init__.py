"""How joints are driven and bodies are loaded: the drives and wrenches of `simulate`."""

from linkwise.drives.drive import (
    PD,
    Drive,
    Free,
    Interpolation,
    Locked,
    Motion,
    Spring,
    Table,
    Torque,
    Wrench,
    WrenchAxes,
    as_drive,
    as_wrench,
)
from linkwise.drives.external import external_wrenches

__all__ = [
    "PD",
    "Drive",
    "Free",
    "Interpolation",
    "Locked",
    "Motion",
    "Spring",
    "Table",
    "Torque",
    "Wrench",
    "WrenchAxes",
    "as_drive",
    "as_wrench",
    "external_wrenches",
]
