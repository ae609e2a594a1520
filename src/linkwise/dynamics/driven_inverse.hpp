#pragma once
// Inverse dynamics of machines with closed loops: the torques of chosen, driven joints that make a
// given motion. Accelerations are affine in them, a = a_0 + B tau, and the columns of B are those
// of the forward dynamics at hand, so whatever that takes is taken here. At the driven degrees of
// freedom themselves
//     B_d tau = (a - a_0)_d,   B_d = S^T H_c^-1 S,
// with H_c^-1 what the constraints leave of H^-1 [featherstone2008, ch. 8]. B_d is positive
// definite where the driven motions are independent; where they determine the whole motion, all of
// a follows. Both are checked.
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "linkwise/dynamics/forward_dynamics.hpp"
#include "linkwise/dynamics/inverse_dynamics.hpp"
#include "linkwise/dynamics/mobility.hpp"

namespace linkwise {

class DrivenInverse {
 public:
  /// driven: joints of the tree. InputError where one is unknown, given twice, closes a loop, has
  /// no freedom, or where there is none; the text then tells which would do.
  DrivenInverse(const Model& model, std::span<const std::string> driven);

  /// tau [nv] of the driven joints, zero for all others, and the loads [n_loads][6] of all joints.
  /// Either may be null. in.tau: what acts beside the drives. InputError, starting with `where`, if
  /// a [nv] opens the loops, or the driven joints cannot make it or repeat each other.
  DynamicsReport evaluate(SweepInput<double> in, const double* a, const std::string& where,
                          double* tau, double* loads);

 private:
  DynamicsReport forward(const SweepInput<double>& in, double* du, double* loads = nullptr);
  double energy(const SweepInput<double>& in, const double* a);
  DynamicsReport require_closed(const SweepInput<double>& in, const double* a, double size,
                                const std::string& where);
  DynamicsReport factor(const SweepInput<double>& in, const std::string& where);
  void solve(double* x) const;
  std::string largest(const double* got, const double* asked) const;
  std::string name_of(int dof) const;

  const Model& model_;
  std::unique_ptr<DynamicsMethod> method_;
  InverseDynamics<double> tree_;
  Mobility mobility_;
  std::vector<int> dofs_;  ///< driven degrees of freedom
  std::vector<double> B_;  ///< [dofs][dofs]; its Cholesky factor below the diagonal and on it
  std::vector<double> rest_, beside_, tau_, a0_, du_, miss_, work_;
};

}  // namespace linkwise
