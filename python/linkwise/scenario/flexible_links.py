"""Makes links of a scenario's machine elastic."""

from __future__ import annotations

from linkwise._core import InputError, Model
from linkwise.flexible.section import Section
from linkwise.io.complaint import near, shorten
from linkwise.scenario.arguments import ScenarioSource
from linkwise.scenario.schema import OUTSIDE, SHAPES


def with_flexible_links(source: ScenarioSource, model: Model) -> Model:
    """The model with the elastic links of the scenario."""
    for name, link in source.settings.flexible.items():
        keys = ("flexible", name)
        if name not in model.link_names:
            remedy = near(name, model.link_names, "the links are")
            source.complain(keys, f"the model has no link '{shorten(name)}'", remedy)
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
        try:
            model = model.with_flexible(
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
        except InputError as error:
            problem, _, remedy = str(error).partition("; ")
            source.complain(keys, problem, remedy or "correct it")
    return model
