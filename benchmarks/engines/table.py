"""The table of engines. A further one is a file with `build` and a line here."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module, metadata, util
from pathlib import Path
from typing import Any

from benchmarks.engines.base import Field


@dataclass(frozen=True)
class Engine:
    name: str
    module: str  # that must be importable
    package: str  # that pip installs
    prepared: bool = False  # whether its C++ side loads what its Python side writes

    @property
    def installed(self) -> bool:
        return util.find_spec(self.module) is not None

    @property
    def version(self) -> str | None:
        try:
            return metadata.version(self.package)
        except metadata.PackageNotFoundError:
            return None

    def build(self, folder: Path) -> Field:
        module: Any = import_module(f"benchmarks.engines.{self.name}")
        built: Field = module.build(folder)
        return built


ENGINES = (
    Engine("linkwise", "linkwise", "linkwise"),
    Engine("pinocchio", "pinocchio", "pin"),
    Engine("mujoco", "mujoco", "mujoco", prepared=True),
    Engine("dart", "dartpy", "dartpy"),
    Engine("drake", "pydrake", "drake"),
)
BY_NAME = {engine.name: engine for engine in ENGINES}
