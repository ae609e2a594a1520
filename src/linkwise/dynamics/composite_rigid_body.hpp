#pragma once
// Joint-space mass matrix by composite inertias, and forward dynamics by its Cholesky factor
// (method 3 of [walker1982]; branch-induced sparsity as in [featherstone2008, ch. 6]):
//     H_ij = P_j^T (X ... X)^T Yc_i P_i,   H = L^T L keeps zero what H has zero.
// It takes O(N depth) time and O(nv^2) memory: the reference for small machines, hopeless
// for long chains.
#include <vector>

#include "linkwise/dynamics/inverse_dynamics.hpp"
#include "linkwise/kinematics/body_columns.hpp"

namespace linkwise {

class CompositeRigidBody {
 public:
  explicit CompositeRigidBody(const Model& model);

  /// Row-major nv x nv, armature included; rows of prescribed degrees of freedom are those of 1.
  void mass_matrix(const double* q, double* H);

  /// As ArticulatedBody::evaluate.
  bool evaluate(const SweepInput<double>& in, double* du, double* loads);
  int failed_body() const { return failed_body_; }

 private:
  void calc_columns(const double* q);
  bool factor();

  const Model* model_;
  InverseDynamics<double> inverse_;
  BodyColumns columns_;
  std::vector<Inertia<double>> composite_;
  std::vector<int> before_;  ///< per column: the next one towards the base, -1
  std::vector<double> H_, tau_, rhs_;
  int failed_body_ = -1;
};

}  // namespace linkwise
