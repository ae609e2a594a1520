#pragma once
// What sweeps keep of bodies with coordinates of their own, and of the ports that these move.
#include <algorithm>
#include <vector>

#include "linkwise/kinematics/body_state.hpp"
#include "linkwise/recursion/loop_steps.hpp"

namespace linkwise {

template <class S>
class OwnBodies {
 public:
  explicit OwnBodies(const Model& model) : model_(model) {
    if (model.own_element.empty()) return;
    place_.resize(model.n_bodies(), -1);
    size_t columns = 0, numbers = 0;
    for (int n = 0; n < model.n_bodies(); ++n) {
      where_coordinates(model, SweepInput<S>{}, n, [&](const auto& body, const OwnState<S>&) {
        place_[n] = static_cast<int>(bodies_.size());
        const int count = body.n_coordinates();
        bodies_.push_back({{}, {}, count});
        columns += count;
        numbers += count * (count + 1) / 2 + 2 * count;
      });
    }
    columns_.resize(columns);
    numbers_.resize(numbers);
    Force<S>* column = columns_.data();
    S* number = numbers_.data();
    for (Body& b : bodies_) {
      b.blocks.M_e = column;
      column += b.n;
      b.blocks.m_e = number;
      b.blocks.p_e = number + b.n * (b.n + 1) / 2;
      b.h = b.blocks.p_e + b.n;
      number = b.h + b.n;
    }
  }
  // Blocks point into it.
  OwnBodies(const OwnBodies&) = delete;
  OwnBodies& operator=(const OwnBodies&) = delete;

  bool has(int n) const { return !place_.empty() && place_[n] >= 0; }

  int count(int n) const { return at(n).n; }
  const OwnEquations<S>& blocks(int n) const { return at(n).blocks; }
  /// That body n carries.
  const ElasticPort<S>& port(int n) const { return at(n).port; }

  /// Equations of body n that moves by v; returns p.
  Force<S> update(const SweepInput<S>& in, int n, const Motion<S>& v) {
    Body& b = at(n);
    where_coordinates(model_, in, n, [&](const auto& body, const OwnState<S>& state) {
      calc_equations(body, v, state, b.blocks);
    });
    return b.blocks.p;
  }
  /// Other rates at the same position: p and p_e alone, what was eliminated stays.
  Force<S> update_bias(const SweepInput<S>& in, int n, const Motion<S>& v) {
    Body& b = at(n);
    OwnEquationsHere<S> now;
    where_coordinates(model_, in, n, [&](const auto& body, const OwnState<S>& state) {
      calc_equations(body, v, state, now);
    });
    std::copy_n(now.p_e, b.n, b.blocks.p_e);
    return now.p;
  }
  void rest(int n) { std::fill_n(at(n).blocks.p_e, at(n).n, S{}); }
  /// Adds of E [nv] what belongs to body n's coordinates to the diagonal of m_e, before they are
  /// eliminated.
  void add_to_diagonal(int n, const S* E) {
    Body& b = at(n);
    for (int k = 0; k < b.n; ++k) b.blocks.m_e[packed(k, k)] += E[own_place(model_, n) + k];
  }

  /// The joint of body n starts on a port of its parent.
  void update_port(const SweepInput<S>& in, int n, const Motion<S>& v_parent, BodyState<S>& state) {
    const BodyTopology& topology = model_.topology[n];
    const Element& e = model_.elements[topology.first_element];
    ElasticPort<S>& port = at(topology.parent).port;
    calc_elastic_port(*e.shape, in.q + e.q, port);
    state.X = port.X * e.placement;
    state.v = state.X * v_parent;
    state.c = {};
    carry_on_port(e, in, port, state.v, state.c);
  }
  /// Adds the wrench Y a + p of body n, of which c is part of a.
  void receive(int n, const Transform<S>& X, const ArticulatedInertia<S>& Y, const Force<S>& p) {
    Body& b = at(model_.topology[n].parent);
    add_to_own(b.n, b.port, X, Y, p, b.blocks);
  }
  void receive(int n, const Force<S>& p) {
    Body& b = at(model_.topology[n].parent);
    for (int k = 0; k < b.n; ++k) b.blocks.p_e[k] += dot(b.port.P[k], p);
  }
  /// Of body n on a port: the acceleration a = X a_p takes what the parent's coordinates give.
  void accelerate_port(int n, const S* du, Motion<S>& a) const {
    const int parent = model_.topology[n].parent;
    const Body& b = at(parent);
    du += own_place(model_, parent);
    for (int k = 0; k < b.n; ++k) a += du[k] * b.port.P[k];
  }

  /// Y: what hangs on body n as seen from its frame; becomes, with p, what the body is then.
  bool eliminate(const SweepInput<S>& in, int n, ArticulatedInertia<S>& Y, Force<S>& p) {
    Body& b = at(n);
    Y += b.blocks.M;
    return eliminate_own(b.n, b.blocks, tau(in, n), b.h, Y, p);
  }
  void respond(const SweepInput<S>& in, int n, Force<S>& p) {
    Body& b = at(n);
    respond_own(b.n, b.blocks, b.blocks.p_e, tau(in, n), b.h, p);
  }
  void accelerate(int n, const Motion<S>& a, S* du) const {
    const Body& b = at(n);
    accelerate_own(b.n, b.blocks, b.h, a, du + own_place(model_, n));
  }

  // Of loops, once a body is eliminated (loop_steps.hpp):

  /// A force on body n, on a port, along its parent's coordinates: adds to z.
  void push(int n, const Force<S>& F, S* z) const {
    const Body& b = at(model_.topology[n].parent);
    for (int k = 0; k < b.n; ++k) z[k] += dot(b.port.P[k], F);
  }
  S carry(int n, const S* z, S* y, Force<S>& F) const {
    return carry_own(at(n).n, at(n).blocks, at(n).h, z, y, F);
  }
  /// Forces along the coordinates of body n that are now known.
  void apply(int n, const S& f, const S* z) {
    Body& b = at(n);
    for (int k = 0; k < b.n; ++k) b.h[k] += f * z[k];
  }

 private:
  struct Body {
    OwnEquations<S> blocks;  ///< m_e is its factor once it is eliminated
    ElasticPort<S> port;
    int n;
    S* h = nullptr;
  };

  Body& at(int n) { return bodies_[place_[n]]; }
  const Body& at(int n) const { return bodies_[place_[n]]; }
  const S* tau(const SweepInput<S>& in, int n) const {
    return in.tau ? in.tau + own_place(model_, n) : nullptr;
  }

  const Model& model_;
  std::vector<int> place_;  ///< by body, -1: it has no coordinates; empty: none has
  std::vector<Body> bodies_;
  std::vector<Force<S>> columns_;
  std::vector<S> numbers_;
};

}  // namespace linkwise
