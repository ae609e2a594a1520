// Block Gauss-Seidel, eq. (16) of [sharf1993]: as Jacobi with the new values inboard.

#include "linkwise/solve/iterative/gauss_seidel.hpp"

#include "linkwise/solve/iterative/relaxation.hpp"

namespace linkwise {
namespace {

class GaussSeidel final : public Relaxation {
 public:
  explicit GaussSeidel(const SolverOptions& options)
      : Relaxation(options, SweepOrder::base_to_tip) {}

 private:
  double relaxation_factor(double, double) override { return 1.0; }
};

}  // namespace

std::unique_ptr<LinearSolver> make_gauss_seidel(const SolverOptions& options) {
  return std::make_unique<GaussSeidel>(options);
}

}  // namespace linkwise
