#include "linkwise/constraint/elastic_boxes.hpp"

#include <algorithm>

#include "linkwise/base/tolerances.hpp"
#include "linkwise/simd/cholesky.hpp"

namespace linkwise {

ElasticBoxes::ElasticBoxes(const Model& model) : model_(model) {
  if (model.own_element.empty()) return;
  place_.resize(model.n_bodies(), -1);
  size_t columns = 0, numbers = 0;
  for (int n = 0; n < model.n_bodies(); ++n) {
    where_coordinates(model, SweepInput<double>{}, n, [&](const auto& body, const auto&) {
      place_[n] = static_cast<int>(boxes_.size());
      const int count = body.n_coordinates();
      boxes_.emplace_back().n = count;
      columns += count;
      numbers += count * (count + 1) + 4 * count;
    });
    const BodyTopology& topology = model.topology[n];
    if (topology.parent >= 0 && on_port(model, topology)) at(topology.parent).carried = n;
  }
  columns_.resize(columns);
  port_columns_.resize(columns);
  numbers_.resize(numbers);
  size_t column = 0;
  double* number = numbers_.data();
  const auto take = [&](int count) { return std::exchange(number, number + count); };
  for (Box& box : boxes_) {
    box.M_e = &columns_[column];
    box.P = &port_columns_[column];
    column += box.n;
    const int square = box.n * (box.n + 1) / 2;
    box.numbers = {take(square), take(square), take(box.n), take(box.n), take(box.n), take(box.n)};
  }
}

bool ElasticBoxes::update(const SweepInput<double>& in, int body,
                          const std::vector<BodyState<double>>& states, double* compliance) {
  Box& box = at(body);
  const int n = box.n;
  OwnEquations<double> of{{}, {}, box.M_e, box.numbers.m_e, box.numbers.p_e};
  where_coordinates(model_, in, body, [&](const auto& it, const OwnState<double>& own) {
    calc_equations(it, states[body].v, own, of);
  });
  box.M = of.M;
  double* const L = box.numbers.factor;
  std::copy_n(box.numbers.m_e, n * (n + 1) / 2, L);
  bool positive = cholesky_factor(n, L, smallest_pivot);

  Transform<double> X;
  box.c = {};
  std::fill_n(box.P, n, Motion<double>{});
  if (box.carried >= 0) {
    const Element& e = model_.elements[model_.topology[box.carried].first_element];
    ElasticPort<double> port;
    calc_elastic_port(*e.shape, in.q + e.q, port);
    for (int k = 0; k < n; ++k) box.P[k] = port.P[k];
    X = states[box.carried].X;
    box.c = states[box.carried].c;
  }
  // With W = L^-1 M_e^T and Q = L^-1 P^T: Y = M - W^T W, Xhat = X - Q^T W, P m_e^-1 P^T = Q^T Q.
  Force<double> W[most_coordinates];
  Motion<double> Q[most_coordinates];
  ArticulatedInertia<double> Y = of.M;
  for (int i = 0; i < n; ++i) {
    W[i] = box.M_e[i];
    Q[i] = box.P[i];
    for (int l = 0; l < i; ++l) {
      W[i] -= L[packed(i, l)] * W[l];
      Q[i] += -L[packed(i, l)] * Q[l];
    }
    W[i] = L[packed(i, i)] * W[i];
    Q[i] = L[packed(i, i)] * Q[i];
    subtract_outer(Y, W[i], W[i]);
  }
  double factor_of_Y[21];
  positive &= factor(Y, factor_of_Y, smallest_pivot);
  double* const C = compliance;
  const auto to_port = [&](const Motion<double>& a) {
    Motion<double> out = X * a;
    for (int i = 0; i < n; ++i) out += -dot(a, W[i]) * Q[i];
    return to_array(out);
  };
  for (int j = 0; j < 6; ++j) {
    Vector6<double> unit{};
    unit[j] = 1;
    const Motion<double> a = solve(factor_of_Y, to_force(unit.data()));
    const Vector6<double> own = to_array(a), there = to_port(a);
    for (int i = 0; i < 6; ++i) {
      C[12 * i + j] = own[i];
      C[12 * (6 + i) + j] = C[12 * j + 6 + i] = there[i];
    }
  }
  for (int j = 0; j < 6; ++j) {
    const double* const row = C + 12 * (6 + j);  // of Xhat Y^-1
    const Vector6<double> there = to_port(to_motion(row));
    for (int i = 0; i < 6; ++i) C[12 * (6 + i) + 6 + j] = there[i];
  }
  for (int k = 0; k < n; ++k) {
    const Vector6<double> q = to_array(Q[k]);
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) C[12 * (6 + i) + 6 + j] += q[i] * q[j];
  }
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < i; ++j)
      C[12 * i + j] = C[12 * j + i] = 0.5 * (C[12 * i + j] + C[12 * j + i]);
  return positive;
}

void ElasticBoxes::push_by_forces(Box& box, const Motion<double>& c) {
  std::copy_n(box.numbers.h, box.n, box.numbers.y);
  cholesky_solve(box.n, box.numbers.factor, box.numbers.y);
  box.push = {};
  box.port_alone = c;
  for (int k = 0; k < box.n; ++k) {
    box.push -= box.numbers.y[k] * box.M_e[k];
    box.port_alone += box.numbers.y[k] * box.P[k];
  }
}

void ElasticBoxes::set_forces(const SweepInput<double>& in, int body) {
  Box& box = at(body);
  const int v = own_place(model_, body);
  for (int k = 0; k < box.n; ++k)
    box.numbers.h[k] = (in.tau ? in.tau[v + k] : 0.0) - box.numbers.p_e[k];
  push_by_forces(box, box.c);
}

void ElasticBoxes::set_forces(int body, const double* h) {
  Box& box = at(body);
  std::copy_n(h, box.n, box.numbers.h);
  push_by_forces(box, {});
}

void ElasticBoxes::accelerate(int body, const double* compliance, const double* w, double* a) {
  Box& box = at(body);
  const Vector6<double> push = to_array(box.push), alone = to_array(box.port_alone);
  double all[12];
  for (int i = 0; i < 12; ++i) all[i] = w[i] + (i < 6 ? push[i] : 0.0);
  for (int i = 0; i < 12; ++i) {
    a[i] = i < 6 ? 0.0 : alone[i - 6];
    for (int j = 0; j < 12; ++j) a[i] += compliance[12 * i + j] * all[j];
  }
  const Motion<double> frame = to_motion(a);
  const Force<double> w_port = to_force(w + 6);
  double* const du = box.numbers.du;
  for (int k = 0; k < box.n; ++k)
    du[k] = box.numbers.h[k] + dot(box.P[k], w_port) - dot(frame, box.M_e[k]);
  cholesky_solve(box.n, box.numbers.factor, du);
}

Force<double> ElasticBoxes::inertia_times(int body, const Motion<double>& a,
                                          const double* du) const {
  const Box& box = at(body);
  Force<double> w = box.M * a;
  for (int k = 0; k < box.n; ++k) w += du[k] * box.M_e[k];
  return w;
}

void ElasticBoxes::calc_forces_missed(const SweepInput<double>& in, int body,
                                      const Motion<double>& a, const double* du,
                                      const Force<double>& w_port, double* left) const {
  const Box& box = at(body);
  const int v = own_place(model_, body);
  times_own(box.n, box.numbers.m_e, du, [&](int k, double taken) {
    left[k] =
        in.tau[v + k] - box.numbers.p_e[k] - dot(a, box.M_e[k]) - taken + dot(box.P[k], w_port);
  });
}

void ElasticBoxes::add_port_rate(int body, const double* du, Motion<double>& a) const {
  const Box& box = at(body);
  for (int k = 0; k < box.n; ++k) a += du[k] * box.P[k];
}

}  // namespace linkwise
