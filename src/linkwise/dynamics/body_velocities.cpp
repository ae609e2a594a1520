#include "linkwise/dynamics/body_velocities.hpp"

#include <algorithm>
#include <cmath>

#include "linkwise/base/error.hpp"
#include "linkwise/forces/armature_bias.hpp"
#include "linkwise/solve/registry.hpp"

namespace linkwise {
namespace {

std::string solver_name(const Model& model, const DynamicsOptions& options) {
  DynamicsOptions asked = options;
  if (asked.method == "auto") asked.method = "constraint_force";
  if (asked.method != "constraint_force")
    throw InputError("state body_velocities needs method constraint_force, not '" + asked.method +
                     "'");
  return choose_dynamics(model, asked).solver;
}

}  // namespace

BodyVelocities::BodyVelocities(const Model& model, const DynamicsOptions& options)
    : model_(&model),
      system_(model),
      solver_(make_solver(solver_name(model, options), options.solver_options)),
      guess_(make_initial_guess(options.initial_guess, options.solver_options.own)),
      f_(system_.A().size()),
      du_(model.nv()),
      v_(model.n_bodies()),
      gravity_(model.n_bodies()) {
  if (has_armature_bias(model))
    throw InputError("state body_velocities takes no armatures" + model.where() +
                     " on floating, planar and spherical joints; use the state joint_rates");
}

std::span<const Motion<double>> BodyVelocities::unpack(const double* v) {
  for (int n = 0; n < model_->n_bodies(); ++n) v_[n] = to_motion(v + 6 * n);
  return v_;
}

void BodyVelocities::from_rates(const double* q, const double* u, double* v) {
  SweepInput<double> in;
  in.q = q;
  in.v = u;
  std::vector<BodyState<double>> state(model_->n_bodies());
  std::vector<GeneralState<double>> general(model_->n_general);
  calc_body_states(*model_, in, state.data(), general.data());
  for (int n = 0; n < model_->n_bodies(); ++n) {
    const Vector6<double> row = to_array(state[n].v);
    std::copy(row.begin(), row.end(), v + 6 * n);
  }
}

void BodyVelocities::to_rates(const double* q, const double* v, double* u) {
  system_.calc_joint_rates(q, unpack(v), u);
}

double BodyVelocities::drift(const double* q, const double* v) {
  return system_.calc_joint_rates(q, unpack(v), du_.data());
}

DynamicsReport BodyVelocities::evaluate(double t, const SweepInput<double>& in, const double* v,
                                        double* dv) {
  system_.assemble_at(in, unpack(v));
  guess_->predict(t, system_.A(), system_.b(), f_);
  DynamicsReport report{solver_->solve(system_.A(), system_.b(), f_)};
  if (report.node >= 0) report.body = system_.body_of_node(report.node);
  guess_->solved(t, f_);
  system_.recover(in, f_, du_.data(), nullptr);
  // Accelerations are relative to a ground that falls upward, a_0 = -g; the velocities are not.
  const Motion<double> ground = ground_acceleration<double>(*model_, in.gravity_factor);
  for (int n = 0; n < model_->n_bodies(); ++n) {
    const int parent = model_->topology[n].parent;
    const Vec3<double>& outside = parent >= 0 ? gravity_[parent].lin : ground.lin;
    gravity_[n].lin = system_.states()[n].X.R * outside;
    const Motion<double>& a = system_.accelerations()[n];
    const Vector6<double> row = to_array(Motion<double>{a.lin - gravity_[n].lin, a.ang});
    std::copy(row.begin(), row.end(), dv + 6 * n);
  }
  return report;
}

}  // namespace linkwise
