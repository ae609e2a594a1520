"""Where a run comes from: model, versions, options and machine kind, as flat attributes.

Values are text or numbers only, so that Zarr, NetCDF and JSON all hold them unchanged; nested
ones are JSON text. Nothing that identifies a person or a machine is recorded.
"""

from __future__ import annotations

import dataclasses
import json
import math
import platform
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from linkwise._core import Frame
from linkwise.notes import warning_attrs, warnings_of

if TYPE_CHECKING:
    from linkwise._core import Model

FORMAT_KEY = "linkwise_run"
FORMAT_VERSION = 2
UNFINISHED = "unfinished"

_RECORDED_PACKAGES = ("linkwise", "numpy", "xarray", "zarr")


def versions() -> dict[str, str]:
    return {"python": platform.python_version()} | {p: _version(p) for p in _RECORDED_PACKAGES}


@cache
def _version(package: str) -> str:
    """Read once: a file per package takes longer than a short simulation."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"


def plain(value: Any) -> str | int | float | bool:
    """A value that every file format keeps: text, number, or JSON text of the rest."""
    if isinstance(value, (str, bool, int)):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    return json.dumps(value, default=str)


def describe(drive: Any) -> dict[str, Any]:
    """A drive or wrench in a few words: its kind, its numbers, the size of its tables."""
    told: dict[str, Any] = {"kind": type(drive).__name__.lower()}
    for field in dataclasses.fields(drive):
        value: Any = getattr(drive, field.name)
        if value is None:
            continue
        if hasattr(value, "times"):
            span = [float(value.times[0]), float(value.times[-1])]
            told[field.name] = {"table": list(value.values.shape), "times": span}
        elif isinstance(value, Frame):
            axes = value.axes.tolist()
            told[field.name] = {"link": value.link, "origin": value.origin.tolist(), "axes": axes}
        elif callable(value):
            told[field.name] = f"function {getattr(value, '__qualname__', type(value).__name__)}"
        else:
            told[field.name] = value.tolist() if hasattr(value, "tolist") else value
    return told


def model_attrs(model: Model) -> dict[str, Any]:
    return {
        "model": model.name,
        "model_source": PurePath(model.source).name if model.source else "",
        "model_hash": model.hash,
        "model_joints": model.n_joints,
        "model_degrees_of_freedom": model.nv,
    }


def provenance(
    model: Model, *, options: Mapping[str, Any], scenario: str = "", cpu_target: str = ""
) -> dict[str, Any]:
    """Attributes known before the first step."""
    found = versions()
    return {
        FORMAT_KEY: FORMAT_VERSION,
        "title": f"linkwise run of {model.name}",
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "linkwise_version": found["linkwise"],
        "versions": json.dumps(found),
        "platform": f"{platform.system()} {platform.machine()}",
        "cpu_target": cpu_target,
        **model_attrs(model),
        "options": json.dumps(dict(options), default=str),
        "scenario": scenario,
        **warning_attrs(warnings_of(model)),
        "outcome": UNFINISHED,
    }
