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
        try:
            if link.file is not None:
                model = model.with_flexible(name, body=_body(source, link, link.file, keys))
            else:
                model = _with_beams(source, link, keys, model)
        except InputError as error:
            problem, _, remedy = str(error).partition("; ")
            source.complain(keys, problem, remedy or "correct it")
    return model


def _body(
    source: ScenarioSource, link: FlexibleSection, file: str, keys: tuple[str, str]
) -> FlexibleBody:
    """The body of the file, with another damping where that is given."""
    for key in sorted(link.model_fields_set - {"file", _DAMPING}):
        source.complain(keys, f"{key} is given beside file, which has it", "leave it out")
    try:
        body = FlexibleBody.load(source.resolve(file))
    except OSError as error:
        source.complain(keys, f"file cannot be read: {error.strerror}", "correct the path")
    return body.with_damping(link.damping) if _DAMPING in link.model_fields_set else body


def _with_beams(
    source: ScenarioSource, link: FlexibleSection, keys: tuple[str, str], model: Model
) -> Model:
    for key in ("section", "E", "G"):
        if getattr(link, key) is None:
            source.complain(keys, f"{key} is missing", f"add {key} = ..., or file = FILE.npz")
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
    sizes = {size: getattr(link, size) for size in needed}
    if link.section == "general":
        sizes |= {size: getattr(link, size) or 0.0 for size in OUTSIDE}
    make = getattr(Section, link.section, Section)
    return model.with_flexible(
        keys[1],
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
