#include "linkwise/dynamics/body_velocities.hpp"

#include <algorithm>
#include <cmath>

#include "linkwise/base/error.hpp"

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
      solver_(solver_name(model, options), options.solver_options, options.initial_guess != "zero"),
      guess_(make_initial_guess(options.initial_guess, options.solver_options.own)),
      f_(system_.A().size()),
      du_(model.nv()),
      v_(model.n_bodies()),
      gravity_(model.n_bodies()) {}

void BodyVelocities::unpack(const double* v) {
  for (int n = 0; n < model_->n_bodies(); ++n) v_[n] = to_motion(v + 6 * n);
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

double BodyVelocities::to_rates(const double* q, const double* v, double* u) {
  unpack(v);
  SweepInput<double> resting;
  resting.q = q;
  system_.calc_states([&](BodyState<double>* state, GeneralState<double>* general) {
    calc_body_states(*model_, resting, state, general);
  });
  std::fill(u, u + model_->nv(), 0.0);  // prescribed joints are locked
  double drift = 0;
  for (int n = 0; n < model_->n_bodies(); ++n) {
    const int parent = model_->topology[n].parent;
    const Motion<double> carried =
        parent >= 0 ? system_.states()[n].X * v_[parent] : Motion<double>{};
    const Vector6<double> gap =
        to_array(Motion<double>{v_[n].lin - carried.lin, v_[n].ang - carried.ang});
    const auto component = [&](const Vector6<double>& direction) {
      double sum = 0;
      for (int i = 0; i < 6; ++i) sum += direction[i] * gap[i];
      return sum;
    };
    const JointConstraint<double>& joint = system_.joint(n);
    for (int i = 0; i < joint.free; ++i) u[joint.dof[i]] = component(joint.dual[i]);
    for (int r = 0; r < joint.rows; ++r)
      if (joint.armature_of[r] < 0) drift = std::max(drift, std::abs(component(joint.B[r])));
  }
  return drift;
}

/// The bodies' states at the velocities v_: nothing passes from body to body.
void BodyVelocities::calc_states(const SweepInput<double>& in, BodyState<double>* states,
                                 GeneralState<double>* general) const {
  SweepInput<double> resting = in;
  resting.v = nullptr;
  calc_body_states(*model_, resting, states, general);
  for (int n = 0; n < model_->n_bodies(); ++n) {
    const BodyTopology& body = model_->topology[n];
    const Motion<double> v_parent = body.parent >= 0 ? v_[body.parent] : Motion<double>{};
    BodyState<double>& state = states[n];
    const Force<double> external = state.bias;  // all that a body at rest has
    if (body.joint_kind == JointKind::general) {
      calc_general_state(*model_, body, in, v_parent, state, general[body.general]);
    } else {
      const Motion<double> P = element_column<double>(model_->elements[body.first_element], 0);
      const Motion<double> relative = in.v[body.v] * P;
      state.c = cross(state.X * v_parent, relative);
    }
    state.v = v_[n];
    state.bias = momentum_bias(model_->constants[n].rigid, v_[n]);
    state.bias += external;
  }
}

DynamicsReport BodyVelocities::evaluate(double t, const SweepInput<double>& in, const double* v,
                                        double* dv) {
  unpack(v);
  system_.calc_states([&](BodyState<double>* state, GeneralState<double>* general) {
    calc_states(in, state, general);
  });
  system_.assemble_rows(in);
  guess_->predict(t, system_.A(), system_.b(), f_);
  DynamicsReport report{solver_.solve(system_.A(), system_.b(), f_, [&](bool with_size) {
    TreeSystem::Distance found{.with_size = with_size};
    system_.recover(in, f_, du_.data(), nullptr, solver_.is_direct() ? nullptr : &found);
    return MotionError{found.gap, found.size};
  })};
  if (report.node >= 0) report.body = system_.body_of_node(report.node);
  guess_->solved(t, f_);
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
