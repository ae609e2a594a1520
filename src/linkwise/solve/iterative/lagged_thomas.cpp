// Conjugate gradients preconditioned by the block Thomas factor of an earlier system.
//
// Along a simulation A changes slowly: the factor of some steps ago is nearly its inverse and a few
// iterations finish the solve. The factor is renewed when a solve took more than lag_limit
// iterations, failed, or met another structure.

#include "linkwise/solve/iterative/lagged_thomas.hpp"

#include <algorithm>

#include "linkwise/solve/direct/tree_factor.hpp"
#include "linkwise/solve/iterative/iterative_solver.hpp"
#include "linkwise/solve/iterative/krylov.hpp"

namespace linkwise {
namespace {

class LaggedThomas final : public IterativeSolver {
 public:
  explicit LaggedThomas(const SolverOptions& options)
      : IterativeSolver(options, Coordinates::original) {}

 private:
  Outcome prepare(const BlockTree& A) override {
    preconditioned_.resize(A.size());
    if (factor_.fits(A)) return Outcome::converged;
    const Outcome outcome = factor_.factor(A);
    set_failed_node(factor_.failed_node());
    return outcome;
  }

  std::span<const double> precondition(std::span<const double> r, std::span<double> z) {
    std::copy(r.begin(), r.end(), z.begin());
    factor_.solve_in_place(z);
    return z;
  }

  double preconditioned_square(std::span<const double> residual) override {
    return dot(residual, precondition(residual, preconditioned_));
  }

  void iterate(std::span<const double> b, std::span<double> x, StopTest& stop) override {
    conjugate_gradients(
        b, x, stop, work_,
        [this](std::span<const double> v, std::span<double> w) { multiply(v, w); },
        [this](std::span<const double> r, std::span<double> z) { return precondition(r, z); });
  }

  void finished(const Report& report) override {
    if (!report.ok() || report.iterations > options_.lag_limit) factor_.clear();
  }

  TreeFactor factor_;
  KrylovVectors work_;
  std::vector<double> preconditioned_;
};

}  // namespace

std::unique_ptr<LinearSolver> make_lagged_thomas(const SolverOptions& options) {
  return std::make_unique<LaggedThomas>(options);
}

}  // namespace linkwise
