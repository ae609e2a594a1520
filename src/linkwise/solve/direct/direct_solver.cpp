// The error estimate is that of a refinement step: with r = b - A x and e = A^-1 r by the same
// factor,
// ||x* - x||_A is close to sqrt(r^T e). The residual is formed in twice the working precision:
// formed in working precision it would be mostly rounding where elimination has lost digits, and
// refinement would gain nothing [higham2002, chapter 12].

#include "linkwise/solve/direct/direct_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "linkwise/linear/residual.hpp"
#include "linkwise/linear/vector.hpp"

namespace linkwise {
namespace {

constexpr Option rows[] = {{.name = "refinement_steps",
                            .fallback = 0,
                            .text = "steps of iterative refinement",
                            .accepts = at_least_zero,
                            .wanted = "give 0 or more"},
                           {.name = "estimate_error",
                            .fallback = false,
                            .text = "estimate the error, at the cost of a product and a solve; "
                                    "otherwise it is NaN"}};
constexpr const Option &steps = rows[0], &estimate = rows[1];

}  // namespace

std::span<const Option> direct_options() { return rows; }

bool ask_for_refinement(const SolverOptions& o) {
  return o.own.count(steps) > 0 || o.own.flag(estimate);
}

DirectSolver::DirectSolver(const SolverOptions& o)
    : LinearSolver(o),
      refinement_steps_(o.own.count(steps)),
      estimate_error_(o.own.flag(estimate)) {}

Report DirectSolver::factor(const BlockTree& A) {
  Report report;
  report.node = factor_matrix(A);
  report.error_estimate = std::numeric_limits<double>::quiet_NaN();
  if (report.node >= 0)
    report.outcome = A.all_finite() ? Outcome::not_positive_definite : Outcome::not_finite;
  return report;
}

Report DirectSolver::solve_factored(const BlockTree& A, std::span<const double> b,
                                    std::span<double> x) {
  std::copy(b.begin(), b.end(), x.begin());
  solve_in_place(A, x);
  Report report;
  if (refinement_steps_ > 0 || estimate_error_)
    report = refine(A, b, x);
  else
    report.error_estimate = std::numeric_limits<double>::quiet_NaN();
  if (!std::isfinite(sum_of_squares(x))) report.outcome = Outcome::not_finite;
  return report;
}

Report DirectSolver::refine(const BlockTree& A, std::span<const double> b, std::span<double> x) {
  residual_.resize(x.size());
  correction_.resize(x.size());
  Report report;
  for (int step = 0; step <= refinement_steps_; ++step) {
    accurate_residual(A, b, x, residual_);
    std::copy(residual_.begin(), residual_.end(), correction_.begin());
    solve_in_place(A, correction_);
    const double error = std::sqrt(std::max(0.0, dot(residual_, correction_)));
    const double scale = std::sqrt(std::max(0.0, dot(x, b)));
    report.error_estimate =
        std::max(scale > 0.0 ? error / scale : error, std::numeric_limits<double>::epsilon());
    if (step < refinement_steps_) add_scaled(1.0, correction_, x);
  }
  report.iterations = refinement_steps_;
  report.error_is_bound = true;
  return report;
}

Report DirectSolver::solve(const BlockTree& A, std::span<const double> b, std::span<double> x) {
  const Report factored = factor(A);
  return factored.ok() ? solve_factored(A, b, x) : factored;
}

Report DirectSolver::solve_many(const BlockTree& A, int count, std::span<const double> b,
                                std::span<double> x) {
  const Report factored = factor(A);
  if (!factored.ok()) return factored;
  const std::size_t size = static_cast<std::size_t>(A.size());
  Report total;
  for (int k = 0; k < count; ++k)
    accumulate(total, solve_factored(A, b.subspan(k * size, size), x.subspan(k * size, size)));
  return total;
}

}  // namespace linkwise
