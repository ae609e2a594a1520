// Model: what it holds, by name, and the same machine changed.
#include <algorithm>

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bind.hpp"
#include "frame.hpp"
#include "joint_lists.hpp"
#include "linkwise/model/builder.hpp"
#include "numbers.hpp"
#include "printable.hpp"
#include "py_model.hpp"
#include "vectors.hpp"

namespace linkwise::bindings {
namespace {

template <class F>
nb::list list_per_joint(const PyModel& self, F&& f) {
  nb::list out;
  for (const JointInfo& joint : self.model->joints) out.append(f(joint));
  return out;
}

nb::bytes to_bytes(const ModelSpec& spec) {
  const std::string bytes = serialize(spec);
  return nb::bytes(bytes.data(), bytes.size());
}

/// InputError where Python could not read the text.
void check_text(const std::string& text) {
  const auto size = static_cast<Py_ssize_t>(text.size());
  if (nb::steal(PyUnicode_DecodeUTF8(text.data(), size, nullptr))) return;
  PyErr_Clear();
  throw InputError("model data is damaged: a name is no UTF-8 text; write it again with to_bytes");
}

ModelSpec from_bytes(const nb::bytes& description) {
  ModelSpec spec = deserialize(std::string(description.c_str(), description.size()));
  for (const std::string* text : {&spec.name, &spec.source, &spec.floating_joint})
    check_text(*text);
  for (const std::string& joint : spec.prescribed) check_text(joint);
  for (const Note& note : spec.notes)
    for (const std::string* text : {&note.element, &note.text}) check_text(*text);
  for (const LinkSpec& link : spec.links) check_text(link.name);
  const auto check_joint = [](const JointSpec& joint) {
    for (const std::string* text : {&joint.name, &joint.parent, &joint.child}) check_text(*text);
  };
  for (const JointSpec& joint : spec.joints) check_joint(joint);
  for (const LoopJointSpec& loop : spec.loop_joints) check_joint(loop.joint);
  for (const CouplingSpec& coupling : spec.couplings) {
    check_text(coupling.name);
    for (const CouplingSpec::Term& term : coupling.terms) check_text(term.joint);
  }
  for (const BearingSpec& bearing : spec.bearings) check_text(bearing.joint);
  return spec;
}

/// Fixed joints that are no joints of the model, because their links are merged.
nb::list welds(const PyModel& self) {
  const std::vector<JointSpec>& joints = self.model->spec().joints;
  std::vector<char> merged(joints.size() + self.model->spec().loop_joints.size() + 1, 1);
  for (const JointInfo& joint : self.model->joints) merged[joint.spec] = 0;
  for (const LoopJoint& loop : self.model->loops.joints) merged[loop.joint.spec] = 0;
  nb::list out;
  for (size_t j = 0; j < joints.size(); ++j)
    if (merged[j]) out.append(nb::make_tuple(joints[j].name, joints[j].parent, joints[j].child));
  return out;
}

/// The same machine with a body welded to one of its links.
PyModel* payload_on(const PyModel& self, const std::string& link, double mass, nb::handle com,
                    nb::handle inertia, const std::string& name) {
  self.model->link_index(link);
  return new PyModel(with_payload(self.model->spec(), link, link_spec(name, mass, com, inertia)));
}

/// The same machine with other inertial data of one link; what is None stays.
PyModel* with_link(const PyModel& self, const std::string& link, nb::handle mass, nb::handle com,
                   nb::handle inertia) {
  ModelSpec spec = self.model->spec();
  LinkSpec& old = spec.links[self.model->link_index(link)];
  if (old.body_kind != BodyKind::rigid)
    throw InputError("link '" + link + "'" + self.model->where() +
                     (old.body_kind == BodyKind::beam
                          ? " is an elastic beam, whose section and density say"
                          : " is an elastic body, whose finite elements say") +
                     " what its inertia is; change these where it is made flexible");
  LinkSpec given =
      link_spec(link, mass.is_none() ? old.mass : real_number(mass, "mass"), com, inertia);
  if (com.is_none()) given.com = old.com;
  if (inertia.is_none()) given.inertia = old.inertia;
  given.body_kind = old.body_kind;
  given.parameters = old.parameters;
  old = std::move(given);
  return new PyModel(std::move(spec));
}

bool closes_loop(const Model& model, const std::string& joint) {
  return std::any_of(model.loops.joints.begin(), model.loops.joints.end(),
                     [&](const LoopJoint& loop) { return loop.joint.name == joint; });
}

PyModel* joints_on(const PyModel& self, const nb::dict& joints) {
  std::vector<std::pair<std::string, Properties>> given;
  for (auto [key, value] : joints) {
    std::string joint;
    if (!nb::try_cast(key, joint) || !nb::isinstance<nb::dict>(value))
      throw InputError(
          "joint properties are no dict of dicts; give {\"elbow\": {\"armature\": 0.1}}");
    if (!closes_loop(*self.model, joint))
      self.model->joint_index(joint);  // names what is unknown or merged
    given.emplace_back(std::move(joint), properties_from(nb::borrow<nb::dict>(value)));
  }
  return new PyModel(with_joints(self.model->spec(), std::move(given)));
}

PyModel* with_joint(const PyModel& self, const std::string& joint, const nb::kwargs& properties) {
  nb::dict one;
  one[joint.c_str()] = properties;
  return joints_on(self, one);
}

PyModel* with_joint_type(const PyModel& self, const std::string& joint, const std::string& type) {
  self.model->load_index(joint);  // names what is unknown or merged
  return new PyModel(with_more_freedom(self.model->spec(), joint, joint_type_from_name(type)));
}

PyModel* prescribe(const PyModel& self, const std::vector<std::string>& names) {
  ModelSpec spec = self.model->spec();
  for (const std::string& name : names) {
    self.model->load_index(name);
    spec.prescribed.push_back(name);
  }
  return new PyModel(std::move(spec));
}

nb::slice slice_of(int start, int length) {
  return nb::slice(nb::int_(start), nb::int_(start + length), nb::int_(1));
}

std::string hash_of(const PyModel& self) {
  return nb::cast<std::string>(nb::module_::import_("hashlib")
                                   .attr("sha256")(to_bytes(self.model->spec()))
                                   .attr("hexdigest")());
}

nb::list joint_axes(const PyModel& self) {
  nb::list out;
  for (int j = 0; j < self.model->n_joints(); ++j) out.append(axes_of(self.model->joint_spec(j)));
  return out;
}

nb::object link_centers_of_mass(const PyModel& self) {
  const std::vector<LinkSpec>& links = self.model->spec().links;
  NewArray out({links.size()}, {3});
  double* row = out.data;
  for (const LinkSpec& link : links)
    for (double x : {link.com.x, link.com.y, link.com.z}) *row++ = x;
  return read_only(out.array);
}

nb::object link_inertias(const PyModel& self) {
  const std::vector<LinkSpec>& links = self.model->spec().links;
  NewArray out({links.size()}, {3, 3});
  double* row = out.data;
  for (const LinkSpec& link : links)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) *row++ = link.inertia.m[packed(i, j)];
  return read_only(out.array);
}

void bind_sizes(ModelClass& c) {
  c.def_prop_ro(
       "name", [](const PyModel& s) { return s.model->spec().name; }, "The machine's name.")
      .def_prop_ro(
          "source", [](const PyModel& s) { return s.model->spec().source; },
          "The file it was read from; empty for a machine built in a program.")
      .def_prop_ro(
          "nq", [](const PyModel& s) { return s.model->nq(); }, "Coordinates: length of q.")
      .def_prop_ro(
          "nv", [](const PyModel& s) { return s.model->nv(); },
          "Degrees of freedom: length of v and tau.")
      .def_prop_ro(
          "n_joints", [](const PyModel& s) { return s.model->n_joints(); },
          "Joints of the tree that carry a load; loads are (..., n_joints + n_loops, 6).")
      .def_prop_ro(
          "n_bodies", [](const PyModel& s) { return s.model->n_bodies(); },
          "Bodies of the recursion: parts with mass. Fewer than n_joints where links between "
          "joints "
          "have no mass.")
      .def_prop_ro(
          "total_mass", [](const PyModel& s) { return s.model->total_mass(); },
          "Mass of the moving bodies [kg].")
      .def_prop_ro(
          "gravity",
          [](const PyModel& s) {
            const auto& g = s.model->gravity;
            return read_only(to_numpy({g.x, g.y, g.z}));
          },
          nb::rv_policy::move, "(3,) [m/s2], world axes.")
      .def_prop_ro(
          "notes", [](const PyModel& s) { return s.model->notes; },
          "What was merged and what to beware of: a list of Note.")
      .def_prop_ro("hash", &hash_of, "SHA-256 of the model's description, hexadecimal.")
      .def(
          "neutral_configuration",
          [](const PyModel& s) { return to_numpy(s.model->neutral_configuration()); },
          "Positions q (nq,) [rad, m] at zero: zeros, quaternions 0, 0, 0, 1.")
      .def(
          "initial_configuration",
          [](const PyModel& s) { return to_numpy(s.model->initial_configuration()); },
          "Positions q (nq,) [rad, m] where simulations start unless told otherwise: as the file "
          "draws the machine, which is the zero position but for the free bodies of an MJCF.")
      .def("__repr__", [](const PyModel& s) {
        return "<linkwise.Model '" + printable(s.model->spec().name) +
               "': " + std::to_string(s.model->n_joints()) + " joints, nq " +
               std::to_string(s.model->nq()) + ", nv " + std::to_string(s.model->nv()) + ">";
      });
}

void bind_joints(ModelClass& c) {
  c.def_prop_ro(
       "joint_names",
       [](const PyModel& s) {
         return list_per_joint(s, [](const JointInfo& j) { return j.name; });
       },
       "Joints of the tree that carry a load, in the order of all that is per joint.")
      .def_prop_ro(
          "joint_types",
          [](const PyModel& s) {
            return list_per_joint(s, [](const JointInfo& j) { return joint_type_name(j.type); });
          },
          "Type of each joint, as in ModelBuilder.add_joint.")
      .def_prop_ro(
          "joint_nq",
          [](const PyModel& s) {
            return list_per_joint(s, [](const JointInfo& j) { return j.nq; });
          },
          "Coordinates of each joint; they add up to nq.")
      .def_prop_ro(
          "joint_nv",
          [](const PyModel& s) {
            return list_per_joint(s, [](const JointInfo& j) { return j.nv; });
          },
          "Degrees of freedom of each joint; they add up to nv.")
      .def_prop_ro(
          "joint_parents", [](const PyModel& s) { return s.model->joint_parents(); },
          "Index of the joint inboard of each joint, -1 at the ground.")
      .def_prop_ro("joint_axes", &joint_axes,
                   "Per joint its axes in the joint frame as (kind, (x, y, z)): revolute, "
                   "prismatic, helical, or the\n"
                   "normal of a planar joint; none for fixed, spherical and floating joints.")
      .def(
          "joint_labels",
          [](const PyModel& s, int joint) {
            if (joint < 0 || joint >= s.model->n_joints())
              throw InputError("joint " + std::to_string(joint) +
                               " is out of range; the model has " +
                               std::to_string(s.model->n_joints()) + " joints");
            return labels_of(s.model->joint_spec(joint));
          },
          "joint"_a,
          "Suffix and unit of each coordinate of a joint, and of each of its rates (the unit of "
          "its "
          "integral).")
      .def_prop_ro(
          "child_link_names",
          [](const PyModel& s) {
            return list_per_joint(s,
                                  [&](const JointInfo& j) { return s.model->links[j.link].name; });
          },
          "Name of the link that each joint moves, its child, in the order of joint_names.")
      .def_prop_ro(
          "parent_link_names",
          [](const PyModel& s) {
            nb::list out;
            for (int j = 0; j < s.model->n_joints(); ++j) out.append(s.model->joint_spec(j).parent);
            return out;
          },
          "Name of the link that each joint hangs on, its parent, in the order of joint_names; "
          "empty for a floating base.")
      .def_prop_ro("welds", &welds,
                   "Fixed joints whose links are merged, as (joint, parent link, child link).")
      .def_prop_ro(
          "child_link_masses",
          [](const PyModel& s) {
            std::vector<double> masses;
            for (const auto& j : s.model->joints)
              masses.push_back(
                  j.last_of_body
                      ? with_body(*s.model, j.body, [](const auto& body) { return mass(body); })
                      : 0.0);
            return read_only(to_numpy(masses));
          },
          nb::rv_policy::move,
          "Mass (n_joints,) [kg] of the child link of each joint, with what was welded to it; 0 "
          "where it "
          "has none.");
}

void bind_loops(ModelClass& c) {
  c.def_prop_ro(
       "n_loops", [](const PyModel& s) { return s.model->n_loops(); },
       "Joints that close loops; their loads stand behind those of the tree's joints.")
      .def_prop_ro(
          "loop_names",
          [](const PyModel& s) {
            nb::list names;
            for (const LoopJoint& loop : s.model->loops.joints) names.append(loop.joint.name);
            return names;
          },
          "Joints that close loops (n_loops,), in the order of their loads.")
      .def_prop_ro(
          "loop_child_link_names",
          [](const PyModel& s) {
            nb::list names;
            for (const LoopJoint& loop : s.model->loops.joints)
              names.append(loop.joint.link < 0 ? "" : s.model->links[loop.joint.link].name);
            return names;
          },
          "Link that each joint that closes a loop gives its load to (n_loops,).");
}

void bind_places(ModelClass& c) {
  c.def(
       "joint_index",
       [](const PyModel& s, const std::string& name) { return s.model->joint_index(name); },
       "name"_a,
       "Position of a joint in all that is per joint, by its name; InputError if unknown.")
      .def(
          "load_index",
          [](const PyModel& s, const std::string& name) { return s.model->load_index(name); },
          "name"_a,
          "Row of a joint's load, by its name: joints that close loops stand behind those of the "
          "tree. InputError if unknown.")
      .def(
          "q_slice",
          [](const PyModel& s, const std::string& name) {
            const JointInfo& j = s.model->joints[s.model->joint_index(name)];
            return slice_of(j.q, j.nq);
          },
          "joint"_a,
          "Where the coordinates of a joint are in q, by its name; InputError if unknown.")
      .def(
          "v_slice",
          [](const PyModel& s, const std::string& name) {
            const JointInfo& j = s.model->joints[s.model->joint_index(name)];
            return slice_of(j.v, j.nv);
          },
          "joint"_a,
          "Where the rates of a joint are in v, tau and accelerations, by its name; InputError if "
          "unknown.");
}

void bind_dof_properties(ModelClass& c) {
  c.def(
      "dof_property",
      [](const PyModel& s, const std::string& name) {
        return read_only(to_numpy(s.model->dof_values(dof_property_from_name(name))));
      },
      "name"_a,
      "A joint property (nv,) by its name, as in ModelBuilder.add_joint, in the unit that the "
      "attribute states (damping: [N m s/rad, N s/m]); InputError if unknown.");
  for (int p = 0; p < n_dof_properties; ++p) {
    std::string attribute = dof_property_table[p].name;
    for (const char* limit : {"lower", "upper", "effort", "velocity"})
      if (attribute == limit) attribute += "_limit";
    const nb::object getter = nb::cpp_function(
        [p](const PyModel& s) { return read_only(to_numpy(s.model->dof[p])); }, nb::is_method());
    c.attr(attribute.c_str()) =
        nb::module_::import_("builtins")
            .attr("property")(getter, nb::none(), nb::none(), dof_property_table[p].text);
  }
}

void bind_links(ModelClass& c) {
  c.def_prop_ro(
       "link_names",
       [](const PyModel& s) {
         nb::list out;
         for (const auto& l : s.model->links) out.append(l.name);
         return out;
       },
       "Every link of the source, merged ones included; each name stands for the link's frame.")
      .def_prop_ro(
          "link_masses",
          [](const PyModel& s) {
            std::vector<double> masses;
            for (const LinkSpec& link : s.model->spec().links) masses.push_back(link.mass);
            return read_only(to_numpy(masses));
          },
          nb::rv_policy::move,
          "Mass of each link (n_links,) [kg], in the order of link_names, as the source gives it.")
      .def_prop_ro("link_centers_of_mass", &link_centers_of_mass, nb::rv_policy::move,
                   "Centre of mass of each link (n_links, 3) [m], in the link's frame.")
      .def_prop_ro(
          "link_inertias", &link_inertias, nb::rv_policy::move,
          "Inertia of each link (n_links, 3, 3) [kg m2] about its centre of mass, link axes.");
}

void bind_variants(ModelClass& c) {
  c.def("prescribe", &prescribe, "joints"_a, nb::rv_policy::take_ownership,
        R"(The same machine with the motion of these joints given.

forward_dynamics takes their accelerations (prescribed=, loop_prescribed=) and finds those of the
others, and the torque of the given motion is part of the joint load. Joints that close loops stand
and move as the tree's q and v make them.

Args:
    joints: names, of joints that close loops too.

Raises:
    InputError: a joint is unknown, a rod or a spring.)")
      .def("with_payload", &payload_on, "link"_a, nb::kw_only(), "mass"_a, "com"_a = nb::none(),
           "inertia"_a = nb::none(), "name"_a = "payload", nb::rv_policy::take_ownership,
           R"(The same machine with a body welded to a link.

Args:
    link: its name.
    mass: [kg]; com: centre of mass (3,) [m]; inertia: (3, 3) [kg m2] about it. All in that link's
        frame; None: zero.
    name: of the new link.

Raises:
    InputError: the link is unknown, the name taken, or no body has such an inertia.)")
      .def("with_link", &with_link, "link"_a, nb::kw_only(), "mass"_a = nb::none(),
           "com"_a = nb::none(), "inertia"_a = nb::none(), nb::rv_policy::take_ownership,
           R"(The same machine with other inertial data of one link; what is None stays.

Args:
    link: its name.
    mass: [kg]; com: centre of mass (3,) [m]; inertia: (3, 3) [kg m2] about it. All in that link's
        frame.

Raises:
    InputError: the link is unknown, or no body has such an inertia.)")
      .def("with_joint", &with_joint, "joint"_a, "properties"_a, nb::rv_policy::take_ownership,
           R"(The same machine with other properties of one joint; what is not given stays.

All act at the joint, behind the gear: a drive's torque and `effort` too (as in Drake and MuJoCo),
and the motor's own torque is the joint's over gear_ratio.

Args:
    joint: its name.
    properties: as of ModelBuilder.add_joint, one value, or one per degree of freedom:
        damping [N m s/rad, N s/m]; friction [N m, N]; friction_velocity [rad/s, m/s];
        stiffness [N m/rad, N/m]; rest_position, lower, upper [rad, m];
        armature [kg m2, kg], the rotor's inertia seen at the joint, or motor_inertia [kg m2] of
        the rotor itself with gear_ratio [rad/rad, rad/m] (1 unless given):
        armature = gear_ratio^2 motor_inertia;
        limit_stiffness [N m/rad, N/m] and limit_damping [s/rad, s/m] of the stops;
        effort [N m, N] and velocity [rad/s, m/s], which limit nothing.

Raises:
    InputError: the joint or a property is unknown, the joint is merged or the floating base, or a
        number makes no sense.)")
      .def("with_joint_type", &with_joint_type, "joint"_a, "type"_a, nb::rv_policy::take_ownership,
           R"(The same machine with a hinge or a slider that leaves more freedom.

Args:
    joint: its name; it may close a loop.
    type: "cylindrical", or of a hinge "spherical". Properties of its coordinate stay in a
        cylindrical joint, whose other coordinate has none; a spherical one has none.

Raises:
    InputError: the joint is unknown or merged, or cannot become one of this type.)")
      .def("with_joints", &joints_on, "joints"_a, nb::rv_policy::take_ownership,
           R"(The same machine with other properties of several joints.

Args:
    joints: by name the properties of each, {"elbow": {"armature": 0.1}}; units and meaning as in
        with_joint.

Raises:
    InputError: as with_joint.)");
}

void bind_storage(ModelClass& c) {
  c.def(
       "to_bytes",
       [](const PyModel& s, const nb::object& source) {
         ModelSpec spec = s.model->spec();
         if (!source.is_none()) spec.source = name_in(source, "source");
         return to_bytes(spec);
       },
       nb::kw_only(), "source"_a = nb::none(),
       R"(The model's description, for from_bytes. source replaces Model.source in it, which may
be a path; None keeps it.)")
      .def_static(
          "from_bytes",
          [](const nb::bytes& description) { return new PyModel(from_bytes(description)); },
          "description"_a,
          R"(The Model whose description to_bytes gave. Runs no code, unlike pickle; InputError for
bytes that are no model.)")
      .def("__eq__",
           [](const PyModel& s, nb::handle other) {
             if (!nb::isinstance<PyModel>(other)) return false;
             const PyModel& o = nb::cast<const PyModel&>(other);
             return s.model == o.model || hash_of(s) == hash_of(o);
           })
      .def("__hash__", [](const PyModel& s) { return nb::hash(nb::cast(hash_of(s))); })
      .def("__getstate__", [](const PyModel& s) { return to_bytes(s.model->spec()); })
      .def("__setstate__",
           [](PyModel& s, const nb::bytes& state) { new (&s) PyModel(from_bytes(state)); });
}

}  // namespace

void bind_model(nb::module_& m, nb::class_<ModelBuilder>& builder) {
  ModelClass c(m, "Model", "An immutable multibody model, safe to share between threads; pickles.");
  bind_sizes(c);
  bind_joints(c);
  bind_loops(c);
  bind_loop_joints(c);
  bind_places(c);
  bind_dof_properties(c);
  bind_links(c);
  bind_frame_placement(c);
  bind_variants(c);
  bind_bearings(c);
  bind_flexible(c, builder);
  bind_storage(c);
}

}  // namespace linkwise::bindings
