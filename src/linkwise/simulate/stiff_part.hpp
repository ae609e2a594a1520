#pragma once
// The stiff part of a tree's equations of motion, solved by the recursion.
//
// Springs, dampers, PD drives, stops, friction and the coordinates of elastic bodies act along
// degrees of freedom, with stiffness K and damping D on the diagonal. With these alone, Newton's
// matrix of an implicit step, gamma being its length times a number, is solved by
//     E = gamma D + gamma^2 K,   du = r_u - (H + E)^-1 (E r_u + gamma K r_q),   dq = r_q + gamma
//     du.
// H + E is the mass matrix of the same tree with E beside the armatures: O(N) (ShiftedMass). Along
// coordinates that are not rates, dq = r_q + gamma S du with qdot = S u.
#include <vector>

#include "linkwise/dynamics/shifted_mass.hpp"
#include "linkwise/simulate/force_gains.hpp"
#include "linkwise/simulate/parent_axes.hpp"

namespace linkwise {

class StiffPart {
 public:
  /// Whether there is one for such a machine: it takes trees.
  static bool suits(const Setup& setup);

  /// The setup must outlive this.
  explicit StiffPart(const Setup& setup);

  /// y [nq + nv] with rates in parent axes. False where H + E is not positive definite.
  bool factor(const double* y, double gamma);
  /// r, z [nq + nv], rates in parent axes.
  void solve(const double* r, double* z);

 private:
  void find_gains(const double* y);

  const Model& model_;
  ParentAxes parent_axes_;
  std::vector<GainRow> rows_;
  ShiftedMass mass_;
  double gamma_ = 0;
  std::vector<double> q_, K_, D_, E_, tau_, du_;  ///< K_, D_: along parent axes
};

}  // namespace linkwise
