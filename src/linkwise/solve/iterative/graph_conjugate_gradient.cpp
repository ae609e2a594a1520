#include "linkwise/solve/iterative/graph_conjugate_gradient.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace linkwise {

Report GraphConjugateGradient::solve(const BlockGraph& A, std::span<const double> b,
                                     std::span<double> x) {
  const Executor& executor = options_.executor;
  Report report;
  std::fill(x.begin(), x.end(), 0.0);
  const double size_of_b = sum_of_squares(b, executor);
  if (!std::isfinite(size_of_b)) report.outcome = Outcome::not_finite;
  report.node = P_.factor(A);
  if (report.node >= 0)
    report.outcome = A.all_finite() ? Outcome::not_positive_definite : Outcome::not_finite;
  if (!report.ok()) report.error_estimate = std::numeric_limits<double>::infinity();
  if (!report.ok() || size_of_b == 0.0) return report;

  stop_.start(options_, nullptr,
              options_.max_iterations > 0 ? options_.max_iterations : 10 * A.size() + 100);
  stop_.set_right_hand_side(b);
  iterate(A, b, x);
  report.outcome = stop_.outcome();
  report.error_estimate = stop_.relative_error();
  const bool ended = report.ok() || report.outcome == Outcome::stagnated;
  if (ended && options_.stop == StopRule::energy_norm) verify(A, b, x, report);
  report.iterations = stop_.iterations();
  if (!std::isfinite(sum_of_squares(x, executor))) report.outcome = Outcome::not_finite;
  return report;
}

void GraphConjugateGradient::iterate(const BlockGraph& A, std::span<const double> b,
                                     std::span<double> x) {
  const Executor& executor = options_.executor;
  conjugate_gradients(
      b, x, stop_, work_,
      [&](std::span<const double> v, std::span<double> w) { A.multiply(v, w, motions_, executor); },
      [&](std::span<const double> r, std::span<double> z) -> std::span<const double> {
        P_.solve(A, r, z, executor);
        return z;
      },
      executor);
}

/// What the recurrences have lost: the correction that the true residual asks for is the error.
void GraphConjugateGradient::verify(const BlockGraph& A, std::span<const double> b,
                                    std::span<double> x, Report& report) {
  const Executor& executor = options_.executor;
  const double energy = stop_.solution_energy(), bound = stop_.energy_bound();
  const int limit = stop_.iterations() + 10;
  left_.resize(x.size());
  more_.resize(x.size());
  double previous = std::numeric_limits<double>::infinity();
  while (true) {
    A.multiply(x, left_, motions_, executor);
    subtract_from(b, left_, executor);
    P_.solve(A, left_, more_, executor);
    const double square = std::max(0.0, dot(left_, more_, executor)) / stop_.smallest_eigenvalue();
    if (square <= bound * bound) {
      report.outcome = Outcome::converged;
      if (energy > 0)
        report.error_estimate = std::max(report.error_estimate, std::sqrt(square / energy));
      return;
    }
    std::fill(more_.begin(), more_.end(), 0.0);
    stop_.start_correction(energy, std::min(limit, stop_.iterations_left()));
    iterate(A, left_, more_);
    const bool complete = stop_.outcome() == Outcome::converged;
    const double error = std::sqrt(std::max(0.0, dot(left_, more_, executor)));
    report.error_estimate = energy > 0 ? error / std::sqrt(energy) : error;
    report.outcome = complete && error <= bound ? Outcome::converged : Outcome::stagnated;
    if (report.ok() || !complete || error > 0.5 * previous) return;
    previous = error;
    add_scaled(1.0, more_, x, executor);
  }
}

}  // namespace linkwise
