#pragma once
// Sweeps of block successive over-relaxation in any order of the nodes: what gauss_seidel, sor and
// their red-black orderings share.

#include <vector>

#include "linkwise/solve/iterative/iterative_solver.hpp"
#include "linkwise/solve/spectrum.hpp"

namespace linkwise {

/// Colours such that no two coupled nodes share one: red and black along chains; the joints of a
/// hub are all coupled, so a hub with k outboard joints needs k + 1.
void colour_nodes(const ScaledTree& system, std::vector<int>& colours);

enum class SweepOrder { base_to_tip, by_colour };

class Relaxation : public IterativeSolver {
 protected:
  Relaxation(const SolverOptions& options, SweepOrder order)
      : IterativeSolver(options, Coordinates::block_scaled), order_(order) {}

  Outcome prepare(const BlockTree& A) override;
  void iterate(std::span<const double> b, std::span<double> x, StopTest& stop) override;
  int default_max_iterations(int size) const override;

  /// The factor of the next sweep, given how much the last two changed the solution (0 before).
  virtual double relaxation_factor(double change, double previous_change) = 0;
  /// Called before the first sweep of a solve.
  virtual void start() {}

 private:
  /// One sweep; returns the sum of squares of the changes.
  double sweep(std::span<const double> b, std::span<double> x, double omega);

  SweepOrder order_;
  std::vector<int> sequence_, colours_;
  std::vector<double> sums_, change_, residual_;
};

}  // namespace linkwise
