#pragma once
// The motion equations of all bodies as one system, projected on the motions that the joints let
// through [hughes1985]: v = J u with the dense global projection matrix J (6 N x nv), so that the
// constraint forces drop out,
//     (J^T M J) du = tau - J^T (M a_0 + p),   a = J du + a_0.
// It takes O(N^3) time and O(N^2) memory. The recursions and the constraint forces are compared
// with it.
#include <vector>

#include "linkwise/dynamics/inverse_dynamics.hpp"
#include "linkwise/kinematics/body_columns.hpp"

namespace linkwise {

class GlobalProjection {
 public:
  explicit GlobalProjection(const Model& model);

  /// As ArticulatedBody::evaluate.
  bool evaluate(const SweepInput<double>& in, double* du, double* loads);
  int failed_body() const { return failed_body_; }

 private:
  void calc_projection();
  void project(const SweepInput<double>& in);
  bool factor_and_solve();

  const Model* model_;
  InverseDynamics<double> inverse_;
  BodyColumns columns_;
  /// The rows of J that belong to a body: its motions for each column that moves it, and which.
  std::vector<std::vector<Motion<double>>> J_;
  std::vector<std::vector<int>> where_;
  std::vector<Motion<double>> a0_;
  std::vector<double> H_, rhs_;
  int failed_body_ = -1;
};

}  // namespace linkwise
