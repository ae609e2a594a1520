"""linkwise: rigid multibody dynamics in linear time, with the six-component load of every joint.

import linkwise as lw

model = lw.load("arm.urdf")
run = lw.simulate(model, duration=10, drives={"elbow": lw.PD(kp=100, kd=10, target=1.0)})
run.joint_load.sel(joint="elbow")
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

# The public names stand in __init__.pyi, one in a line `from MODULE import NAME as NAME`. They are
# imported when first used: the command line must answer `--help` without loading NumPy, xarray and
# the compiled core. No module of this folder is called like a public function or class, because
# importing a submodule binds its name in the package.
_STUB = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
_HOME = {
    words[3]: words[1] for words in map(str.split, _STUB.splitlines()) if words[:1] == ["from"]
}
__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        value = import_module("linkwise.record.provenance").versions()["linkwise"]
    elif name not in _HOME:
        raise AttributeError(f"module 'linkwise' has no attribute {name!r}")
    elif _HOME[name] == "linkwise":
        value = import_module(f"linkwise.{name}")
    else:
        value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
