"""Names, dimensions, units and selections of what a run holds."""

import numpy as np
import pytest

import linkwise as lw
from linkwise.record.schema import QUANTITIES, build_schema


def build(*joints):
    """A chain of joints (name, type), every link with mass."""
    builder = lw.ModelBuilder("chain")
    builder.add_link("base")
    parent = "base"
    for name, kind in joints:
        builder.add_link(f"{name}_link", mass=1.0, inertia=np.eye(3))
        options = {"axes": [(1, 0, 0), (0, 1, 0)]} if kind == "universal" else {}
        builder.add_joint(name, kind, parent, f"{name}_link", **options)
        parent = f"{name}_link"
    return builder.build()


def variable(schema, name):
    return next(v for v in schema.variables if v.name == name)


def test_one_degree_of_freedom_each_shares_the_joint_dimension():
    schema = build_schema(build(("a", "revolute"), ("b", "continuous")))
    for name in ("position", "velocity", "acceleration", "drive_torque"):
        assert variable(schema, name).dims == ("joint",)
    assert variable(schema, "joint_load").dims == ("joint", "component")
    assert schema.coordinates["joint"].values.tolist() == ["a", "b"]
    assert schema.coordinates["component"].values.tolist() == ["fx", "fy", "fz", "nx", "ny", "nz"]
    assert schema.coordinates["body"].values.tolist() == ["a_link", "b_link"]
    units = [variable(schema, n).attrs["units"] for n in ("position", "velocity", "acceleration")]
    assert units == ["rad", "rad/s", "rad/s^2"]
    assert variable(schema, "drive_torque").attrs["units"] == "N m"


def test_mixed_joints_have_coordinates_and_degrees_of_freedom():
    schema = build_schema(build(("base", "floating"), ("slide", "prismatic")))
    assert variable(schema, "position").dims == ("coordinate",)
    assert variable(schema, "velocity").dims == ("dof",)
    coordinates = ["x", "y", "z", "qx", "qy", "qz", "qw"]
    labels = schema.coordinates["coordinate"].values.tolist()
    assert labels == [*(f"base.{c}" for c in coordinates), "slide"]
    rates = ["vx", "vy", "vz", "wx", "wy", "wz"]
    assert schema.coordinates["dof"].values.tolist() == [*(f"base.{r}" for r in rates), "slide"]
    assert schema.coordinates["position_units"].values.tolist() == ["m"] * 3 + ["1"] * 4 + ["m"]
    assert schema.coordinates["velocity_units"].values.tolist() == [
        *["m/s"] * 3,
        *["rad/s"] * 3,
        "m/s",
    ]
    torque = schema.coordinates["drive_torque_units"].values.tolist()
    assert torque == ["N", "N", "N", "N m", "N m", "N m", "N"]


@pytest.mark.parametrize(
    ("kind", "coordinates", "rates"),
    [
        ("cylindrical", ["j.translation", "j.angle"], ["j.v", "j.w"]),
        ("universal", ["j.angle1", "j.angle2"], ["j.w1", "j.w2"]),
        ("spherical", ["j.qx", "j.qy", "j.qz", "j.qw"], ["j.wx", "j.wy", "j.wz"]),
        ("planar", ["j.x", "j.y", "j.angle"], ["j.vx", "j.vy", "j.wz"]),
    ],
)
def test_labels_of_each_joint_type(kind, coordinates, rates):
    schema = build_schema(build(("j", kind)))
    assert schema.coordinates["coordinate"].values.tolist() == coordinates
    assert schema.coordinates["dof"].values.tolist() == rates


def test_composite_joints_number_their_axes_and_tell_angles_from_lengths():
    builder = lw.ModelBuilder("stack")
    for name in ("base", "a", "b"):
        builder.add_link(name, mass=1.0, inertia=np.eye(3))
    axes = [("prismatic", (1, 0, 0)), ("revolute", (0, 0, 1)), ("helical", (0, 1, 0), 0.1)]
    builder.add_joint("stack", "composite", "base", "a", axes=axes)
    builder.add_joint("single", "composite", "a", "b", axes=axes[:1])
    schema = build_schema(builder.build())
    labels = ["stack.1", "stack.2", "stack.3", "single"]
    assert schema.coordinates["coordinate"].values.tolist() == labels
    assert schema.coordinates["dof"].values.tolist() == labels
    assert schema.coordinates["position_units"].values.tolist() == ["m", "rad", "rad", "m"]


def test_fixed_joints_carry_loads_and_have_no_coordinates():
    builder = lw.ModelBuilder("welded")
    for name in ("base", "a", "b"):
        builder.add_link(name, mass=1.0, inertia=np.eye(3))
    builder.add_joint("weld", "fixed", "base", "a")
    builder.add_joint("hinge", "revolute", "a", "b")
    schema = build_schema(builder.build(keep_fixed=True))
    assert schema.coordinates["joint"].values.tolist() == ["weld", "hinge"]
    assert schema.coordinates["coordinate"].values.tolist() == ["hinge"]
    assert variable(schema, "joint_load").shape == (2, 6)


def test_joint_subset_takes_its_columns():
    model = build(("a", "revolute"), ("ball", "spherical"), ("b", "prismatic"))
    schema = build_schema(model, joints=["b", "a"])
    assert schema.coordinates["joint"].values.tolist() == ["a", "b"]
    assert variable(schema, "velocity").dims == ("joint",)
    chunk = {
        "position": np.arange(12.0).reshape(2, 6),
        "velocity": np.arange(10.0).reshape(2, 5),
        "joint_load": np.arange(36.0).reshape(2, 3, 6),
    }
    np.testing.assert_array_equal(variable(schema, "position").rows(chunk, 2), [[0, 5], [6, 11]])
    np.testing.assert_array_equal(variable(schema, "velocity").rows(chunk, 2), [[0, 4], [5, 9]])
    loads = variable(schema, "joint_load").rows(chunk, 2)
    np.testing.assert_array_equal(loads, chunk["joint_load"][:, [0, 2]])


def test_quantities_select_variables():
    model = build(("a", "revolute"))
    names = {v.name for v in build_schema(model, ["energy", "position"]).variables}
    assert names == {"position", "kinetic_energy", "potential_energy"}
    assert build_schema(model, "joint_load").quantities == ("joint_load",)
    assert build_schema(model, wrenched=["a_link"]).quantities == QUANTITIES


def test_wrenches_are_recorded_of_wrenched_bodies_alone():
    model = build(("a", "revolute"), ("b", "revolute"))
    assert "external_wrench" not in build_schema(model).quantities
    made = build_schema(model, ["external_wrench"], wrenched=[model.child_link_names[1]])
    assert variable(made, "external_wrench").shape == (1, 6)
    assert made.coordinates["wrenched_body"].values.tolist() == [model.child_link_names[1]]


@pytest.mark.parametrize(
    ("arguments", "pattern"),
    [
        ({"quantities": ["positoin"]}, "record: unknown quantity 'positoin'; use position"),
        ({"joints": ["elbw"]}, "elbw"),
    ],
)
def test_unknown_names_are_refused(arguments, pattern):
    with pytest.raises(lw.InputError, match=pattern):
        build_schema(build(("elbow", "revolute")), **arguments)


def test_labels_of_many_joints_are_not_objects():
    names = [f"joint_{k}" for k in range(2000)]
    schema = build_schema(build(*((name, "revolute") for name in names)))
    assert all(c.values.dtype.kind == "U" for c in schema.coordinates.values())
    assert schema.coordinates["joint"].values[-1] == names[-1]
