#pragma once
// (H + E)^-1 x in O(N), with H the joint-space mass matrix of a tree and E a diagonal: what an
// implicit step makes of springs and dampers along the degrees of freedom. It enters the
// articulated-body recursion where the armature of a rotor does, and that of coordinates of a
// body's own on the diagonal of their m_e.
#include <vector>

#include "linkwise/kinematics/body_columns.hpp"
#include "linkwise/recursion/own_bodies.hpp"
#include "linkwise/recursion/stack_steps.hpp"

namespace linkwise {

class ShiftedMass {
 public:
  /// Joints that close loops, and couplings, are not seen.
  explicit ShiftedMass(const Model& model);

  /// Factors H + E at q [nq]; E [nv] is not negative. False where it is not positive definite.
  bool factor(const double* q, const double* E);

  /// du [nv] = (H + E)^-1 tau; zero in degrees of freedom whose motion is given. Not in place.
  void solve(const double* tau, double* du);

 private:
  const Model* model_;
  BodyColumns columns_;
  OwnBodies<double> own_;
  std::vector<EliminatedAxis<double>> axis_;
  std::vector<ArticulatedInertia<double>> Y_;
  std::vector<Force<double>> p_;
  std::vector<Motion<double>> a_;
};

}  // namespace linkwise
