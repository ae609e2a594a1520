#include "linkwise/dynamics/mobility.hpp"

#include <algorithm>

namespace linkwise {
namespace {

Motion<double> operator*(const Matrix6<double>& W, const Force<double>& f) {
  const Vector6<double> w = to_array(f);
  Vector6<double> out{};
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) out[i] += W[6 * i + j] * w[j];
  return to_motion(out.data());
}

/// X W X^T.
Matrix6<double> transform_to_child(const Transform<double>& X, const Matrix6<double>& W) {
  // Rows of the symmetric W are its columns: each pass moves one side and transposes.
  const auto half = [&](const Matrix6<double>& in) {
    Matrix6<double> out;
    for (int i = 0; i < 6; ++i) {
      const Vector6<double> column = to_array(X * to_motion(&in[6 * i]));
      for (int j = 0; j < 6; ++j) out[6 * j + i] = column[j];
    }
    return out;
  };
  return half(half(W));
}

/// (H^-1)_kk of a column; W of what carries it becomes W of what it carries.
double let_move(const EliminatedAxis<double>& axis, const Motion<double>& P, Matrix6<double>& W) {
  const Force<double> V = axis.D_inverse * axis.U;
  const Motion<double> given = W * V;
  const double mobility = axis.D_inverse + dot(given, V);
  const Vector6<double> p = to_array(P), g = to_array(given);
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) W[6 * i + j] += mobility * p[i] * p[j] - p[i] * g[j] - g[i] * p[j];
  return mobility;
}

}  // namespace

Mobility::Mobility(const Model& model)
    : model_(&model),
      columns_(model),
      own_(model),
      axis_(columns_.count()),
      Y_(model.n_bodies()),
      W_(model.n_bodies()),
      diagonal_(model.nv()) {}

std::span<const double> Mobility::evaluate(const double* q) {
  SweepInput<double> in;
  in.q = q;
  columns_.update(in);
  if (!tip_to_base(in)) return {};
  base_to_tip();
  return diagonal_;
}

bool Mobility::tip_to_base(const SweepInput<double>& in) {
  const Model& model = *model_;
  const std::vector<double>& armature = model.dof_values(DofProperty::armature);
  std::fill(Y_.begin(), Y_.end(), ArticulatedInertia<double>{});
  for (int n = 0; n < model.n_bodies(); ++n) {
    BodyState<double> state;
    if (own_.has(n)) own_.update(in, n, {});
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
      const double D = eliminate<ColumnJoint>(Y, Force<double>{}, columns_.P(k),
                                              armature[columns_.dof(k)], 0.0, axis_[k]);
      if (!is_positive(D)) return false;
      reduce_inertia(axis_[k], Y);
    }
    const int parent = model.topology[n].parent;
    if (parent >= 0) Y_[parent] += transform_to_parent(columns_.state(n).X, Y);
    if (on_port(model, model.topology[n])) own_.receive(n, columns_.state(n).X, Y, Force<double>{});
  }
  return true;
}

/// Of body n on a port, by what its parent W_p does: Z W_p Z^T + P m_e^-1 P^T with
/// Z = X - P m_e^-1 M_e^T, the acceleration of the port where that of the parent's frame is one.
Matrix6<double> Mobility::of_port(int n) const {
  const int parent = model_->topology[n].parent, count = own_.count(parent);
  const OwnEquations<double>& of = own_.blocks(parent);
  const ElasticPort<double>& port = own_.port(parent);
  const Transform<double>& X = columns_.state(n).X;
  Vector6<double> Z[6], sum[most_coordinates] = {};  // columns of Z; P m_e^-1
  for (int k = 0; k < count; ++k) {
    double unit[most_coordinates] = {};
    unit[k] = 1;
    cholesky_solve(count, of.m_e, unit);
    for (int l = 0; l < count; ++l) {
      const Vector6<double> P = to_array(port.P[l]);
      for (int i = 0; i < 6; ++i) sum[k][i] += unit[l] * P[i];
    }
  }
  for (int j = 0; j < 6; ++j) {
    double unit[6] = {};
    unit[j] = 1;
    const Motion<double> along = to_motion(unit);
    Z[j] = to_array(X * along);
    for (int k = 0; k < count; ++k)
      for (int i = 0; i < 6; ++i) Z[j][i] -= sum[k][i] * dot(along, of.M_e[k]);
  }
  Matrix6<double> W{};
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) {
      for (int k = 0; k < 6; ++k)
        for (int l = 0; l < 6; ++l) W[6 * i + j] += Z[k][i] * W_[parent][6 * k + l] * Z[l][j];
      for (int k = 0; k < count; ++k) W[6 * i + j] += sum[k][i] * to_array(port.P[k])[j];
    }
  return W;
}

/// What each coordinate of body n's own yields to its force: m_e^-1 + m_e^-1 M_e^T W M_e m_e^-1.
void Mobility::own_coordinates(int n) {
  const int count = own_.count(n);
  const OwnEquations<double>& of = own_.blocks(n);
  for (int k = 0; k < count; ++k) {
    double unit[most_coordinates] = {};
    unit[k] = 1;
    cholesky_solve(count, of.m_e, unit);
    Force<double> wrench;
    for (int l = 0; l < count; ++l) wrench += unit[l] * of.M_e[l];
    diagonal_[own_place(*model_, n) + k] = unit[k] + dot(W_[n] * wrench, wrench);
  }
}

void Mobility::base_to_tip() {
  const Model& model = *model_;
  for (int n = 0; n < model.n_bodies(); ++n) {
    Matrix6<double>& W = W_[n];
    const int parent = model.topology[n].parent;
    W = parent < 0                          ? Matrix6<double>{}
        : on_port(model, model.topology[n]) ? of_port(n)
                                            : transform_to_child(columns_.state(n).X, W_[parent]);
    for (int k = columns_.first(n); k < columns_.first(n + 1); ++k)
      diagonal_[columns_.dof(k)] = let_move(axis_[k], columns_.P(k), W);
    if (own_.has(n)) own_coordinates(n);
  }
}

}  // namespace linkwise
