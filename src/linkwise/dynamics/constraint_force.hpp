#pragma once
// Forward dynamics by the joint constraint forces: assemble A f = b, solve it by any linear solver
// of the table, read accelerations and loads back [sharf1993].
#include "linkwise/constraint/tree_system.hpp"
#include "linkwise/dynamics/forward_dynamics.hpp"
#include "linkwise/dynamics/refinement.hpp"
#include "linkwise/solve/checked_solver.hpp"

namespace linkwise {

class ConstraintForce : public DynamicsMethod {
 public:
  ConstraintForce(const Model& model, const DynamicsOptions& options);
  DynamicsReport evaluate(double t, const SweepInput<double>& in, double* du,
                          double* loads) override;
  void accepted(double t) override;
  std::span<const double> constraint_force() const override { return f_; }
  const TreeSystem& system() const { return system_; }

 private:
  TreeSystem system_;
  CheckedSolver solver_;
  std::unique_ptr<InitialGuess> guess_;
  std::vector<double> f_, df_;
  Refinement<double> refinement_;
};

}  // namespace linkwise
