#pragma once
// How easily each degree of freedom moves: the diagonal of the inverse H^-1 of the joint-space mass
// matrix, in O(N) and without H.
//
// Inward, articulated inertias Y as in [featherstone2008, ch. 7]; outward, the mobility W_n of body
// n, which takes a wrench on it to its acceleration with all else left free. For a joint P with
// U = Y P, D = P^T U + armature, V = U / D and W = X W_p X^T,
//     (H^-1)_nn = 1/D + V^T W V,   W_n = (1 - P V^T) W (1 - V P^T) + P P^T / D
// [rodriguez1987]. A stack of degrees of freedom is a chain of such joints in one frame.
#include <span>
#include <vector>

#include "linkwise/kinematics/body_columns.hpp"
#include "linkwise/recursion/own_bodies.hpp"
#include "linkwise/recursion/stack_steps.hpp"

namespace linkwise {

class Mobility {
 public:
  explicit Mobility(const Model& model);

  /// Per degree of freedom (H^-1)_ii, 0 for prescribed ones; empty where H is not positive
  /// definite. Valid until the next call.
  std::span<const double> evaluate(const double* q);

 private:
  bool tip_to_base(const SweepInput<double>& in);
  void base_to_tip();
  Matrix6<double> of_port(int n) const;
  void own_coordinates(int n);

  const Model* model_;
  BodyColumns columns_;
  OwnBodies<double> own_;
  std::vector<EliminatedAxis<double>> axis_;
  std::vector<ArticulatedInertia<double>> Y_;
  std::vector<Matrix6<double>> W_;
  std::vector<double> diagonal_;
};

}  // namespace linkwise
