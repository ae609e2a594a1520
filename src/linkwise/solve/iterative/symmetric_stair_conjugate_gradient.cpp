// Conjugate gradients with the symmetric stair preconditioner [bu2024].
//
// The two stair-shaped triangular parts of a block tridiagonal A, averaged as
//     M^-1 = D^-1 + D^-1 (D - A) D^-1,
// are on A~ the polynomial M^-1 = 2 - A~: an eigenvalue 1 - mu of A~ becomes 1 - mu^2, the spectrum
// of the reduced system, in half the iterations at two products each - all of them parallel. A body
// with m joints allows eigenvalues of A~ up to m, so that hubs take M^-1 = m - A~, which stays
// positive definite but gains less the larger the hub.

#include "linkwise/solve/iterative/preconditioned.hpp"

namespace linkwise {
namespace {

class SymmetricStairConjugateGradient final : public PreconditionedConjugateGradient {
 public:
  explicit SymmetricStairConjugateGradient(const SolverOptions& options)
      : PreconditionedConjugateGradient(options, Coordinates::block_scaled) {}

 private:
  Outcome prepare(const BlockTree&) override {
    shift_ = scaled().joints_on_a_body();
    return Outcome::converged;
  }

  void precondition(std::span<const double> r, std::span<double> z) override {
    multiply(r, z);
    for (std::size_t i = 0; i < z.size(); ++i) z[i] = shift_ * r[i] - z[i];
  }

  double shift_ = 2.0;
};

}  // namespace

std::unique_ptr<LinearSolver> make_symmetric_stair_conjugate_gradient(
    const SolverOptions& options) {
  return std::make_unique<SymmetricStairConjugateGradient>(options);
}

}  // namespace linkwise
