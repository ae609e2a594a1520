"""The model file or scenario that a command is given: its options, and how it is loaded."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from linkwise._core import Model
    from linkwise.scenario import Scenario

FloatingBase = Annotated[
    bool, typer.Option("--floating-base", help="Let the root link of a model file float.")
]
PackageDirs = Annotated[
    list[Path] | None,
    typer.Option("--package-dir", help="Where packages of package:// paths are; repeatable."),
]


def load_given(
    path: Path, floating_base: bool, package_dirs: Sequence[Path] | None
) -> tuple[Model, Scenario | None]:
    """The model of a file, and the scenario where the file is one."""
    from linkwise.io.load import load
    from linkwise.scenario import load_scenario

    if path.suffix.lower() != ".toml":
        dirs = package_dirs or []
        return load(path, floating_base=floating_base, package_dirs=dirs), None
    if floating_base or package_dirs:
        raise typer.BadParameter("a scenario says itself how its model is loaded; edit it")
    scenario = load_scenario(path)
    return scenario.load_model(), scenario
