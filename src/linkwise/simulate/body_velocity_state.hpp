#pragma once
// The paper's state instead of the joint rates: joint coordinates and the bodies' own velocities,
// y = [q; w], of one member [sharf1993].
#include "linkwise/dynamics/body_velocities.hpp"
#include "linkwise/simulate/simulation.hpp"

namespace linkwise {

struct Simulation::BodyVelocityState final : OdeSystem {
  explicit BodyVelocityState(Simulation& owner);

  /// y of the owner's state.
  const std::vector<double>& start();
  /// Writes the owner's state at time t; returns how far joints come apart, in m/s or rad/s.
  double interpolate(double t);

 private:
  int size() const override { return owner_.position_size() + velocities_.size(); }
  int position_size() const override { return owner_.position_size(); }
  Outcome evaluate(double t, const double* y, double* ydot) override;
  void position_rates(const double* q, const double* w, double* qdot) override;
  void normalise(double* y) override { owner_.normalise(y); }
  void accepted(double t, const double* y) override;

  Simulation& owner_;
  BodyVelocities velocities_;
  std::vector<double> y_, rates_;
};

}  // namespace linkwise
