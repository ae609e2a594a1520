"""`linkwise inspect`: what is in a model file, and what became of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from linkwise.cli.model import FloatingBase, PackageDirs, load_given
from linkwise.cli.output import JsonOption, console, number, print_json, table, text

if TYPE_CHECKING:
    from linkwise._core import Model

_MOST_ROWS = 60
#: The rank of larger loops takes too long to look at a file.
_MOST_LOOP_ROWS = 600
_LIMITS = ("lower", "upper", "effort", "velocity")
#: What acts on a joint, each with what says how.
_ACTING = {
    "armature": (),
    "damping": (),
    "friction": ("friction_velocity",),
    "stiffness": ("rest_position",),
    "limit_stiffness": ("limit_damping",),
}


def inspect(
    model: Annotated[
        Path, typer.Argument(metavar="MODEL", help="Model file (URDF, MJCF, SDF) or scenario.")
    ],
    floating_base: FloatingBase = False,
    package_dir: PackageDirs = None,
    every_row: Annotated[bool, typer.Option("--all", help="Show all rows of long models.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Show the joints, bodies and masses of MODEL, what was merged and why, and warnings."""
    found = describe_model(load_given(model, floating_base, package_dir)[0])
    if as_json:
        print_json(found)
        return
    screen = console()
    screen.print(_headline(found), markup=False)
    most = len(found["joints"]) if every_row else _MOST_ROWS
    screen.print(_joint_table(found["joints"], most))
    if (properties := _property_table(found["joints"], most)) is not None:
        screen.print(properties)
    if found["loops"]:
        screen.print(_loop_table(found["loops"], most))
    if found["undecided"]:
        screen.print(_undecided_table(found["undecided"]))
    notes = found["notes"] + [
        {"level": "warning", "element": told["joint"], "text": told["text"]}
        for told in found.get("misfits", ())
    ]
    if notes:
        screen.print(_note_table(notes, len(notes) if every_row else _MOST_ROWS))


def describe_model(model: Model) -> dict[str, Any]:
    """The model as plain data: what the tables and `--json` show."""
    names, types, bodies = model.joint_names, model.joint_types, model.child_link_names
    parents, axes, masses = model.joint_parents, model.joint_axes, model.child_link_masses.tolist()
    acting = [key for name, more in _ACTING.items() for key in (name, *more)]
    properties = {key: model.dof_property(key).tolist() for key in (*_LIMITS, *acting)}
    joints = []
    first = 0
    for k, count in enumerate(model.joint_nv):
        span = slice(first, first + count)
        first += count
        joints.append(
            {
                "joint": names[k],
                "type": types[k],
                "axes": [{"kind": kind, "axis": axis} for kind, axis in axes[k]],
                "parent": bodies[parents[k]] if parents[k] >= 0 else None,
                "body": bodies[k],
                "mass": masses[k],
                "degrees_of_freedom": count,
                **{key: values[span] for key, values in properties.items()},
            }
        )
    return {
        "model": model.name,
        "source": model.source,
        "hash": model.hash,
        "links": len(model.link_names),
        "bodies": model.n_bodies,
        "nq": model.nq,
        "nv": model.nv,
        "total_mass": model.total_mass,
        "gravity": model.gravity,
        "joints": joints,
        "loops": _loops(model),
        "couplings": model.coupling_names,
        **_mobility(model),
        "notes": [{"level": n.level, "element": n.element, "text": n.text} for n in model.notes],
    }


def _loops(model: Model) -> list[dict[str, Any]]:
    """The joints that close loops, and how far each is from that in the pose that is drawn."""
    from linkwise._core import loop_gaps

    return [
        {
            "joint": name,
            "type": kind,
            "axes": [{"kind": kind_of_axis, "axis": axis} for kind_of_axis, axis in axes],
            "parent": parent,
            "child": child,
            "degrees_of_freedom": freedom,
            "gap": {"shift": float(gap[0]), "turn": float(gap[1])},
        }
        for name, kind, axes, parent, child, freedom, gap in zip(
            model.loop_names,
            model.loop_types,
            model.loop_axes,
            model.loop_parent_link_names,
            model.loop_child_link_names,
            model.loop_nv,
            loop_gaps(model, model.initial_configuration()),
            strict=True,
        )
    ]


def _mobility(model: Model) -> dict[str, Any]:
    """Degrees of freedom by counting, as if nothing held the same twice, and in the pose that is
    drawn, with how many loads are held more than once there, and which of them nothing decides;
    None where it does not close."""
    from linkwise._core import InputError, indeterminacy
    from linkwise.loads.undecided import misfit_notes, undecided_loads

    rows = sum(6 - freedom for freedom in model.loop_nv) + len(model.coupling_names)
    found: dict[str, Any] = {
        "counted_mobility": model.nv - rows,
        "mobility": None,
        "self_stresses": None,
        "undecided": [],
    }
    if not rows or rows > _MOST_LOOP_ROWS:
        return found
    try:
        q = model.initial_configuration()
        held = indeterminacy(model, q)
        undecided = undecided_loads(model, q)
        misfits = misfit_notes(model, q)
    except InputError:
        return found
    told = [
        {
            "self_stresses": one.self_stresses,
            "joints": one.joints,
            "couplings": one.couplings,
            "remedies": one.remedies,
        }
        for one in undecided
    ]
    return found | {
        "mobility": held.mobility,
        "self_stresses": held.rows - held.rank,
        "undecided": told,
        "misfits": [{"joint": joint, "text": said} for joint, said in misfits],
    }


def _plural(count: int, noun: str, nouns: str = "") -> str:
    return f"{count} {noun if count == 1 else nouns or noun + 's'}"


def _headline(found: dict[str, Any]) -> str:
    """Counts in a sentence."""
    source = f" ({text(found['source'])})" if found["source"] else ""
    gravity = ", ".join(number(component) for component in found["gravity"].tolist())
    freedom = _plural(found["nv"], "degree of freedom", "degrees of freedom")
    links = _plural(found["links"], "link")
    bodies = _plural(found["bodies"], "moving body", "moving bodies")
    return (
        f"{text(found['model'])}{source}: {links} in {bodies}, "
        f"{freedom} ({_plural(found['nq'], 'coordinate')}), {number(found['total_mass'], 6)} kg, "
        f"gravity ({gravity}) m/s2{_said_of_loops(found)}"
    )


def _said_of_loops(found: dict[str, Any]) -> str:
    loops, couplings = found["loops"], found["couplings"]
    if not loops and not couplings:
        return ""
    tied = [_plural(len(couplings), "coupling")] if couplings else []
    if loops:
        tied.append(_plural(len(loops), "joint closes a loop", "joints close loops"))
    counted = found["counted_mobility"]
    taken = found["nv"] - counted
    said = (
        f"; {'; '.join(tied)}: {found['nv']} - {taken} = {counted} degrees of freedom by counting"
    )
    if found["mobility"] is not None:
        said += f", {found['mobility']} as drawn"
    if found["self_stresses"]:
        said += f", with {_plural(found['self_stresses'], 'self-stress', 'self-stresses')}"
    return said


def _axis(axis: Sequence[float]) -> str:
    """x, -z or components to three digits."""
    for letter, component in zip("xyz", axis, strict=True):
        if abs(component) == 1:
            return letter if component > 0 else f"-{letter}"
    return "(" + " ".join(f"{c:.3g}" for c in axis) + ")"


def _axes_cell(joint: dict[str, Any]) -> str:
    single = len(joint["axes"]) == 1 or joint["type"] in ("universal", "cylindrical")
    axes = [_axis(a["axis"]) for a in joint["axes"]]
    if joint["type"] == "cylindrical":
        axes = axes[:1]
    if single:
        return ", ".join(axes)
    return ", ".join(f"{a['kind']} {axis}" for a, axis in zip(joint["axes"], axes, strict=True))


def _limits_cell(joint: dict[str, Any]) -> str:
    """Lower and upper, a pair per degree of freedom; nothing where none is limited."""
    pairs = list(zip(joint["lower"], joint["upper"], strict=True))
    if all(abs(low) == float("inf") and abs(high) == float("inf") for low, high in pairs):
        return ""
    return ", ".join(f"{low:.4g} .. {high:.4g}" for low, high in pairs)


def _joint_table(joints: Sequence[dict[str, Any]], most: int) -> Any:
    title = "Joints and the bodies they carry"
    if len(joints) > most:
        title += f" (the first {most} of {len(joints)}; --all shows all)"
    columns = ("joint", "type", "axis", "limits", "effort", "parent", "body", "mass [kg]")
    right = {"effort", "mass [kg]"}
    made = table(title, [(name, "right" if name in right else "left") for name in columns])
    for joint in joints[:most]:
        made.add_row(
            text(joint["joint"]),
            joint["type"],
            _axes_cell(joint),
            _limits_cell(joint),
            ", ".join(filter(None, map(number, joint["effort"]))),
            text(joint["parent"] or "(ground)"),
            text(joint["body"]),
            number(joint["mass"]),
        )
    return made


def _loop_table(loops: Sequence[dict[str, Any]], most: int) -> Any:
    title = "Joints that close loops"
    if len(loops) > most:
        title += f" (the first {most} of {len(loops)}; --all shows all)"
    columns = [(name, "left") for name in ("joint", "type", "axis", "parent", "child")]
    made = table(title, [*columns, ("apart [mm]", "right"), ("apart [deg]", "right")])
    for loop in loops[:most]:
        ends = (text(loop["parent"]), text(loop["child"]))
        apart = (1e3 * loop["gap"]["shift"], math.degrees(loop["gap"]["turn"]))
        cells = (_axes_cell(loop), *ends, *(f"{gap:.3g}" if gap > 1e-9 else "0" for gap in apart))
        made.add_row(text(loop["joint"]), loop["type"], *cells)
    return made


def _property_table(joints: Sequence[dict[str, Any]], most: int) -> Any:
    """What acts on joints: a row for each that has any, a column for each that any has; or None."""
    used = [name for name in _ACTING if any(any(joint[name]) for joint in joints)]
    rows = [joint for joint in joints if any(any(joint[name]) for name in used)]
    if not rows:
        return None
    columns = [column for name in used for column in (name, *_ACTING[name])]
    title = "Joint properties [SI]"
    if len(rows) > most:
        title += f" (the first {most} of {len(rows)}; --all shows all)"
    made = table(title, [("joint", "left"), *((name, "right") for name in columns)])
    for joint in rows[:most]:
        cells = []
        for name in used:
            for column in (name, *_ACTING[name]):
                values = joint[column] if any(joint[name]) else []
                shown = values[:1] if len(set(values)) == 1 else values
                cells.append(", ".join(map(number, shown)))
        made.add_row(text(joint["joint"]), *cells)
    return made


def _undecided_table(undecided: Sequence[dict[str, Any]]) -> Any:
    """What no rigid body decides, and what was tried and does."""
    from linkwise.loads.undecided import Undecided

    made = table("Loads that rigid bodies and bearings do not decide, as drawn", [("", "left")])
    for one in undecided:
        made.add_row(text(Undecided(**one).text))
    return made


def _note_table(notes: Sequence[dict[str, str]], most: int) -> Any:
    """Warnings first, then what was merged."""
    order = {"warning": 0, "merge": 1, "info": 2}
    ranked = sorted(notes, key=lambda note: order.get(note["level"], 3))
    title = "Notes"
    if len(notes) > most:
        title += f" (the first {most} of {len(notes)}; --all shows all)"
    made = table(title, [("", "left"), ("element", "left"), ("what and why", "left")])
    for note in ranked[:most]:
        style = "yellow" if note["level"] == "warning" else ""
        made.add_row(note["level"], text(note["element"]), text(note["text"]), style=style)
    return made
