"""Where the robots of the package example-robot-data are on this disk."""

from __future__ import annotations

from importlib import metadata
from pathlib import Path


def robot(name: str) -> Path:
    """The URDF file called `name` in a folder of `name`'s description; ends without the package."""
    folder, _, stem = name.partition("/")
    try:
        files = metadata.files("example-robot-data") or []
    except metadata.PackageNotFoundError:
        raise SystemExit("this example's robot: pip install example-robot-data") from None
    for file in files:
        if file.name == f"{stem}.urdf" and folder in file.parts:
            return Path(str(file.locate()))
    raise SystemExit(f"example-robot-data has no {name}; install another version")
