// The frame around every iteration: scale, iterate, unscale, verify.
//
// An iteration sees its own residual, which recurrences carry along, shrink for ever. The true
// residual does not: rounding leaves an error of about epsilon ||x~|| / sqrt(smallest eigenvalue)
// in the A-norm. Where that may matter, the true residual of the result is formed with the system
// as given. If it is not clearly small enough, the same method computes the correction that it asks
// for. The A-norm of that correction *is* the error of the result, measured and not extrapolated.

#include "linkwise/solve/iterative/iterative_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "linkwise/linear/residual.hpp"
#include "linkwise/linear/vector.hpp"

namespace linkwise {

int IterativeSolver::default_max_iterations(int size) const { return 10 * size + 100; }

void IterativeSolver::multiply(std::span<const double> x, std::span<double> y) const {
  if (coordinates_ == Coordinates::block_scaled)
    scaled_.multiply(x, y);
  else
    system_->multiply(x, y);
}

double IterativeSolver::preconditioned_square(std::span<const double> residual) {
  return sum_of_squares(residual, executor());
}

Outcome IterativeSolver::prepare_all(const BlockTree& A) {
  system_ = &A;
  failed_node_ = -1;
  if (coordinates_ == Coordinates::block_scaled && !scaled_.prepare(A)) {
    failed_node_ = scaled_.failed_node();
    return Outcome::not_positive_definite;
  }
  const std::size_t size = static_cast<std::size_t>(A.size());
  for (std::vector<double>* v : {&b_, &x_, &residual_, &correction_}) v->resize(size);
  return prepare(A);
}

Report IterativeSolver::solve(const BlockTree& A, std::span<const double> b, std::span<double> x) {
  const double size_of_b = sum_of_squares(b, executor());
  Report report;
  if (!std::isfinite(size_of_b)) {
    report.outcome = Outcome::not_finite;
    report.error_estimate = std::numeric_limits<double>::infinity();
    return report;
  }
  if (size_of_b == 0.0) {
    std::fill(x.begin(), x.end(), 0.0);
    return report;
  }
  if (!std::isfinite(sum_of_squares(x, executor()))) std::fill(x.begin(), x.end(), 0.0);
  report.outcome = prepare_all(A);
  if (report.ok())
    report = run(A, b, x);
  else
    report.error_estimate = std::numeric_limits<double>::infinity();
  if (report.outcome == Outcome::not_positive_definite && !A.all_finite())
    report.outcome = Outcome::not_finite;
  const bool unfinished = report.outcome == Outcome::reached_max_iterations ||
                          report.outcome == Outcome::stagnated ||
                          report.outcome == Outcome::diverged;
  report.node = unfinished ? worst_node(b, x) : failed_node_;
  finished(report);
  return report;
}

/// The node whose share of the residual is the largest.
int IterativeSolver::worst_node(std::span<const double> b, std::span<const double> x) {
  bound_error(b, x, false);
  int worst = -1;
  double most = -1.0;
  for (int i = 0; i < system_->n(); ++i) {
    const std::size_t at = system_->offset[i], dim = system_->dim[i];
    const double share = sum_of_squares(std::span<const double>(b_).subspan(at, dim));
    if (share > most) {
      most = share;
      worst = i;
    }
  }
  return worst;
}

Report IterativeSolver::run(const BlockTree& A, std::span<const double> b, std::span<double> x) {
  const bool is_scaled = coordinates_ == Coordinates::block_scaled;
  const int limit =
      options_.max_iterations > 0 ? options_.max_iterations : default_max_iterations(A.size());
  stop_.start(options_, is_scaled ? &scaled_ : nullptr, limit);
  if (is_scaled) {
    scaled_.scale_right_hand_side(b, b_);
    scaled_.scale_solution(x, x_);
  } else {
    std::copy(b.begin(), b.end(), b_.begin());
    std::copy(x.begin(), x.end(), x_.begin());
  }
  stop_.set_right_hand_side(b_);
  iterate(b_, x_, stop_);
  if (is_scaled)
    scaled_.unscale_solution(x_, x);
  else
    std::copy(x_.begin(), x_.end(), x.begin());

  Report report{stop_.outcome(), stop_.iterations(), stop_.relative_error()};
  if (!std::isfinite(sum_of_squares(x, executor()))) report.outcome = Outcome::not_finite;
  const bool ended = report.ok() || report.outcome == Outcome::stagnated;
  // If the guess is almost exact, no decrease can be seen, and the residual decides.
  if (ended && options_.stop == StopRule::energy_norm && (!report.ok() || rounding_may_matter(x_)))
    verify(b, x, report);
  report.iterations = stop_.iterations();
  return report;
}

bool IterativeSolver::rounding_may_matter(std::span<const double> x) const {
  // Nothing is known of the spectrum of D^-1 A when the iteration worked with another
  // preconditioner.
  if (coordinates_ == Coordinates::original) return true;
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  const double floor =
      10.0 * epsilon * epsilon * sum_of_squares(x, executor()) / stop_.smallest_eigenvalue();
  return floor > 0.01 * stop_.energy_bound() * stop_.energy_bound();
}

/// Forms the residual of x, in iteration coordinates in b_, and bounds the squared error that left
/// it.
double IterativeSolver::bound_error(std::span<const double> b, std::span<const double> x,
                                    bool accurate) {
  if (accurate) {
    accurate_residual(*system_, b, x, residual_);
  } else {
    system_->multiply(x, residual_);
    subtract_from(b, residual_, executor());
  }
  if (coordinates_ == Coordinates::block_scaled)
    scaled_.scale_right_hand_side(residual_, b_);
  else
    std::copy(residual_.begin(), residual_.end(), b_.begin());
  return std::max(0.0, preconditioned_square(b_)) / stop_.smallest_eigenvalue();
}

void IterativeSolver::verify(std::span<const double> b, std::span<double> x, Report& report) {
  const double bound = stop_.energy_bound();
  const double energy = stop_.solution_energy();
  const double scale = energy > 0.0 ? 1.0 / std::sqrt(energy) : 1.0;
  // A correction that takes longer than the solution did is lost in rounding.
  const int limit = stop_.iterations() + 10;
  report.outcome = Outcome::converged;
  if (bound_error(b, x, false) <= bound * bound) return;  // the iteration's own estimate stands
  double previous = std::numeric_limits<double>::infinity();
  while (true) {
    const double square = bound_error(b, x, true);
    if (square <= bound * bound) {
      report.error_estimate = std::sqrt(square) * scale;
      return;
    }
    std::fill(x_.begin(), x_.end(), 0.0);
    stop_.start_correction(energy, std::min(limit, stop_.iterations_left()));
    iterate(b_, x_, stop_);
    const bool complete = stop_.outcome() == Outcome::converged;
    // What an unfinished correction still lacks is part of the error too.
    const double missing = complete ? 0.0 : std::min(square, stop_.squared_error());
    const double error = std::sqrt(std::max(0.0, dot(b_, x_, executor())) + missing);
    report.error_estimate = error * scale;
    if (complete && error <= bound) return;
    if (!complete || error > 0.5 * previous) {
      report.outcome = Outcome::stagnated;
      return;
    }
    previous = error;
    if (coordinates_ == Coordinates::block_scaled)
      scaled_.unscale_solution(x_, correction_);
    else
      std::copy(x_.begin(), x_.end(), correction_.begin());
    add_scaled(1.0, correction_, x, executor());
  }
}

}  // namespace linkwise
