#pragma once
// Forward dynamics by the joint constraint forces: assemble A f = b, solve it by any linear solver
// of the table, read accelerations and loads back [sharf1993].
#include "linkwise/constraint/tree_system.hpp"
#include "linkwise/dynamics/forward_dynamics.hpp"
#include "linkwise/dynamics/inverse_dynamics.hpp"

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
  /// Where a light body carries a heavy one, A holds the heavy one's compliance in its last digits
  /// only: the forces come out right, their differences, the accelerations, do not. The torque that
  /// the accelerations miss (Newton-Euler, which does not suffer) gives their correction through
  /// the same A, and the loads follow from the corrected motion.
  DynamicsReport correct(const SweepInput<double>& in, double* du, double* loads);

  const Model* model_;
  TreeSystem system_;
  std::unique_ptr<LinearSolver> solver_;
  std::unique_ptr<InitialGuess> guess_;
  std::vector<double> f_, df_, missing_, ddu_;
  std::unique_ptr<InverseDynamics<double>> inverse_;  ///< made for the first correction
  bool direct_;
};

}  // namespace linkwise
