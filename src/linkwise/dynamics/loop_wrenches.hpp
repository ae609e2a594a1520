#pragma once
// What joints that close loops do to the bodies that they join, whoever eliminates them.
#include <vector>

#include "linkwise/kinematics/loop_states.hpp"
#include "linkwise/spatial/inertia.hpp"

namespace linkwise {

/// Of directions that are nearly dependent: some thousandths from a singular position. Closer to it
/// noise takes over, measured on rows of four-bars; further from it coasting is less accurate.
inline constexpr double weak_pivot = 1e-5;
/// What pivots of a scaled Lambda (loop_system.hpp) count as zero: rounding errors leave 1e-16 of a
/// zero, and a gap makes dependent constraints independent, by pivots of the order of its square.
double null_pivot(double gap);

inline Force<double> direction(const Vector6<double>& Q) { return to_force(Q.data()); }

/// D, which weighs forces that constraints leave open: what the two bodies of a joint yield to it,
/// each alone, and its rotors.
class LoopMetric {
 public:
  explicit LoopMetric(const Model& model);
  /// D [rows] of a loop joint, lower triangle, packed.
  void calc(int l, const LoopState& loop, double* D) const;
  /// What the bodies of a joint yield to the wrench w, in F's axes.
  double yields(int l, const LoopState& loop, const Force<double>& w) const;
  /// What the parent and the child of a joint yield to a wrench on them.
  const Compliance<double>& of_parent(int l) const { return a_[l]; }
  const Compliance<double>& of_child(int l) const { return b_[l]; }

 private:
  const Model& model_;
  std::vector<Compliance<double>> a_, b_;  ///< of both bodies, by loop
};

/// Torques of loop joints: what is given, less what rotors of turning rates take by themselves.
class LoopTorques {
 public:
  explicit LoopTorques(const Model& model);
  void update(const SweepInput<double>& in, const LoopStates& states);
  /// Are there any?
  bool any() const { return tau_ != nullptr; }
  /// Wrench of a joint on its child, in F's axes.
  Force<double> wrench(const LoopState& loop) const;

 private:
  const Model& model_;
  bool has_bias_;  ///< of rotors
  std::vector<double> with_bias_;
  const double* tau_ = nullptr;
};

/// The load of a loop joint as users see it, [6], of its wrench on its child.
void store_loop_load(const LoopJoint& loop, const Force<double>& w, double* load);

}  // namespace linkwise
