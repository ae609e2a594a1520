"""How joints are driven and bodies are loaded: the drives and wrenches of ``simulate``."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from linkwise._core import InputError

Array = npt.NDArray[np.float64]
Interpolation = Literal["linear", "cubic"]
Frame = Literal["world", "body"]


def _finite(value: npt.ArrayLike, what: str) -> Array:
    try:
        given = np.asarray(value)
    except (TypeError, ValueError):  # lists of unequal lengths
        given = np.empty(0, dtype=object)
    if given.dtype.kind not in "iuf":  # NumPy itself would turn texts and truth values into numbers
        raise InputError(f"{what}: not numbers; give numbers in SI units")
    array = given.astype(np.float64)  # a copy: the caller's array may change later
    if not np.isfinite(array).all():
        raise InputError(f"{what}: not finite; give finite numbers in SI units")
    return array


def _scalar(value: float, what: str, *, negative_ok: bool = True) -> float:
    array = _finite(value, what)
    if array.ndim:
        raise InputError(f"{what}: has shape {array.shape}; give one number")
    if not negative_ok and array < 0:
        raise InputError(f"{what}: is negative ({float(array):g}); give a value >= 0")
    return float(array)


@dataclass(frozen=True, eq=False)
class Table:
    """Values over time.

    times: (n,) seconds, strictly increasing, n >= 2.
    values: (n,) or (n, k), SI units.
    interpolation: "linear", or "cubic" (a spline with continuous second derivative).

    Before the first and after the last time the values there hold.
    """

    times: Array
    values: Array
    interpolation: Interpolation = "linear"

    def __post_init__(self) -> None:
        times = _finite(self.times, "table times")
        values = _finite(self.values, "table values")
        if times.ndim != 1 or len(times) < 2:
            raise InputError(f"table times: shape {times.shape}; give (n,) with n >= 2")
        if values.ndim not in (1, 2) or len(values) != len(times):
            raise InputError(
                f"table values: shape {values.shape} for {len(times)} times; "
                f"give ({len(times)},) or ({len(times)}, k)"
            )
        wrong = np.flatnonzero(np.diff(times) <= 0)
        if wrong.size:
            k = int(wrong[0])
            raise InputError(
                f"table times: {times[k + 1]:g} s after {times[k]:g} s; give increasing times"
            )
        if self.interpolation not in ("linear", "cubic"):
            raise InputError(
                f"table interpolation: '{self.interpolation}' is unknown; use linear or cubic"
            )
        for name, array in (("times", times), ("values", values.reshape(len(times), -1))):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @classmethod
    def from_csv(
        cls,
        path: str | os.PathLike[str],
        columns: str | Sequence[str] | None = None,
        interpolation: Interpolation = "linear",
    ) -> Table:
        """The named columns of a CSV file (all by default), in this order.

        Raises InputError with file, line and column for gaps, NaN and time running backwards.
        """
        from linkwise.io.table import read_table

        table = read_table(path)
        wanted = table.names if columns is None else columns
        names = [wanted] if isinstance(wanted, str) else list(wanted)
        values = table.values[:, [table.index(name) for name in names]]
        return cls(table.times, values, interpolation)


class Drive(ABC):
    """What moves or holds one joint."""

    @abstractmethod
    def apply(self, simulation: Any, joint: str) -> None:
        """Set this drive on ``joint`` of a ``_core.Simulation``."""


@dataclass(frozen=True, eq=False)
class Torque(Drive):
    """A given joint torque [N m], or force [N] along a sliding axis.

    value: a number (a joint of one degree of freedom), an array (nv,), a Table, or a function
    ``value(t, q, v)`` of time [s] and the joint's own position and rate that returns either.
    """

    value: float | npt.ArrayLike | Table | Callable[[float, Array, Array], npt.ArrayLike]

    def __post_init__(self) -> None:
        if not isinstance(self.value, Table) and not callable(self.value):
            object.__setattr__(self, "value", np.atleast_1d(_finite(self.value, "torque")))

    def apply(self, simulation: Any, joint: str) -> None:
        if isinstance(self.value, Table):
            table = self.value
            simulation.drive_torque_table(
                joint, table.times, table.values, interpolation=table.interpolation
            )
        elif callable(self.value):
            simulation.drive_torque_callable(joint, self.value)
        else:
            simulation.drive_torque(joint, self.value)


@dataclass(frozen=True, eq=False)
class PD(Drive):
    """Torque kp (target - q) - kd v on a joint of one degree of freedom; with a table as target,
    kp (target - q) + kd (target' - v).

    kp: N m/rad (N/m), >= 0; kd: N m s/rad (N s/m), >= 0; target: rad (m), a number or a Table.
    """

    kp: float
    kd: float
    target: float | Table = 0.0

    def __post_init__(self) -> None:
        for name in ("kp", "kd"):
            value = _scalar(getattr(self, name), f"pd {name}", negative_ok=False)
            object.__setattr__(self, name, value)
        if not isinstance(self.target, Table):
            object.__setattr__(self, "target", _scalar(self.target, "pd target"))
        elif self.target.values.shape[1] != 1:
            raise InputError("pd target: the table has several columns; name one")

    def apply(self, simulation: Any, joint: str) -> None:
        if isinstance(self.target, Table):
            table = self.target
            simulation.drive_pd_table(
                joint,
                self.kp,
                self.kd,
                table.times,
                table.values[:, 0],
                interpolation=table.interpolation,
            )
        else:
            simulation.drive_pd(joint, self.kp, self.kd, self.target)


@dataclass(frozen=True)
class Spring(Drive):
    """A spring and damper between the joint's two bodies: stiffness (rest - q) - damping v.

    stiffness: N m/rad (N/m), damping: N m s/rad (N s/m), rest: rad (m).
    """

    stiffness: float
    damping: float = 0.0
    rest: float = 0.0

    def __post_init__(self) -> None:
        for name in ("stiffness", "damping"):
            value = _scalar(getattr(self, name), f"spring {name}", negative_ok=False)
            object.__setattr__(self, name, value)
        object.__setattr__(self, "rest", _scalar(self.rest, "spring rest"))

    def apply(self, simulation: Any, joint: str) -> None:
        simulation.drive_pd(joint, self.stiffness, self.damping, self.rest)


@dataclass(frozen=True)
class Locked(Drive):
    """The joint is held at its initial position; its load holds the whole wrench."""

    def apply(self, simulation: Any, joint: str) -> None:
        simulation.drive_locked(joint)


@dataclass(frozen=True)
class Free(Drive):
    """No drive: only the joint's own damping, friction and spring act (also the default)."""

    def apply(self, simulation: Any, joint: str) -> None:
        simulation.drive_free(joint)


@dataclass(frozen=True, eq=False)
class Wrench:
    """An external force and moment on a body, at the origin of its frame.

    value: [fx fy fz nx ny nz] in N and N m, or a Table of these six, or a function ``value(t)``.
    frame: the axes of the components, "world" or "body".
    """

    value: npt.ArrayLike | Table | Callable[[float], npt.ArrayLike]
    frame: Frame = field(default="world")

    def __post_init__(self) -> None:
        if self.frame not in ("world", "body"):
            raise InputError(f"wrench frame: '{self.frame}' is unknown; use world or body")
        if isinstance(self.value, Table):
            shape: tuple[int, ...] = self.value.values.shape[1:]
        elif callable(self.value):
            return
        else:
            object.__setattr__(self, "value", _finite(self.value, "wrench"))
            shape = np.shape(self.value)
        if shape != (6,):
            raise InputError(f"wrench: shape {shape}; give six components fx fy fz nx ny nz")

    def apply(self, simulation: Any, body: str) -> None:
        """Set this wrench on ``body`` of a ``_core.Simulation``."""
        if isinstance(self.value, Table):
            table = self.value
            simulation.wrench_table(
                body,
                table.times,
                table.values,
                interpolation=table.interpolation,
                frame=self.frame,
            )
        elif callable(self.value):
            simulation.wrench_callable(body, self.value, frame=self.frame)
        else:
            simulation.wrench(body, self.value, frame=self.frame)


def as_drive(value: Any) -> Drive:
    """A drive from what a user may write for one: a Drive, a number, an array, a Table, a function.

    Everything but a Drive is a torque.
    """
    return value if isinstance(value, Drive) else Torque(value)


def as_wrench(value: Any) -> Wrench:
    """A wrench from a Wrench, six numbers, a Table or a function of time (world axes)."""
    return value if isinstance(value, Wrench) else Wrench(value)
