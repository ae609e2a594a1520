#pragma once
// The paper's state instead of the joint rates: joint coordinates and the bodies' own velocities,
// y = [q; w], of one member [sharf1993].
#include "linkwise/dynamics/body_velocities.hpp"
#include "linkwise/simulate/given_motion.hpp"
#include "linkwise/simulate/integrated_state.hpp"

namespace linkwise {

class BodyVelocityState final : public IntegratedState {
 public:
  /// InputError when the options ask for a method without constraint forces.
  BodyVelocityState(const Model& model, const DynamicsOptions& options, Host host);

  const std::vector<double>& from_rates(const std::vector<double>& state) override;
  void interpolate(Integrator& integrator, double t, std::vector<double>& state) override;
  double drift() const override { return drift_; }

 private:
  int size() const override { return model_.nq() + velocities_.size(); }
  int position_size() const override { return model_.nq(); }
  Outcome evaluate(double t, const double* y, double* ydot) override;
  Outcome evaluate_aside(double t, const double* y, double* ydot) override;
  void position_rates(const double* q, const double* w, double* qdot) override;
  bool constrained() const override { return model_.nq() != model_.nv(); }
  Outcome project(double /*t*/, double* y) override {
    normalise_quaternions(model_, y);
    return Outcome::converged;
  }
  void accepted(double t, const double* y) override;
  double step_limit(double t) override { return host_.step_limits->after(t); }
  bool breaks_at(double t) override { return host_.step_limits->breaks_at(t); }

  const Model& model_;
  DynamicsOptions options_;
  Host host_;
  BodyVelocities velocities_;
  std::unique_ptr<BodyVelocities> aside_;  ///< made when first needed
  std::vector<double> y_, rates_;
  double drift_ = 0;
};

}  // namespace linkwise
