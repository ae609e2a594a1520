#pragma once
// Which joint loads rigid bodies determine. Constraints that repeat each other let forces through
// that cancel inside the loops and move nothing: self-stresses, the null vectors N of Lambda. Any
// multiple may be added to the loads [wojtyra2005]. A component that no self-stress touches is
// determinate: no choice of forces changes it. So is one whose self-stresses bearings decide.
#include <vector>

#include "linkwise/model/model.hpp"

namespace linkwise {

struct Indeterminacy {
  int rows = 0;  ///< directions that loop joints and couplings hold
  int rank = 0;  ///< how many of them are independent
  int n_self_stresses = 0;
  int mobility = 0;  ///< degrees of freedom that are left
  /// Joint loads of independent self-stresses, each with its largest force, or moment over the
  /// loops' length, 1: [n_self_stresses][n_loads][6], in the users' frames as joint loads are.
  std::vector<double> self_stresses;
  /// Of those that no bearing decides, scaled alike: [n_undecided][n_loads][6]. All where the model
  /// has no bearings.
  int n_undecided = 0;
  std::vector<double> undecided;
  std::vector<char> determinate;  ///< [n_loads][6]
  std::vector<char> by_bearings;  ///< determinate, but not by rigid bodies alone
  std::vector<char> couplings;    ///< [n_couplings]: whether the load of each is determinate
};

/// At position q, which must close the loops: InputError otherwise.
Indeterminacy find_indeterminacy(const Model& model, const double* q);

}  // namespace linkwise
