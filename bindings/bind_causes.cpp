#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bind.hpp"
#include "doc_text.hpp"
#include "report.hpp"
#include "states.hpp"

namespace linkwise::bindings {
namespace {

nb::object loads_by_cause(const PyModel& self, const std::vector<std::string>& names, nb::handle q,
                          nb::handle v, nb::handle tau, nb::handle external, nb::handle prescribed,
                          nb::handle loop_tau, nb::handle loop_prescribed,
                          const std::string& method, nb::handle threads) {
  const Model& m = *self.model;
  const std::vector<Cause> causes = causes_from_names(names);
  const States s(m, q, v, tau, "tau", external, prescribed, loop_tau, loop_prescribed);
  const Executor executor = executor_for(whole_number(threads, "threads"), s.count * m.n_bodies());
  NewArray loads(s.lead, {causes.size(), size(m.n_loads()), 6});
  const EvaluationReport report = without_gil([&](const GoOn& go_on) {
    return self.evaluator.loads_by_cause(s.count, s.input(), causes, method, executor, loads.data,
                                         go_on);
  });
  if (!report.ok()) throw NumericsError(failure_text(m, report));
  check_result(loads.data, s.count * causes.size() * m.n_loads() * 6);
  return loads.array;
}

}  // namespace

void bind_causes(nb::module_& m) {
  m.def(
      "joint_loads_by_cause", &loads_by_cause, "model"_a, "causes"_a, "q"_a, "v"_a.none(),
      "tau"_a = nb::none(), nb::kw_only(), "external"_a = nb::none(), "prescribed"_a = nb::none(),
      "loop_tau"_a = nb::none(), "loop_prescribed"_a = nb::none(), "method"_a = "articulated_body",
      "threads"_a = nb::none(),
      doc::text(
          R"(Joint loads that each cause alone makes; a joint load is linear in its causes.

Every state of a tree is eliminated once and solved for each cause [rodriguez1987].)",
          {R"(    causes: any of "gravity", "velocity", "drive" (tau, loop_tau), "motion" (prescribed,
        loop_prescribed), "passive" (the model's damping, friction, springs and stops), "external",
        "misfit" (what bearings do not fit by).
)",
           doc::q_v_tau, doc::external, doc::prescribed, doc::loop_tau, doc::loop_prescribed,
           "    method: \"articulated_body\" or \"constraint_force\".\n"},
          R"(    (..., causes, n_joints + n_loops, 6) [N, N m], as of joint_loads. All seven causes add up to the
    joint loads under all of these together. Loads that rigid bodies do not determine (see
    indeterminacy) are split by the rule that chooses them, the least energy, so they add up too.)",
          R"(a cause is unknown, shapes do not fit the model, or a number is not finite.
    NumericsError: the method failed.)")
          .c_str());
}

}  // namespace linkwise::bindings
