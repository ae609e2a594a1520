#pragma once
// What a simulation of one member may integrate in place of joint coordinates and rates: the table
// of such states.
#include <functional>
#include <memory>
#include <string_view>
#include <vector>

#include "linkwise/dynamics/forward_dynamics.hpp"
#include "linkwise/integrate/integrator.hpp"
#include "linkwise/simulate/step_limits.hpp"

namespace linkwise {

class IntegratedState : public OdeSystem {
 public:
  using Evaluation = std::function<DynamicsReport()>;
  /// What is asked of whoever knows forces and endings.
  struct Host {
    std::function<SweepInput<double>(double t, const double* q, const double* u)> input;
    /// Makes an evaluation, whose results are ydot [n], and says what it is worth.
    std::function<Outcome(double t, const Evaluation& evaluation, const double* ydot, int n)> judge;
    std::function<void()> accepted;
    StepLimits* step_limits;
  };

  /// y of joint coordinates and rates.
  virtual const std::vector<double>& from_rates(const std::vector<double>& state) = 0;
  /// Joint coordinates and rates at time t into `state`.
  virtual void interpolate(Integrator& integrator, double t, std::vector<double>& state) = 0;
  /// How far joints came apart at the last interpolation, in m/s or rad/s.
  virtual double drift() const = 0;
};

struct StateEntry {
  std::string_view name;
  /// InputError where the options do not fit.
  std::unique_ptr<IntegratedState> (*make)(const Model&, const DynamicsOptions&,
                                           IntegratedState::Host);
};

/// Null for "joint_rates", which needs no other state. InputError, listing the known names, when
/// the name is unknown.
const StateEntry* find_state(std::string_view name);

}  // namespace linkwise
