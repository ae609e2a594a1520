"""Scenario files: a machine, its drives, how long and how exactly to simulate, what to record."""

from __future__ import annotations

import inspect
import os
import re
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from pydantic import ValidationError

from linkwise._core import InputError, Model
from linkwise.io.complaint import complain, near, shorten
from linkwise.io.files import SCENARIO_BYTES, read_bytes
from linkwise.io.load import load
from linkwise.scenario.arguments import ArgumentBuilder, ScenarioSource, key_path
from linkwise.scenario.schema import ScenarioFile, describe, keys_at

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
        """The machine. Raises InputError if it cannot be had."""
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
            )
        for name in ("floating_base", "joint_order", "keep_fixed", "mimic", "package_dirs"):
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
        output = self.settings.output
        return {
            **builder.simulate(),
            "drives": builder.joint_drives(),
            "wrenches": builder.body_wrenches(),
            "q0": builder.state("position"),
            "v0": builder.state("velocity"),
            "every": output.every,
            "quantities": builder.quantities(),
            "joints": builder.joints(),
            "output": None if output.path is None else self.resolve(output.path),
            "scenario_text": self.text,
        }

    def _scene(self, kind: str, options: dict[str, Any]) -> Model:
        from linkwise import scenes

        function: Callable[..., Model] = getattr(scenes, kind)
        known = inspect.signature(function).parameters
        for name in options:
            if name not in known:
                self.complain(
                    ("model", kind, name), "unknown key", near(name, known, "the keys are")
                )
        try:
            return function(**options)
        except InputError as error:
            raise InputError(f"{shorten(self.path, 400)}: model.{kind}: {error}") from None
        except (TypeError, OverflowError) as error:
            self.complain(("model", kind), shorten(error, 120), "check the types of its values")


def load_scenario(path: str | os.PathLike[str]) -> Scenario:
    """Read and check a scenario file. Files that it names are looked for relative to it.

    Raises InputError, in one line that names file, key and remedy, for anything that is not
    valid TOML, unknown keys, wrong types or units, numbers that are not finite or out of range.
    """
    data = read_bytes(path, "scenario", SCENARIO_BYTES)
    try:
        text = data.decode("utf-8")
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
        problem = f"is not valid TOML ({shorten(problem, 120)})"
        complain(path, "scenario", problem, "correct the syntax", line_number)
    except (RecursionError, ValueError) as error:
        # ValueError: Python refuses integers of thousands of digits.
        problem = f"cannot be read ({shorten(error, 120)})"
        complain(path, "scenario", problem, "use shorter keys and numbers, nested less deeply")
    if isinstance(document.get("model"), str):
        document["model"] = {"path": document["model"]}
    try:
        settings = ScenarioFile.model_validate(document)
    except ValidationError as error:
        _complain_first(path, error)
    return Scenario(Path(path), settings, text)


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
