// Conjugate gradients preconditioned by the block Thomas factor of an earlier system.
//
// Along a simulation A changes slowly: the factor of some steps ago is nearly its inverse and a few
// iterations finish the solve. The factor is renewed when a solve took more than lag_limit
// iterations, failed, or met another structure.

#include <algorithm>

#include "linkwise/solve/direct/tree_factor.hpp"
#include "linkwise/solve/iterative/preconditioned.hpp"

namespace linkwise {
namespace {

constexpr Option lag_limit{.name = "lag_limit",
                           .fallback = 8,
                           .text = "iterations of a solve after which the factor is renewed",
                           .accepts = at_least_one,
                           .wanted = "give 1 or more"};

class LaggedThomas final : public PreconditionedConjugateGradient {
 public:
  explicit LaggedThomas(const SolverOptions& options)
      : PreconditionedConjugateGradient(options, Coordinates::original),
        limit_(options.own.count(lag_limit)) {}

 private:
  Outcome prepare(const BlockTree& A) override {
    if (factor_.fits(A)) return Outcome::converged;
    const Outcome outcome = factor_.factor(A);
    set_failed_node(factor_.failed_node());
    return outcome;
  }

  void precondition(std::span<const double> r, std::span<double> z) override {
    std::copy(r.begin(), r.end(), z.begin());
    factor_.solve_in_place(z);
  }

  void finished(const Report& report) override {
    if (!report.ok() || report.iterations > limit_) factor_.clear();
  }

  int limit_;
  TreeFactor factor_;
};

}  // namespace

std::span<const Option> lagged_thomas_options() { return {&lag_limit, 1}; }

std::unique_ptr<LinearSolver> make_lagged_thomas(const SolverOptions& options) {
  return std::make_unique<LaggedThomas>(options);
}

}  // namespace linkwise
