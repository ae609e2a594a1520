#pragma once
// Runs a simulation and keeps everything that it can write.

#include <algorithm>
#include <cmath>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "dynamics/dynamics_case.hpp"
#include "linkwise/simulate/simulation.hpp"
#include "model/machines.hpp"

namespace linkwise::testing {

inline std::shared_ptr<const Model> make_model(ModelSpec spec) {
  return std::make_shared<const Model>(std::move(spec));
}

/// Of this step where the kind takes one, else of the default tolerance.
inline SimulationOptions fixed_step(double step, std::string_view kind = "runge_kutta_4") {
  SimulationOptions options;
  options.integrator = kind;
  for (const IntegratorEntry& entry : integrator_registry())
    if (entry.name == kind && entry.fixed_step) options.integration.step = step;
  return options;
}

struct Recorded {
  std::vector<double> q, v, du, loads, drive_torque, external;
  double kinetic = 0, potential = 0;
  double energy() const { return kinetic + potential; }
};

/// One sample at t, or nothing when the run stopped.
inline bool advance(Simulation& simulation, double t, Recorded& at) {
  const Model& m = simulation.model();
  at.q.resize(m.nq());
  at.v.resize(m.nv());
  at.du.resize(m.nv());
  at.loads.resize(6 * m.n_joints());
  at.drive_torque.resize(m.nv());
  at.external.resize(6 * m.n_joints());
  Sample sample;
  sample["position"] = at.q.data();
  sample["velocity"] = at.v.data();
  sample["acceleration"] = at.du.data();
  sample["joint_load"] = at.loads.data();
  sample["drive_torque"] = at.drive_torque.data();
  sample["external_wrench"] = at.external.data();
  sample["kinetic_energy"] = &at.kinetic;
  sample["potential_energy"] = &at.potential;
  return simulation.advance(t, sample);
}

inline std::vector<Recorded> run(Simulation& simulation, const std::vector<double>& times) {
  std::vector<Recorded> out;
  for (double t : times) {
    Recorded at;
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

inline double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double worst = 0;
  for (size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(a[i] - b[i]));
  return worst;
}

inline std::vector<std::string_view> all_kinds() {
  std::vector<std::string_view> kinds;
  for (const IntegratorEntry& entry : integrator_registry()) kinds.push_back(entry.name);
  return kinds;
}

/// Every method with the joint rates as state, and the bodies' own velocities as state.
struct Formulation {
  std::string method;
  const StateEntry* state = nullptr;
};
inline std::vector<Formulation> formulations(const Model& model) {
  std::vector<Formulation> all{{"constraint_force", find_state("body_velocities")}};
  for (const DynamicsEntry& entry : dynamics_table())
    if (takes(entry, model)) all.push_back({std::string(entry.name)});
  return all;
}
inline void PrintTo(const Formulation& f, std::ostream* out) {
  *out << f.method << (f.state ? ", body velocities" : "");
}
inline SimulationOptions with(SimulationOptions options, const Formulation& f) {
  options.dynamics.method = f.method;
  options.dynamics.solver_options.tolerance = 1e-12;  // of the methods that iterate
  options.state = f.state;
  return options;
}

/// Every kind of coordinate in one tree, no forces but gravity.
inline ModelSpec every_kind(std::uint64_t seed = 101) {
  using enum JointType;
  Draws draws(seed);
  return tree_spec({revolute, spherical, planar, composite, revolute}, {-1, 0, 0, 1, 1}, draws);
}

/// A particle of 1 kg on a massless rod of 1 m: q'' = -9.81 sin q.
inline ModelSpec pendulum() {
  ModelSpec spec;
  spec.links = {{"base", 0, {}, {}}, {"bob", 1, {0, 0, -1}, {}}};
  JointSpec hinge;
  hinge.name = "hinge";
  hinge.parent = "base";
  hinge.child = "bob";
  hinge.axes = {{AxisKind::revolute, {0, 1, 0}, 0}};
  spec.joints = {hinge};
  return spec;
}

}  // namespace linkwise::testing
