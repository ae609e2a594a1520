#pragma once
// States of a model as they come from outside, with all that acts on them.
#include <memory>
#include <string>
#include <vector>

#include "linkwise/dynamics/batch.hpp"
#include "linkwise/kinematics/loop_states.hpp"
#include "linkwise/kinematics/sweep_input.hpp"

namespace linkwise {

/// InputError where a wrench acts on a link that is no body, or the factor of gravity is not
/// finite.
void check_states(const Model& model, size_t count, const BatchInput& states);

/// tau [count][nv], null for none, with the model's passive forces in the states added.
std::vector<double> with_passive_forces(const Model& model, size_t count, const BatchInput& states,
                                        const double* tau);

/// InputError naming a spring whose ends meet though it is longer than that, so that its force has
/// no direction. tau: what else acts along the coordinates of loop joints, or null; `where`: begins
/// the message.
void require_directions(const Model& model, const LoopStates& states, const double* tau,
                        const std::string& where = "");

/// Rates and torques that were left out are zero, the model's passive forces are among the torques
/// where they act. The arrays of `states` must outlive it. InputError as check_states().
class AppliedStates {
 public:
  /// first: what states are counted from where one is told.
  AppliedStates(const Model& model, size_t count, const BatchInput& states, size_t first = 0);
  ~AppliedStates();
  AppliedStates(const AppliedStates&) = delete;
  AppliedStates& operator=(const AppliedStates&) = delete;

  /// State i, for a sweep; it holds until the next one is asked for. InputError where it leaves a
  /// loop open.
  SweepInput<double> operator[](size_t i) { return row(i, false); }
  /// The same for a method. One that finds the loop joints' states itself is to say then whether
  /// they are open, and gets their passive forces.
  SweepInput<double> for_method(size_t i, bool finds_loops) { return row(i, finds_loops); }
  /// All of them; rates may still be null.
  const BatchInput& rows() const { return rows_; }

 private:
  class Loops;
  SweepInput<double> row(size_t i, bool loops_later);

  const Model* model_;
  BatchInput rows_;
  std::vector<double> torques_, rest_;
  std::unique_ptr<Loops> loops_;
};

}  // namespace linkwise
