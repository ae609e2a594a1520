#include "linkwise/solve/stop_test.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "linkwise/linear/vector.hpp"

namespace linkwise {
namespace {

constexpr double unseen_condition = 1e8;

}  // namespace

void StopTest::start(const SolverOptions& options, const ScaledTree* scaling, int max_iterations) {
  estimate_.start(0.0);
  squared_error_ = std::numeric_limits<double>::infinity();
  scaling_ = scaling;
  rule_ = options.stop;
  executor_ = options.executor;
  tolerance_ = options.tolerance;
  absolute_tolerance_ = options.absolute_tolerance;
  if (rule_ == StopRule::energy_norm && options.energy_bound) {
    tolerance_ = options.energy_bound->relative;
    absolute_tolerance_ = options.energy_bound->absolute;
  }
  right_hand_side_norm_ = 0.0;
  solution_energy_ = 0.0;
  smallest_eigenvalue_ = 1.0;
  max_iterations_ = max_iterations;
  iterations_ = 0;
  correcting_ = false;
  outcome_ = Outcome::converged;
}

void StopTest::start_correction(double solution_energy, int max_iterations) {
  max_iterations_ = iterations_ + max_iterations;
  // A rough residual contains the slow modes that decide its energy, but does not show them for a
  // while. The contraction of the main iteration does.
  const double contraction = estimate_.contraction();
  estimate_.start(contraction < 1.0 ? contraction : 0.0);
  solution_energy_ = solution_energy;
  correcting_ = true;
  outcome_ = Outcome::converged;
}

void StopTest::set_right_hand_side(std::span<const double> b) {
  if (needs_residual())
    right_hand_side_norm_ =
        scaling_ ? scaling_->residual_norm(b) : std::sqrt(sum_of_squares(b, executor_));
}

double StopTest::energy_bound() const {
  return tolerance_ * std::sqrt(std::max(0.0, solution_energy_)) + absolute_tolerance_;
}

double StopTest::relative_error() const {
  // Nothing is known beyond rounding.
  const double error = std::sqrt(std::max(0.0, squared_error_));
  return solution_energy_ > 0.0
             ? std::max(error / std::sqrt(solution_energy_), std::numeric_limits<double>::epsilon())
             : error;
}

// The extrapolated tail of the decreases is too low when convergence pauses. The bound is too high,
// by up to the condition number. Measured on rigid chains of every kind and on random trees: the
// larger of the tail and half (in the norm) of the bound is right to a factor of about three.
double StopTest::calc_squared_error(const IterationStep& step) const {
  if (step.squared_error >= 0.0) return step.squared_error;
  const double tail = estimate_.squared_error();
  // No contraction has been seen yet. A change says something only if it would be small enough even
  // for a slowest mode that is 1e8 times slower than what the iteration has met. This accepts a
  // guess that is exact already.
  if (!std::isfinite(tail))
    return unseen_condition * std::max(std::abs(step.decrease), step.squared_bound);
  const double share = correcting_ ? 1.0 : 0.25;
  return std::max(tail, share * step.squared_bound);
}

bool StopTest::accepts_start(double preconditioned_square) {
  if (rule_ != StopRule::energy_norm || correcting_) return false;
  const double square = unseen_condition * preconditioned_square;
  if (!(square <= energy_bound() * energy_bound())) return false;
  outcome_ = Outcome::converged;
  squared_error_ = square;
  return true;
}

bool StopTest::meets_energy_rule(const IterationStep& step) const {
  const double bound = energy_bound();
  // A correction only has to be known to two digits: its size is the error of the solution.
  constexpr double correction_accuracy = 1e-4;
  const double target = std::max(
      bound * bound, correcting_ ? correction_accuracy * std::max(0.0, estimate_.total()) : 0.0);
  // In practice the error is at least a hundredth of the last decrease, which decides most steps.
  return 0.01 * std::abs(step.decrease) <= target && calc_squared_error(step) <= target;
}

bool StopTest::meets_rule(const IterationStep& step) const {
  const auto solution_norm = [&](std::span<const double> v) {
    return scaling_ ? scaling_->solution_norm(v) : std::sqrt(sum_of_squares(v, executor_));
  };
  switch (rule_) {
    case StopRule::paper:
      return step.factor * solution_norm(step.change) <= tolerance_ * solution_norm(step.x);
    case StopRule::residual: {
      const double norm = scaling_ ? scaling_->residual_norm(step.residual)
                                   : std::sqrt(sum_of_squares(step.residual, executor_));
      return norm <= tolerance_ * right_hand_side_norm_;
    }
    case StopRule::energy_norm:
      return meets_energy_rule(step);
  }
  return false;
}

/// Did the iteration change the solution in its last bits only?
bool StopTest::at_rounding_level(const IterationStep& step) const {
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  if (correcting_ || std::abs(step.decrease) > 1e3 * epsilon * epsilon * step.solution_energy)
    return false;
  const double change = step.factor * step.factor * sum_of_squares(step.change, executor_);
  return change <= 4.0 * epsilon * epsilon * sum_of_squares(step.x, executor_);
}

bool StopTest::stops(const IterationStep& step) {
  ++iterations_;
  estimate_.add(step.decrease);
  if (estimate_.count() == 1) first_decrease_ = std::abs(step.decrease);
  if (!correcting_) solution_energy_ = step.solution_energy;
  if (!std::isfinite(step.decrease) || !std::isfinite(step.solution_energy))
    outcome_ = Outcome::not_finite;
  else if (meets_rule(step))
    outcome_ = Outcome::converged;
  else if (at_rounding_level(step))
    outcome_ = Outcome::stagnated;
  else if (std::abs(step.decrease) > 1e20 * first_decrease_)
    outcome_ = Outcome::diverged;
  else if (iterations_ >= max_iterations_)
    outcome_ = Outcome::reached_max_iterations;
  else
    return false;
  squared_error_ = calc_squared_error(step);
  return true;
}

}  // namespace linkwise
