// Quantities of a state without its accelerations: poses, Jacobians, energies, momenta, mass
// matrix.
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include "bind.hpp"
#include "linkwise/dynamics/quantities.hpp"
#include "linkwise/forces/passive.hpp"
#include "states.hpp"

namespace linkwise::bindings {
namespace {

/// f(model, q, v, out) for every state, over threads; out has `tail` numbers. v is zero where it
/// is None.
template <class F>
nb::object map_states(const PyModel& self, nb::handle q, nb::handle v, std::optional<int> threads,
                      const Shape& tail, F&& f) {
  const Model& m = *self.model;
  States s(m, q, v, nb::none(), "tau", nb::none());
  NewArray out(s.lead, tail);
  const size_t n = product(tail);
  const Executor executor = executor_for(threads, s.count * m.n_bodies());
  const std::vector<double> zero(m.nv());
  without_gil([&](const GoOn& go_on) {
    for_each_part(m, s.count, executor, go_on, [&](size_t first, size_t count) {
      for (size_t i = first; i < first + count; ++i)
        f(m, s.q.data + i * m.nq(), s.v.given ? s.v.data + i * m.nv() : zero.data(),
          out.data + i * n);
    });
  });
  return s.lead.empty() && tail.empty() ? nb::object(nb::float_(out.data[0])) : out.array;
}

void bind_forces_and_energies(nb::module_& m) {
  m.def(
      "mass_matrix",
      [](const PyModel& self, nb::handle q, std::optional<int> threads) {
        const size_t nv = self.model->nv();
        const States s(*self.model, q, nb::none(), nb::none(), "tau", nb::none());
        const Executor executor = executor_for(threads, s.count * self.model->n_bodies());
        NewArray H(s.lead, {nv, nv});
        without_gil([&](const GoOn& go_on) {
          self.evaluator.mass_matrix(s.count, s.q.data, executor, H.data, go_on);
        });
        return H.array;
      },
      "model"_a, "q"_a, nb::kw_only(), "threads"_a = nb::none(),
      "Joint-space mass matrix (..., nv, nv), armature included.");
  m.def(
      "passive_torque",
      [](const PyModel& self, nb::handle q, nb::handle v, std::optional<int> threads) {
        return map_states(self, q, v, threads, {size(self.model->nv())},
                          [](const Model& m, const double* q, const double* v, double* out) {
                            std::fill(out, out + m.nv(), 0.0);
                            add_passive_forces(m, q, v, out);
                          });
      },
      "model"_a, "q"_a, "v"_a, nb::kw_only(), "threads"_a = nb::none(),
      "Torque (..., nv) [N m, N] of the joints' own damping, friction, springs and stops.");
  m.def(
      "kinetic_energy",
      [](const PyModel& self, nb::handle q, nb::handle v, std::optional<int> threads) {
        return map_states(self, q, v, threads, {},
                          [](const Model& m, const double* q, const double* v, double* out) {
                            *out = kinetic_energy(m, q, v);
                          });
      },
      "model"_a, "q"_a, "v"_a, nb::kw_only(), "threads"_a = nb::none(),
      "Kinetic energy (...) [J], rotors (armature) included.");
  m.def(
      "potential_energy",
      [](const PyModel& self, nb::handle q, std::optional<int> threads) {
        return map_states(self, q, nb::none(), threads, {},
                          [](const Model& m, const double* q, const double*, double* out) {
                            *out = potential_energy(m, q);
                          });
      },
      "model"_a, "q"_a, nb::kw_only(), "threads"_a = nb::none(),
      "Potential energy (...) [J] of gravity (zero at the world origin), springs and stops.");
  m.def(
      "momentum",
      [](const PyModel& self, nb::handle q, nb::handle v, std::optional<int> threads) {
        return map_states(self, q, v, threads, {6},
                          [](const Model& m, const double* q, const double* v, double* out) {
                            momentum(m, q, v, out);
                          });
      },
      "model"_a, "q"_a, "v"_a, nb::kw_only(), "threads"_a = nb::none(),
      "Linear [kg m/s] and angular [kg m2/s] momentum (..., 6) about the world origin, world "
      "axes.");
}

/// The joint of a body given by the name of its link or by index.
int joint_of(const PyModel& self, nb::handle body) {
  int joint = -1;
  if (nb::isinstance<nb::str>(body)) {
    const LinkInfo& link = self.model->links[self.model->link_index(nb::cast<std::string>(body))];
    joint = link.joint;
    if (joint < 0 || self.model->links[self.model->joints[joint].link].name != link.name)
      throw InputError("link '" + link.name +
                       "' is welded and has no frame of its own; name the body that carries "
                       "it (Model.notes)");
  } else {
    joint = nb::cast<int>(body);
    if (joint < 0 || joint >= self.model->n_joints())
      throw InputError("body index " + std::to_string(joint) + " is out of range; the model has " +
                       std::to_string(self.model->n_joints()) + " bodies");
  }
  return joint;
}

void bind_poses(nb::module_& m) {
  m.def(
      "joint_poses",
      [](const PyModel& self, nb::handle q, std::optional<int> threads) {
        return map_states(self, q, nb::none(), threads, {size(self.model->n_joints()), 4, 4},
                          [](const Model& m, const double* q, const double*, double* out) {
                            joint_poses(m, q, out);
                          });
      },
      "model"_a, "q"_a, nb::kw_only(), "threads"_a = nb::none(),
      "Poses (..., n_joints, 4, 4) of the joint frames, each fixed in its joint's child link: 4 x "
      "4 "
      "matrices that take points of that frame to the world, m.");
  m.def(
      "link_poses",
      [](const PyModel& self, nb::handle q, std::optional<int> threads) {
        return map_states(self, q, nb::none(), threads, {self.model->links.size(), 4, 4},
                          [](const Model& m, const double* q, const double*, double* out) {
                            link_poses(m, q, out);
                          });
      },
      "model"_a, "q"_a, nb::kw_only(), "threads"_a = nb::none(),
      "Poses (..., links, 4, 4) of all links of the source, merged ones too, in the world.");
  m.def(
      "body_jacobian",
      [](const PyModel& self, nb::handle q, nb::handle body, std::optional<int> threads) {
        const int joint = joint_of(self, body);
        return map_states(self, q, nb::none(), threads, {6, size(self.model->nv())},
                          [joint](const Model& m, const double* q, const double*, double* out) {
                            body_jacobian(m, q, joint, out);
                          });
      },
      "model"_a, "q"_a, "body"_a, nb::kw_only(), "threads"_a = nb::none(),
      "Jacobian (..., 6, nv) of a body's frame in its own axes, linear first; body: name or "
      "index.");
}

}  // namespace

void bind_kinematics(nb::module_& m) {
  m.def("require_memory", &require_memory, "bytes"_a, "what"_a,
        "MemoryError, with the estimate, where so many bytes are not available.");
  bind_forces_and_energies(m);
  bind_poses(m);
}

}  // namespace linkwise::bindings
