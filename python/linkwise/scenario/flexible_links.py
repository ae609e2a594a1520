"""Makes links of a scenario's machine elastic."""

from __future__ import annotations

from linkwise._core import InputError, Model
from linkwise.flexible.body import FlexibleBody
from linkwise.flexible.section import Section
from linkwise.io.complaint import near, shorten
from linkwise.scenario.arguments import ScenarioSource
from linkwise.scenario.schema import OUTSIDE, SHAPES, FlexibleSection

_DAMPING = "damping"


def with_flexible_links(source: ScenarioSource, model: Model) -> Model:
    """The model with the elastic links of the scenario."""
    for name, link in source.settings.flexible.items():
        keys = ("flexible", name)
        if name not in model.link_names:
            remedy = near(name, model.link_names, "the links are")
            source.complain(keys, f"the model has no link '{shorten(name)}'", remedy)
        (_check_beams if link.file is None else _check_file)(source, link, keys)
        try:
            if link.file is not None:
                model = model.with_flexible(name, body=_body(source, link, link.file))
            else:
                model = _with_beams(link, name, model)
        except InputError as error:
            problem, _, remedy = str(error).partition("; ")
            source.complain(keys, problem, remedy or "correct it")
    return model


def _check_file(source: ScenarioSource, link: FlexibleSection, keys: tuple[str, str]) -> None:
    for key in sorted(link.model_fields_set - {"file", _DAMPING}):
        source.complain(keys, f"{key} is given beside file, which has it", "leave it out")


def _body(source: ScenarioSource, link: FlexibleSection, file: str) -> FlexibleBody:
    """The body of the file, with another damping where that is given."""
    try:
        body = FlexibleBody.load(source.resolve(file))
    except OSError as error:
        raise InputError(f"file cannot be read: {error.strerror}; correct the path") from None
    return body.with_damping(link.damping) if _DAMPING in link.model_fields_set else body


def _check_beams(source: ScenarioSource, link: FlexibleSection, keys: tuple[str, str]) -> None:
    for key in ("section", "E", "G"):
        if getattr(link, key) is None:
            source.complain(keys, f"{key} is missing", f"add {key} = ..., or file = FILE.npz")
    changed = source.settings.link.get(keys[1])
    if link.density is not None and changed is not None and changed.mass is not None:
        problem = f"density is given beside mass in [link.{shorten(keys[1])}], which it replaces"
        source.complain(keys, problem, "leave one of them out")
    assert link.section is not None
    needed = SHAPES[link.section]
    for size in sorted({size for sizes in SHAPES.values() for size in sizes}):
        given = getattr(link, size) is not None
        if link.section == "general" and size in OUTSIDE:
            continue
        if given != (size in needed):
            text = f"a {link.section} section is given by {', '.join(needed)}"
            problem = f"{size} is {'given' if given else 'missing'}: {text}"
            source.complain(keys, problem, f"{'leave it out' if given else 'give it'}")


def _with_beams(link: FlexibleSection, name: str, model: Model) -> Model:
    assert link.section is not None
    sizes = {size: getattr(link, size) for size in SHAPES[link.section]}
    if link.section == "general":
        sizes |= {size: getattr(link, size) or 0.0 for size in OUTSIDE}
    make = getattr(Section, link.section, Section)
    return model.with_flexible(
        name,
        section=make(**sizes),
        E=link.E,
        G=link.G,
        density=link.density,
        damping=link.damping,
        bodies=link.bodies,
        interior_modes=link.interior_modes,
        stretches=link.stretches,
        end=link.end,
        z=link.z,
    )
