#include <string_view>
#include <unordered_map>

#include <nanobind/nanobind.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "arrays.hpp"
#include "bind.hpp"
#include "py_model.hpp"

namespace linkwise::bindings {
namespace {

Vec3<double> vec3(nb::handle value, const char* name) {
  const ArrayIn a = as_array(value, name);
  if (a.ndim() != 1 || a.shape(0) != 3)
    throw InputError(std::string(name) + " has shape " + shape_text(shape_of(a)) +
                     " but shape (3,) is expected");
  return {a.data()[0], a.data()[1], a.data()[2]};
}

Mat3<double> mat3(nb::handle value, const char* name) {
  const ArrayIn a = as_array(value, name);
  if (a.ndim() != 2 || a.shape(0) != 3 || a.shape(1) != 3)
    throw InputError(std::string(name) + " has shape " + shape_text(shape_of(a)) +
                     " but shape (3, 3) is expected");
  Mat3<double> m;
  std::copy(a.data(), a.data() + 9, m.m);
  return m;
}

AxisSpec axis_spec(nb::handle item, const std::string& head) {
  AxisSpec out;
  if (nb::isinstance<nb::tuple>(item) || nb::isinstance<nb::list>(item)) {
    const nb::object first = item[0];
    if (nb::isinstance<nb::str>(first)) {
      const std::string kind = nb::cast<std::string>(first);
      if (kind == "prismatic")
        out.kind = AxisKind::prismatic;
      else if (kind == "helical")
        out.kind = AxisKind::helical;
      else if (kind != "revolute")
        throw InputError(head + "axis kind '" + kind +
                         "' is unknown; known: revolute, prismatic, helical");
      out.axis = vec3(item[1], "axis");
      if (nb::len(item) > 2) out.pitch = nb::cast<double>(item[2]);
      return out;
    }
  }
  out.axis = vec3(item, "axis");
  return out;
}

std::vector<double> values_of(nb::handle value, const char* name) {
  const ArrayIn a = as_array(value, name);
  return {a.data(), a.data() + a.size()};
}

LinkSpec link_spec(std::string name, double mass, nb::handle com, nb::handle inertia) {
  LinkSpec link;
  link.name = std::move(name);
  link.mass = mass;
  if (!com.is_none()) link.com = vec3(com, "com");
  if (!inertia.is_none()) {
    const Mat3<double> I = mat3(inertia, "inertia");
    double scale = 0;
    for (double x : I.m) scale = std::max(scale, std::abs(x));
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < i; ++j)
        if (std::abs(I.m[3 * i + j] - I.m[3 * j + i]) > 1e-9 * scale)
          throw InputError("link '" + link.name +
                           "': inertia is not symmetric; give a symmetric 3x3 matrix");
    link.inertia = {{I.m[0], I.m[3], I.m[4], I.m[6], I.m[7], I.m[8]}};
  }
  return link;
}

/// The same machine with a body welded to one of its links.
PyModel* with_payload(const PyModel& self, const std::string& link, double mass, nb::handle com,
                      nb::handle inertia, const std::string& name) {
  ModelSpec spec = self.model->spec();
  self.model->link_index(link);
  spec.links.push_back(link_spec(name, mass, com, inertia));
  JointSpec weld;
  weld.name = name + "_mount";
  weld.type = JointType::fixed;
  weld.parent = link;
  weld.child = name;
  weld.axes.push_back({});
  spec.joints.push_back(std::move(weld));
  return new PyModel(std::move(spec));
}

/// The same machine with other inertial data of one link; what is None stays.
PyModel* with_link(const PyModel& self, const std::string& link, nb::handle mass, nb::handle com,
                   nb::handle inertia) {
  ModelSpec spec = self.model->spec();
  self.model->link_index(link);
  for (LinkSpec& old : spec.links) {
    if (old.name != link) continue;
    const LinkSpec given =
        link_spec(link, mass.is_none() ? old.mass : nb::cast<double>(mass), com, inertia);
    old.mass = given.mass;
    if (!com.is_none()) old.com = given.com;
    if (!inertia.is_none()) old.inertia = given.inertia;
  }
  return new PyModel(std::move(spec));
}

class ModelBuilder {
 public:
  ModelBuilder(std::string name, nb::handle gravity, std::string source) {
    spec.name = std::move(name);
    spec.gravity = vec3(gravity, "gravity");
    spec.source = std::move(source);
  }

  void add_link(std::string name, double mass, nb::handle com, nb::handle inertia) {
    spec.links.push_back(link_spec(std::move(name), mass, com, inertia));
  }

  void add_joint(std::string name, const std::string& type, std::string parent, std::string child,
                 nb::handle translation, nb::handle rotation, nb::handle axis, nb::handle axes,
                 double pitch, const nb::kwargs& properties) {
    JointSpec joint;
    joint.name = std::move(name);
    const std::string head =
        "joint '" + joint.name + "'" + (spec.source.empty() ? "" : " of " + spec.source) + ": ";
    try {
      joint.type = joint_type_from_name(type);
    } catch (const InputError& error) {
      throw InputError(head + error.what());
    }
    joint.parent = std::move(parent);
    joint.child = std::move(child);
    if (!translation.is_none()) joint.translation = vec3(translation, "translation");
    if (!rotation.is_none()) joint.rotation = mat3(rotation, "rotation");
    if (!axes.is_none()) {
      for (nb::handle item : axes) joint.axes.push_back(axis_spec(item, head));
    } else if (!axis.is_none() || joint.type != JointType::composite) {
      joint.axes.push_back(
          {AxisKind::revolute, axis.is_none() ? Vec3<double>{0, 0, 1} : vec3(axis, "axis"), 0});
    }
    if (joint.type == JointType::helical) joint.axes.at(0).pitch = pitch;
    for (auto [key, value] : properties) {
      const std::string property = nb::cast<std::string>(key);
      int index = -1;
      for (int p = 0; p < n_dof_properties; ++p)
        if (property == dof_property_table[p].name) index = p;
      if (index < 0)
        throw InputError(head + "property '" + property +
                         "' is unknown; see ModelBuilder.add_joint");
      if (value.is_none()) continue;
      std::vector<double> values = values_of(value, dof_property_table[index].name);
      if (values.size() == 1 && values[0] == dof_property_table[index].fallback) continue;
      joint.dof.push_back({static_cast<DofProperty>(index), std::move(values)});
    }
    spec.joints.push_back(std::move(joint));
  }

  void add_note(const std::string& level, std::string element, std::string text) {
    if (level != "merge" && level != "warning" && level != "info")
      throw InputError("note level '" + level + "' is unknown; known: merge, warning, info");
    spec.notes.push_back({level == "merge"     ? NoteLevel::merge
                          : level == "warning" ? NoteLevel::warning
                                               : NoteLevel::info,
                          std::move(element), std::move(text)});
  }

  ModelSpec spec;
};

/// A chain of equal links made without Python objects: N in the millions.
PyModel* make_chain(size_t n, const std::string& joint, nb::handle axes, nb::handle translation,
                    double mass, nb::handle com, nb::handle inertia, nb::handle gravity,
                    double damping, double armature, bool floating_base) {
  ModelBuilder builder("chain", gravity, "");
  const ArrayIn axis_list = as_array(axes, "axes");
  if (axis_list.ndim() != 2 || axis_list.shape(1) != 3 || axis_list.shape(0) == 0)
    throw InputError("axes has shape " + shape_text(shape_of(axis_list)) +
                     " but shape (k, 3) is expected");
  const size_t k = axis_list.shape(0);
  LinkSpec link;
  link.mass = mass;
  link.com = vec3(com, "com");
  const Mat3<double> I = mat3(inertia, "inertia");
  link.inertia = {{I.m[0], I.m[3], I.m[4], I.m[6], I.m[7], I.m[8]}};
  JointSpec spec;
  spec.type = joint_type_from_name(joint);
  const Vec3<double> step = vec3(translation, "translation");
  if (damping != 0) spec.dof.push_back({DofProperty::damping, {damping}});
  if (armature != 0) spec.dof.push_back({DofProperty::armature, {armature}});
  auto& links = builder.spec.links;
  auto& joints = builder.spec.joints;
  links.reserve(n + 1);
  joints.reserve(n);
  builder.spec.floating_base = floating_base;
  if (!floating_base) {
    links.emplace_back();
    links.back().name = "ground";
  }
  for (size_t i = 0; i < n; ++i) {
    link.name = "link_" + std::to_string(i + 1);
    links.push_back(link);
    if (floating_base && i == 0) continue;
    spec.name = "joint_" + std::to_string(i + 1);
    spec.parent = links[links.size() - 2].name;
    spec.child = link.name;
    spec.translation = i == 0 ? Vec3<double>{} : step;
    const double* a = axis_list.data() + 3 * (i % k);
    const double* a2 = axis_list.data() + 3 * ((i + 1) % k);
    spec.axes.assign(1, {AxisKind::revolute, {a[0], a[1], a[2]}, 0});
    if (spec.type == JointType::universal)
      spec.axes.push_back({AxisKind::revolute, {a2[0], a2[1], a2[2]}, 0});
    joints.push_back(spec);
  }
  return new PyModel(std::move(builder.spec));
}

nb::slice slice_of(int start, int length) {
  return nb::slice(nb::int_(start), nb::int_(start + length), nb::int_(1));
}

std::string hash_of(const PyModel& self) {
  const std::string bytes = serialize(self.model->spec());
  return nb::cast<std::string>(nb::module_::import_("hashlib")
                                   .attr("sha256")(nb::bytes(bytes.data(), bytes.size()))
                                   .attr("hexdigest")());
}

nb::list joint_axes(const PyModel& self) {
  std::unordered_map<std::string_view, const JointSpec*> specs;
  for (const JointSpec& j : self.model->spec().joints) specs.emplace(j.name, &j);
  nb::list out;
  for (const JointInfo& joint : self.model->joints) {
    nb::list axes;
    const auto add = [&axes](const char* kind, const Vec3<double>& a) {
      axes.append(nb::make_tuple(kind, nb::make_tuple(a.x, a.y, a.z)));
    };
    const auto found = specs.find(joint.name);
    const bool turns_freely = joint.type == JointType::fixed ||
                              joint.type == JointType::spherical ||
                              joint.type == JointType::floating;
    if (found != specs.end() && !turns_freely) {
      for (const AxisSpec& axis : found->second->axes) {
        if (joint.type == JointType::cylindrical) add("prismatic", axis.axis);
        const bool slides = joint.type == JointType::prismatic || axis.kind == AxisKind::prismatic;
        const bool screws = joint.type == JointType::helical || axis.kind == AxisKind::helical;
        add(joint.type == JointType::planar ? "normal"
            : slides                        ? "prismatic"
            : screws                        ? "helical"
                                            : "revolute",
            axis.axis);
      }
    }
    out.append(axes);
  }
  return out;
}

nb::object link_centers_of_mass(const PyModel& self) {
  const std::vector<LinkSpec>& links = self.model->spec().links;
  NewArray out({links.size()}, {3});
  double* row = out.data;
  for (const LinkSpec& link : links)
    for (double x : {link.com.x, link.com.y, link.com.z}) *row++ = x;
  return out.array;
}

nb::object link_inertias(const PyModel& self) {
  const std::vector<LinkSpec>& links = self.model->spec().links;
  NewArray out({links.size()}, {3, 3});
  double* row = out.data;
  for (const LinkSpec& link : links)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) *row++ = link.inertia.m[sym_index(i, j)];
  return out.array;
}

}  // namespace

void bind_model(nb::module_& m) {
  nb::class_<Note>(m, "Note", "What building a model merged, or warns about.")
      .def_prop_ro("level",
                   [](const Note& n) {
                     return n.level == NoteLevel::merge     ? "merge"
                            : n.level == NoteLevel::warning ? "warning"
                                                            : "info";
                   })
      .def_ro("element", &Note::element)
      .def_ro("text", &Note::text)
      .def("__repr__", [](const Note& n) { return "Note(" + n.element + ": " + n.text + ")"; });

  nb::class_<ModelBuilder>(
      m, "ModelBuilder",
      "Collects links and joints by name; build() checks them and gives the immutable Model.\n\n"
      "SI units. Frames as in URDF: a joint's frame is placed in its parent link's frame; the "
      "child\n"
      "link's frame coincides with it when the joint is at zero.")
      .def(
          "__init__",
          [](ModelBuilder* self, std::string name, nb::object gravity, std::string source) {
            if (gravity.is_none()) gravity = nb::make_tuple(0.0, 0.0, -9.81);
            new (self) ModelBuilder(std::move(name), gravity, std::move(source));
          },
          "name"_a = "model", nb::kw_only(), "gravity"_a = nb::none(), "source"_a = "")
      .def("add_link", &ModelBuilder::add_link, "name"_a, nb::kw_only(), "mass"_a = 0.0,
           "com"_a = nb::none(), "inertia"_a = nb::none(),
           "Adds a link: mass [kg], centre of mass (3,) [m] in the link frame, inertia (3, 3) [kg "
           "m2] about the\n"
           "centre of mass in link axes.")
      .def("add_joint", &ModelBuilder::add_joint, "name"_a, "type"_a, "parent"_a, "child"_a,
           nb::kw_only(), "translation"_a = nb::none(), "rotation"_a = nb::none(),
           "axis"_a = nb::none(), "axes"_a = nb::none(), "pitch"_a = 0.0, "properties"_a,
           "Adds a joint between two links.\n\n"
           "type: fixed, revolute, continuous, prismatic, helical, cylindrical, universal, "
           "spherical, planar,\n"
           "floating or composite. translation (3,) [m] and rotation (3, 3) place the joint frame "
           "in the parent link\n"
           "frame; axis (3,) in the joint frame (normal of a planar joint); axes: two for "
           "universal, a list of\n"
           "(kind, axis) or (\"helical\", axis, pitch) for composite; pitch [m/rad].\n"
           "Properties, one value or one per degree of freedom: damping, friction, "
           "friction_velocity, stiffness,\n"
           "rest_position, armature, lower, upper, effort, velocity, limit_stiffness, "
           "limit_damping.")
      .def(
          "add_note", &ModelBuilder::add_note, "level"_a, "element"_a, "text"_a,
          "Adds a note for Model.notes, as readers of files do about what they leave out; level is "
          "\"merge\",\n"
          "\"warning\" or \"info\".")
      .def(
          "set_floating_base",
          [](ModelBuilder& self, std::string joint_name) {
            self.spec.floating_base = true;
            self.spec.floating_joint = std::move(joint_name);
          },
          "joint_name"_a = "root_joint",
          "The root link floats on a joint of this name instead of being welded to the ground.")
      .def(
          "build",
          [](const ModelBuilder& self, bool keep_fixed) {
            ModelSpec spec = self.spec;
            spec.keep_fixed = keep_fixed;
            return new PyModel(std::move(spec));
          },
          nb::kw_only(), "keep_fixed"_a = false,
          "Checks everything and builds the Model; InputError names the element and the remedy. "
          "keep_fixed keeps\n"
          "fixed joints whose child has mass as joints with a load instead of merging the child "
          "into its parent.");

  nb::class_<PyModel>(m, "Model",
                      "An immutable multibody tree, safe to share between threads; pickles.")
      .def_prop_ro("name", [](const PyModel& s) { return s.model->spec().name; })
      .def_prop_ro("source", [](const PyModel& s) { return s.model->spec().source; })
      .def_prop_ro(
          "nq", [](const PyModel& s) { return s.model->nq(); }, "Length of q.")
      .def_prop_ro(
          "nv", [](const PyModel& s) { return s.model->nv(); },
          "Degrees of freedom: length of v and tau.")
      .def_prop_ro("n_joints", [](const PyModel& s) { return s.model->n_joints(); })
      .def_prop_ro(
          "n_bodies", [](const PyModel& s) { return s.model->n_joints(); },
          "Body k is the child link of joint k.")
      .def_prop_ro("joint_names",
                   [](const PyModel& s) {
                     nb::list out;
                     for (const auto& j : s.model->joints) out.append(j.name);
                     return out;
                   })
      .def_prop_ro("joint_types",
                   [](const PyModel& s) {
                     nb::list out;
                     for (const auto& j : s.model->joints) out.append(joint_type_name(j.type));
                     return out;
                   })
      .def_prop_ro("body_names",
                   [](const PyModel& s) {
                     nb::list out;
                     for (const auto& j : s.model->joints) out.append(s.model->links[j.link].name);
                     return out;
                   })
      .def_prop_ro(
          "link_names",
          [](const PyModel& s) {
            nb::list out;
            for (const auto& l : s.model->links) out.append(l.name);
            return out;
          },
          "Every link of the source, merged ones included.")
      .def_prop_ro(
          "link_masses",
          [](const PyModel& s) {
            std::vector<double> masses;
            for (const LinkSpec& link : s.model->spec().links) masses.push_back(link.mass);
            return to_numpy(masses);
          },
          nb::rv_policy::move, "Mass of each link (n_links,) in kg, in the order of link_names.")
      .def_prop_ro("link_centers_of_mass", &link_centers_of_mass, nb::rv_policy::move,
                   "Centre of mass of each link (n_links, 3) in m, in the link's frame.")
      .def_prop_ro(
          "link_inertias", &link_inertias, nb::rv_policy::move,
          "Inertia of each link (n_links, 3, 3) in kg m2 about its centre of mass, link axes.")
      .def_prop_ro("joint_nq",
                   [](const PyModel& s) {
                     nb::list out;
                     for (const auto& j : s.model->joints) out.append(j.nq);
                     return out;
                   })
      .def_prop_ro("joint_nv",
                   [](const PyModel& s) {
                     nb::list out;
                     for (const auto& j : s.model->joints) out.append(j.nv);
                     return out;
                   })
      .def_prop_ro(
          "joint_parents",
          [](const PyModel& s) {
            nb::list out;
            for (const auto& j : s.model->joints) {
              const BodyTopology& body = s.model->topology[j.body];
              int parent = -1;
              if (j.first_element == body.first_element) {
                if (body.parent >= 0) {
                  const BodyTopology& p = s.model->topology[body.parent];
                  parent = s.model->elements[p.first_element + p.n_elements - 1].joint;
                }
              } else {
                parent = s.model->elements[j.first_element - 1].joint;
              }
              out.append(parent);
            }
            return out;
          },
          "Index of the joint inboard of each joint, -1 at the ground.")
      .def_prop_ro("joint_axes", &joint_axes,
                   "Per joint its axes in the joint frame as (kind, (x, y, z)): revolute, "
                   "prismatic, helical, or the\n"
                   "normal of a planar joint; none for fixed, spherical and floating joints.")
      .def_prop_ro(
          "body_masses",
          [](const PyModel& s) {
            std::vector<double> masses;
            for (const auto& j : s.model->joints)
              masses.push_back(j.last_of_body ? s.model->constants[j.body].inertia.m : 0);
            return to_numpy(masses);
          },
          nb::rv_policy::move, "Mass of each body (n_bodies,) in kg, with what was welded to it.")
      .def(
          "joint_index",
          [](const PyModel& s, const std::string& name) { return s.model->joint_index(name); },
          "name"_a)
      .def(
          "q_slice",
          [](const PyModel& s, const std::string& name) {
            const JointInfo& j = s.model->joints[s.model->joint_index(name)];
            return slice_of(j.q, j.nq);
          },
          "joint"_a, "Where the joint's coordinates are in q.")
      .def(
          "v_slice",
          [](const PyModel& s, const std::string& name) {
            const JointInfo& j = s.model->joints[s.model->joint_index(name)];
            return slice_of(j.v, j.nv);
          },
          "joint"_a, "Where the joint's rates are in v, tau and accelerations.")
      .def(
          "prescribe",
          [](const PyModel& s, const std::vector<std::string>& names) {
            ModelSpec spec = s.model->spec();
            for (const std::string& name : names) {
              s.model->joint_index(name);
              spec.prescribed.push_back(name);
            }
            return new PyModel(std::move(spec));
          },
          "joints"_a, nb::rv_policy::take_ownership,
          "The same machine with the motion of these joints given: forward_dynamics takes their "
          "accelerations\n"
          "(prescribed=) and finds those of the others.")
      .def("with_payload", &with_payload, "link"_a, nb::kw_only(), "mass"_a, "com"_a = nb::none(),
           "inertia"_a = nb::none(), "name"_a = "payload", nb::rv_policy::take_ownership,
           "The same machine with a body welded to a link: mass [kg], centre of mass [m] and "
           "inertia about it\n"
           "[kg m2] in that link's frame.")
      .def("with_link", &with_link, "link"_a, nb::kw_only(), "mass"_a = nb::none(),
           "com"_a = nb::none(), "inertia"_a = nb::none(), nb::rv_policy::take_ownership,
           "The same machine with another mass [kg], centre of mass [m] or inertia about it "
           "[kg m2] of one link;\n"
           "what is None stays.")
      .def_prop_ro(
          "total_mass", [](const PyModel& s) { return s.model->total_mass(); },
          "Mass of the moving bodies, kg.")
      .def_prop_ro(
          "gravity",
          [](const PyModel& s) {
            const auto& g = s.model->gravity;
            return to_numpy({g.x, g.y, g.z});
          },
          nb::rv_policy::move, "m/s2, world axes.")
      .def_prop_ro(
          "notes", [](const PyModel& s) { return s.model->notes; },
          "What was merged and what to beware of.")
      .def_prop_ro("hash", &hash_of, "SHA-256 of the model's description, hexadecimal.")
      .def(
          "neutral_configuration",
          [](const PyModel& s) { return to_numpy(s.model->neutral_configuration()); },
          "q (nq,) at the zero position: zeros, quaternions 0, 0, 0, 1.")
      .def(
          "dof_property",
          [](const PyModel& s, const std::string& name) {
            for (int p = 0; p < n_dof_properties; ++p)
              if (name == dof_property_table[p].name) return to_numpy(s.model->dof[p]);
            throw InputError("property '" + name + "' is unknown; see ModelBuilder.add_joint");
          },
          "name"_a, "A joint property as an array (nv,); names as in ModelBuilder.add_joint.")
      .def("__repr__",
           [](const PyModel& s) {
             return "<linkwise.Model '" + s.model->spec().name +
                    "': " + std::to_string(s.model->n_joints()) + " joints, nq " +
                    std::to_string(s.model->nq()) + ", nv " + std::to_string(s.model->nv()) + ">";
           })
      .def(
          "to_bytes",
          [](const PyModel& s, const nb::object& source) {
            ModelSpec spec = s.model->spec();
            if (!source.is_none()) spec.source = nb::cast<std::string>(source);
            const std::string bytes = serialize(spec);
            return nb::bytes(bytes.data(), bytes.size());
          },
          nb::kw_only(), "source"_a = nb::none(),
          "The model's description, for from_bytes. source replaces Model.source in it, which may "
          "be "
          "a path.")
      .def_static(
          "from_bytes",
          [](const nb::bytes& description) {
            return new PyModel(deserialize(std::string(description.c_str(), description.size())));
          },
          "description"_a,
          "The Model that to_bytes described. Runs no code, unlike pickle; InputError for bytes "
          "that "
          "are no model.")
      .def("__getstate__",
           [](const PyModel& s) {
             const std::string bytes = serialize(s.model->spec());
             return nb::bytes(bytes.data(), bytes.size());
           })
      .def("__setstate__", [](PyModel& s, const nb::bytes& state) {
        new (&s) PyModel(deserialize(std::string(state.c_str(), state.size())));
      });
  for (const DofPropertyEntry& entry : dof_property_table) {
    const std::string name = entry.name;
    static const char* const suffixed[][2] = {{"lower", "lower_limit"},
                                              {"upper", "upper_limit"},
                                              {"effort", "effort_limit"},
                                              {"velocity", "velocity_limit"}};
    std::string attribute = name;
    for (const auto& s : suffixed)
      if (name == s[0]) attribute = s[1];
    const int p = static_cast<int>(&entry - dof_property_table);
    nb::object getter = nb::cpp_function(
        [p](const PyModel& s) { return to_numpy(s.model->dof[p]); }, nb::is_method());
    m.attr("Model").attr(attribute.c_str()) =
        nb::module_::import_("builtins").attr("property")(getter);
  }

  m.def("make_chain", &make_chain, "n_bodies"_a, nb::kw_only(), "joint"_a, "axes"_a,
        "translation"_a, "mass"_a, "com"_a, "inertia"_a, "gravity"_a, "damping"_a = 0.0,
        "armature"_a = 0.0, "floating_base"_a = false);
}

}  // namespace linkwise::bindings
