#pragma once
// Runs a simulation and keeps everything that it can write.

#include <memory>
#include <vector>

#include "linkwise/simulate/simulation.hpp"
#include "model/machines.hpp"

namespace linkwise::testing {

inline std::shared_ptr<const Model> make_model(ModelSpec spec) {
  return std::make_shared<const Model>(std::move(spec));
}

/// Of this step where the kind takes one, else of the default tolerance.
inline SimulationOptions fixed_step(double step,
                                    IntegratorKind kind = IntegratorKind::runge_kutta_4) {
  SimulationOptions options;
  options.integrator = kind;
  for (const IntegratorEntry& entry : integrator_registry())
    if (entry.kind == kind && entry.fixed_step) options.integration.step = step;
  return options;
}

struct Instant {
  std::vector<double> q, v, du, loads, drive_torque;
  double kinetic = 0, potential = 0;
  double energy() const { return kinetic + potential; }
};

/// One sample at t, or nothing when the run stopped.
inline bool advance(Simulation& simulation, double t, Instant& at) {
  const Model& m = simulation.model();
  at.q.resize(m.nq());
  at.v.resize(m.nv());
  at.du.resize(m.nv());
  at.loads.resize(6 * m.n_joints());
  at.drive_torque.resize(m.nv());
  return simulation.advance(t, {at.q.data(), at.v.data(), at.du.data(), at.loads.data(),
                                at.drive_torque.data(), &at.kinetic, &at.potential});
}

inline std::vector<Instant> run(Simulation& simulation, const std::vector<double>& times) {
  std::vector<Instant> out;
  for (double t : times) {
    Instant at;
    if (!advance(simulation, t, at)) break;
    out.push_back(at);
  }
  return out;
}

inline std::vector<double> every(double step, double end) {
  std::vector<double> times;
  for (int i = 0; i * step <= end * (1 + 1e-12); ++i) times.push_back(i * step);
  return times;
}

}  // namespace linkwise::testing
