#include "linkwise/dynamics/shifted_mass.hpp"

#include <algorithm>

namespace linkwise {

ShiftedMass::ShiftedMass(const Model& model)
    : model_(&model),
      columns_(model),
      own_(model),
      axis_(columns_.count()),
      Y_(model.n_bodies()),
      p_(model.n_bodies()),
      a_(model.n_bodies()) {}

bool ShiftedMass::factor(const double* q, const double* E) {
  const Model& model = *model_;
  const std::vector<double>& armature = model.dof_values(DofProperty::armature);
  SweepInput<double> in;
  in.q = q;
  columns_.update(in);
  std::fill(Y_.begin(), Y_.end(), ArticulatedInertia<double>{});
  for (int n = 0; n < model.n_bodies(); ++n) {
    BodyState<double> state;
    if (own_.has(n)) {
      own_.update(in, n, {});
      own_.add_to_diagonal(n, E);
    }
    if (on_port(model, model.topology[n])) own_.update_port(in, n, {}, state);
  }
  for (int n = model.n_bodies() - 1; n >= 0; --n) {
    ArticulatedInertia<double>& Y = Y_[n];
    Force<double> none;
    if (own_.has(n)) {
      if (!own_.eliminate(in, n, Y, none)) return false;
    } else {
      with_body(model, n, [&](const auto& body) { add_inertia(Y, body); });
    }
    for (int k = columns_.first(n + 1) - 1; k >= columns_.first(n); --k) {
      const int i = columns_.dof(k);
      const double D = eliminate<ColumnJoint>(Y, Force<double>{}, columns_.P(k), armature[i] + E[i],
                                              0.0, axis_[k]);
      if (!is_positive(D)) return false;
      reduce_inertia(axis_[k], Y);
    }
    const int parent = model.topology[n].parent;
    if (parent >= 0) Y_[parent] += transform_to_parent(columns_.state(n).X, Y);
    if (on_port(model, model.topology[n])) own_.receive(n, columns_.state(n).X, Y, Force<double>{});
  }
  return true;
}

void ShiftedMass::solve(const double* tau, double* du) {
  const Model& model = *model_;
  SweepInput<double> in;
  in.tau = tau;
  std::fill(p_.begin(), p_.end(), Force<double>{});
  std::fill_n(du, model.nv(), 0.0);
  for (int n = 0; n < model.n_bodies(); ++n)
    if (own_.has(n)) own_.rest(n);
  for (int n = model.n_bodies() - 1; n >= 0; --n) {
    Force<double>& p = p_[n];
    if (own_.has(n)) own_.respond(in, n, p);
    for (int k = columns_.first(n + 1) - 1; k >= columns_.first(n); --k) {
      EliminatedAxis<double>& axis = axis_[k];
      axis.h = tau[columns_.dof(k)] - ColumnJoint::project(p, columns_.P(k));
      p += (axis.D_inverse * axis.h) * axis.U;
    }
    const int parent = model.topology[n].parent;
    if (parent >= 0) p_[parent] += transpose_times(columns_.state(n).X, p);
    if (on_port(model, model.topology[n])) own_.receive(n, p);
  }
  for (int n = 0; n < model.n_bodies(); ++n) {
    Motion<double>& a = a_[n];
    const int parent = model.topology[n].parent;
    a = parent < 0 ? Motion<double>{} : columns_.state(n).X * a_[parent];
    if (on_port(model, model.topology[n])) own_.accelerate_port(n, du, a);
    for (int k = columns_.first(n); k < columns_.first(n + 1); ++k) {
      const double rate = axis_[k].D_inverse * (axis_[k].h - dot(a, axis_[k].U));
      a += rate * columns_.P(k);
      du[columns_.dof(k)] = rate;
    }
    if (own_.has(n)) own_.accelerate(n, a, du);
  }
}

}  // namespace linkwise
