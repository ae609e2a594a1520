#pragma once
// Many states of one model: groups of native_lanes systems in SIMD lanes, the rest one by one. The
// grouping depends on the count alone, so results do not depend on who computes which group.
#include <memory>
#include <span>

#include "linkwise/model/model.hpp"

namespace linkwise {

/// Row-major arrays with one row per system; null where a quantity is absent.
struct BatchInput {
  const double* q = nullptr;
  const double* v = nullptr;
  const double* tau = nullptr;  ///< forward dynamics
  const double* du = nullptr;   ///< inverse dynamics: accelerations of the motion
  /// Forward dynamics: accelerations of prescribed degrees of freedom, [nv]; null: zero.
  const double* prescribed = nullptr;
  const double* loop_tau = nullptr;         ///< torques of loop joints; null: none
  const double* loop_prescribed = nullptr;  ///< accelerations of prescribed loop joints; null: zero
  const double* external = nullptr;         ///< [n_joints][6] per system
  double gravity_factor = 1;
  const double* passive = nullptr;  ///< loads by cause: the part of the torques that is no drive's
  bool passive_acts = false;        ///< Evaluator: the model's passive forces act beside tau

  /// The rows from `first` on.
  BatchInput from(const Model& model, size_t first) const;
};

/// The methods that run on lanes.
enum class BatchMethod { articulated_body, constraint_force };

/// What alone loads the joints while the mechanism gives way to it.
enum class Cause { gravity, velocity, drive, motion, passive, external, misfit };

/// One worker's scratch: everything is allocated at the first use of its kind.
class BatchEvaluator {
 public:
  explicit BatchEvaluator(const Model& model);
  ~BatchEvaluator();

  /// du [count][nv]; loads [count][n_joints][6] or null. Returns the body at which a system's
  /// elimination failed, or -1.
  int forward_dynamics(size_t count, const BatchInput& in, double* du, double* loads,
                       BatchMethod method = BatchMethod::articulated_body);

  /// loads [count][causes][n_joints][6]: every system is eliminated once and solved for each cause.
  /// The shares of all causes add up to the loads of forward dynamics under tau + passive.
  int loads_by_cause(size_t count, const BatchInput& in, std::span<const Cause> causes,
                     double* loads, BatchMethod method = BatchMethod::articulated_body);

  /// tau [count][nv] and loads [count][n_joints][6]; either may be null.
  void inverse_dynamics(size_t count, const BatchInput& in, double* tau, double* loads);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace linkwise
