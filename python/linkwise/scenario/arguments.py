"""Fitting a scenario to its model: joints, bodies, tables and units become simulate() arguments."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import numpy as np
import numpy.typing as npt

from linkwise import drives
from linkwise._core import Frame, InputError, Model, integrators, methods, solvers
from linkwise.base import COMPONENTS
from linkwise.io.complaint import complain, near, shorten
from linkwise.io.mjcf_state import read_keyframe
from linkwise.io.table import CsvTable, read_table
from linkwise.io.units import check_dimension
from linkwise.io.urdf_elements import placement
from linkwise.loads.rating import Rating
from linkwise.record.labels import joint_scalars
from linkwise.record.schema import QUANTITIES
from linkwise.scenario.fields import Quantity
from linkwise.scenario.schema import (
    FreeSection,
    JointSection,
    LinkSection,
    LockedSection,
    MotionSection,
    PDSection,
    ScenarioFile,
    Section,
    SpringSection,
    TorqueSection,
    WrenchSection,
)

_D = TypeVar("_D", bound=drives.Drive | drives.Table)
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+\Z")
# Dimension of a quantity along an angle and along a length.
_KINDS = {
    "position": ("angle", "length"),
    "velocity": ("angular velocity", "velocity"),
    "torque": ("moment", "force"),
    "stiffness": ("angular stiffness", "stiffness"),
    "damping": ("angular damping", "damping"),
}
# The same for the properties of a joint.
_PROPERTIES = {
    "damping": _KINDS["damping"],
    "friction": _KINDS["torque"],
    "friction_velocity": _KINDS["velocity"],
    "stiffness": _KINDS["stiffness"],
    "rest_position": _KINDS["position"],
    "armature": ("inertia", "mass"),
    "motor_inertia": ("inertia", "inertia"),
    "gear_ratio": ("number", "number"),
    "lower": _KINDS["position"],
    "upper": _KINDS["position"],
    "effort": _KINDS["torque"],
    "velocity": _KINDS["velocity"],
    "limit_stiffness": _KINDS["stiffness"],
    "limit_damping": ("time per angle", "time per length"),
}


@dataclass(frozen=True)
class ScenarioSource:
    """A scenario file's path, what it says, and the folder that the path is relative to."""

    path: Path
    settings: ScenarioFile
    home: Path = field(default_factory=Path.cwd, kw_only=True)

    def resolve(self, path: str) -> Path:
        """A path in the file, relative to the file's own directory."""
        near = self.path.parent / path
        # As it was written, as long as that is the same: complaints show it.
        return near if Path.cwd() == self.home else self.home / near

    def complain(self, keys: Sequence[str], problem: str, remedy: str) -> NoReturn:
        """Raise the InputError about the value at these keys."""
        complain(self.path, key_path(keys), problem, remedy)


def key_path(keys: Sequence[str]) -> str:
    """Keys as TOML writes them: drive."left.elbow".kp."""
    return ".".join(shorten(k) if _BARE_KEY.match(k) else f'"{shorten(k)}"' for k in keys)


class ArgumentBuilder:
    """Fits a scenario's joints, bodies, tables and units to the model."""

    def __init__(self, source: ScenarioSource, model: Model) -> None:
        self.source = source
        self.model = model
        self.joint_names = {name: index for index, name in enumerate(model.joint_names)}
        self.loop_names = {name: index for index, name in enumerate(model.loop_names)}
        self.tables: dict[Path, CsvTable] = {}

    def joint_properties(self) -> dict[str, dict[str, npt.NDArray[np.float64]]]:
        """By joint the properties that the scenario gives it."""
        settings = self.source.settings
        for loop in settings.loop.keys() & settings.joint.keys():
            self.source.complain(("joint", loop), "is a loop as well", f"use loop.{loop} alone")
        given = [(("joint", name), section) for name, section in settings.joint.items()]
        given += [(("loop", name), section) for name, section in settings.loop.items()]
        return {keys[1]: self._properties(section, keys) for keys, section in given}

    def _properties(
        self, section: JointSection, keys: tuple[str, str]
    ) -> dict[str, npt.NDArray[np.float64]]:
        joint = keys[1]
        units = self._units(joint, keys, positions=False)
        return {
            name: self._fit(
                value if isinstance(value, list) else [value] * len(units),
                units,
                (*keys, name),
                kinds,
            )
            for name, kinds in _PROPERTIES.items()
            if (value := getattr(section, name)) is not None
        }

    # -- state and output -------------------------------------------------------------------

    def state(self, key: str) -> npt.NDArray[np.float64] | None:
        """q0 ("position") or v0 ("velocity"); None where the file says nothing."""
        given: dict[str, Quantity | list[Quantity]] = getattr(self.source.settings.initial, key)
        model, keyframe = self.model, self._keyframe()
        position = key == "position"
        if keyframe is not None:
            state = keyframe[0 if position else 1]
        elif not given:
            return None
        else:
            state = np.array(model.initial_configuration()) if position else np.zeros(model.nv)
        for joint, values in given.items():
            if joint in self.loop_names:  # see loop_positions(), loop_velocities()
                continue
            keys = ("initial", key, joint)
            self._check_joint(joint, keys)
            units = self._units(joint, keys, positions=position)
            numbers = self._fit(values, units, keys, _KINDS[key])
            if "1" in units:
                numbers[-4:] = self._quaternion(numbers[-4:], keys)
            state[model.q_slice(joint) if position else model.v_slice(joint)] = numbers
        return state

    def held(self) -> dict[str, Any]:
        """Which joints the start of a run leaves where they are, and where loop joints are then
        and how they move."""
        hold = [
            joint for joint in self.source.settings.initial.position if joint in self.joint_names
        ]
        found = {
            "hold": hold,
            "loop_position": self.loop_positions(),
            "loop_velocity": self.loop_velocities(),
        }
        return {key: value for key, value in found.items() if value}

    def loop_positions(self) -> dict[str, float]:
        """Where joints that close loops start [rad, m]."""
        found = {}
        for joint, values in self.source.settings.initial.position.items():
            if joint not in self.loop_names:
                continue
            keys = ("initial", "position", joint)
            units = self._units(joint, keys, positions=True)
            if len(units) != 1:
                self.source.complain(
                    keys,
                    f"joint '{shorten(joint)}' closes a loop and has several axes",
                    "give positions of joints of the tree",
                )
            found[joint] = float(self._fit(values, units, keys, _KINDS["position"])[0])
        return found

    def loop_velocities(self) -> dict[str, list[float]]:
        """The rates that joints which close loops start with [rad/s, m/s]."""
        found = {}
        for joint, values in self.source.settings.initial.velocity.items():
            if joint not in self.loop_names:
                continue
            keys = ("initial", "velocity", joint)
            units = self._units(joint, keys, positions=False)
            found[joint] = self._fit(values, units, keys, _KINDS["velocity"]).tolist()
        return found

    def _keyframe(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]] | None:
        """q and v of the keyframe that the file names, or None."""
        settings = self.source.settings
        name = settings.initial.keyframe
        if name is None:
            return None
        keys = ("initial", "keyframe")
        if settings.model.path is None:
            self.source.complain(keys, "belongs to an MJCF file", "remove it")
        try:
            return read_keyframe(self.model, self.source.resolve(settings.model.path), name)
        except InputError as error:
            raise InputError(
                f"{shorten(self.source.path, 400)}: {key_path(keys)}: {error}"
            ) from None

    def _quaternion(
        self, quaternion: npt.NDArray[np.float64], keys: Sequence[str]
    ) -> npt.NDArray[np.float64]:
        length = float(np.linalg.norm(quaternion))
        if abs(length - 1) > 1e-3:
            self.source.complain(
                keys, f"its quaternion x y z w has length {length:g}", "give a unit quaternion"
            )
        return quaternion / length

    def quantities(self) -> list[str] | None:
        """Names of what to record."""
        names = self.source.settings.output.quantities
        for name in names or ():
            if name not in QUANTITIES:
                self.source.complain(
                    ("output", "quantities"),
                    f"unknown quantity '{shorten(name)}'",
                    near(name, QUANTITIES, "known"),
                )
        return names

    def simulate(self) -> dict[str, Any]:
        """The options of [simulate]; methods, solvers and integrators must be known by name."""
        section = self.source.settings.simulate
        tables = {"integrator": integrators, "method": methods, "solver": solvers}
        for key, table in tables.items():
            known = [entry["name"] for entry in table()]
            if key != "integrator":
                known.append("auto")
            name = getattr(section, key)
            if name is not None and name not in known:
                remedy = near(name, known, "known")
                self.source.complain(("simulate", key), f"unknown {key} '{shorten(name)}'", remedy)
        options = section.model_dump()
        rest = {name: options.pop(name) for name in ("duration", "threads")}
        return {**rest, "numerics": {k: v for k, v in options.items() if v is not None}}

    def joints(self) -> list[str] | None:
        """Names of the joints to record."""
        names = self.source.settings.output.joints
        for name in names or ():
            self._check_loaded(name, ("output", "joints"))
        return names

    # -- drives -----------------------------------------------------------------------------

    def joint_drives(self) -> dict[str, drives.Drive]:
        """Drives by joint name."""
        result: dict[str, drives.Drive] = {}
        for joint, section in self.source.settings.drive.items():
            keys = ("drive", joint)
            result[joint] = self._drive(joint, section, keys)
        return result

    def _drive(self, joint: str, section: Section, keys: tuple[str, str]) -> drives.Drive:
        units = self._units(joint, keys, positions=False)
        if isinstance(section, TorqueSection):
            if section.table is not None:
                names = self._columns(section.table, section.column, section.columns, joint, keys)
                return drives.Torque(
                    self._table(section.table, names, units, section.interpolation, keys, "torque")
                )
            assert section.value is not None
            return drives.Torque(
                self._fit(section.value, units, (*keys, "value"), _KINDS["torque"])
            )
        if isinstance(section, PDSection | SpringSection):
            if len(units) != 1:
                self.source.complain(
                    keys,
                    f"a {section.kind} drive needs a joint of one degree of freedom, "
                    f"this one has {len(units)}",
                    "use a torque drive",
                )
            if isinstance(section, SpringSection):
                return self._make(
                    keys,
                    drives.Spring,
                    self._one(section.stiffness, units, (*keys, "stiffness"), "stiffness"),
                    self._one(section.damping, units, (*keys, "damping"), "damping"),
                    self._one(section.rest, units, (*keys, "rest"), "position"),
                )
            return self._pd(joint, section, units, keys)
        if isinstance(section, MotionSection):
            names = self._columns(section.table, section.column, section.columns, joint, keys)
            table = self._table(section.table, names, units, "cubic", keys, "position")
            return self._make(keys, drives.Motion, table)
        assert isinstance(section, LockedSection | FreeSection)
        return drives.Locked() if isinstance(section, LockedSection) else drives.Free()

    def _pd(
        self, joint: str, section: PDSection, units: list[str], keys: tuple[str, str]
    ) -> drives.PD:
        kp = self._one(section.kp, units, (*keys, "kp"), "stiffness")
        kd = self._one(section.kd, units, (*keys, "kd"), "damping")
        if section.table is None:
            assert section.target is not None
            return self._make(
                keys,
                drives.PD,
                kp,
                kd,
                self._one(section.target, units, (*keys, "target"), "position"),
            )
        names = self._columns(section.table, section.column, section.columns, joint, keys)
        table = self._table(section.table, names, units, section.interpolation, keys, "position")
        return self._make(keys, drives.PD, kp, kd, table)

    def ratings(self) -> dict[str, Rating]:
        """Ratings by joint name."""
        found = {}
        for joint, section in self.source.settings.rating.items():
            self._check_loaded(joint, ("rating", joint))
            found[joint] = Rating(**section.model_dump())
        return found

    def wrenches(self) -> dict[str, drives.Wrench]:
        """External wrenches by their names in the file."""
        sections = self.source.settings.wrench
        links = self.model.link_names if sections else []
        known = set(links)
        result = {}
        for name, section in sections.items():
            keys: tuple[str, ...] = ("wrench", name)
            if section.link is None and name not in known:
                remedy = near(name, links, "the links are")
                self.source.complain(
                    keys, "is no link of the model and names none", f"add link = ..., or {remedy}"
                )
            if section.link is not None:
                _check_link(self.source, self.model, section.link, (*keys, "link"))
            result[name] = self._wrench(name, section)
        return result

    def _wrench(self, name: str, section: WrenchSection) -> drives.Wrench:
        turned = None if isinstance(section.axes, str) else section.axes
        at = Frame(section.link or name, section.point, turned)
        axes: drives.WrenchAxes = "frame"
        if section.axes is None or isinstance(section.axes, str):
            axes = section.axes or "world"
        if section.table is None:
            zero = [Quantity(0.0, None)] * 3
            parts = [*(section.force or zero), *(section.moment or zero)]
            return drives.Wrench([p.value for p in parts], axes, at=at)
        names = section.columns or COMPONENTS
        units = ["m", "m", "m", "rad", "rad", "rad"]
        keys = ("wrench", name)
        table = self._table(section.table, names, units, section.interpolation, keys, "torque")
        return drives.Wrench(table, axes, at=at)

    # -- tables -----------------------------------------------------------------------------

    def _csv(self, name: str) -> CsvTable:
        path = self.source.resolve(name)
        if path not in self.tables:
            self.tables[path] = read_table(path)
        return self.tables[path]

    def _columns(
        self,
        name: str,
        column: str | None,
        columns: list[str] | None,
        joint: str,
        keys: tuple[str, str],
    ) -> list[str]:
        """The columns meant: those named, the one with the joint's name, or the only one."""
        if columns is not None:
            return columns
        if column is not None:
            return [column]
        names = self._csv(name).names
        if joint in names:
            return [joint]
        if len(names) == 1:
            return [names[0]]
        self.source.complain(
            keys,
            f"which column of '{shorten(name)}' is meant is not clear",
            f"add column = one of {', '.join(shorten(n) for n in names[:8])}",
        )

    def _table(
        self,
        name: str,
        columns: Sequence[str],
        units: list[str],
        interpolation: str,
        keys: tuple[str, str],
        kind: str,
    ) -> drives.Table:
        table = self._csv(name)
        if len(columns) != len(units):
            self.source.complain(
                keys,
                f"names {len(columns)} columns for {len(units)} components",
                "give columns = [...] with one name for each",
            )
        indices = [table.index(column) for column in columns]
        for index, unit, column in zip(indices, units, columns, strict=True):
            try:
                check_dimension(table.dimensions[index], *_allowed(unit, _KINDS[kind]))
            except ValueError as error:
                problem, _, remedy = str(error).partition("; ")
                complain(table.path, f"column '{shorten(column)}'", problem, remedy, 1)
        return self._make(keys, drives.Table, table.times, table.values[:, indices], interpolation)

    def _make(self, keys: Sequence[str], kind: type[_D], *values: Any) -> _D:
        """The drive; its complaints get the file and the key in front."""
        try:
            return kind(*values)
        except InputError as error:
            problem, _, remedy = str(error).partition("; ")
            self.source.complain(keys, problem, remedy)

    # -- shared -----------------------------------------------------------------------------

    def _check_joint(self, joint: str, keys: Sequence[str]) -> int:
        if joint not in self.joint_names:
            try:
                self.model.joint_index(joint)
            except InputError as error:
                if "merged" in str(error):  # a fixed joint of the file
                    problem, _, remedy = str(error).partition("; ")
                    self.source.complain(keys, problem, remedy)
            if joint in self.loop_names:
                self.source.complain(
                    keys,
                    f"joint '{shorten(joint)}' closes a loop: this follows from the other joints",
                    "name a joint of the tree",
                )
            remedy = near(joint, [*self.joint_names, *self.loop_names], "the joints are")
            self.source.complain(keys, f"the model has no joint '{shorten(joint)}'", remedy)
        return self.joint_names[joint]

    def _check_loaded(self, joint: str, keys: Sequence[str]) -> None:
        """A joint that has a load: those that close loops, rods and springs too."""
        if joint not in self.loop_names:
            self._check_joint(joint, keys)

    def _units(self, joint: str, keys: Sequence[str], *, positions: bool) -> list[str]:
        """Per coordinate or velocity of any joint "rad", "m", "1" or "rad or m"."""
        if joint in self.loop_names:
            labels = self.model.loop_labels(self.loop_names[joint])
            return [unit for _, unit in labels[0 if positions else 1]]
        index = self._check_joint(joint, keys)
        coordinates, velocities = joint_scalars(self.model, [index])
        return [str(u) for u in (coordinates if positions else velocities).units]

    def _fit(
        self,
        values: Quantity | list[Quantity],
        units: list[str],
        keys: Sequence[str],
        kinds: tuple[str, str],
    ) -> npt.NDArray[np.float64]:
        listed = values if isinstance(values, list) else [values]
        if len(listed) != len(units):
            self.source.complain(
                keys,
                f"has {len(listed)} numbers, the joint needs {len(units)}",
                "give one number" if len(units) == 1 else f"give a list of {len(units)}",
            )
        for quantity, unit in zip(listed, units, strict=True):
            try:
                check_dimension(quantity.dimension, *_allowed(unit, kinds))
            except ValueError as error:
                problem, _, remedy = str(error).partition("; ")
                self.source.complain(keys, problem, remedy)
        return np.array([quantity.value for quantity in listed])

    def _one(self, value: Quantity, units: list[str], keys: Sequence[str], kind: str) -> float:
        return float(self._fit(value, units, keys, _KINDS[kind])[0])


def with_inertias(source: ScenarioSource, model: Model) -> Model:
    """The model with the payloads and the changed links of the scenario."""
    for name, link in source.settings.link.items():
        _check_link(source, model, name, ("link", name))
        try:
            model = model.with_link(name, mass=link.mass, com=link.com, inertia=_tensor(link))
        except InputError as error:
            source.complain(("link", name), str(error), "correct its inertial data")
    return _with_payloads(source, model, on_flexible=False)


def with_payloads_on_flexible(source: ScenarioSource, model: Model) -> Model:
    """Adds those on links that only making links flexible has made, such as `jib:end`."""
    return _with_payloads(source, model, on_flexible=True)


def _with_payloads(source: ScenarioSource, model: Model, *, on_flexible: bool) -> Model:
    for name, payload in source.settings.payload.items():
        if (payload.link.rpartition(":")[0] in source.settings.flexible) != on_flexible:
            continue
        keys = ("payload", name)
        _check_link(source, model, payload.link, (*keys, "link"))
        try:
            model = model.with_payload(
                payload.link,
                mass=payload.mass,
                com=payload.com,
                inertia=_tensor(payload),
                name=name,
            )
        except InputError as error:
            source.complain(keys, str(error), "correct its name or its inertial data")
    return model


def with_loops(source: ScenarioSource, model: Model) -> Model:
    """The model with what ties links and joints together in the scenario."""
    for name, loop in source.settings.loop.items():
        keys = ("loop", name)
        for end in ("parent", "child"):
            _check_link(source, model, getattr(loop, end), (*keys, end))
        none = [0.0, 0.0, 0.0]
        try:
            model = model.with_loop(
                name,
                loop.type,
                loop.parent,
                loop.child,
                translation=loop.translation,
                rotation=placement(none, loop.rotation or none)[:3, :3],
                child_translation=loop.child_translation,
                child_rotation=placement(none, loop.child_rotation or none)[:3, :3],
                axis=loop.axis,
                axes=loop.axes,
                pitch=loop.pitch or 0.0,
            )
        except InputError as error:
            problem, _, remedy = str(error).partition("; ")
            source.complain(keys, problem, remedy or "correct it")
    for table, given in (("rod", source.settings.rod), ("spring", source.settings.spring)):
        for name, section in given.items():
            for end in ("parent", "child"):
                _check_link(source, model, getattr(section, end), (table, name, end))
            values = section.model_dump(exclude_none=True)
            try:
                model = getattr(model, f"with_{table}")(name, **values)
            except InputError as error:
                problem, _, remedy = str(error).partition("; ")
                source.complain((table, name), problem, remedy or "correct it")
    for name, coupling in source.settings.coupling.items():
        try:
            model = model.with_coupling(name, coupling.factors, offset=coupling.offset)
        except InputError as error:
            problem, _, remedy = str(error).partition("; ")
            source.complain(("coupling", name), problem, remedy or "correct it")
    for joint, bearing in source.settings.bearing.items():
        try:
            model = model.with_bearing(joint, **bearing.model_dump(exclude_none=True))
        except InputError as error:
            problem, _, remedy = str(error).partition("; ")
            source.complain(("bearing", joint), problem, remedy or "correct it")
    return model


def with_properties(source: ScenarioSource, model: Model) -> Model:
    """The model with the joint properties that the scenario changes."""
    for joint, properties in ArgumentBuilder(source, model).joint_properties().items():
        try:
            model = model.with_joint(joint, **properties) if properties else model
        except InputError as error:
            problem, _, remedy = str(error).partition("; ")
            table = "loop" if joint in source.settings.loop else "joint"
            source.complain((table, joint), problem, remedy)
    return model


def _check_link(source: ScenarioSource, model: Model, link: str, keys: Sequence[str]) -> None:
    if link not in model.link_names:
        remedy = near(link, model.link_names, "the links are")
        source.complain(keys, f"the model has no link '{shorten(link)}'", remedy)


def _tensor(section: LinkSection) -> npt.NDArray[np.float64] | None:
    if section.inertia is None:
        return None
    xx, yy, zz, xy, xz, yz = [*section.inertia, 0.0, 0.0, 0.0][:6]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _allowed(unit: str, kinds: tuple[str, str]) -> tuple[str, ...]:
    """Dimensions that a quantity along a coordinate of this unit may have."""
    angular, linear = kinds
    if unit == "1":
        return ("number",)
    return tuple(d for d, u in ((angular, "rad"), (linear, "m")) if u in unit.split(" or "))
