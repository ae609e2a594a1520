"""Scenario files: a machine, its drives, how long and how exactly to simulate, what to record."""

from __future__ import annotations

import inspect
import os
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt
from pydantic import ValidationError

from linkwise import scenes
from linkwise._core import InputError, Model
from linkwise.io.complaint import complain, near, shorten
from linkwise.io.files import SCENARIO_BYTES, read_bytes
from linkwise.io.load import load
from linkwise.loads.rating import Rating
from linkwise.loads.section_summary import SectionRating
from linkwise.notes import quiet, tell, warnings_of
from linkwise.scenario.arguments import (
    ArgumentBuilder,
    ScenarioSource,
    key_path,
    with_inertias,
    with_loops,
    with_payloads_on_flexible,
    with_properties,
)
from linkwise.scenario.flexible_links import with_flexible_links
from linkwise.scenario.schema import FlexibleFile, RatingsFile, ScenarioFile, describe, keys_at
from linkwise.scenario.toml_slips import diagnose

#: Keys that say how a model file is loaded.
_OF_MODEL_FILES = (
    "floating_base",
    "joint_order",
    "keep_fixed",
    "mimic",
    "equality",
    "package_dirs",
)
# tomllib takes time quadratic in the parts of a dotted key: minutes for a file of 100 kB.
_PART = r"""(?:[A-Za-z0-9_-]+|"[^"\n]*"|'[^'\n]*')"""
_LONG_KEY = re.compile(rf"(?m)(?:^|[\[{{,])[ \t]*{_PART}(?:[ \t]*\.[ \t]*{_PART}){{16}}")


@dataclass(frozen=True)
class Scenario(ScenarioSource):
    """A scenario file whose keys, types and units were checked.

    path: the file; settings: what it says; text: its content, for the provenance.
    """

    text: str

    def load_model(self) -> Model:
        """The machine with its payloads and properties. Raises InputError if it cannot be had.

        What was ignored or assumed is a ModelWarning each, as in `linkwise.load`.
        """
        with quiet():  # the scenario may cure what is wrong in the model's file
            bare = self._bare_model()
        model = with_flexible_links(self, with_inertias(self, with_loops(self, bare)))
        model = with_properties(self, with_payloads_on_flexible(self, model))
        tell(warnings_of(model), reading=True)
        return model

    def ratings(self, model: Model) -> dict[str, Rating]:
        """What the joints may carry, by name. InputError for unknown joints."""
        return ArgumentBuilder(self, model).ratings()

    def _bare_model(self) -> Model:
        source, settings = self.settings.model, self.settings
        if source.path is not None:
            return load(
                self.resolve(source.path),
                floating_base=settings.floating_base,
                gravity=settings.gravity,
                package_dirs=[self.resolve(d) for d in settings.package_dirs],
                joint_order=settings.joint_order,
                keep_fixed=settings.keep_fixed,
                mimic=settings.mimic,
                equality=settings.equality,
            )
        for name in _OF_MODEL_FILES:
            if name in settings.model_fields_set:
                self.complain((name,), "belongs to a model file", "remove it")
        kind = next(k for k in ("chain", "tree", "srms") if getattr(source, k) is not None)
        options = dict(getattr(source, kind))
        if settings.gravity is not None:
            options["gravity"] = tuple(settings.gravity)
        return self._scene(kind, options)

    def simulate_arguments(self, model: Model) -> dict[str, Any]:
        """Keyword arguments of linkwise.simulate. InputError for joints, bodies, columns or units
        that do not fit the model."""
        builder = ArgumentBuilder(self, model)
        builder.ratings()  # used by those who read the run, wrong ones are found now
        output = self.settings.output
        return {
            **builder.simulate(),
            "drives": builder.joint_drives(),
            "wrenches": builder.wrenches(),
            "q0": builder.state("position"),
            "v0": builder.state("velocity"),
            **builder.held(),
            "every": output.every,
            "record": {
                "quantities": builder.quantities(),
                "joints": builder.joints(),
                "extremes": output.extremes,
                "scenario_text": self.text,
            },
            "output": self._output_path(),
        }

    def first_position(self, model: Model) -> tuple[npt.NDArray[np.float64] | None, list[str]]:
        """Where the scenario starts (nq,) [rad, m], loops perhaps open, None where it does not say;
        and the joints that it places. InputError as `simulate_arguments`."""
        return ArgumentBuilder(self, model).state("position"), list(self.settings.initial.position)

    def replaces_elsewhere(self) -> Path | None:
        """What [output] path would replace outside the folder of this file, or None.

        Scenarios come from other people. Where they write may not cost a file that they were never
        shown.
        """
        path = self._output_path()
        if path is None or not os.path.lexists(path):
            return None
        folder = os.path.realpath(self.resolve("."))
        inside = os.path.realpath(path).startswith(os.path.join(folder, ""))
        return None if inside else path

    def _output_path(self) -> Path | None:
        path = self.settings.output.path
        return None if path is None else self.resolve(path)

    def _scene(self, kind: str, options: dict[str, Any]) -> Model:
        function: Callable[..., Model] = getattr(scenes, kind)
        known = inspect.signature(function).parameters
        for name in options:
            if name not in known:
                self.complain(
                    ("model", kind, name), "unknown key", near(name, known, "the keys are")
                )
        try:
            return function(**options)
        except (InputError, MemoryError) as error:
            raise InputError(f"{shorten(self.path, 400)}: model.{kind}: {error}") from None
        except (TypeError, ValueError, ArithmeticError) as error:
            self.complain(("model", kind), shorten(error, 120), "check the types of its values")


def load_scenario(path: str | os.PathLike[str]) -> Scenario:
    """Read and check a scenario file. Files that it names are looked for relative to it.

    Raises InputError, in one line that names file, key and remedy, for anything that is not
    valid TOML, unknown keys, wrong types or units, numbers that are not finite or out of range.
    """
    text, document = _read_toml(path, read_bytes(path, "scenario", SCENARIO_BYTES))
    if isinstance(document.get("model"), str):
        document["model"] = {"path": document["model"]}
    try:
        settings = ScenarioFile.model_validate(document)
    except ValidationError as error:
        _complain_first(path, error)
    return Scenario(Path(path), settings, text)


def variant(scenario: Scenario, changes: Mapping[str, Any]) -> Scenario:
    """The scenario with other values, by dotted key: {"payload.box.mass": 5}.

    Raises InputError for keys and values that a scenario does not take.
    """
    document = tomllib.loads(scenario.text)
    if isinstance(document.get("model"), str):
        document["model"] = {"path": document["model"]}
    for key, value in changes.items():
        *tables, last = _parts(key)
        place = document
        for name in tables:
            place = place.setdefault(name, {})
            if not isinstance(place, dict):
                complain(scenario.path, key, f"'{shorten(name)}' is no table", "correct the key")
        place[last] = value
    try:
        settings = ScenarioFile.model_validate(document)
    except ValidationError as error:
        _complain_first(scenario.path, error)
    said = ", ".join(f"{key} = {value!r}" for key, value in changes.items())
    text = f"{scenario.text.rstrip()}\n\n# changed: {' '.join(said.split())}\n"
    return Scenario(scenario.path, settings, text, home=scenario.home)


def _parts(key: str) -> list[str]:
    """The names in a dotted key, as TOML reads it."""
    try:
        place: Any = tomllib.loads(f"{key} = 0") if "\n" not in key and "=" not in key else None
    except tomllib.TOMLDecodeError:
        place = None
    found = []
    while isinstance(place, dict) and len(place) == 1:
        ((name, place),) = place.items()
        found.append(name)
    if not found or place != 0:
        raise InputError(f"key {shorten(key)!r}: is not a key; write it as payload.box.mass")
    return found


def parse_axis(text: str) -> tuple[str, list[Any]]:
    """Key and values of a sweep's axis, written KEY=[VALUE, VALUE, ...] in TOML."""
    key, _, values = text.partition("=")
    try:
        found = tomllib.loads(f"values = {values}")["values"] if "\n" not in values else None
    except (tomllib.TOMLDecodeError, KeyError):
        found = None
    if not isinstance(found, list) or not found:
        raise InputError(
            f"{shorten(text)!r}: is no axis of a sweep; write KEY=[VALUE, VALUE], such as "
            "payload.box.mass=[0, 5, 10]"
        )
    _parts(key)
    return key.strip(), found


def load_ratings(path: str | os.PathLike[str]) -> dict[str, Rating]:
    """The [rating.JOINT] tables of a TOML file, which may be a whole scenario, by joint name."""
    return _ratings(path, read_bytes(path, "ratings", SCENARIO_BYTES))


def ratings_in(scenario_text: str) -> dict[str, Rating]:
    """The ratings in the text of a scenario, such as a run keeps."""
    return _ratings("scenario of the run", scenario_text.encode("utf-8"))


def section_ratings_in(scenario_text: str) -> dict[str, SectionRating]:
    """What sections of flexible links may carry, by link, in the text of a scenario."""
    name = "scenario of the run"
    _, document = _read_toml(name, scenario_text.encode("utf-8"))
    try:
        found = FlexibleFile.model_validate({"flexible": document.get("flexible", {})})
    except ValidationError as error:
        _complain_first(name, error)
    return {
        link: SectionRating(stress=section.allowable_stress)
        for link, section in found.flexible.items()
        if section.allowable_stress is not None
    }


def _ratings(path: str | os.PathLike[str], data: bytes) -> dict[str, Rating]:
    _, document = _read_toml(path, data)
    if "simulate" not in document and set(document) - {"rating"}:
        key = sorted(set(document) - {"rating"})[0]
        complain(path, key_path([key]), "unknown key", "give [rating.JOINT] tables or a scenario")
    try:
        found = RatingsFile.model_validate({"rating": document.get("rating", {})})
    except ValidationError as error:
        _complain_first(path, error)
    return {joint: Rating(**section.model_dump()) for joint, section in found.rating.items()}


def _read_toml(path: str | os.PathLike[str], data: bytes) -> tuple[str, dict[str, Any]]:
    try:
        text = data.decode("utf-8-sig")
        if _LONG_KEY.search(text):
            raise ValueError("a key has more than 16 parts")
        document = tomllib.loads(text)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        complain(path, "scenario", "is not UTF-8 text", "save it as UTF-8", line)
    except tomllib.TOMLDecodeError as error:
        match = re.search(r"\(at line (\d+), column \d+\)\Z", str(error))
        problem = re.sub(r" \(at [^()]*\)\Z", "", str(error))
        line_number = int(match.group(1)) if match else None
        found = diagnose(text, line_number)
        problem, remedy = found or (f"({shorten(problem, 120)})", "correct the syntax")
        if not problem.startswith("is "):
            problem = (
                f"is not valid TOML: it {problem}" if found else f"is not valid TOML {problem}"
            )
        complain(path, "scenario", problem, remedy, line_number)
    except (RecursionError, ValueError) as error:
        # ValueError: Python refuses integers of thousands of digits.
        problem = f"cannot be read ({shorten(error, 120)})"
        complain(path, "scenario", problem, "use shorter keys and numbers, nested less deeply")
    return text, document


def _complain_first(path: str | os.PathLike[str], error: ValidationError) -> NoReturn:
    details = error.errors(include_url=False)
    # An unknown key is most often a misspelt one, which then also shows as missing.
    first = next((d for d in details if d["type"] == "extra_forbidden"), details[0])
    if first["type"] == "extra_forbidden":
        location = first["loc"]
        known = keys_at(location[:-1])
        keys, problem, _ = describe({**first})
        complain(
            path, key_path(keys), "unknown key", near(str(location[-1]), known, "the keys are")
        )
    keys, problem, remedy = describe({**first})
    complain(path, key_path(keys) or "scenario", problem, remedy)
