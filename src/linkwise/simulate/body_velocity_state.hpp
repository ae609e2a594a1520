#pragma once
// The paper's state instead of the joint rates: joint coordinates and the bodies' own velocities,
// y = [q; w], of one member [sharf1993].
#include <functional>

#include "linkwise/dynamics/body_velocities.hpp"
#include "linkwise/integrate/integrator.hpp"
#include "linkwise/simulate/given_motion.hpp"

namespace linkwise {

class BodyVelocityState final : public OdeSystem {
 public:
  using Evaluation = std::function<DynamicsReport()>;
  /// What is asked of whoever knows forces and endings.
  struct Host {
    std::function<SweepInput<double>(double t, const double* q, const double* u)> input;
    /// Makes an evaluation, whose results are dw [n], and says what it is worth.
    std::function<Outcome(double t, const Evaluation& evaluation, const double* dw, int n)> judge;
    std::function<void()> accepted;
  };

  /// InputError when the options ask for a method without constraint forces.
  BodyVelocityState(const Model& model, const DynamicsOptions& options, Host host);

  /// y of joint coordinates and rates.
  const std::vector<double>& from_rates(const std::vector<double>& state);
  /// Joint coordinates and rates at time t into `state`; returns how far joints come apart, in m/s
  /// or rad/s.
  double interpolate(Integrator& integrator, double t, std::vector<double>& state);

 private:
  int size() const override { return model_.nq() + velocities_.size(); }
  int position_size() const override { return model_.nq(); }
  Outcome evaluate(double t, const double* y, double* ydot) override;
  void position_rates(const double* q, const double* w, double* qdot) override;
  void normalise(double* y) override { normalise_quaternions(model_, y); }
  void accepted(double t, const double* y) override;

  const Model& model_;
  Host host_;
  BodyVelocities velocities_;
  std::vector<double> y_, rates_;
};

}  // namespace linkwise
