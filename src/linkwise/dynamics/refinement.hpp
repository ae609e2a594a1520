#pragma once
// Refinement of what A f = b gives. Where a light body carries a heavy one, A holds the heavy one's
// compliance in its last digits only: the forces come out right, their differences, the
// accelerations, do not. Newton-Euler, which does not suffer, gives the loads of the accelerations
// found and the torques that they miss; the answer to these, through the same factors, is added to
// both.
#include <memory>
#include <vector>

#include "linkwise/base/tolerances.hpp"
#include "linkwise/dynamics/inverse_dynamics.hpp"

namespace linkwise {

template <class S>
class Refinement {
 public:
  explicit Refinement(const Model& model) : model_(&model) {}

  /// `violation`: by what part of the largest acceleration the motion misses its equations.
  static bool is_due(const S& violation) {
    bool any = false;
    for (int l = 0; l < lane_count<S>; ++l) any |= lane(violation, l) > acceptable_violation;
    return any;
  }
  /// `refined` in the lanes that need it.
  static S choose(const S& violation, const S& refined, const S& old) {
    return violation > acceptable_violation ? refined : old;
  }

  /// Refines du [nv] and loads [n_joints][6], or null. respond(rest, du, loads) answers to torques
  /// alone, at the same q.
  template <class Respond>
  void refine(const SweepInput<S>& in, const S& violation, S* du, S* loads, Respond&& respond) {
    const Model& model = *model_;
    if (!inverse_) inverse_ = std::make_unique<InverseDynamics<S>>(model);
    const int n_loads = loads ? 6 * model.n_joints() : 0;
    torques_.resize(model.nv());
    given_loads_.resize(n_loads);
    more_loads_.resize(n_loads);
    inverse_->evaluate(in, du, torques_.data(), loads ? given_loads_.data() : nullptr);
    for (int i = 0; i < model.nv(); ++i) torques_[i] = in.tau[i] - torques_[i];
    SweepInput<S> rest;
    rest.q = in.q;
    rest.tau = torques_.data();
    rest.gravity_factor = 0;
    more_.assign(model.nv(), S{});
    respond(rest, more_.data(), loads ? more_loads_.data() : nullptr);
    for (int i = 0; i < model.nv(); ++i) du[i] = du[i] + choose(violation, more_[i], S{});
    for (int i = 0; i < n_loads; ++i)
      loads[i] = choose(violation, given_loads_[i] + more_loads_[i], loads[i]);
  }

 private:
  const Model* model_;
  std::unique_ptr<InverseDynamics<S>> inverse_;  ///< made when first needed
  std::vector<S> torques_, more_, given_loads_, more_loads_;
};

}  // namespace linkwise
