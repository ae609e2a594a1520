#pragma once
// The articulated-body recursion with the branches of a tree side by side [hwang1988]. A branch is
// a run of bodies each of which carries one other; branches whose parents are done go outward, and
// branches whose outboard ones are done inward, all at once on the threads of the pool. Only the
// order of the evaluation changes: the result is the same to the last bit for any number of
// threads.
#include <vector>

#include "linkwise/dynamics/forward_dynamics.hpp"
#include "linkwise/kinematics/body_columns.hpp"

namespace linkwise {

/// The branches of a tree and the order in which they can be evaluated.
struct BranchSchedule {
  explicit BranchSchedule(const Model& model);

  std::vector<std::vector<int>> branches;  ///< bodies from base to tip
  /// Branches by the number of branches between them and the base, and the longest way to a tip.
  std::vector<std::vector<int>> outward, inward;
};

class BranchRecursion : public DynamicsMethod {
 public:
  BranchRecursion(const Model& model, const DynamicsOptions& options);
  DynamicsReport evaluate(double t, const SweepInput<double>& in, double* du,
                          double* loads) override;
  const BranchSchedule& schedule() const { return schedule_; }

 private:
  template <class Visit>
  void for_branches(const std::vector<std::vector<int>>& levels, Visit&& visit);
  bool eliminate(int n, const double* tau);
  void gather(int n);
  void accelerate(int n, const SweepInput<double>& in, double* du);

  const Model* model_;
  int threads_;
  BranchSchedule schedule_;
  std::vector<std::vector<int>> children_;
  BodyColumns columns_;
  std::vector<ArticulatedInertia<double>> Y_, Y_given_;  ///< own, and as its parent sees it
  std::vector<Force<double>> p_, p_given_, V_, load_;
  std::vector<Motion<double>> a_;
  std::vector<double> D_inverse_, h_;
  std::vector<char> failed_;
};

}  // namespace linkwise
