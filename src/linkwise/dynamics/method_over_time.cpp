#include "linkwise/dynamics/method_over_time.hpp"

#include <chrono>

#include "linkwise/base/finite.hpp"

namespace linkwise {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace

DynamicsOptions MethodOverTime::usual_options() {
  DynamicsOptions options;
  options.initial_guess = "cubic";
  return options;
}

MethodOverTime::MethodOverTime(const Model& model, DynamicsOptions options)
    : model_(&model),
      choice_(choose_dynamics(model, options)),
      options_(std::move(options)),
      method_(make_dynamics(model, options_)) {}

DynamicsReport MethodOverTime::evaluate(double t, const SweepInput<double>& in, double* du,
                                        double* loads) {
  DynamicsReport report = method_->evaluate(t, in, du, loads);
  const size_t n_loads = 6 * static_cast<size_t>(model_->n_loads());
  if (report.ok() && !(all_finite({du, static_cast<size_t>(model_->nv())}) &&
                       (!loads || all_finite({loads, n_loads}))))
    report.outcome = Outcome::not_finite;
  return report;
}

EvaluationReport MethodOverTime::evaluate(double t, const BatchInput& state, double* du,
                                          double* loads, bool accept) {
  AppliedStates applied(*model_, 1, state);
  const DynamicsReport report =
      evaluate(t, applied.for_method(0, method_->finds_loops()), du, loads);
  if (accept && report.ok()) method_->accepted(t);
  return evaluation_report(*model_, choice_, report);
}

std::vector<MethodOverTime::Step> MethodOverTime::follow(std::span<const double> times,
                                                         const BatchInput& states, double* du,
                                                         double time_limit, const GoOn& go_on) {
  AppliedStates applied(*model_, times.size(), states);
  std::vector<Step> steps;
  const Clock::time_point begin = Clock::now();
  for (size_t i = 0; i < times.size() && go_on(); ++i) {
    const Clock::time_point started = Clock::now();
    const DynamicsReport report = evaluate(times[i], applied.for_method(i, method_->finds_loops()),
                                           du + i * static_cast<size_t>(model_->nv()), nullptr);
    steps.push_back({report, seconds_since(started)});
    method_->accepted(times[i]);
    if (seconds_since(begin) > time_limit) break;
  }
  return steps;
}

}  // namespace linkwise
