#pragma once
// Assembles A f = b of [sharf1993, eqs. (10)-(14)] for a tree, and reads motion and loads back from
// f. With the free accelerations afree_n = M_n^-1 (g_n + known wrenches),
//     A_nn = B_n^T (M_n^-1 + X_n M_p^-1 X_n^T) B_n + compliance
//     A_np = -B_n^T X_n M_p^-1 B_p
//     A_ns = B_n^T X_n M_p^-1 X_s^T B_s
//     b_n  = B_n^T (X_n afree_p + c_n - afree_n) + tau / armature
// Siblings n, s are a hub of the block tree. Never solves. Bodies enter by their compliance alone.
#include <vector>

#include "linkwise/constraint/joint_constraint.hpp"
#include "linkwise/exec/executor.hpp"
#include "linkwise/linear/block_tree.hpp"

namespace linkwise {

class TreeSystem {
 public:
  /// InputError naming the body when one has a singular inertia.
  /// The executor shares the rows; it influences no result.
  explicit TreeSystem(const Model& model, const Executor& executor = Executor());

  const BlockTree& A() const { return A_; }
  const std::vector<double>& b() const { return b_; }
  const std::vector<BodyState<double>>& states() const { return state_; }

  void assemble(const SweepInput<double>& in);
  /// The two halves of assemble(), for states that are found in another way: f(states, general)
  /// writes them, and the joints' constraints follow; then the rows.
  template <class F>
  void calc_states(F&& f) {
    f(state_.data(), general_.data());
    calc_constraints();
  }
  void assemble_rows(const SweepInput<double>& in);
  /// Of the states at hand.
  const JointConstraint<double>& joint(int body) const { return joint_[body]; }
  /// How far an f that is not exact and the du that follow from it are from the truth. The bodies'
  /// accelerations of f balance all forces but open the joints; those of du keep the joints
  /// together. The truth does both, and as the two kinds of error are at right angles in the norm
  /// of the kinetic energy, the distance of the two bounds either [prager1947]:
  ///     gap^2 = ||f* - f||_A^2 + ||du* - du||^2.
  struct Distance {
    double gap = 0;
    double size = 0;         ///< ||du||
    bool with_size = false;  ///< is it wanted?
  };
  /// du [nv] from the solution f; loads [n_joints][6] or null; the distance or null.
  void recover(const SweepInput<double>& in, const std::vector<double>& f, double* du,
               double* loads, Distance* distance = nullptr);
  /// Accelerations of the bodies that recover() found, the ground's being minus gravity.
  const std::vector<Motion<double>>& accelerations() const { return a_; }
  /// Largest violation of a constraint by the accelerations that recover() found, relative to the
  /// largest acceleration. It shows what rounding and an inexact f have cost.
  double violation() const { return violation_; }
  /// Body of a node of A (they are numbered alike).
  int body_of_node(int node) const { return node; }

 private:
  void calc_constraints();
  void add_distance(int n, const SweepInput<double>& in, const std::vector<double>& f,
                    const double* du, const Motion<double>& relative, const Motion<double>& open,
                    Distance& distance);
  void calc_free_accelerations(const SweepInput<double>& in);
  void assemble_node(int n, const SweepInput<double>& in);

  const Model* model_;
  Executor executor_;
  BlockTree A_;
  std::vector<double> b_;
  std::vector<Compliance<double>> compliance_;
  std::vector<BodyState<double>> state_;
  std::vector<GeneralState<double>> general_;
  std::vector<JointConstraint<double>> joint_;
  std::vector<Force<double>> known_, g_, w_;
  std::vector<Motion<double>> a_, off_, moved_;
  double violation_ = 0;
};

}  // namespace linkwise
