// Torques of given motions, and what a machine is to the joints that drive it.
#include <optional>
#include <tuple>

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bind.hpp"
#include "doc_text.hpp"
#include "linkwise/base/error.hpp"
#include "numbers.hpp"
#include "report.hpp"
#include "states.hpp"

namespace linkwise::bindings {
namespace {

struct InverseResult {
  nb::object tau, loop_tau, joint_load;
};

/// What inverse dynamics returns: torques, loads, or everything.
enum class InverseWanted { torques, loads, full };

struct InverseArguments {
  nb::handle q, v, a, external;
  std::vector<std::string> driven;
  bool passive;
  double gravity;
  nb::handle threads;
};

void refuse_hidden_torques(const Model& m, const std::vector<std::string>& driven) {
  for (const std::string& name : driven)
    for (const LoopJoint& loop : m.loops.joints)
      if (loop.joint.name == name)
        throw InputError("driven: joint '" + name + "'" + m.where() +
                         " closes a loop, and its torque is loop_tau of the full result; give "
                         "full=True, or drive joints of the tree");
}

nb::object inverse_dynamics(const PyModel& self, const InverseArguments& given,
                            InverseWanted wanted) {
  const Model& m = *self.model;
  const States s(m, given.q, given.v, given.a, "acceleration", given.external);
  const Executor executor =
      executor_for(whole_number(given.threads, "threads"), s.count * m.n_bodies());
  if (wanted == InverseWanted::torques) refuse_hidden_torques(m, given.driven);
  const bool full = wanted == InverseWanted::full;
  std::optional<NewArray> tau, loop_tau, loads;
  if (wanted != InverseWanted::loads) tau.emplace(s.lead, Shape{size(m.nv())});
  if (full) loop_tau.emplace(s.lead, Shape{size(m.loops.nv)});
  if (wanted != InverseWanted::torques) loads.emplace(s.lead, Shape{size(m.n_loads()), 6});
  BatchInput in = s.input();
  in.du = std::exchange(in.tau, nullptr);
  in.gravity_factor = given.gravity;
  in.passive_acts = given.passive;
  if (loop_tau) std::fill_n(loop_tau->data, s.count * m.loops.nv, 0.0);
  const InverseOutput out{tau ? tau->data : nullptr, loop_tau ? loop_tau->data : nullptr,
                          loads ? loads->data : nullptr};
  const EvaluationReport report = without_gil([&](const GoOn& go_on) {
    return self.evaluator.inverse_dynamics(s.count, in, given.driven, executor, out, go_on);
  });
  if (!report.ok()) throw NumericsError(failure_text(m, report));
  if (tau) check_result(tau->data, s.count * size(m.nv()));
  if (loads) check_result(loads->data, s.count * size(6 * m.n_loads()));
  if (full) return nb::cast(InverseResult{tau->array, loop_tau->array, loads->array});
  return tau ? tau->array : loads->array;
}

nb::object mass_matrix(const PyModel& self, nb::handle q, nb::handle threads) {
  const Model& m = *self.model;
  const size_t nv = size(m.nv());
  const States s(m, q, nb::none(), nb::none(), "tau", nb::none());
  const Executor executor = executor_for(whole_number(threads, "threads"), s.count * m.n_bodies());
  NewArray H(s.lead, {nv, nv});
  without_gil([&](const GoOn& go_on) {
    self.evaluator.mass_matrix(s.count, s.q.data, executor, H.data, go_on);
  });
  check_result(H.data, s.count * nv * nv);
  return H.array;
}

/// The matrices of a machine in the coordinates of driven joints.
nb::object reduced(const PyModel& self, nb::handle q, const std::vector<std::string>& driven,
                   bool of_rates) {
  const Model& m = *self.model;
  const States s(m, q, nb::none(), nb::none(), "tau", nb::none());
  DrivenInverse kernel(m, driven);
  const size_t n = size(kernel.n_driven()), rows = of_rates ? size(m.nv()) : n;
  NewArray out(s.lead, {rows, n});
  const EvaluationReport report = without_gil([&](const GoOn& go_on) {
    return self.evaluator.reduce(s.count, s.q.data, kernel, of_rates ? nullptr : out.data,
                                 of_rates ? out.data : nullptr, go_on);
  });
  if (!report.ok()) throw NumericsError(failure_text(m, report));
  check_result(out.data, s.count * rows * n);
  return out.array;
}

using InverseState = std::tuple<nb::object, nb::object, nb::object>;

void bind_result(nb::module_& m) {
  nb::class_<InverseResult>(m, "InverseDynamicsResult", "What inverse_dynamics(full=True) returns.")
      .def_ro("tau", &InverseResult::tau, "(..., nv) [N m, N], of the tree's joints.")
      .def_ro(
          "loop_tau", &InverseResult::loop_tau,
          "tau (..., size) [N m, N] of the joints that close loops, size the sum of their nv, in "
          "the order of model.loop_slices; zero of those that are not driven.")
      .def_ro("joint_load", &InverseResult::joint_load,
              "(..., n_joints + n_loops, 6) [N, N m], as of joint_loads.")
      .def("__getstate__",
           [](const InverseResult& r) { return InverseState(r.tau, r.loop_tau, r.joint_load); })
      .def("__setstate__", [](InverseResult& r, const InverseState& state) {
        const auto& [tau, loop_tau, joint_load] = state;
        new (&r) InverseResult{tau, loop_tau, joint_load};
      });
}

constexpr const char* inverse_title =
    R"( of a given motion, by the recursion of Newton and Euler [luh1980].

Machines with closed loops need `driven`: with more joints than ways to move, torques are not
determined. Loads that rigid bodies do not determine are those of least energy, as of joint_loads.)";
constexpr const char* inverse_arguments =
    R"(    driven: names of the joints that may have torques; none: all those of a tree.
    passive: the model's damping, friction, springs and stops act beside the torques.
)";
constexpr const char* inverse_errors =
    R"(shapes do not fit the model, a number is not finite, accelerations open a loop, or the
    driven joints cannot make the motion or repeat each other.
    NumericsError: the position is singular.)";

void bind_motion(nb::module_& m) {
  m.def(
      "inverse_dynamics",
      [](const PyModel& self, nb::handle q, nb::handle v, nb::handle a, nb::handle external,
         const std::vector<std::string>& driven, bool passive, bool full, double gravity,
         nb::handle threads) {
        return inverse_dynamics(self, {q, v, a, external, driven, passive, gravity, threads},
                                full ? InverseWanted::full : InverseWanted::torques);
      },
      "model"_a, "q"_a, "v"_a.none(), "acceleration"_a.none(), nb::kw_only(),
      "external"_a = nb::none(), "driven"_a = std::vector<std::string>(), "passive"_a = false,
      "full"_a = false, "gravity"_a = 1.0, "threads"_a = nb::none(),
      doc::text(
          (std::string("Joint torques") + inverse_title).c_str(),
          {doc::q_v_acceleration, doc::external, inverse_arguments,
           "    full: return everything; needed where a driven joint closes a loop.\n",
           doc::gravity},
          R"(    tau (..., nv) [N m, N], the torque of the rotors (armature) included. Without `passive`
    it is the total: less passive_torque it is what the drives give. It is what forward_dynamics takes
    to make the accelerations, with the same `passive`. With full an InverseDynamicsResult.)",
          inverse_errors)
          .c_str());
  m.def(
      "inverse_dynamics_loads",
      [](const PyModel& self, nb::handle q, nb::handle v, nb::handle a, nb::handle external,
         const std::vector<std::string>& driven, bool passive, double gravity, nb::handle threads) {
        return inverse_dynamics(self, {q, v, a, external, driven, passive, gravity, threads},
                                InverseWanted::loads);
      },
      "model"_a, "q"_a, "v"_a.none(), "acceleration"_a.none(), nb::kw_only(),
      "external"_a = nb::none(), "driven"_a = std::vector<std::string>(), "passive"_a = false,
      "gravity"_a = 1.0, "threads"_a = nb::none(),
      doc::text((std::string("Joint loads") + inverse_title).c_str(),
                {doc::q_v_acceleration, doc::external, inverse_arguments, doc::gravity},
                "    (..., n_joints + n_loops, 6) [N, N m]: as of joint_loads.", inverse_errors)
          .c_str());
}

void bind_reduced(nb::module_& m) {
  m.def(
      "mass_matrix",
      [](const PyModel& self, nb::handle q, const std::vector<std::string>& driven,
         nb::handle threads) {
        return driven.empty() ? mass_matrix(self, q, threads) : reduced(self, q, driven, false);
      },
      "model"_a, "q"_a, nb::kw_only(), "driven"_a = std::vector<std::string>(),
      "threads"_a = nb::none(),
      doc::text(
          R"(Joint-space mass matrix H with v^T H v / 2 the kinetic energy, by composite rigid bodies
[walker1982]. In a tree H dv/dt + bias = tau.

Of machines with loops or couplings, H is that of all joints of the tree, whose rates are tied to each
other: H dv/dt + bias = tau + K^T f, with f the forces that hold the loops. With `driven` it is the
matrix of the machine itself, N^T H N with N of driven_jacobian: what the driven joints feel of it.)",
          {doc::q,
           R"(    driven: names of joints whose motion determines that of the machine, of the tree or closing
        loops; none: all joints of the tree.
)"},
          R"(    H (..., nv, nv) [kg m2, kg m, kg], symmetric, with the rotors (armature) of all joints, those
    that close loops too. With driven (..., n, n), n the degrees of freedom of the driven joints, in
    their order.)",
          R"(shapes do not fit the model, or a number is not finite. With driven also: q leaves a loop
    open, a joint is unknown, or the joints repeat each other or do not determine the motion.)")
          .c_str());
  m.def(
      "driven_jacobian",
      [](const PyModel& self, nb::handle q, const std::vector<std::string>& driven,
         nb::handle threads) {
        whole_number(threads, "threads");
        return reduced(self, q, driven, true);
      },
      "model"_a, "q"_a, "driven"_a, nb::kw_only(), "threads"_a = nb::none(),
      doc::text(
          R"(Rates of all joints of the tree that the driven ones make: v = N v_driven keeps all loops closed
and all couplings tied [featherstone2008, ch. 8]. N^T tau are torques of the tree's joints as the driven
ones feel them, and frame_jacobian(...) @ N is the Jacobian of the machine.)",
          {doc::q,
           R"(    driven: names of joints whose motion determines that of the machine, of the tree or closing
        loops.
)"},
          R"(    N (..., nv, n) [rad/rad, m/rad, rad/m, m/m], n the degrees of freedom of the driven joints, in
    their order.)",
          R"(shapes do not fit the model, a number is not finite, q leaves a loop open, a joint is
    unknown, or the joints repeat each other or do not determine the motion.
    NumericsError: the position is singular.)")
          .c_str());
}

}  // namespace

void bind_inverse(nb::module_& m) {
  bind_result(m);
  bind_motion(m);
  bind_reduced(m);
}

}  // namespace linkwise::bindings
