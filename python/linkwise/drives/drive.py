"""How joints are driven and bodies are loaded: the drives and wrenches of ``simulate``."""

from __future__ import annotations

import copy
import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from linkwise._core import Frame, InputError, as_floats
from linkwise.base import Array
from linkwise.drives.course import (
    Span,
    as_breakpoints,
    course,
    find_turn,
    note_on_function,
    notes_on_span,
    notes_on_turn,
    wrapped_at,
)
from linkwise.drives.jumps import LEAST_ROWS, NAMES, find_jump
from linkwise.io.complaint import check_one_of, shown
from linkwise.io.table import read_table

if TYPE_CHECKING:
    from linkwise._core import Model
Interpolation = Literal["linear", "cubic"]
WrenchAxes = Literal["world", "frame"]


#: Beyond it, squares of times may overflow [s].
_LONGEST = 1e100


def _finite(value: npt.ArrayLike, what: str) -> Array:
    array = np.array(as_floats(value, what))  # a copy: the caller's array may change later
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
        if np.abs(times).max() > _LONGEST:
            raise InputError(f"table times: reach {np.abs(times).max():g} s; give shorter times")
        check_one_of("table interpolation", self.interpolation, ("linear", "cubic"))
        spans = np.diff(times)
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            slopes = np.diff(values, axis=0).T / spans
            if self.interpolation == "cubic":
                slopes = 12 * slopes / spans**2  # as large as any derivative of the spline
        if not np.isfinite(slopes).all():
            raise InputError(
                "table values: change by more than a double holds; give smaller values or longer "
                "times"
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
        table = read_table(path)
        wanted = table.names if columns is None else columns
        names = [wanted] if isinstance(wanted, str) else list(wanted)
        values = table.values[:, [table.index(name) for name in names]]
        return cls(table.times, values, interpolation)


def check_smooth(table: Table) -> None:
    """InputError where a table of positions cannot be differentiated twice."""
    if table.interpolation != "cubic":
        raise InputError(
            "motion: the velocity of a linear table jumps at every row; use interpolation cubic"
        )
    if len(table.times) < LEAST_ROWS:
        raise InputError(
            f"motion: the table has {len(table.times)} rows; give at least {LEAST_ROWS}, so that "
            "its derivatives can be checked"
        )
    for column in range(table.values.shape[1]):
        turn = find_turn(table.times, table.values[:, column])
        if turn is not None:
            raise InputError(f"motion: the position {wrapped_at(turn)}")
        jump = find_jump(table.times, table.values[:, column])
        if jump is not None:
            which = f" of column {column + 1}" if table.values.shape[1] > 1 else ""
            raise InputError(
                f"motion: the {NAMES[jump.derivative]}{which} jumps by about {jump.size:.3g} near "
                f"t = {jump.time:.6g} s; give a smoother motion, or rows closer together"
            )


def check_derivatives(motion: Callable[[float], Any], times: Array) -> Array:
    """Positions (n, k) of a motion at these times; InputError unless it returns its derivatives."""
    rows = []
    for time in times:
        returned = motion(float(time))
        if not isinstance(returned, tuple | list) or len(returned) != 3:
            raise InputError(
                f"motion: at t = {time:g} s the function returns no three values; return position, "
                "velocity and acceleration"
            )
        parts = [np.atleast_1d(_finite(part, f"motion at t = {time:g} s")) for part in returned]
        if len({part.shape for part in parts}) != 1 or parts[0].ndim != 1:
            raise InputError(f"motion: at t = {time:g} s its three values have different shapes")
        rows.append(np.stack(parts))
    values = np.stack(rows)
    for k in (1, 2):
        # Simpson's rule on pairs of intervals; a motion may have corners, but not everywhere.
        change = values[2::2, k - 1] - values[:-2:2, k - 1]
        width = (times[2::2] - times[:-2:2])[:, None]
        mean = (values[:-2:2, k] + 4 * values[1::2, k] + values[2::2, k]) / 6
        wrong = np.abs(change - width * mean) > 1e-2 * np.abs(values[:, k]).max() * width + 1e-9
        if wrong.mean() > 0.5:
            raise InputError(
                f"motion: its {NAMES[k]} is not the derivative of its {NAMES[k - 1]}; "
                "return all three of one motion"
            )
    return values[:, 0]


def _hand_over(
    simulation: Any,
    setter: str,
    name: str | Frame,
    value: Any,
    known: Callable[[Callable[..., Any]], dict[str, Any]],
    **more: Any,
) -> None:
    """Give the core simulation a table, a function and what is known of it, or constants: it has a
    setter for each."""
    if isinstance(value, Table):
        set_table = getattr(simulation, f"{setter}_table")
        set_table(name, value.times, value.values, interpolation=value.interpolation, **more)
    elif callable(value):
        getattr(simulation, f"{setter}_callable")(name, value, **more, **known(value))
    else:
        getattr(simulation, setter)(name, value, **more)


def _notes(value: Any, breakpoints: Any, end: float) -> list[str]:
    if isinstance(value, Table):
        return notes_on_span(value.times, end)
    return [note_on_function(end)] if callable(value) and breakpoints is None else []


def _moved_state(span: Span, change: float) -> tuple[Array, Array]:
    return span.q + change, span.v + change


class Drive(ABC):
    """What moves or holds one joint."""

    def check(self, model: Model, joint: str, end: float) -> None:  # noqa: B027
        """InputError where the drive does not fit the joint, or a simulation from 0 to `end`."""

    def notes(self, end: float) -> list[str]:
        """What the reader of a simulation from 0 to `end` [s] should know of this drive."""
        return []

    @abstractmethod
    def apply(self, simulation: Any, joint: str, span: Span | None = None) -> None:
        """Set this drive on ``joint`` of a ``_core.Simulation``; functions are looked at over the
        span, where it is given."""


@dataclass(frozen=True, eq=False)
class Torque(Drive):
    """A given joint torque [N m], or force [N] along a sliding axis.

    value: a number (a joint of one degree of freedom), an array (nv,), a Table, or a function
    ``value(t, q, v)`` of time [s] and the joint's own position and rate that returns either.
    breakpoints: Of a function, the times [s] at which it jumps or has a kink, such as those of a
        sampled controller; () for none. Without them the function is called before the run, to
        see when it changes.
    """

    value: float | npt.ArrayLike | Table | Callable[[float, Array, Array], npt.ArrayLike]
    breakpoints: npt.ArrayLike | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "breakpoints", as_breakpoints(self.breakpoints, "torque"))
        if not isinstance(self.value, Table) and not callable(self.value):
            object.__setattr__(self, "value", np.atleast_1d(_finite(self.value, "torque")))

    def notes(self, end: float) -> list[str]:
        return _notes(self.value, self.breakpoints, end)

    def apply(self, simulation: Any, joint: str, span: Span | None = None) -> None:
        def known(function: Callable[..., Any]) -> dict[str, Any]:
            return course(function, self.breakpoints, span, _moved_state)

        _hand_over(simulation, "drive_torque", joint, self.value, known)


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

    def notes(self, end: float) -> list[str]:
        if not isinstance(self.target, Table):
            return []
        times = self.target.times
        return [*notes_on_span(times, end), *notes_on_turn(times, self.target.values[:, 0])]

    def apply(self, simulation: Any, joint: str, span: Span | None = None) -> None:
        if isinstance(self.target, Table) and self.target.times[-1] <= 0:
            # Its last row alone acts: the slope before it is no target velocity at the start.
            simulation.drive_pd(joint, self.kp, self.kd, float(self.target.values[-1, 0]))
        elif isinstance(self.target, Table):
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

    def apply(self, simulation: Any, joint: str, span: Span | None = None) -> None:
        simulation.drive_pd(joint, self.stiffness, self.damping, self.rest)


@dataclass(frozen=True, eq=False)
class Motion(Drive):
    """The joint follows a given motion exactly; its load holds the drive torque that this takes.

    value: a cubic Table of positions [rad, m], one column per degree of freedom, that covers the
        whole simulation; or a function ``value(t)`` that returns position, velocity and
        acceleration. The joint starts on the motion, whatever the initial state says.

    breakpoints: Of a function, as for `Torque`.

    Tables whose position, velocity or acceleration jumps are refused: the load would be that of
    the interpolation, not of the motion.
    """

    value: Table | Callable[[float], tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike]]
    breakpoints: npt.ArrayLike | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "breakpoints", as_breakpoints(self.breakpoints, "motion"))
        if isinstance(self.value, Table):
            check_smooth(self.value)
        elif not callable(self.value):
            raise InputError(
                "motion: is neither a Table nor a function; to hold a joint still use Locked"
            )

    def check(self, model: Model, joint: str, end: float) -> None:
        loop = model.load_index(joint) - model.n_joints
        dofs = model.v_slice(joint) if loop < 0 else model.loop_slices[loop][1]
        places = model.q_slice(joint) if loop < 0 else model.loop_slices[loop][0]
        if places.stop - places.start != dofs.stop - dofs.start:
            raise InputError(
                "motion: needs angles or distances, and this joint has a quaternion; let three "
                "hinges stand for it (and sliders, where it slides), with links without mass "
                "between them, and give their motions, or drive it by torque"
            )
        if isinstance(self.value, Table):
            first, last = self.value.times[0], self.value.times[-1]
            if first > 0 or last < end * (1 - 1e-12):
                raise InputError(
                    f"motion: the table covers {first:g} to {last:g} s, the simulation 0 to "
                    f"{end:g} s; give rows for all of it"
                )
            when, positions = self.value.times, self.value.values
        else:
            when = np.linspace(0.0, end, 257)
            positions = check_derivatives(self.value, when)
        if positions.shape[1] != dofs.stop - dofs.start:
            raise InputError(
                f"motion: gives {positions.shape[1]} positions for {dofs.stop - dofs.start} "
                "degrees of freedom"
            )
        lower, upper = model.lower_limit, model.upper_limit
        if loop >= 0:
            lower, upper = model.loop_property("lower"), model.loop_property("upper")
        lower, upper = lower[dofs], upper[dofs]
        slack = 1e-9 * (1 + np.abs(positions).max())
        out = np.argwhere((positions < lower - slack) | (positions > upper + slack))
        if out.size:
            row, column = out[0]
            raise InputError(
                f"motion: leaves the joint's limits {lower[column]:g} .. {upper[column]:g} at "
                f"t = {when[row]:g} s ({positions[row, column]:g}); give a motion within them"
            )

    def notes(self, end: float) -> list[str]:
        return [] if isinstance(self.value, Table) else _notes(self.value, self.breakpoints, end)

    def apply(self, simulation: Any, joint: str, span: Span | None = None) -> None:
        def known(function: Callable[..., Any]) -> dict[str, Any]:
            return course(function, self.breakpoints, span, part=lambda value: value[2])

        _hand_over(simulation, "drive_motion", joint, self.value, known)


@dataclass(frozen=True)
class Locked(Drive):
    """The joint is held at its initial position; its load holds the whole wrench."""

    def apply(self, simulation: Any, joint: str, span: Span | None = None) -> None:
        simulation.drive_locked(joint)


@dataclass(frozen=True)
class Free(Drive):
    """No drive: only the joint's own damping, friction and spring act (also the default)."""

    def apply(self, simulation: Any, joint: str, span: Span | None = None) -> None:
        simulation.drive_free(joint)


@dataclass(frozen=True, eq=False)
class Wrench:
    """An external force and moment at the origin of a frame on any link.

    value: [fx fy fz nx ny nz] in N and N m, or a Table of these six, or a function ``value(t)``.
    axes: those of the components, "world", or "frame" for those of the frame where it acts; "world"
        by default, but at a Frame with axes of its own it must be said.
    at: where it acts, a link's name or a Frame; None: the frame that it is given for.
    breakpoints: Of a function, as for `Torque`.
    """

    value: npt.ArrayLike | Table | Callable[[float], npt.ArrayLike]
    axes: WrenchAxes | None = field(default=None)
    at: str | Frame | None = field(default=None, kw_only=True)
    breakpoints: npt.ArrayLike | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "breakpoints", as_breakpoints(self.breakpoints, "wrench"))
        if self.axes is not None:
            check_one_of("wrench axes", self.axes, ("world", "frame"))
        if self.at is not None and not isinstance(self.at, str | Frame):
            raise InputError(
                f"wrench at: {shown(self.at)} is no frame; give the name of a link, or a "
                "linkwise.Frame"
            )
        if isinstance(self.value, Table):
            shape: tuple[int, ...] = self.value.values.shape[1:]
        elif callable(self.value):
            return
        else:
            object.__setattr__(self, "value", _finite(self.value, "wrench"))
            shape = np.shape(self.value)
        if shape != (6,):
            raise InputError(f"wrench: shape {shape}; give six components fx fy fz nx ny nz")

    def notes(self, end: float) -> list[str]:
        """What the reader of a simulation from 0 to `end` [s] should know of this wrench."""
        return _notes(self.value, self.breakpoints, end)

    def apply(self, simulation: Any, frame: str | Frame, span: Span | None = None) -> None:
        """Set this wrench on a ``_core.Simulation``, at ``frame`` unless it says itself where; a
        function is looked at over the span, where it is given."""

        def known(function: Callable[..., Any]) -> dict[str, Any]:
            return course(function, self.breakpoints, span)

        at = self.where(frame)
        axes = "world" if self.along_world(at) else "frame"
        _hand_over(simulation, "wrench", at, self.value, known, axes=axes)

    def where(self, frame: str | Frame) -> str | Frame:
        """Where it acts, given for this frame."""
        return frame if self.at is None else self.at

    def placed(self, frame: str | Frame) -> Wrench:
        """The same, acting where it says itself or at `frame`."""
        at = self.where(frame)
        made = copy.copy(self)
        object.__setattr__(made, "at", Frame(at) if isinstance(at, str) else at)
        made.along_world(at)
        return made

    def along_world(self, at: str | Frame) -> bool:
        """Whether the components are along the world's axes, at this frame. InputError where that
        must be said."""
        if self.axes is None and isinstance(at, Frame) and not np.array_equal(at.axes, np.eye(3)):
            raise InputError(
                f"wrench: its frame on {at.link!r} has axes of its own; say whether the components "
                'are along these: linkwise.Wrench(..., axes="frame"), or axes="world"'
            )
        return self.axes != "frame"


def as_drive(value: Any) -> Drive:
    """A drive from what a user may write for one: a Drive, a number, an array, a Table, a function.

    Everything but a Drive is a torque.
    """
    if value is None:
        raise InputError("None given; give a drive, a number, a table or a function")
    return value if isinstance(value, Drive) else Torque(value)


def as_wrench(value: Any) -> Wrench:
    """A wrench from a Wrench, six numbers, a Table or a function of time (world axes)."""
    return value if isinstance(value, Wrench) else Wrench(value)
