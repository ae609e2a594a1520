#include "linkwise/solve/checked_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "linkwise/linear/residual.hpp"
#include "linkwise/linear/vector.hpp"
#include "linkwise/solve/registry.hpp"

namespace linkwise {
namespace {

/// Of one solution; few take more than three.
constexpr int most_rounds = 12;
/// What a further round aims at, in tolerances.
constexpr double aim = 0.5 * Strictness::slack;
/// How much tighter one round may be than the last, and all together: what is asked for beyond that
/// is below rounding.
constexpr double largest_step = 1e-3, tightest = 1e-12;

double relative(double error, double size) { return size > 0.0 ? error / size : error; }

/// The least that ||x*||_A can be, from x^T b = x^T A x* and a bound on ||x* - x||_A.
double least_size(double product, double bound) {
  if (!std::isfinite(bound)) return 0.0;
  return 0.5 * (std::sqrt(bound * bound + 4.0 * std::max(0.0, product)) - bound);
}

SolverOptions with_bound(SolverOptions options, std::shared_ptr<const EnergyBound> bound) {
  options.energy_bound = std::move(bound);
  return options;
}

}  // namespace

bool Strictness::tighten(double excess, bool stuck) {
  // Where asking for more did not help, the iteration thinks that it is done: ask for far more.
  const bool helped = rounds_ == 0 || excess <= 0.5 * previous_;
  if (stuck && !helped) return false;
  value_ *= helped ? std::max(largest_step, aim / excess) : largest_step;
  previous_ = excess;
  return ++rounds_ < most_rounds && value_ >= tightest;
}

double Strictness::relieved() const { return std::min(1.0, 1.2 * value_); }

CheckedSolver::CheckedSolver(std::string_view solver, const SolverOptions& options, bool learns)
    : direct_(find_solver(solver).kind == SolverKind::direct),
      learns_(learns),
      rule_(options.stop),
      fixed_{options.tolerance, options.absolute_tolerance},
      asked_(options.energy_bound),
      given_(std::make_shared<EnergyBound>()),
      max_iterations_(options.max_iterations),
      solver_(make_solver(solver, with_bound(options, given_))) {}

/// ||x* - x||_A; NaN where A has no factor.
double CheckedSolver::error(const BlockTree& A, std::span<const double> b,
                            std::span<const double> x) {
  if (!factored_ && factor_.factor(A) != Outcome::converged)
    return std::numeric_limits<double>::quiet_NaN();
  factored_ = true;
  residual_.resize(x.size());
  accurate_residual(A, b, x, residual_);
  correction_ = residual_;
  factor_.solve_in_place(correction_);
  return std::sqrt(std::max(0.0, dot(residual_, correction_)));
}

Report CheckedSolver::solve(const BlockTree& A, std::span<const double> b, std::span<double> x) {
  return solve(A, b, x, [](bool) {
    return MotionError{std::numeric_limits<double>::infinity(), 0.0};
  });
}

Report CheckedSolver::solve(const BlockTree& A, std::span<const double> b, std::span<double> x,
                            const Recover& recover) {
  const EnergyBound asked = asked_ ? *asked_ : fixed_;
  const bool by_energy = rule_ == StopRule::energy_norm;
  factored_ = motion_is_rough_ = false;
  Report total;
  for (Strictness strictness(by_energy ? strictness_ : 1.0);;) {
    *given_ = {strictness.value() * asked.relative, strictness.value() * asked.absolute};
    const int before = total.iterations;
    solver_->limit_iterations(max_iterations_ > 0 ? std::max(1, max_iterations_ - before) : 0);
    total = solver_->solve(A, b, x);
    total.iterations += before;
    MotionError motion = recover(false);
    const bool done = total.ok(), stuck = total.outcome == Outcome::stagnated;
    const bool spent = total.outcome == Outcome::reached_max_iterations;
    if (direct_ || !(done || stuck || spent)) return total;

    const double least = least_size(dot(x, b), motion.gap);
    const bool close =
        done && motion.gap <= Strictness::slack * (asked.relative * least + asked.absolute);
    total.error_is_bound = std::isfinite(motion.gap);
    if (total.error_is_bound) total.error_estimate = relative(motion.gap, least);
    if (close) learn(strictness.relieved());
    if (close || (!by_energy && total.error_is_bound)) return total;
    const double off = error(A, b, x);
    if (!std::isfinite(off)) return total;
    total.error_is_bound = true;
    // ||x*||^2 = ||e||^2 + x^T (b + r)  [strakos2002]
    const double size = std::sqrt(std::max(0.0, off * off + dot(x, b) + dot(x, residual_)));
    const double allowed = asked.relative * size + asked.absolute;
    total.error_estimate = relative(off, size);
    if (!by_energy || spent || size == 0.0) return total;

    double excess = off / allowed;
    if (std::isfinite(motion.gap)) {
      // Where nothing accelerates, the forces say what is large.
      motion = recover(true);
      motion.size = std::max(motion.size, size);
      const double rest = std::sqrt(std::max(0.0, motion.gap * motion.gap - off * off));
      // The true motion may be smaller than the one found by its error.
      const double least_motion = std::max(0.0, motion.size - rest);
      excess = std::max(excess, rest / (asked.relative * least_motion + asked.absolute));
    }
    // What an iteration could not finish is believed where it is as good as was asked for.
    if (excess <= (done || strictness.rounds() > 0 ? Strictness::slack : 1.0)) {
      total.outcome = Outcome::converged;
      learn(excess < 1.0 ? strictness.relieved() : strictness.value());
      return total;
    }
    const double tried = strictness.value();
    if (max_iterations_ > 0 && total.iterations >= max_iterations_) {
      total.outcome = Outcome::reached_max_iterations;
      return total;
    }
    if (!strictness.tighten(excess, stuck)) {
      motion_is_rough_ = off <= Strictness::slack * allowed;
      total.outcome = motion_is_rough_ ? Outcome::converged : Outcome::stagnated;
      learn(tried);
      return total;
    }
  }
}

}  // namespace linkwise
