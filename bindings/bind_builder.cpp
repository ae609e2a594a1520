// ModelBuilder and what else makes a Model from Python's numbers.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>

#include "bind.hpp"
#include "linkwise/model/builder.hpp"
#include "numbers.hpp"
#include "printable.hpp"
#include "py_model.hpp"
#include "vectors.hpp"

namespace linkwise::bindings {
namespace {

AxisSpec axis_spec(nb::handle item) {
  const bool is_sequence = nb::isinstance<nb::tuple>(item) || nb::isinstance<nb::list>(item);
  if (is_sequence && nb::len(item) > 1 && nb::isinstance<nb::str>(item[0]))
    return make_axis(name_in(nb::object(item[0]), "kind of an axis"), vec3(item[1], "axis"),
                     nb::len(item) > 2 ? real_number(item[2], "pitch") : 0);
  return {AxisKind::revolute, vec3(item, "axis"), 0};
}

JointSpec joint_spec(std::string name, std::string parent, std::string child,
                     nb::handle translation, nb::handle rotation, nb::handle axis, nb::handle axes,
                     nb::handle initial) {
  JointSpec joint;
  joint.name = std::move(name);
  joint.parent = std::move(parent);
  joint.child = std::move(child);
  if (!translation.is_none()) joint.translation = vec3(translation, "translation");
  if (!rotation.is_none()) joint.rotation = mat3(rotation, "rotation");
  if (!axes.is_none())
    for (nb::handle item : axes) joint.axes.push_back(axis_spec(item));
  else if (!axis.is_none())
    joint.axes.push_back({AxisKind::revolute, vec3(axis, "axis"), 0});
  if (!initial.is_none()) {
    const ArrayIn given = as_array(initial, "initial");
    joint.initial.assign(given.data(), given.data() + given.size());
  }
  return joint;
}

void add_joint(ModelBuilder& builder, std::string name, const std::string& type, std::string parent,
               std::string child, nb::handle translation, nb::handle rotation, nb::handle axis,
               nb::handle axes, double pitch, nb::handle initial, const nb::kwargs& properties) {
  builder.add_joint(joint_spec(std::move(name), std::move(parent), std::move(child), translation,
                               rotation, axis, axes, initial),
                    type, pitch, properties_from(properties));
}

/// A chain of equal links made without Python objects: N in the millions.
PyModel* chain_of(size_t n, const std::string& joint, nb::handle axes, nb::handle translation,
                  double mass, nb::handle com, nb::handle inertia, nb::handle gravity,
                  double damping, double armature, bool floating_base) {
  const ArrayIn axis_list = as_array(axes, "axes");
  if (axis_list.ndim() != 2 || axis_list.shape(1) != 3 || axis_list.shape(0) == 0)
    throw InputError("axes has shape " + shape_text(shape_of(axis_list)) +
                     " but shape (k, 3) is expected");
  EqualChain chain;
  chain.n_links = n;
  chain.joint = joint_type_from_name(joint);
  for (const double* a = axis_list.data(); a != axis_list.data() + axis_list.size(); a += 3)
    chain.axes.push_back({a[0], a[1], a[2]});
  chain.translation = vec3(translation, "translation");
  chain.link = link_spec("", mass, com, inertia);
  chain.gravity = vec3(gravity, "gravity");
  chain.damping = damping;
  chain.armature = armature;
  chain.floating_base = floating_base;
  return new PyModel(make_chain(chain));
}

}  // namespace

void add_loop(ModelBuilder& builder, std::string name, const std::string& type, std::string parent,
              std::string child, nb::handle translation, nb::handle rotation,
              nb::handle child_translation, nb::handle child_rotation, nb::handle axis,
              nb::handle axes, double pitch, const nb::kwargs& properties) {
  LoopJointSpec loop;
  loop.joint = joint_spec(std::move(name), std::move(parent), std::move(child), translation,
                          rotation, axis, axes, nb::none());
  if (!child_translation.is_none())
    loop.child_translation = vec3(child_translation, "child_translation");
  if (!child_rotation.is_none()) loop.child_rotation = mat3(child_rotation, "child_rotation");
  builder.add_loop_joint(std::move(loop), type, pitch, properties_from(properties));
}

namespace {

LoopJointSpec between(std::string name, std::string parent, std::string child, nb::handle point,
                      nb::handle child_point) {
  LoopJointSpec loop;
  loop.joint.name = std::move(name);
  loop.joint.parent = std::move(parent);
  loop.joint.child = std::move(child);
  if (!point.is_none()) loop.joint.translation = vec3(point, "point");
  if (!child_point.is_none()) loop.child_translation = vec3(child_point, "child_point");
  return loop;
}

}  // namespace

void add_rod(ModelBuilder& builder, std::string name, std::string parent, std::string child,
             double length, nb::handle point, nb::handle child_point) {
  builder.add_rod(between(std::move(name), std::move(parent), std::move(child), point, child_point),
                  length);
}

void add_spring(ModelBuilder& builder, std::string name, std::string parent, std::string child,
                double length, nb::handle point, nb::handle child_point,
                const nb::kwargs& properties) {
  builder.add_spring(
      between(std::move(name), std::move(parent), std::move(child), point, child_point), length,
      properties_from(properties));
}

void add_coupling(ModelBuilder& builder, std::string name, const nb::dict& factors, double offset) {
  CouplingSpec coupling;
  coupling.name = std::move(name);
  coupling.offset = offset;
  for (auto [joint, given] : factors) {
    CouplingSpec::Term term{name_in(nb::borrow(joint), "a coupled joint"), 0};
    if (nb::isinstance<nb::sequence>(given) && !nb::isinstance<nb::str>(given)) {
      const size_t n = nb::len(given);
      if (n < 1 || n > 4)
        throw InputError(
            "coupling '" + coupling.name + "': joint '" + term.joint + "' has " +
            std::to_string(n) +
            " factors; give those of its coordinate and of its powers up to the fourth");
      for (size_t k = 0; k < n; ++k)
        (k == 0 ? term.factor : term.higher[k - 1]) = real_number(given[k], "factor");
    } else {
      term.factor = real_number(given, "factor");
    }
    coupling.terms.push_back(std::move(term));
  }
  builder.add_coupling(std::move(coupling));
}

LinkSpec link_spec(std::string name, double mass, nb::handle com, nb::handle inertia) {
  return make_link(std::move(name), mass, com.is_none() ? Vec3<double>{} : vec3(com, "com"),
                   inertia.is_none() ? Mat3<double>{} : mat3(inertia, "inertia"));
}

Properties properties_from(const nb::dict& given) {
  Properties found;
  for (auto [key, value] : given) {
    std::string name;
    if (!nb::try_cast(key, name))
      throw InputError("a joint property is no text; give its name in quotes");
    found.emplace_back(std::move(name), std::nullopt);
    if (value.is_none()) continue;
    const ArrayIn array = as_array(value, found.back().first.c_str());
    found.back().second.emplace(array.data(), array.data() + array.size());
  }
  return found;
}

namespace {

void bind_note(nb::module_& m) {
  nb::class_<Note>(m, "Note", "What building a model merged, or warns about.")
      .def_prop_ro(
          "level", [](const Note& n) { return note_level_name(n.level); },
          "\"merge\", \"warning\" or \"info\".")
      .def_ro("element", &Note::element, "The link or joint that it is about.")
      .def_ro("text", &Note::text, "What was done or is to be known, in one sentence.")
      .def("__getstate__",
           [](const Note& n) { return std::tuple(static_cast<int>(n.level), n.element, n.text); })
      .def("__setstate__",
           [](Note& n, const std::tuple<int, std::string, std::string>& state) {
             const auto& [level, element, text] = state;
             new (&n) Note{static_cast<NoteLevel>(level), element, text};
           })
      .def("__repr__",
           [](const Note& n) { return printable("Note(" + n.element + ": " + n.text + ")"); });
}

void bind_chain(nb::module_& m) {
  m.def("make_chain", &chain_of, "n_bodies"_a, nb::kw_only(), "joint"_a, "axes"_a, "translation"_a,
        "mass"_a, "com"_a, "inertia"_a, "gravity"_a, "damping"_a = 0.0, "armature"_a = 0.0,
        "floating_base"_a = false);
}

void bind_joints(nb::class_<ModelBuilder>& builder) {
  builder
      .def("add_joint", &add_joint, "name"_a, "type"_a, "parent"_a, "child"_a, nb::kw_only(),
           "translation"_a = nb::none(), "rotation"_a = nb::none(), "axis"_a = nb::none(),
           "axes"_a = nb::none(), "pitch"_a = 0.0, "initial"_a = nb::none(), "properties"_a,
           R"(Adds a joint between two links.

Args:
    name: unique among joints.
    type: fixed, revolute, continuous, prismatic, helical, cylindrical, universal, spherical,
        planar, floating or composite.
    parent, child: names of links.
    translation: (3,) [m]; rotation: (3, 3). They place the joint frame in the parent link's frame;
        None: in its origin, parallel to it.
    axis: (3,) in the joint frame, the normal of a planar joint; None: z.
    axes: two for universal, a list of (kind, axis) or ("helical", axis, pitch) for composite.
    pitch: of helical [m/rad].
    initial: the joint's coordinates [rad, m] where a simulation starts; None: its zero position.
    properties: damping, friction, friction_velocity, stiffness, rest_position, armature (or
        motor_inertia and gear_ratio), lower, upper, effort, velocity, limit_stiffness,
        limit_damping; one value, or one per degree of freedom. Units as in Model.with_joint.

Raises:
    InputError: a type, property or shape is wrong; what concerns several elements, build checks.)")
      .def("add_loop", &add_loop, "name"_a, "type"_a, "parent"_a, "child"_a, nb::kw_only(),
           "translation"_a = nb::none(), "rotation"_a = nb::none(),
           "child_translation"_a = nb::none(), "child_rotation"_a = nb::none(),
           "axis"_a = nb::none(), "axes"_a = nb::none(), "pitch"_a = 0.0, "properties"_a,
           R"(Adds a joint that closes a loop: each of its links hangs on another joint already.

Args:
    name: unique among joints.
    type, axis, axes, pitch, properties: as in add_joint; a composite joint cannot close a loop.
    parent, child: names of links, or the root link for the ground.
    translation: (3,) [m]; rotation: (3, 3). They place the joint frame in the parent link's frame;
        None: in its origin, parallel to it.
    child_translation, child_rotation: the same in the child link's frame. At zero coordinates the
        two frames are one.

Raises:
    InputError: as add_joint.)");
}

void bind_what_ties(nb::class_<ModelBuilder>& builder) {
  builder
      .def("add_rod", &add_rod, "name"_a, "parent"_a, "child"_a, nb::kw_only(), "length"_a,
           "point"_a = nb::none(), "child_point"_a = nb::none(),
           R"(Adds a rod without mass between a ball on each of two links: it keeps the distance of
two points, and its only load is its force along the line between them.

Args:
    name: unique among joints.
    parent, child: names of links, or the root link for the ground.
    length: [m], more than 0.
    point, child_point: (3,) in the links' frames [m]; None: their origins.

Raises:
    InputError: the length is not more than 0, or an array has another shape.)")
      .def(
          "add_spring", &add_spring, "name"_a, "parent"_a, "child"_a, nb::kw_only(), "length"_a,
          "point"_a = nb::none(), "child_point"_a = nb::none(), "properties"_a,
          R"(Adds a spring and damper without mass between a ball on each of two links. Its force is along
the line between the points, and its coordinate is how much their distance is more than its length.

Args:
    name: unique among joints.
    parent, child: names of links, or the root link for the ground.
    length: distance at which it is slack [m], 0 or more.
    point, child_point: (3,) in the links' frames [m]; None: their origins.
    properties: those of a prismatic joint as in add_joint, as stiffness [N/m], damping [N s/m],
        and lower and upper with limit_stiffness for a stop or a rope; they count from the length.

Raises:
    InputError: the length is negative, a property is unknown, or an array has another shape.)")
      .def(
          "add_coupling", &add_coupling, "name"_a, "factors"_a, nb::kw_only(), "offset"_a = 0.0,
          R"(Ties coordinates of joints together, as gears, racks, screws, differentials and cams do.

The sum of factor times coordinate is offset at all times; a list of factors is that of a polynomial
without a constant, of the coordinate and its second, third and fourth power. The coupling's load,
one number, acts on each joint as the torque or force factor times load, of a polynomial its slope
times load. Joints that close loops may be coupled, too.

Args:
    name: unique among couplings.
    factors: that of each joint, or up to four, by its name; joints of one degree of freedom
        [rad, m].
    offset: what the sum is.

Raises:
    InputError: a factor is not a number; what concerns the joints, build checks.)");
}

}  // namespace

nb::class_<ModelBuilder> bind_builder(nb::module_& m) {
  bind_note(m);
  nb::class_<ModelBuilder> builder(
      m, "ModelBuilder",
      "Collects links and joints by name; build() checks them and gives the immutable Model.\n\n"
      "SI units. Frames as in URDF: a joint's frame is placed in its parent link's frame; the "
      "child\n"
      "link's frame coincides with it when the joint is at zero.");
  bind_joints(builder);
  bind_what_ties(builder);
  builder
      .def(
          "__init__",
          [](ModelBuilder* self, std::string name, nb::object gravity, std::string source) {
            if (gravity.is_none()) gravity = nb::make_tuple(0.0, 0.0, -9.81);
            new (self) ModelBuilder(std::move(name), vec3(gravity, "gravity"), std::move(source));
          },
          "name"_a = "model", nb::kw_only(), "gravity"_a = nb::none(), "source"_a = "",
          "name of the machine; gravity (3,) [m/s2] in world axes, None: (0, 0, -9.81); source: "
          "the file that messages name.")
      .def(
          "add_link",
          [](ModelBuilder& self, std::string name, double mass, nb::handle com,
             nb::handle inertia) { self.add_link(link_spec(std::move(name), mass, com, inertia)); },
          "name"_a, nb::kw_only(), "mass"_a = 0.0, "com"_a = nb::none(), "inertia"_a = nb::none(),
          R"(Adds a link.

Args:
    name: unique among links.
    mass: [kg]; com: centre of mass (3,) [m]; inertia: (3, 3) [kg m2] about it. All in the link's
        frame; None: zero.

Raises:
    InputError: an array has another shape, or a number is not finite.)")
      .def("add_note", &ModelBuilder::add_note, "level"_a, "element"_a, "text"_a,
           R"(Adds a note for Model.notes, as readers of files do about what they leave out.

Args:
    level: "merge", "warning" or "info"; element: the link or joint; text: one sentence.

Raises:
    InputError: the level is unknown.)")
      .def("set_floating_base", &ModelBuilder::set_floating_base, "joint_name"_a = "root_joint",
           R"(The root link floats on a joint of this name (joint_name) instead of being welded to
the ground.)")
      .def(
          "build",
          [](const ModelBuilder& self, bool keep_fixed) {
            return new PyModel(self.spec(keep_fixed));
          },
          nb::kw_only(), "keep_fixed"_a = false,
          R"(Checks everything and builds the Model.

Args:
    keep_fixed: keeps fixed joints that carry mass as joints with a load, instead of merging
        the child into its parent.

Raises:
    InputError: what is wrong, with the element and the remedy.)");
  bind_chain(m);
  return builder;
}

}  // namespace linkwise::bindings
