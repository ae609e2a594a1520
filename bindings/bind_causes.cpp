#include <algorithm>
#include <atomic>

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bind.hpp"
#include "linkwise/constraint/joint_constraint.hpp"
#include "report.hpp"
#include "states.hpp"

namespace linkwise::bindings {
namespace {

constexpr std::pair<const char*, Cause> cause_names[] = {
    {"gravity", Cause::gravity}, {"velocity", Cause::velocity}, {"drive", Cause::drive},
    {"motion", Cause::motion},   {"passive", Cause::passive},   {"external", Cause::external}};

std::vector<Cause> causes_of(const std::vector<std::string>& names) {
  std::vector<Cause> causes;
  for (const std::string& name : names) {
    const auto* found = std::find_if(std::begin(cause_names), std::end(cause_names),
                                     [&](const auto& known) { return name == known.first; });
    if (found == std::end(cause_names)) {
      std::string known;
      for (const auto& [other, cause] : cause_names)
        known += (known.empty() ? "" : ", ") + std::string(other);
      throw InputError("cause '" + name + "' is unknown; known: " + known);
    }
    causes.push_back(found->second);
  }
  return causes;
}

nb::object loads_by_cause(const PyModel& self, const std::vector<std::string>& names, nb::handle q,
                          nb::handle v, nb::handle tau, nb::handle external, nb::handle prescribed,
                          const std::string& method, nb::handle threads) {
  const Model& m = *self.model;
  const std::vector<Cause> causes = causes_of(names);
  States s(m, q, v, tau, "tau", external, prescribed);
  check_external(m, s);
  check_prescribed(m, s);
  if (method != "articulated_body" && method != "constraint_force")
    throw InputError("method '" + method +
                     "' does not split loads; use articulated_body or constraint_force");
  const bool by_force = method == "constraint_force";
  if (by_force) require_regular_inertias(m);
  const bool passive = std::find(causes.begin(), causes.end(), Cause::passive) != causes.end();
  const size_t width = causes.size() * 6 * m.n_joints();
  NewArray loads(s.lead, {causes.size(), size(m.n_joints()), 6});
  const int team = threads_of(threads, s.count * m.n_bodies());
  std::atomic<int> body{-1};
  Interrupt interrupt;
  {
    const nb::gil_scoped_release release;
    BatchInput in;
    in.q = s.q.data;
    in.v = s.v.given ? s.v.data : nullptr;
    in.tau = s.tau.given ? s.tau.data : nullptr;
    in.external = s.external.given ? s.external.data : nullptr;
    in.du = s.prescribed.given ? s.prescribed.data : nullptr;
    std::vector<double> own;
    if (passive) {
      own = with_passive(m, s, nullptr);
      in.passive = own.data();
    }
    over_parts(m, s.count, team, interrupt, [&](size_t first, size_t count) {
      PyModel::Lease scratch(self);
      const int failed = scratch->batch.loads_by_cause(
          count, rows_from(m, in, first), causes, loads.data + first * width,
          by_force ? BatchMethod::constraint_force : BatchMethod::articulated_body);
      for (int seen = body; failed > seen && !body.compare_exchange_weak(seen, failed);) {
      }
    });
  }
  interrupt.rethrow();
  if (body >= 0) {
    PyReport report;
    report.method = method;
    report.body = m.body_name(body);
    throw NumericsError(failure_text(m, report, Outcome::not_positive_definite));
  }
  return loads.array;
}

}  // namespace

void bind_causes(nb::module_& m) {
  m.def("joint_loads_by_cause", &loads_by_cause, "model"_a, "causes"_a, "q"_a, "v"_a.none(),
        "tau"_a = nb::none(), nb::kw_only(), "external"_a = nb::none(), "prescribed"_a = nb::none(),
        "method"_a = "articulated_body", "threads"_a = nb::none(),
        "Joint loads (..., causes, n_joints, 6) [N, N m] that each of the causes alone makes, "
        "frames and signs as in joint_loads.\n\n"
        "causes: any of \"gravity\", \"velocity\", \"drive\" (tau), \"motion\" (prescribed), "
        "\"passive\" (the model's damping,\n"
        "friction, springs and stops), \"external\". All of them add up to the joint loads under "
        "all of these together.\n"
        "Every state is eliminated once and solved for each cause. threads influences no bit.");
}

}  // namespace linkwise::bindings
