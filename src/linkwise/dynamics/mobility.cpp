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
      axis_(columns_.count()),
      Y_(model.n_bodies()),
      W_(model.n_bodies()),
      diagonal_(model.nv()) {}

std::span<const double> Mobility::evaluate(const double* q) {
  SweepInput<double> in;
  in.q = q;
  columns_.update(in);
  if (!tip_to_base(in)) return {};
  base_to_tip(in);
  return diagonal_;
}

bool Mobility::tip_to_base(const SweepInput<double>& in) {
  const Model& model = *model_;
  const std::vector<double>& armature = model.dof_values(DofProperty::armature);
  std::fill(Y_.begin(), Y_.end(), ArticulatedInertia<double>{});
  for (int n = model.n_bodies() - 1; n >= 0; --n) {
    ArticulatedInertia<double>& Y = Y_[n];
    with_body(model, n,
              [&](const auto& body) { add_condensed(Y, body, model, in, n, Motion<double>{}); });
    for (int k = columns_.first(n + 1) - 1; k >= columns_.first(n); --k) {
      const double D = eliminate<ColumnJoint>(Y, Force<double>{}, columns_.P(k),
                                              armature[columns_.dof(k)], 0.0, axis_[k]);
      if (!is_positive(D)) return false;
      reduce_inertia(axis_[k], Y);
    }
    const int parent = model.topology[n].parent;
    if (parent >= 0) Y_[parent] += transform_to_parent(columns_.state(n).X, Y);
  }
  return true;
}

/// What each coordinate of body n's own yields to its force, where W is what the body does.
void Mobility::own_coordinates(const SweepInput<double>& in, int n, const Matrix6<double>& W) {
  where_coordinates(*model_, in, n, [&](const auto& body, OwnState<double> inside) {
    constexpr int count = std::remove_cvref_t<decltype(body)>::n_coordinates;
    const Motion<double> none{};
    double tau[count]{}, rest[count], rate[count];
    inside.tau = tau;
    const Force<double> p = condense(body, none, inside).p;
    accelerate_own(body, none, inside, none, rest);
    for (int k = 0; k < count; ++k) {
      tau[k] = 1;
      Force<double> less = p;
      less -= condense(body, none, inside).p;
      Vector6<double> a{};
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) a[i] += W[6 * i + j] * to_array(less)[j];
      accelerate_own(body, none, inside, to_motion(a.data()), rate);
      diagonal_[model_->elements[model_->own_element[n]].v + k] = rate[k] - rest[k];
      tau[k] = 0;
    }
  });
}

void Mobility::base_to_tip(const SweepInput<double>& in) {
  const Model& model = *model_;
  for (int n = 0; n < model.n_bodies(); ++n) {
    Matrix6<double>& W = W_[n];
    const int parent = model.topology[n].parent;
    W = parent >= 0 ? transform_to_child(columns_.state(n).X, W_[parent]) : Matrix6<double>{};
    for (int k = columns_.first(n); k < columns_.first(n + 1); ++k)
      diagonal_[columns_.dof(k)] = let_move(axis_[k], columns_.P(k), W);
    own_coordinates(in, n, W);
  }
}

}  // namespace linkwise
