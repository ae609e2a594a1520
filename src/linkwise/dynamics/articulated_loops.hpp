#pragma once
// Articulated-body recursion with closed loops. Each group of loops is eliminated when the inward
// sweep reaches its top, the body at which the loops meet. Unit forces F of the loop joints are
// carried there along the paths of the loops (recursion/loop_steps.hpp), which gives
//     Psi^T a_top + beta + Lambda f = r
//     Y_top += Psi Lambda^+ Psi^T,   p_top -= Psi Lambda^+ (r - beta)
// Outward, f follows from a_top and is a known wrench from there on. Constraints that repeat each
// other make Lambda singular: of all f that solve it the one of least f^T D f is taken, where D
// holds what the two bodies of each joint yield to it, each alone. That is an energy, so the choice
// depends on no unit and no frame. Accelerations are the same for all f, so those that are asked
// for alone come of independent constraints (independent_loops.hpp).
#include <memory>
#include <vector>

#include "linkwise/dynamics/bearing_shares.hpp"
#include "linkwise/dynamics/independent_loops.hpp"
#include "linkwise/dynamics/loop_groups.hpp"
#include "linkwise/dynamics/loop_report.hpp"
#include "linkwise/dynamics/loop_system.hpp"
#include "linkwise/dynamics/loop_wrenches.hpp"
#include "linkwise/recursion/tree_sweeps.hpp"

namespace linkwise {

class ArticulatedLoops {
 public:
  explicit ArticulatedLoops(const Model& model);

  /// du [nv]; loads [n_joints + n_loops][6] or null. False when some D is not positive definite:
  /// `failed_body`.
  bool evaluate(const SweepInput<double>& in, double* du, double* loads);

  /// Rates du [nv] of a machine at rest at q that change the residuals of its loop joints by
  /// `asked` [n_loops][6] and take the least kinetic energy: K du = asked, du^T H du / 2 as small
  /// as that lets it be. What dependent constraints ask for in vain is left out, and so are
  /// directions that hold less than `null` of what the strongest does.
  bool respond(const double* q, const double* asked, double null, double* du);

  /// Of the last evaluation: the torque or force that each coupling puts into each of its joints,
  /// in the order of the model's couplings and their terms.
  void coupling_loads(const double* q, std::vector<double>& loads) const;

  int failed_body() const { return sweeps_.failed_body(); }
  const LoopReport& report() const { return report_; }
  const LoopStates& states() const { return states_; }
  /// Whether the last evaluation was by independent rows.
  bool took_independent() const { return took_independent_; }
  const std::vector<LoopGroup>& groups() const { return groups_; }

  // Of the last evaluation, with loads: forces of a group that cancel.
  int find_self_stresses(int group) {
    systems_[group].factor_exactly();
    return systems_[group].n_null();
  }
  /// Joint loads [n_loads][6] of self-stress k, found before.
  void self_stress(int group, int k, const double* q, double* loads) const;
  /// Self-stresses of a group that no bearing decides: joint loads [n][n_loads][6], one after the
  /// other behind `loads`. couplings [n_couplings]: marks those that such a self-stress loads.
  void append_undecided(int group, const double* q, std::vector<double>& loads,
                        std::vector<char>& couplings);
  /// How far the longest loop reaches, m; 1 where there is none.
  double longest_loop() const;

 private:
  struct Work {
    std::vector<LoopColumn<double>> columns;
    std::vector<Force<double>> Psi;             ///< [rows] on the top
    std::vector<double> beta, r, size, f, rhs;  ///< [rows]; size: of what makes up beta and r
    std::vector<double> y;                      ///< [columns of the joint][rows] of a carrier
    std::vector<double> own_z, own_y;           ///< [rows][own] of each carrier
  };

  /// Of an evaluation by independent rows. none: it takes all.
  enum class Answer { good, failed, none };

  void begin(const SweepInput<double>& in, bool with_loads);
  void find_states(const SweepInput<double>& in);
  bool evaluate_all(const SweepInput<double>& in, double* du, double* loads);
  Answer evaluate_independent(const SweepInput<double>& in, double* du);
  void find_independent();
  void take_rows(int g, std::vector<char>& taken) const;
  void carry(const SweepInput<double>& in, int g);
  void carry_own(int g, const LoopGroup::Carrier& carrier);
  void push_own(int g, const LoopGroup::Carrier& carrier);
  void place_forces(const SweepInput<double>& in, int g);
  void place_coupling(const SweepInput<double>& in, int g, const LoopGroup::Member& member);
  double yielding_of(const SweepInput<double>& in, const LoopGroup::Member& member) const;
  void factor(const SweepInput<double>& in, int g, bool with_loads);
  void reduce_top(int g);
  void solve_forces(const SweepInput<double>& in, int g, bool with_loads);
  void add_known_wrenches(const SweepInput<double>& in);
  void add_to_load(int g, const double* f, std::vector<Force<double>>& load) const;
  void store_loop_loads(double* loads);
  void add_coupling_to_load(const LoopGroup::Member& member, double f,
                            std::vector<Force<double>>& load) const;
  void make_bearing_shares();
  void store_stress(int g, const double* f, const double* q, double* loads) const;
  double size_of(const LoopGroup::Member& member, const double* f, const double* q) const;
  void mark_couplings(int g, const double* f, const double* q, std::vector<char>& marks) const;
  int find_stresses(int g, const double* q);
  void share_by_bearings(int g, const double* q, double misfit, double* loads);

  const Model& model_;
  TreeSweeps<double> sweeps_;
  LoopStates states_;
  std::vector<LoopGroup> groups_;
  LoopMetric metric_;
  LoopTorques torques_;  ///< of the last evaluation
  std::vector<Work> work_;
  std::vector<LoopSystem> systems_;
  /// Ranges of bodies that are swept between the eliminations of groups, and how many groups are
  /// eliminated after each: tip to base.
  struct Stage {
    std::vector<KindRange> ranges;
    int first_group, last_group;
  };
  std::vector<Stage> stages_;
  std::vector<std::vector<int>> terms_;  ///< by coupling: columns of its joints, -1: given motion
  std::unique_ptr<IndependentLoops> independent_;  ///< made when accelerations are asked for
  bool independent_known_ = false, took_independent_ = false;
  std::vector<Force<double>> load_;
  std::vector<BearingShares> shares_;  ///< by group, where the model has bearings
  std::vector<double> null_forces_, stresses_, alpha_;
  LoopReport report_;
  const double* asked_ = nullptr;  ///< in place of what rates ask for
  double null_ = 0;                ///< pivots of the scaled Lambda below this are zero
  std::vector<double> at_rest_;
};

}  // namespace linkwise
