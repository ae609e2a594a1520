// Block Jacobi, eq. (15) of [sharf1993]: D f+ = b + (D - A) f, which is f+ = f + (b - A~ f) on A~.

#include "linkwise/linear/vector.hpp"
#include "linkwise/solve/iterative/iterative_solver.hpp"

namespace linkwise {
namespace {

class Jacobi final : public IterativeSolver {
 public:
  explicit Jacobi(const SolverOptions& options)
      : IterativeSolver(options, Coordinates::block_scaled) {}

 private:
  int default_max_iterations(int) const override { return 20000; }

  void iterate(std::span<const double> b, std::span<double> x, StopTest& stop) override {
    change_.resize(x.size());
    residual_.resize(x.size());
    multiply(x, residual_);
    subtract_from(b, residual_, executor());
    while (true) {
      change_.swap(residual_);
      add_scaled(1.0, change_, x, executor());
      multiply(x, residual_);
      subtract_from(b, residual_, executor());
      IterationStep step;
      // ||e||^2 - ||e - d||^2 = d^T (r + r+), and the change d is the old residual r.
      step.decrease = sum_of_squares(change_, executor()) + dot(change_, residual_, executor());
      step.solution_energy = dot(x, b, executor());
      step.x = x;
      step.change = change_;
      step.residual = residual_;
      if (stop.stops(step)) return;
    }
  }

  std::vector<double> change_, residual_;
};

}  // namespace

std::unique_ptr<LinearSolver> make_jacobi(const SolverOptions& options) {
  return std::make_unique<Jacobi>(options);
}

}  // namespace linkwise
