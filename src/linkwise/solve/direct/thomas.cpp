// Block Thomas algorithm: A x = b by elimination leaf to root and back (theory.md, section 6).
//
// The error estimate is that of one refinement step: with r = b - A x and e = A^-1 r by the same
// factor, ||x* - x||_A is close to sqrt(r^T e). Elimination in force space loses digits on long
// straight chains of parallel hinges (condition ~ N^4), which this estimate shows.

#include "linkwise/solve/direct/thomas.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "linkwise/linear/vector.hpp"

namespace linkwise {

Report Thomas::factor(const BlockTree& A) {
  Report report;
  report.outcome = factor_.factor(A);
  report.node = factor_.failed_node();
  report.error_estimate = std::numeric_limits<double>::quiet_NaN();
  return report;
}

Report Thomas::solve_factored(const BlockTree& A, std::span<const double> b, std::span<double> x) {
  std::copy(b.begin(), b.end(), x.begin());
  factor_.solve_in_place(x);
  Report report;
  if (options_.refinement_steps > 0 || options_.estimate_error)
    report = refine(A, b, x);
  else
    report.error_estimate = std::numeric_limits<double>::quiet_NaN();
  if (!std::isfinite(sum_of_squares(x))) report.outcome = Outcome::not_finite;
  return report;
}

Report Thomas::refine(const BlockTree& A, std::span<const double> b, std::span<double> x) {
  residual_.resize(x.size());
  correction_.resize(x.size());
  Report report;
  for (int step = 0; step <= options_.refinement_steps; ++step) {
    A.multiply(x, residual_);
    subtract_from(b, residual_);
    std::copy(residual_.begin(), residual_.end(), correction_.begin());
    factor_.solve_in_place(correction_);
    const double error = std::sqrt(std::max(0.0, dot(residual_, correction_)));
    const double scale = std::sqrt(std::max(0.0, dot(x, b)));
    report.error_estimate = scale > 0.0 ? error / scale : error;
    if (step < options_.refinement_steps) add_scaled(1.0, correction_, x);
  }
  report.iterations = options_.refinement_steps;
  return report;
}

Report Thomas::solve(const BlockTree& A, std::span<const double> b, std::span<double> x) {
  const Report factored = factor(A);
  return factored.ok() ? solve_factored(A, b, x) : factored;
}

Report Thomas::solve_many(const BlockTree& A, int count, std::span<const double> b,
                          std::span<double> x) {
  const Report factored = factor(A);
  if (!factored.ok()) return factored;
  const std::size_t size = static_cast<std::size_t>(A.size());
  Report total;
  for (int k = 0; k < count; ++k)
    accumulate(total, solve_factored(A, b.subspan(k * size, size), x.subspan(k * size, size)));
  return total;
}

std::unique_ptr<LinearSolver> make_thomas(const SolverOptions& options) {
  return std::make_unique<Thomas>(options);
}

}  // namespace linkwise
