#include "linkwise/dynamics/loop_wrenches.hpp"

#include <algorithm>

#include "linkwise/bodies/body_kinds.hpp"
#include "linkwise/forces/armature_bias.hpp"
#include "linkwise/recursion/own_bodies.hpp"

namespace linkwise {
namespace {

/// What a body yields to a wrench, all else left free. Where its inertia is singular it is given
/// some: D only weighs forces that constraints leave open.
Compliance<double> yielding(const Model& model, int body, const Transform<double>& X) {
  if (body < 0) return {};
  Inertia<double> M = with_body(
      model, body, [](const auto& own) -> Inertia<double> { return frozen_inertia(own); });
  ArticulatedInertia<double> Y;
  add_inertia(Y, M);
  double L[21];
  if (!linkwise::factor(Y, L, 1e-10)) {
    const double lever = dot(X.r, X.r), own = M.I.m[0] + M.I.m[2] + M.I.m[5];
    if (!(M.m > 0)) M.m = model.total_mass();
    const double more = 0.1 * own + M.m * (lever > 0 ? lever : own > 0 ? 0 : 1);
    for (const int i : {0, 2, 5}) M.I.m[i] += more;
  }
  return invert_inertia(M);
}

/// Bodies that bend, at rest in their shape of the zero position, and what they carry on ports:
/// what each yields to a wrench, with nothing else on it.
class ElasticYielding {
 public:
  explicit ElasticYielding(const Model& model)
      : model_(model), own_(model), q_(model.neutral_configuration()) {}

  bool takes(int body) const {
    return body >= 0 && (own_.has(body) || on_port(model_, model_.topology[body]));
  }

  Compliance<double> of(int body) {
    ArticulatedInertia<double> Y{};
    if (own_.has(body))
      Y = alone(body);
    else
      add_inertia(Y, with_body(model_, body, [](const auto& own) -> Inertia<double> {
                    return frozen_inertia(own);
                  }));
    if (on_port(model_, model_.topology[body])) Y += of_port(body);
    return inverse(Y);
  }

 private:
  /// With what the coordinates yield.
  ArticulatedInertia<double> alone(int body) {
    SweepInput<double> in;
    in.q = q_.data();
    ArticulatedInertia<double> Y{};
    Force<double> none{};
    own_.update(in, body, {});
    own_.eliminate(in, body, Y, none);
    return Y;
  }

  /// Of a port: the inverse of Z Y^-1 Z^T + P m_e^-1 P^T, Z = X - P m_e^-1 M_e^T.
  ArticulatedInertia<double> of_port(int body) {
    SweepInput<double> in;
    in.q = q_.data();
    const int parent = model_.topology[body].parent, n = own_.count(parent);
    const Compliance<double> frame = inverse(alone(parent));
    BodyState<double> state;
    own_.update_port(in, body, {}, state);
    const OwnEquations<double>& blocks = own_.blocks(parent);
    const ElasticPort<double>& port = own_.port(parent);
    ArticulatedInertia<double> W{};
    for (int j = 0; j < 6; ++j) {
      Vector6<double> unit{};
      unit[j] = 1;
      const Force<double> w = to_force(unit.data());
      double y[most_coordinates];
      for (int k = 0; k < n; ++k) y[k] = dot(port.P[k], w);
      cholesky_solve(n, blocks.m_e, y);
      Force<double> felt = transpose_times(state.X, w);
      for (int k = 0; k < n; ++k) felt -= y[k] * blocks.M_e[k];
      const Motion<double> a = frame * felt;
      double z[most_coordinates];
      for (int k = 0; k < n; ++k) z[k] = dot(a, blocks.M_e[k]);
      cholesky_solve(n, blocks.m_e, z);
      Motion<double> at = state.X * a;
      for (int k = 0; k < n; ++k) at += (y[k] - z[k]) * port.P[k];
      const Vector6<double> column = to_array(at);
      for (int i = j; i < 6; ++i) entry(W, i, j) = column[i];
    }
    const Compliance<double> back = inverse(W);
    return {back.A, back.B, back.C};
  }

  static Compliance<double> inverse(const ArticulatedInertia<double>& Y) {
    double L[21];
    factor(Y, L, smallest_pivot);
    ArticulatedInertia<double> out;
    for (int j = 0; j < 6; ++j) {
      Vector6<double> unit{};
      unit[j] = 1;
      const Vector6<double> column = to_array(solve(L, to_force(unit.data())));
      for (int i = j; i < 6; ++i) entry(out, i, j) = column[i];
    }
    return {out.A, out.B, out.C};
  }

  const Model& model_;
  OwnBodies<double> own_;
  std::vector<double> q_;
};

}  // namespace

double null_pivot(double gap) { return std::clamp(100 * gap * gap, 1e-10, 1e-4); }

LoopMetric::LoopMetric(const Model& model) : model_(model) {
  ElasticYielding elastic(model);
  const auto of = [&](int body, const Transform<double>& X) {
    return elastic.takes(body) ? elastic.of(body) : yielding(model, body, X);
  };
  for (const LoopJoint& loop : model.loops.joints) {
    a_.push_back(of(loop.parent_body, loop.on_parent));
    b_.push_back(of(loop.joint.body, loop.on_child));
  }
}

void LoopMetric::calc(int l, const LoopState& loop, double* D) const {
  Force<double> on_a[6], on_b[6];
  for (int i = 0; i < loop.rows; ++i) {
    const Force<double> Q = direction(loop.row[i]);
    on_a[i] = wrench_on_a(loop, Q);
    on_b[i] = wrench_on_b(model_.loops.joints[l], Q);
    const Motion<double> a = a_[l] * on_a[i], b = b_[l] * on_b[i];
    for (int j = 0; j <= i; ++j) D[packed(i, j)] = dot(a, on_a[j]) + dot(b, on_b[j]);
    D[packed(i, i)] += loop.yields[i];
  }
}

double LoopMetric::yields(int l, const LoopState& loop, const Force<double>& w) const {
  const Force<double> on_a = wrench_on_a(loop, w), on_b = wrench_on_b(model_.loops.joints[l], w);
  return dot(a_[l] * on_a, on_a) + dot(b_[l] * on_b, on_b);
}

LoopTorques::LoopTorques(const Model& model)
    : model_(model), has_bias_(has_armature_bias(model.loops)) {}

void LoopTorques::update(const SweepInput<double>& in, const LoopStates& states) {
  tau_ = in.loop_tau;
  if (!has_bias_ || !in.v) return;
  with_bias_.assign(model_.loops.nv, 0.0);
  if (tau_) std::copy_n(tau_, with_bias_.size(), with_bias_.begin());
  add_armature_bias(model_.loops, states.v().data(), -1, with_bias_.data());
  tau_ = with_bias_.data();
}

Force<double> LoopTorques::wrench(const LoopState& loop) const {
  Force<double> w{};
  for (int k = 0; tau_ && k < loop.basis.n; ++k) {
    const Force<double> dual = direction(loop.basis.dual[k]);
    const double tau = tau_[loop.dof[k]];
    w += tau * dual;
  }
  return w;
}

void store_loop_load(const LoopJoint& loop, const Force<double>& w, double* load) {
  const Vector6<double> user = to_array(inverse_transpose_times(loop.joint.to_user, w));
  std::copy(user.begin(), user.end(), load);
}

}  // namespace linkwise
