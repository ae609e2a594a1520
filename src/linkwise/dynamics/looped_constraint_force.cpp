#include "linkwise/dynamics/looped_constraint_force.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "linkwise/base/finite.hpp"
#include "linkwise/base/tolerances.hpp"
#include "linkwise/dynamics/loop_wrenches.hpp"

namespace linkwise {
namespace {

/// Changes of f below the first are good enough to end a refinement, above the second they are no
/// answer.
constexpr double fine = 1e-9, rough = 1e-6;
constexpr int most_refinements = 5;

}  // namespace

LoopedConstraintForce::LoopedConstraintForce(const Model& model, const DynamicsOptions& options)
    : model_(&model), system_(model), f_(system_.A().size()), df_(system_.A().size()) {
  if (options.solver == "conjugate_gradient") {
    SolverOptions own = options.solver_options;
    own.executor = options.executor;
    iteration_ = std::make_unique<GraphConjugateGradient>(own);
  } else {
    factor_ = std::make_unique<GraphFactor>(system_.A());
  }
  for (const LoopJoint& loop : model.loops.joints)
    rows_ += loop_rows(model, loop) - loop_rotors(model, loop);
  rows_ += model.n_couplings();
}

Report LoopedConstraintForce::solve(const std::vector<double>& b, std::vector<double>& x,
                                    bool least) {
  if (iteration_) {
    const Report report = iteration_->solve(system_.A(), b, x);
    missed_ = 0;
    return report;
  }
  Report report;
  report.error_estimate = std::numeric_limits<double>::quiet_NaN();
  missed_ = factor_->solve(system_.A(), b, x, least);
  if (!all_finite(x)) report.outcome = Outcome::not_finite;
  return report;
}

/// What the factor says of the loops; by how much the constraints contradict each other.
void LoopedConstraintForce::describe(double missed) {
  loops_.rows = loops_.rank = loops_.strong = rows_;
  if (!factor_) return;
  loops_.rank = loops_.strong = rows_ - factor_->n_null();
  loops_.smallest_pivot = factor_->smallest_pivot();
  double asked = 0;
  const BlockGraph& A = system_.A();
  for (int i = 0; i < A.n(); ++i)
    for (int r = 0; r < A.dim(i); ++r)
      asked = std::max(asked, system_.size()[A.offset[i] + r] * factor_->scale(i, r));
  loops_.contradiction = asked > 0 ? missed / asked : 0;
}

DynamicsReport LoopedConstraintForce::evaluate(double, const SweepInput<double>& in, double* du,
                                               double* loads) {
  const bool least = loads != nullptr;
  system_.assemble(in);
  loops_ = {};
  const double gap = widest_miss(system_.loops(), false);
  loops_.open = std::max(gap, widest_miss(system_.loops(), true));
  DynamicsReport report;
  if (!system_.is_regular()) {
    report.outcome =
        system_.A().all_finite() ? Outcome::not_positive_definite : Outcome::not_finite;
    return report;
  }
  if (factor_) report.node = factor_->factor(system_.A(), null_pivot(gap), least);
  if (report.node >= 0)
    report.outcome =
        system_.A().all_finite() ? Outcome::not_positive_definite : Outcome::not_finite;
  else
    static_cast<Report&>(report) = solve(system_.b(), f_, least);
  if (report.node >= 0) report.body = system_.body_of_node(report.node);
  if (!report.ok()) return report;
  describe(missed_);
  report.loops = loops_;
  if (loops_.is_contradictory()) report.outcome = Outcome::singular_position;
  system_.recover(in, f_, du, loads);
  if (factor_ && report.ok() && !refine(in, du, loads, least)) report.outcome = Outcome::stagnated;
  if (loads) system_.coupling_loads(f_, coupling_load_);
  return report;
}

/// Where Newton and Euler find anything missing. Once, as a rule; where masses are very unlike the
/// forces themselves are rough, and it is repeated. What makes it no better, because rounding along
/// the tree is all that is missing, is taken back. False where the forces remain rough.
bool LoopedConstraintForce::refine(const SweepInput<double>& in, double* du, double* loads,
                                   bool least) {
  system_.assemble_rest(in, f_, du);
  double rest = system_.rest(), change = 0;
  if (std::max(system_.violation(), rest) <= acceptable_violation) return true;
  const size_t n_loads = loads ? 6 * static_cast<size_t>(model_->n_loads()) : 0;
  for (int step = 0; step < most_refinements; ++step) {
    if (!solve(system_.b(), df_, least).ok()) return false;
    before_.f = f_;
    before_.du.assign(du, du + model_->nv());
    before_.loads.assign(loads, loads + n_loads);
    system_.add_rest(in, df_, f_, du, loads);
    change = relative_change();
    system_.assemble_rest(in, f_, du);
    if (!(system_.rest() < 0.5 * rest)) {
      f_ = before_.f;
      std::copy(before_.du.begin(), before_.du.end(), du);
      std::copy(before_.loads.begin(), before_.loads.end(), loads);
      break;
    }
    rest = system_.rest();
    if (change <= fine) break;
  }
  return change < rough;
}

/// Of the last refinement, the larger one of that of f as it is and of f where D_A is 1.
double LoopedConstraintForce::relative_change() const {
  const BlockGraph& A = system_.A();
  double change = 0, size = 0, scaled_change = 0, scaled_size = 0;
  for (int i = 0; i < A.n(); ++i)
    for (int r = 0; r < A.dim(i); ++r) {
      const double df = std::abs(df_[A.offset[i] + r]), f = std::abs(f_[A.offset[i] + r]);
      change = std::max(change, df);
      size = std::max(size, f);
      scaled_change = std::max(scaled_change, df / factor_->scale(i, r));
      scaled_size = std::max(scaled_size, f / factor_->scale(i, r));
    }
  return size > 0 ? std::max(change / size, scaled_change / scaled_size) : 0;
}

bool LoopedConstraintForce::respond(const double* q, const double* asked, double* du) {
  at_rest_.assign(model_->nv(), 0.0);
  SweepInput<double> in;
  in.q = q;
  in.tau = at_rest_.data();
  in.gravity_factor = 0;
  system_.assemble(in, asked);
  loops_ = {};
  const double gap = widest_miss(system_.loops(), false);
  if (factor_ && factor_->factor(system_.A(), null_pivot(gap), false) >= 0) return false;
  if (!solve(system_.b(), f_, false).ok()) return false;
  describe(missed_);
  system_.recover(in, f_, du, nullptr);
  return true;
}

}  // namespace linkwise
