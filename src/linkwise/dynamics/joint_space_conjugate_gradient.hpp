#pragma once
// Forward dynamics by conjugate gradients on the joint-space mass matrix, which is never formed
// (method 4 of [walker1982]; in parallel [lee1988]): a product H x is the inverse dynamics of the
// accelerations x of the resting machine without gravity, one sweep outward and one inward. The
// preconditioner is the diagonal of H, from composite inertias.
#include <vector>

#include "linkwise/dynamics/articulated_body.hpp"
#include "linkwise/dynamics/forward_dynamics.hpp"
#include "linkwise/dynamics/inverse_dynamics.hpp"
#include "linkwise/kinematics/body_columns.hpp"
#include "linkwise/solve/iterative/krylov.hpp"

namespace linkwise {

/// Stop rule, tolerance and limit are those of the solver options. It starts from zero: the result
/// depends on the state alone.
class JointSpaceConjugateGradient : public DynamicsMethod {
 public:
  JointSpaceConjugateGradient(const Model& model, const DynamicsOptions& options);
  DynamicsReport evaluate(double t, const SweepInput<double>& in, double* du,
                          double* loads) override;

 private:
  bool calc_diagonal();
  Report solve(const SweepInput<double>& in);
  double error(const SweepInput<double>& in);
  void multiply(std::span<const double> x, std::span<double> y);

  const Model* model_;
  SolverOptions options_;
  InverseDynamics<double> inverse_;
  ArticulatedBody<double> recursion_;  ///< what the result is checked by
  BodyColumns columns_;
  std::vector<Inertia<double>> composite_;
  std::vector<Motion<double>> a_;
  std::vector<Force<double>> w_;
  std::vector<double> inverse_diagonal_, b_, x_, tau_, residual_, correction_;
  StopTest stop_;
  KrylovVectors work_;
  int failed_body_ = -1;
};

}  // namespace linkwise
