#pragma once
// Many states of one model: groups of native_lanes systems in SIMD lanes, the rest one by one. The
// grouping depends on the count alone, so results do not depend on who computes which group.
#include <memory>

#include "linkwise/model/model.hpp"

namespace linkwise {

/// Row-major arrays with one row a system; null where a quantity is absent.
struct BatchInput {
  const double* q = nullptr;
  const double* v = nullptr;
  const double* tau = nullptr;       ///< forward dynamics
  const double* du = nullptr;        ///< inverse dynamics
  const double* external = nullptr;  ///< [n_joints][6] a system
  double gravity_factor = 1;
};

/// The methods that run on lanes.
enum class BatchMethod { articulated_body, constraint_force };

/// One worker's scratch: everything is allocated at the first use of its kind.
class BatchEvaluator {
 public:
  explicit BatchEvaluator(const Model& model);
  ~BatchEvaluator();

  /// du [count][nv]; loads [count][n_joints][6] or null. Returns the body at which a system's
  /// elimination failed, or -1.
  int forward_dynamics(size_t count, const BatchInput& in, double* du, double* loads,
                       BatchMethod method = BatchMethod::articulated_body);

  /// tau [count][nv] and loads [count][n_joints][6]; either may be null.
  void inverse_dynamics(size_t count, const BatchInput& in, double* tau, double* loads);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace linkwise
