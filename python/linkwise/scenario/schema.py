"""The keys of a scenario file, their types and units, as pydantic models.

What depends on the machine (does the joint exist, is this unit right for a sliding joint) is
checked in :mod:`linkwise.scenario.arguments`, once the model is loaded.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, cast

from pydantic import BaseModel, ConfigDict, Field, create_model, model_validator

from linkwise._core import numerics
from linkwise.io.complaint import shorten
from linkwise.io.units import check_dimension
from linkwise.scenario.fields import (
    Acceleration,
    Angles,
    Count,
    Direction,
    Factors,
    Limit,
    Number,
    Point,
    Quantity,
    Scalar,
    Time,
    Vector,
    along_or_all,
    of,
)

Interpolation = Literal["linear", "cubic"]


class Section(BaseModel):
    """A table of the file: unknown keys are errors, nothing is converted silently."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class ModelSection(Section):
    """Where the machine comes from: a file, or one of the generators of linkwise.scenes."""

    path: str | None = None
    chain: dict[str, Any] | None = None
    tree: dict[str, Any] | None = None
    srms: dict[str, Any] | None = None

    @model_validator(mode="after")
    def _one(self) -> ModelSection:
        given = [name for name in type(self).model_fields if getattr(self, name) is not None]
        if len(given) != 1:
            problem = "no model is given" if not given else f"{' and '.join(given)} are both given"
            raise ValueError(
                f'{problem}; give one: model = "robot.urdf", or [model.chain], [model.tree], '
                "[model.srms]"
            )
        return self


class InitialSection(Section):
    """Initial state by joint name; joints not named start as the model is drawn, or as its
    keyframe says, and at rest."""

    keyframe: str | int | None = None
    position: dict[str, Vector] = {}
    velocity: dict[str, Vector] = {}


class _Tabled(Section):
    table: str | None = None
    column: str | None = None
    columns: list[str] | None = None
    interpolation: Interpolation = "linear"

    def _check_table(self, other: str, given: bool) -> None:
        if self.table is None:
            for name in ("column", "columns", "interpolation"):
                if name in self.model_fields_set:
                    raise ValueError(f'{name} belongs to a table; add table = "FILE.csv"')
            if not given:
                raise ValueError(f'has neither {other} nor table; give {other} or "FILE.csv"')
        elif given:
            raise ValueError(f"has both {other} and table; keep one")
        if self.column is not None and self.columns is not None:
            raise ValueError("has both column and columns; keep one")


class TorqueSection(_Tabled):
    """A constant torque, or one from a table."""

    kind: Literal["torque"]
    value: Vector | None = None

    @model_validator(mode="after")
    def _one(self) -> TorqueSection:
        self._check_table("value", self.value is not None)
        return self


class MotionSection(_Tabled):
    """A motion from a table of positions, followed exactly."""

    kind: Literal["motion"]
    table: str
    interpolation: Literal["cubic"] = "cubic"

    @model_validator(mode="after")
    def _one(self) -> MotionSection:
        self._check_table("table", False)
        return self


class PDSection(_Tabled):
    """A PD controller to a fixed or tabulated target."""

    kind: Literal["pd"]
    kp: Scalar
    kd: Scalar
    target: Scalar | None = None

    @model_validator(mode="after")
    def _one(self) -> PDSection:
        self._check_table("target", self.target is not None)
        return self


class SpringSection(Section):
    """A spring and damper to a rest position."""

    kind: Literal["spring"]
    stiffness: Scalar
    damping: Scalar = Quantity(0.0, None)
    rest: Scalar = Quantity(0.0, None)


class LockedSection(Section):
    """The joint stays where it starts."""

    kind: Literal["locked"]


class FreeSection(Section):
    """No drive."""

    kind: Literal["free"]


DriveSection = Annotated[
    TorqueSection | MotionSection | PDSection | SpringSection | LockedSection | FreeSection,
    Field(discriminator="kind"),
]
DRIVES: dict[str, type[Section]] = {
    "torque": TorqueSection,
    "motion": MotionSection,
    "pd": PDSection,
    "spring": SpringSection,
    "locked": LockedSection,
    "free": FreeSection,
}


class WrenchSection(_Tabled):
    """A force and moment at a point of a link, constant or from a table of six columns.

    Where no link is given, the section's name is one. axes: of the components, as in `Wrench`, or
    roll, pitch, yaw of axes against the link's.
    """

    link: str | None = None
    point: Point | None = None
    axes: Literal["world", "frame"] | Angles | None = None
    force: list[Scalar] | None = Field(default=None, min_length=3, max_length=3)
    moment: list[Scalar] | None = Field(default=None, min_length=3, max_length=3)

    @model_validator(mode="after")
    def _one(self) -> WrenchSection:
        self._check_table("force or moment", self.force is not None or self.moment is not None)
        if self.columns is not None and len(self.columns) != 6:
            raise ValueError(f"columns has {len(self.columns)} names; name six: fx fy fz nx ny nz")
        if self.column is not None:
            raise ValueError("column names one of six; give columns")
        for name, dimension in (("force", "force"), ("moment", "moment")):
            for quantity in getattr(self, name) or ():
                check_dimension(quantity.dimension, dimension)
        return self


Mass = Annotated[float, of("number", "mass"), Field(ge=0)]
Inertia = Annotated[
    list[Annotated[float, of("number", "inertia")]], Field(min_length=3, max_length=6)
]


class LinkSection(Section):
    """Other inertial data of a link; what is not given stays as in the model."""

    mass: Mass | None = None
    com: Point | None = None
    inertia: Inertia | None = None

    @model_validator(mode="after")
    def _complete(self) -> LinkSection:
        if self.inertia is not None and len(self.inertia) not in (3, 6):
            raise ValueError(
                f"inertia has {len(self.inertia)} numbers; give ixx iyy izz, or also ixy ixz iyz"
            )
        return self


class PayloadSection(LinkSection):
    """A body welded to a link; centre of mass and inertia about it in the link's frame."""

    link: str
    mass: Mass


class JointSection(Section):
    """Other properties of a joint; what is not given stays as in the model. Keys as in
    ModelBuilder.add_joint, a value for all degrees of freedom or one for each."""

    damping: Vector | None = None
    friction: Vector | None = None
    friction_velocity: Vector | None = None
    stiffness: Vector | None = None
    rest_position: Vector | None = None
    armature: Vector | None = None
    motor_inertia: Vector | None = None
    gear_ratio: Vector | None = None
    lower: Limit | None = None
    upper: Limit | None = None
    effort: Limit | None = None
    velocity: Limit | None = None
    limit_stiffness: Vector | None = None
    limit_damping: Vector | None = None


class LoopSection(JointSection):
    """A joint that closes a loop between two links, with its point and axes on both of them.

    rotation: roll, pitch, yaw of the joint's frame against the link's.
    """

    type: Literal[
        "fixed",
        "revolute",
        "continuous",
        "prismatic",
        "helical",
        "cylindrical",
        "universal",
        "spherical",
        "planar",
        "floating",
    ]
    parent: str
    child: str
    translation: Point | None = None
    rotation: Angles | None = None
    child_translation: Point | None = None
    child_rotation: Angles | None = None
    axis: Direction | None = None
    axes: Annotated[list[Direction], Field(min_length=2, max_length=2)] | None = None
    pitch: Annotated[float, of("length per angle")] | None = None

    @model_validator(mode="after")
    def _fits(self) -> LoopSection:
        for name, types in (("pitch", ("helical",)), ("axes", ("universal",))):
            if getattr(self, name) is not None and self.type not in types:
                raise ValueError(f"{name} belongs to a {types[0]} joint; remove it")
            if getattr(self, name) is None and self.type in types:
                raise ValueError(f"a {self.type} joint needs {name}; add {name} = ...")
        if self.axis is not None and self.type in ("fixed", "universal", "spherical", "floating"):
            raise ValueError(f"axis has no meaning for a {self.type} joint; remove it")
        return self


class RodSection(Section):
    """A rod without mass between a ball on each of two links."""

    parent: str
    child: str
    length: Annotated[float, of("length"), Field(gt=0)]
    point: Point | None = None
    child_point: Point | None = None


Turn = Annotated[list[Annotated[float, of("angle")]], Field(min_length=3, max_length=3)]


class BearingSection(Section):
    """How stiff a joint is against the loads that it holds, rigid where nothing is given, and what
    it does not fit by."""

    radial: Annotated[float, of("stiffness"), Field(gt=0)] | None = None
    axial: Annotated[float, of("stiffness"), Field(gt=0)] | None = None
    tilt: Annotated[float, of("angular stiffness"), Field(gt=0)] | None = None
    torsion: Annotated[float, of("angular stiffness"), Field(gt=0)] | None = None
    axis: Direction | None = None
    offset: Annotated[float | list[float], along_or_all("length")] | None = None
    turn: Turn | None = None
    preload: Annotated[float | list[float], along_or_all("force")] | None = None


Length = Annotated[float, of("length"), Field(gt=0)]
Modulus = Annotated[float, of("pressure"), Field(gt=0)]
SecondMoment = Annotated[float, of("second moment of area"), Field(gt=0)]

#: What each shape of a beam's section is given by.
SHAPES: dict[str, tuple[str, ...]] = {
    "round": ("diameter",),
    "tube": ("diameter", "wall"),
    "rectangle": ("width", "height"),
    "box": ("width", "height", "wall"),
    "general": ("area", "Iy", "Iz", "J"),
}
#: What a general section may be given besides: the outer sizes, for its stresses.
OUTSIDE = ("width", "height")


class FlexibleSection(Section):
    """A link that is an elastic beam, or a body of finite elements from a file."""

    file: str | None = None
    section: Literal["round", "tube", "rectangle", "box", "general"] | None = None
    diameter: Length | None = None
    wall: Length | None = None
    width: Length | None = None
    height: Length | None = None
    area: Annotated[float, of("area"), Field(gt=0)] | None = None
    Iy: SecondMoment | None = None
    Iz: SecondMoment | None = None
    J: SecondMoment | None = None
    E: Modulus | None = None
    G: Modulus | None = None
    density: Annotated[float, of("density"), Field(gt=0)] | None = None
    damping: Annotated[Number, Field(ge=0)] = 0.0
    bodies: Annotated[int, Field(ge=1)] = 1
    interior_modes: Annotated[int, Field(ge=0)] = 2
    stretches: bool = True
    end: Point | None = None
    z: Direction | None = None
    allowable_stress: Modulus | None = None


class PointSpringSection(Section):
    """A spring and damper without mass between a ball on each of two links.

    Limits count from the length.
    """

    parent: str
    child: str
    length: Annotated[float, of("length"), Field(ge=0)]
    point: Point | None = None
    child_point: Point | None = None
    stiffness: Annotated[float, of("stiffness")] | None = None
    damping: Annotated[float, of("damping")] | None = None
    lower: Annotated[float, of("length")] | None = None
    upper: Annotated[float, of("length")] | None = None
    limit_stiffness: Annotated[float, of("stiffness")] | None = None
    limit_damping: Annotated[float, of("damping")] | None = None


class CouplingSection(Section):
    """Coordinates tied together: the sum of factor times coordinate is offset, in SI units; a list
    of factors is that of a polynomial without a constant."""

    factors: Annotated[dict[str, Factors], Field(min_length=1)]
    offset: Number = 0.0


Force = Annotated[float, of("force"), Field(gt=0)]
Moment = Annotated[float, of("moment"), Field(gt=0)]


class RatingSection(Section):
    """What a joint may carry."""

    force: Force | None = None
    axial: Force | None = None
    radial: Force | None = None
    moment: Moment | None = None
    tilting_moment: Moment | None = None
    torque: Moment | None = None
    drive_power: Annotated[Number, Field(gt=0)] | None = None


class _SimulateSection(Section):
    duration: Time
    threads: Count | None = None


#: The type of an option by its kind in the core's table.
_KINDS: dict[str, Any] = {
    "number": Annotated[Number, Field(gt=0)],
    "count": Count,
    "name": str,
}

if TYPE_CHECKING:
    SimulateSection = _SimulateSection
else:
    #: Options of linkwise.simulate and of its Numerics, where their defaults are.
    SimulateSection = create_model(
        "SimulateSection",
        __base__=_SimulateSection,
        **{
            row["name"]: (
                (Time if row["units"] == "s" else _KINDS[row["kind"]]) | None,
                Field(default=None, description=row["description"]),
            )
            for row in numerics()
        },
    )


class OutputSection(Section):
    """What is recorded, how often, and where."""

    every: Time | None = None
    quantities: list[str] | None = None
    joints: list[str] | None = None
    extremes: bool | None = None
    path: str | None = None


class ScenarioFile(Section):
    """A whole scenario file."""

    model: ModelSection
    gravity: Annotated[list[Acceleration], Field(min_length=3, max_length=3)] | None = None
    floating_base: bool = False
    joint_order: Literal["file", "pinocchio"] = "file"
    keep_fixed: bool = False
    mimic: Literal["couple", "independent", "error"] = "couple"
    equality: Literal["exact", "ignore"] = "exact"
    package_dirs: list[str] = []
    initial: InitialSection = InitialSection()
    drive: dict[str, DriveSection] = {}
    wrench: dict[str, WrenchSection] = {}
    payload: dict[str, PayloadSection] = {}
    link: dict[str, LinkSection] = {}
    flexible: dict[str, FlexibleSection] = {}
    joint: dict[str, JointSection] = {}
    loop: dict[str, LoopSection] = {}
    rod: dict[str, RodSection] = {}
    spring: dict[str, PointSpringSection] = {}
    coupling: dict[str, CouplingSection] = {}
    bearing: dict[str, BearingSection] = {}
    rating: dict[str, RatingSection] = {}
    simulate: SimulateSection
    output: OutputSection = OutputSection()


class RatingsFile(Section):
    """The ratings of a file."""

    rating: dict[str, RatingSection] = {}


class FlexibleFile(Section):
    """The elastic links of a file."""

    flexible: dict[str, FlexibleSection] = {}


_SECTIONS: dict[str, type[Section]] = {
    "model": ModelSection,
    "initial": InitialSection,
    "simulate": SimulateSection,
    "output": OutputSection,
}


# Sections that hold one table per name.
_NAMED: dict[str, type[Section]] = {
    "wrench": WrenchSection,
    "payload": PayloadSection,
    "link": LinkSection,
    "flexible": FlexibleSection,
    "joint": JointSection,
    "loop": LoopSection,
    "rod": RodSection,
    "spring": PointSpringSection,
    "coupling": CouplingSection,
    "bearing": BearingSection,
    "rating": RatingSection,
}


def keys_at(location: tuple[str | int, ...]) -> list[str]:
    """The keys that the table at ``location`` may have, for complaints about unknown ones."""
    section: type[Section] = ScenarioFile
    if location[:1] == ("drive",) and len(location) > 2:
        section = DRIVES[cast(str, location[2])]
    elif location[:1] and location[0] in _NAMED and len(location) > 1:
        section = _NAMED[str(location[0])]
    elif location:
        section = _SECTIONS.get(str(location[0]), ScenarioFile)
    return list(section.model_fields)


def describe(error: dict[str, Any]) -> tuple[tuple[str, ...], str, str]:
    """Key path, problem and remedy of one pydantic error."""
    location = tuple(error["loc"])
    kind, given, context = error["type"], error.get("input"), error.get("ctx", {})
    path = tuple(str(p) for i, p in enumerate(location) if not (i == 2 and location[0] == "drive"))
    shown = f"'{shorten(given)}'" if isinstance(given, str) else shorten(given)
    if kind == "value_error":
        problem, _, remedy = str(context["error"]).partition("; ")
        return path, problem, remedy or "give a finite number, with a unit if need be"
    if kind == "missing":
        if location == ("simulate",):
            return path, "is missing", "add [simulate] with duration = ... in s"
        if location == ("model",):
            return path, "is missing", 'add model = "FILE", above the first table'
        return path, "is missing", f"add {location[-1]} = ..."
    if kind == "union_tag_not_found":
        return path, "has no kind", f"add kind = one of {', '.join(DRIVES)}"
    if kind == "union_tag_invalid":
        tag = shorten(context.get("tag", ""))
        return (*path, "kind"), f"'{tag}' is not a kind of drive", f"use one of {', '.join(DRIVES)}"
    if kind == "literal_error":
        return path, f"{shown} is not known", f"use {context['expected']}"
    if kind in ("greater_than", "greater_than_equal"):
        bound = context.get("gt", context.get("ge"))
        word = "above" if "gt" in context else "at least"
        return path, f"is {shown}", f"give a number {word} {bound:g}"
    if kind == "less_than":
        return path, f"is {shown}", f"give a number below {context['lt']}"
    if kind in ("too_short", "too_long"):
        what = "axes" if path[-1] == "axes" else "numbers"
        count = "two" if what == "axes" else "three"
        return path, f"has {context['actual_length']} {what}", f"give {count}"
    wanted = {
        "string_type": "a text in quotes",
        "bool_type": "true or false",
        "int_type": "a whole number",
        "list_type": "a list in brackets",
        "dict_type": "a table",
        "model_type": "a table",
        "model_attributes_type": "a table",
    }.get(kind, "a value of the right type")
    return path, f"{shown} does not fit here", f"give {wanted}"
