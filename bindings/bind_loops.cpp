// Model: the joints that close its loops, which are not joints of its tree.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bind.hpp"
#include "joint_lists.hpp"
#include "numbers.hpp"
#include "py_model.hpp"
#include "vectors.hpp"

namespace linkwise::bindings {
namespace {

template <class F>
nb::list list_per_loop(const PyModel& self, F&& f) {
  nb::list out;
  for (const LoopJoint& loop : self.model->loops.joints) out.append(f(loop));
  return out;
}

void write_pose(double* out, const Mat3<double>& rotation, const Vec3<double>& translation) {
  const double point[3] = {translation.x, translation.y, translation.z};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out[4 * i + j] = rotation.m[3 * i + j];
    out[4 * i + 3] = point[i];
    out[12 + i] = 0;
  }
  out[15] = 1;
}

nb::object loop_placements(const PyModel& self) {
  const Model& model = *self.model;
  const auto first_given = static_cast<int>(model.spec().joints.size());
  NewArray out({static_cast<size_t>(model.n_loops())}, {2, 4, 4});
  double* pose = out.data;
  for (const LoopJoint& loop : model.loops.joints) {
    const JointSpec& joint = model.spec_of(loop.joint);
    LoopJointSpec given;  // a joint of the tree's kind lies in its child's frame
    if (loop.joint.spec >= first_given)
      given = model.spec().loop_joints[loop.joint.spec - first_given];
    write_pose(pose, joint.rotation, joint.translation);
    write_pose(pose + 16, given.child_rotation, given.child_translation);
    pose += 32;
  }
  return read_only(out.array);
}

/// The same machine with one more joint that closes a loop.
PyModel* with_loop(const PyModel& self, std::string name, const std::string& type,
                   std::string parent, std::string child, nb::handle translation,
                   nb::handle rotation, nb::handle child_translation, nb::handle child_rotation,
                   nb::handle axis, nb::handle axes, double pitch, const nb::kwargs& properties) {
  ModelSpec spec = self.model->spec();
  ModelBuilder one(spec.name, spec.gravity, spec.source);
  add_loop(one, std::move(name), type, std::move(parent), std::move(child), translation, rotation,
           child_translation, child_rotation, axis, axes, pitch, properties);
  spec.loop_joints.push_back(one.spec().loop_joints.front());
  return new PyModel(std::move(spec));
}

PyModel* with_rod(const PyModel& self, std::string name, std::string parent, std::string child,
                  double length, nb::handle point, nb::handle child_point) {
  ModelSpec spec = self.model->spec();
  ModelBuilder one(spec.name, spec.gravity, spec.source);
  add_rod(one, std::move(name), std::move(parent), std::move(child), length, point, child_point);
  spec.loop_joints.push_back(one.spec().loop_joints.front());
  return new PyModel(std::move(spec));
}

PyModel* with_spring(const PyModel& self, std::string name, std::string parent, std::string child,
                     double length, nb::handle point, nb::handle child_point,
                     const nb::kwargs& properties) {
  ModelSpec spec = self.model->spec();
  ModelBuilder one(spec.name, spec.gravity, spec.source);
  add_spring(one, std::move(name), std::move(parent), std::move(child), length, point, child_point,
             properties);
  spec.loop_joints.push_back(one.spec().loop_joints.front());
  return new PyModel(std::move(spec));
}

/// The same machine with one more coupling of its joints.
PyModel* with_coupling(const PyModel& self, std::string name, const nb::dict& factors,
                       double offset) {
  ModelSpec spec = self.model->spec();
  ModelBuilder one(spec.name, spec.gravity, spec.source);
  add_coupling(one, std::move(name), factors, offset);
  spec.couplings.push_back(one.spec().couplings.front());
  return new PyModel(std::move(spec));
}

void bind_with_loops(ModelClass& c) {
  c.def("with_loop", &with_loop, "name"_a, "type"_a, "parent"_a, "child"_a, nb::kw_only(),
        "translation"_a = nb::none(), "rotation"_a = nb::none(), "child_translation"_a = nb::none(),
        "child_rotation"_a = nb::none(), "axis"_a = nb::none(), "axes"_a = nb::none(),
        "pitch"_a = 0.0, "properties"_a, nb::rv_policy::take_ownership,
        R"(The same machine with one more joint, which closes a loop.

Args:
    name: unique among joints.
    type, axis, axes, pitch, properties: as in ModelBuilder.add_loop.
    parent, child: names of links, or the root link for the ground.
    translation, rotation, child_translation, child_rotation: as in ModelBuilder.add_loop.

Raises:
    InputError: as ModelBuilder.add_loop and build.)")
      .def("with_rod", &with_rod, "name"_a, "parent"_a, "child"_a, nb::kw_only(), "length"_a,
           "point"_a = nb::none(), "child_point"_a = nb::none(), nb::rv_policy::take_ownership,
           R"(The same machine with a rod without mass, which keeps the distance of two points.

Args:
    name, parent, child, length, point, child_point: as in ModelBuilder.add_rod.

Raises:
    InputError: as ModelBuilder.add_rod and build.)")
      .def("with_spring", &with_spring, "name"_a, "parent"_a, "child"_a, nb::kw_only(), "length"_a,
           "point"_a = nb::none(), "child_point"_a = nb::none(), "properties"_a,
           nb::rv_policy::take_ownership,
           R"(The same machine with a spring and damper without mass between two points.

Args:
    name, parent, child, length, point, child_point, properties: as in ModelBuilder.add_spring.

Raises:
    InputError: as ModelBuilder.add_spring and build.)")
      .def("with_coupling", &with_coupling, "name"_a, "factors"_a, nb::kw_only(), "offset"_a = 0.0,
           nb::rv_policy::take_ownership,
           R"(The same machine with coordinates of its joints tied together.

Args:
    name, factors, offset: as in ModelBuilder.add_coupling.

Raises:
    InputError: as ModelBuilder.add_coupling and build.)");
}

void bind_loop_coordinates(ModelClass& c) {
  c.def_prop_ro(
       "loop_types",
       [](const PyModel& s) {
         return list_per_loop(s, [](const LoopJoint& l) {
           return l.kind == LoopKind::rod      ? "rod"
                  : l.kind == LoopKind::spring ? "spring"
                                               : joint_type_name(l.joint.type);
         });
       },
       "Type of each joint that closes a loop, as in ModelBuilder.add_loop, \"rod\" or \"spring\".")
      .def_prop_ro(
          "loop_nv",
          [](const PyModel& s) {
            return list_per_loop(s, [](const LoopJoint& l) {
              return l.kind == LoopKind::rod ? 5 : l.kind == LoopKind::spring ? 6 : l.joint.nv;
            });
          },
          "Degrees of freedom that each joint that closes a loop leaves to its two links; it takes "
          "the rest of six.")
      .def_prop_ro(
          "loop_slices",
          [](const PyModel& s) {
            const auto slice = [](int first, int n) {
              return nb::slice(nb::int_(first), nb::int_(first + n), nb::int_(1));
            };
            return list_per_loop(s, [&](const LoopJoint& l) {
              return nb::make_tuple(slice(l.joint.q, l.joint.nq), slice(l.joint.v, l.joint.nv));
            });
          },
          "Where the coordinates and the rates of each joint that closes a loop are among those of "
          "all loop joints: two slices each.")
      .def(
          "loop_property",
          [](const PyModel& s, const std::string& name) {
            return to_numpy(s.model->loops.dof[static_cast<int>(dof_property_from_name(name))]);
          },
          "name"_a,
          "A property (n_loop_rates,) [its own unit] of all loop joints, by its name, such as "
          "\"lower\", \"upper\" "
          "or "
          "\"damping\"; InputError if unknown.");
}

}  // namespace

void bind_loop_joints(ModelClass& c) {
  bind_loop_coordinates(c);
  c.def_prop_ro(
       "loop_axes",
       [](const PyModel& s) {
         return list_per_loop(s, [&](const LoopJoint& l) {
           return l.kind == LoopKind::joint ? axes_of(s.model->spec_of(l.joint)) : nb::list();
         });
       },
       "Axes of each joint that closes a loop, as joint_axes; none of rods and springs.")
      .def_prop_ro(
          "loop_parent_link_names",
          [](const PyModel& s) {
            return list_per_loop(
                s, [&](const LoopJoint& l) { return s.model->links[l.parent_link].name; });
          },
          "Name of the parent link of each joint that closes a loop.")
      .def_prop_ro(
          "loop_child_link_names",
          [](const PyModel& s) {
            return list_per_loop(
                s, [&](const LoopJoint& l) { return s.model->links[l.joint.link].name; });
          },
          "Name of the child link of each joint that closes a loop.")
      .def(
          "loop_labels",
          [](const PyModel& s, int loop) {
            if (loop < 0 || loop >= s.model->n_loops())
              throw InputError("loop joint " + std::to_string(loop) +
                               " is out of range; the model has " +
                               std::to_string(s.model->n_loops()));
            return labels_of(s.model->spec_of(s.model->loops.joints[loop].joint));
          },
          "loop"_a,
          "Suffix and unit of the coordinates and the rates of loop joint number `loop`, as "
          "joint_labels.")
      .def_prop_ro(
          "coupling_joints",
          [](const PyModel& s) {
            nb::list out;
            for (const Coupling& coupling : s.model->couplings) {
              nb::list joints;
              for (const Coupling::Term& term : coupling.terms)
                joints.append(s.model->joint_at(term.joint).name);
              out.append(joints);
            }
            return out;
          },
          "Names of the joints that each coupling ties together, in the order of its loads.")
      .def_prop_ro(
          "coupling_names",
          [](const PyModel& s) {
            nb::list out;
            for (const CouplingSpec& coupling : s.model->spec().couplings)
              out.append(coupling.name);
            return out;
          },
          "Couplings, in the order of all that is per coupling.")
      .def_prop_ro("loop_placements", &loop_placements, nb::rv_policy::move,
                   "Poses (n_loops, 2, 4, 4) [m] of each joint that closes a loop: of its frame in "
                   "its parent link, and of\n"
                   "its frame in its child link. At zero coordinates the two are one.");
  bind_with_loops(c);
}

}  // namespace linkwise::bindings
